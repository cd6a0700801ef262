"""All kinds of rig, by the name a study calls them."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache

from fibrefit.core.declarations import KINDS, declaration_of
from fibrefit.rigs.rig import Rig

RIGS: dict[str, Rig] = {kind: declaration_of(kind) for kind in KINDS}


@lru_cache(maxsize=256)
def rig_of(
    kind: str,
    variant: str = "",
    found: tuple[tuple[str, float], ...] = (),
    possible: tuple[tuple[str, tuple[float, float]], ...] = (),
) -> Rig:
    """Rig of a study.

    Parameters
    ----------
    kind, variant : str
        The variant is empty for the usual one.
    found : tuple of (str, float)
        Conditions that are parameters, the same in all records and known about a value in SI units only.
    possible : tuple of (str, (float, float))
        Least and most of what the rig can do, in SI units, where that is known.

    Raises
    ------
    KeyError
        Naming a condition that the rig has not.
    """
    rig = RIGS[kind].variants[variant] if variant else RIGS[kind]
    for name, value in found:
        rig = rig.finding(name, value)
    return replace(rig, possible=dict(possible)) if possible else rig
