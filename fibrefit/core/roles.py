"""What a column of a record, a state of a rig and a phase of its motion are called, and their units: the one table."""

from __future__ import annotations

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
