"""Many starts: a solver's success is a claim, and agreement of independent starts is the evidence."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping
from concurrent.futures import ThreadPoolExecutor
from functools import partial

import jax.numpy as jnp
import numpy as np

from fibrefit.fit.result import Starts
from fibrefit.fit.solve import EXACT, NEAR, Descent, descend_all
from fibrefit.problem.layout import Layout
from fibrefit.problem.problem import Problem

CHUNK = 4
"""Starts that are searched from in one go, by one core."""
SAME_PLACE = 1.0
"""Distance in units of the steps within which two starts have come to the same place."""
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


def search(
    problem: Problem, starts: np.ndarray, width: np.ndarray, ladders: np.ndarray, told: Callable[[float], None]
) -> Descent:
    """Descents from many starts, horizon by horizon, on all cores.

    Starts that have come to the same place by the end of a horizon go on as one: what follows would be the same.

    Parameters
    ----------
    problem : Problem
    starts : (n_start, n_free) free coordinates
    width : (n_free,) unit of the steps
    ladders : (n_ladder, n_stage, n_record) int
        Ways to lengthen the horizon, taken in turn: a model that lacks something may follow one into a poor minimum and
        another into a better one.
    told : callable
        Told the share that is done.

    Returns
    -------
    Descent
        NumPy, leaves ``(n_start, ...)``.
    """
    number, stages = len(starts), ladders.shape[1]
    ladder = np.arange(number) % len(ladders)
    leader = np.arange(number)
    nil = np.zeros(number, dtype=int)
    found = Descent(starts, np.full(number, np.inf), nil, nil.astype(bool))
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        for stage in range(stages):
            near = EXACT if stage == stages - 1 else NEAR
            going = np.unique(leader)
            parts = [going[i : i + CHUNK] for i in range(0, len(going), CHUNK)]
            run = partial(_part, problem, found.free, width, ladders[ladder, stage], near)
            ended = found._replace(steps=nil)
            for done, (part, descent) in enumerate(zip(parts, pool.map(run, parts), strict=True), 1):
                ended = Descent(*(_put(old, part, new) for old, new in zip(ended, descent, strict=True)))
                told((stage + done / len(parts)) / stages)
            ended = ended._replace(steps=found.steps + ended.steps)
            found = Descent(*(leaf[leader] for leaf in ended))
            leader = _leaders(found, width, ladder)
    return found


def _put(old: np.ndarray, rows: np.ndarray, new: np.ndarray) -> np.ndarray:
    whole = old.copy()
    whole[rows] = new
    return whole


def _part(
    problem: Problem, frees: np.ndarray, width: np.ndarray, counts: np.ndarray, near: float, part: np.ndarray
) -> Descent:
    """Descents from the starts `part`; a short part is filled up, since one of another length is another program."""
    rows = np.resize(part, CHUNK)
    active = np.arange(CHUNK) < len(part)
    ended = descend_all(problem, frees[rows], width, counts[rows], active, jnp.asarray(near))
    return Descent(*(np.asarray(leaf)[: len(part)] for leaf in ended))


def _leaders(found: Descent, width: np.ndarray, ladder: np.ndarray) -> np.ndarray:
    """For each start the first of those on its ladder that came to the same place."""
    leader = np.arange(len(ladder))
    for i in np.flatnonzero(np.isfinite(found.cost)):
        for j in np.unique(leader[:i][np.isfinite(found.cost[:i])]):
            same = ladder[i] == ladder[j] and abs(found.cost[i] - found.cost[j]) <= SAME_BASIN * found.cost[j]
            if same and np.max(np.abs(found.free[i] - found.free[j]) / width) < SAME_PLACE:
                leader[i] = j
                break
    return leader


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
