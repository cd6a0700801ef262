"""What a column of a record can stand for."""

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
