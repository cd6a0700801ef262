"""All kinds of rig, by the name a study calls them."""

from __future__ import annotations

from fibrefit.rigs.fibre_mass import FIBRE_MASS, FORCE_ONLY
from fibrefit.rigs.guided_mass import FREE_MASS, GUIDED_MASS
from fibrefit.rigs.pendulums.inverted import INVERTED_PENDULUM
from fibrefit.rigs.pendulums.plain import PENDULUM
from fibrefit.rigs.pulley_drive import PULLEY_DRIVE
from fibrefit.rigs.rig import Rig

RIGS: dict[str, Rig] = {rig.kind: rig for rig in (FIBRE_MASS, PULLEY_DRIVE, INVERTED_PENDULUM, GUIDED_MASS, PENDULUM)}
VARIANTS: dict[str, Rig] = {"force_only": FORCE_ONLY, "free": FREE_MASS}
"""Rigs of which a study says that less of them was measured, by its `variant`."""


def rig_of(kind: str, variant: str = "") -> Rig:
    """Rig of a study, by its kind and its variant, empty for the usual one."""
    return VARIANTS[variant] if variant else RIGS[kind]
