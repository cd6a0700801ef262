"""What laws, rigs and records are declared with: parameters, capabilities, kinds of rig, roles, states and phases."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from importlib import import_module
from typing import Any, NamedTuple


@dataclass(frozen=True, slots=True)
class Parameter:
    """Declaration of one number a model contains.

    Parameters
    ----------
    name : str
        Name in the study, the results and every message; dotted for effects
        (``guide.stribeck_friction.breakaway_excess``).
    unit : str
        SI unit of the value, e.g. ``"N/m"``.
    doc : str
        One sentence that says what it is.
    typical : float
        A plausible size, in `unit`; sets scales and search ranges.
    lower, upper : float
        Physical range, in `unit`; infinite where there is no limit.
    null : float
        Value at which the effect vanishes exactly, in `unit`.
    log : bool
        Whether the value spans decades and is searched on a logarithmic scale.
    reciprocal : bool
        Whether it is searched by its inverse, because the effect vanishes where the value is infinite. A model takes
        such a value as `ByInverse` too, and has a finite derivative in the inverse there.
    relative : bool
        Whether it is a relative change of a parameter: a search takes it by the logarithm of what it multiplies by, as
        it does what that parameter differs by from record to record.
    starts : tuple of float
        Where a search for it begins, in `unit`; about the typical size where empty.
    spread : float
        How far from the typical value a shape may well be, in `unit`; as far as that is from zero where it is 0.
    source : str
        Where the law or the range comes from.
    symbol : str
        In the equation of its law.
    """

    name: str
    unit: str
    doc: str
    typical: float
    lower: float = -math.inf
    upper: float = math.inf
    null: float = 0.0
    log: bool = False
    reciprocal: bool = False
    relative: bool = False
    starts: tuple[float, ...] = ()
    spread: float = 0.0
    source: str = ""
    symbol: str = ""


class ByInverse(NamedTuple):
    """A value given by its inverse, so that an infinite one is a plain zero.

    Parameters
    ----------
    inverse : () in the inverse of the parameter's unit
    """

    inverse: Any


def inverse_of(value: Any) -> Any:
    """Inverse of a value that may be given by it."""
    return value.inverse if isinstance(value, ByInverse) else 1.0 / value


KINDS: tuple[str, ...] = (
    "fibre_mass",
    "pulley_drive",
    "inverted_pendulum",
    "guided_mass",
    "pendulum",
)
"""Each is declared in ``fibrefit/rigs/<kind>.py``, under its name in capitals."""


def declaration_of(kind: str) -> Any:
    """Declaration of a kind of rig, found by its name as a plug-in is: the equations beside it stand floors above."""
    return getattr(import_module(f"fibrefit.rigs.{kind}"), kind.upper())


class Capability(StrEnum):
    """One thing a rig has; its value says it in words."""

    FIBRE = "a fibre whose force is measured"
    GUIDE = "a guide"
    PULLEY = "a pulley"
    DRIVE = "a drive that takes fibre in"
    INCLINE = "an inclination"
    TAUT_POINT = "a position where its fibre is known to be just taut"
    FALL = "a weight that falls into its fibre"
    PIVOT = "a pivot"
    PUSH = "a measured force that pushes its mass"
    PLACE = "a position that is measured and explained"


ROLES: dict[str, str] = {
    "time": "s",
    "force": "N",
    "position": "m",
    "velocity": "m/s",
    "drive": "m",
    "angle": "rad",
    "force_1": "N",
    "force_2": "N",
}
"""SI unit of each role."""

USUAL_NOISE: dict[str, float] = {
    "force": 0.4,
    "position": 2e-5,
    "velocity": 1e-4,
    "drive": 1e-5,
    "angle": 1e-3,
    "force_1": 0.4,
    "force_2": 0.4,
}
"""Noise rms that is assumed of a planned channel where the study states none, in SI units."""

FORCES = frozenset(role for role, unit in ROLES.items() if unit == "N")
"""Roles that are readings of a force gauge."""

STATES: dict[str, str] = {"position": "m", "speed": "m/s", "stretch": "m", "stretch rate": "m/s", "tension": "N"}
"""SI unit of each state of a rig that residuals and curves are drawn over."""

HISTORY: dict[str, str] = {"time": "s", "path": "m", "time at rest": "s", "load cycles": "-", "drive speed": "m/s"}
"""SI unit of what a record goes through: the time since its first sample; the path of its weight, and for how long that
has been at rest; the load cycles of its fibre; the speed of its drive, without its sign."""

TURNING: dict[str, str] = {"position": "rad", "speed": "rad/s"}
"""The units of those that are angles, on a rig that turns."""

SI: dict[str, str] = ROLES | STATES | HISTORY
"""SI unit of each variable that a law may depend on: a role, a state or what a record goes through."""

PHASES = (
    "held",
    "slack",
    "taut, loading",
    "taut, unloading",
    "at rest",
    "moving forwards",
    "moving back",
    "sticking",
)
HELD, SLACK, LOADING, UNLOADING, REST, FORWARDS, BACK, STICKING = range(len(PHASES))
TAUT = (LOADING, UNLOADING, REST, STICKING)
"""Phases in which a fibre carries load, on a rig that has one."""


@dataclass(frozen=True)
class Statement:
    """What was found besides the checks.

    Parameters
    ----------
    identifier : str
        By which its sentence is found.
    facts : mapping of str to object
        What the sentence needs, in SI units.
    """

    identifier: str
    facts: Mapping[str, Any] = field(default_factory=dict)
