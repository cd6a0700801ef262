"""What a column of a record, and a state of a rig, can stand for: the one table of their units."""

from __future__ import annotations

ROLES: dict[str, str] = {
    "time": "s",
    "force": "N",
    "position": "m",
    "drive": "m",
    "angle": "rad",
    "force_1": "N",
    "force_2": "N",
}
"""SI unit of each role."""

STATES: dict[str, str] = {"position": "m", "speed": "m/s", "stretch": "m", "stretch rate": "m/s", "tension": "N"}
"""SI unit of each state of a rig that residuals and curves are drawn over."""

TURNING: dict[str, str] = {"position": "rad", "speed": "rad/s"}
"""The units of those that are angles, on a rig that turns."""
