"""All kinds of rig, by the name a study calls them."""

from __future__ import annotations

from functools import lru_cache

from fibrefit.rigs.fibre_mass import FIBRE_MASS, FORCE_ONLY
from fibrefit.rigs.followed_mass import FOLLOWED_MASS
from fibrefit.rigs.guided_mass import FREE_MASS, GUIDED_MASS
from fibrefit.rigs.pendulums.inverted import INVERTED_PENDULUM
from fibrefit.rigs.pendulums.plain import PENDULUM
from fibrefit.rigs.pulley_drive import PULLEY_DRIVE
from fibrefit.rigs.rig import Rig

RIGS: dict[str, Rig] = {rig.kind: rig for rig in (FIBRE_MASS, PULLEY_DRIVE, INVERTED_PENDULUM, GUIDED_MASS, PENDULUM)}
VARIANTS: dict[str, Rig] = {"force_only": FORCE_ONLY, "free": FREE_MASS, "followed": FOLLOWED_MASS}
"""Rigs of which a study says that less of them was measured, or something else explained, by its `variant`."""


@lru_cache(maxsize=256)
def rig_of(kind: str, variant: str = "", found: tuple[tuple[str, float], ...] = ()) -> Rig:
    """Rig of a study.

    Parameters
    ----------
    kind, variant : str
        The variant is empty for the usual one.
    found : tuple of (str, float)
        Conditions that are parameters, the same in all records and known about a value in SI units only.

    Raises
    ------
    KeyError
        Naming a condition that the rig has not.
    """
    rig = VARIANTS[variant] if variant else RIGS[kind]
    for name, value in found:
        rig = rig.finding(name, value)
    return rig
