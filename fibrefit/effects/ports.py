"""The ports of a rig: the kind of law each takes, and what such a law can say, its hooks."""

from __future__ import annotations

import inspect
from types import FunctionType

from fibrefit.effects.law import DriveLaw, Effect, FibreLaw, GuideLaw, PulleyLaw, RigLaw, SensorLaw

PORTS: dict[str, type[Effect]] = {
    "guide": GuideLaw,
    "fibre": FibreLaw,
    "pulley": PulleyLaw,
    "drive": DriveLaw,
    "sensor": SensorLaw,
    "rig": RigLaw,
}

ANNOUNCED: dict[str, dict[str, str]] = {
    "guide": {"compliance": "creeps"},
    "fibre": {"when_slack": "forgets", "memory_rate": "memory", "memory_at_rest": "memory"},
    "pulley": {"inertia": "turns", "rubbing": "rubs"},
    "drive": {"compliance": "yields"},
    "sensor": {"lags": "dynamic", "late_by": "dynamic"},
    "rig": {},
}
"""Hooks that are only asked where the law announces them, and the attribute that does."""


def port_of(effect: type[Effect]) -> str | None:
    """Port whose kind of law an effect is; None where it is of none."""
    return next((port for port, kind in PORTS.items() if issubclass(effect, kind)), None)


def hooks_of(port: str) -> dict[str, FunctionType]:
    """What a law of a port can say, by name, with the answer that adds nothing.

    Parameters
    ----------
    port : str
        One of `PORTS`.
    """
    methods = vars(PORTS[port]).items()
    return {name: method for name, method in methods if inspect.isfunction(method) and not name.startswith("_")}


def own_classes(effect: type[Effect]) -> list[type]:
    """Classes an effect is made of that are not the library's, the most derived first."""
    return [cls for cls in effect.__mro__ if issubclass(cls, Effect) and not cls.__module__.startswith("fibrefit.")]


def said_by(effect: type[Effect]) -> tuple[str, ...]:
    """Hooks of its port to which an effect has an answer of its own."""
    port = port_of(effect)
    known = hooks_of(port) if port else {}
    return tuple(name for name, method in known.items() if inspect.getattr_static(effect, name) is not method)
