"""The kinds of rig, by the name a study calls them: the one list."""

from __future__ import annotations

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
