"""What a rig can have that a law acts on."""

from __future__ import annotations

from enum import StrEnum


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
