"""The ports of a rig: the kind of law each takes, and what such a law can say, its hooks."""

from __future__ import annotations

import inspect
from types import FunctionType

from fibrefit.laws.law import (
    DriveLaw,
    Effect,
    FibreLaw,
    GuideLaw,
    PivotLaw,
    PulleyLaw,
    RigLaw,
    SensorLaw,
    StudyLaw,
)
from fibrefit.laws.pushes import PushLaw

PORTS: dict[str, type[Effect]] = {
    "guide": GuideLaw,
    "fibre": FibreLaw,
    "pulley": PulleyLaw,
    "drive": DriveLaw,
    "push": PushLaw,
    "pivot": PivotLaw,
    "sensor": SensorLaw,
    "study": StudyLaw,
    "rig": RigLaw,
}

ANNOUNCED: dict[str, dict[str, str]] = {
    "guide": {"compliance": "creeps", "loose": "carries"},
    "fibre": {"when_slack": "forgets", "memory_rate": "memory", "memory_at_rest": "memory"},
    "pulley": {"inertia": "turns", "rubbing": "rubs"},
    "drive": {"compliance": "yields", "passed_on": "remembers"},
    "sensor": {"lags": "dynamic", "late_by": "dynamic"},
    "study": {"pace": "retimes"},
}
"""Hooks that are only called where the law announces them, and the attribute that does."""


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
    kind = PORTS[port]
    # The hooks of a study are those of a rig and more; what all effects have is no hook of a port.
    methods = {
        name: method for cls in reversed(kind.__mro__) if cls in PORTS.values() for name, method in vars(cls).items()
    }
    return {n: method for n, method in methods.items() if inspect.isfunction(method) and not n.startswith("_")}


def overridden_hooks(effect: type[Effect]) -> tuple[str, ...]:
    """Hooks of its port to which an effect has an answer of its own."""
    port = port_of(effect)
    known = hooks_of(port) if port else {}
    return tuple(name for name, method in known.items() if inspect.getattr_static(effect, name) is not method)
