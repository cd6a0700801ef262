"""The kinds of rig, and what a rig can have that a law acts on."""

from __future__ import annotations

from enum import StrEnum

KINDS: tuple[str, ...] = (
    "fibre_mass",
    "pulley_drive",
    "inverted_pendulum",
    "guided_mass",
    "pendulum",
)
"""Each is declared in ``fibrefit/rigs/<kind>.py``, under its name in capitals."""


def declared_in(kind: str) -> tuple[str, str]:
    """Module and name of the declaration of a kind of rig."""
    return f"fibrefit.rigs.{kind}", kind.upper()


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
