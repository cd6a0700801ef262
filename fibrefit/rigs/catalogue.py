"""All kinds of rig, by the name a study calls them."""

from __future__ import annotations

from functools import lru_cache

from fibrefit.rigs.fibre_mass import FIBRE_MASS
from fibrefit.rigs.guided_mass import GUIDED_MASS
from fibrefit.rigs.inverted_pendulum import INVERTED_PENDULUM
from fibrefit.rigs.pendulum import PENDULUM
from fibrefit.rigs.pulley_drive import PULLEY_DRIVE
from fibrefit.rigs.rig import Rig

RIGS: dict[str, Rig] = {rig.kind: rig for rig in (FIBRE_MASS, PULLEY_DRIVE, INVERTED_PENDULUM, GUIDED_MASS, PENDULUM)}


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
    rig = RIGS[kind].variants[variant] if variant else RIGS[kind]
    for name, value in found:
        rig = rig.finding(name, value)
    return rig
