"""Many starts: a solver's success is a claim, and agreement of independent starts is the evidence."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fibrefit.fit.result import Starts
from fibrefit.fit.solve import Descent
from fibrefit.problem.layout import Layout

SAME_BASIN = 1e-3
"""Relative difference in cost below which two starts ended in the same minimum, if their values agree too."""


def scattered(layout: Layout, centre: np.ndarray, spread: Mapping[str, float], number: int, seed: int) -> np.ndarray:
    """Starting values ``(number, n_free)`` in SI units: the centre, then a scrambled Sobol cloud around it.

    Parameters
    ----------
    layout : Layout
    centre : (n_free,) in SI units
    spread : mapping of name to factor
        A shared parameter is multiplied by a factor between 1/spread and spread; others stay.
    number, seed : int
    """
    from scipy.stats import qmc

    moved = [
        i for i, (slot, record) in enumerate(layout.entries) if record is None and spread.get(slot.name, 1.0) > 1.0
    ]
    starts = np.tile(centre, (number, 1))
    if number < 2 or not moved:
        return starts
    cloud = qmc.Sobol(len(moved), seed=seed).random_base2(int(np.ceil(np.log2(number - 1))) if number > 2 else 0)
    for i, share in zip(moved, cloud[: number - 1].T, strict=True):
        slot = layout.entries[i][0]
        value = centre[i] * spread[slot.name] ** (2.0 * share - 1.0)
        starts[1:, i] = np.clip(value, slot.range.lower, slot.range.upper)
    return starts


def table(layout: Layout, began: np.ndarray, found: Descent) -> Starts:
    """Where all starts ended, sorted into basins."""
    shared = [i for i, (_, record) in enumerate(layout.entries) if record is None]
    cost = np.asarray(found.cost)
    with np.errstate(invalid="ignore"):
        values = layout.values(np.asarray(found.free))
    return Starts(
        names=tuple(layout.entries[i][0].name for i in shared),
        began=began[:, shared],
        ended=values[:, shared],
        values=values,
        cost=cost,
        steps=np.asarray(found.steps),
        basin=_basins(cost),
    )


def _basins(cost: np.ndarray) -> np.ndarray:
    basin = np.full(len(cost), -1)
    label, level = -1, -np.inf
    for i in np.argsort(cost):
        if not np.isfinite(cost[i]):
            break
        if cost[i] > level * (1.0 + SAME_BASIN) or label < 0:
            label, level = label + 1, cost[i]
        basin[i] = label
    return basin
