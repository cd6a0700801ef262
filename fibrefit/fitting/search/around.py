"""Minima beside the one where all starts ended.

Starts that follow a motion contact by contact are led alike, and may all be led into the same wrong order of small late
bounces, or past a turn at which the guide holds the weight. From far off its error bars, and over the whole record at
once, a descent may come down on the other side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fibrefit.fitting.result import Starts
from fibrefit.fitting.search.multistart import STARTS_AT_ONCE, basins_of, with_rows
from fibrefit.fitting.search.solve import FOR_A_HORIZON, TO_THE_END, Descent, Stopping, descend_all, gram_at, widths
from fibrefit.fitting.search.thinned import thinning
from fibrefit.fitting.thresholds import FIT_TOLERANCE, SAME_PLACE
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.problem import Problem, gram_root

ROUNDS = 3
"""How often there is a look around what is the best minimum by then."""
AWAY = 60.0
"""Distance of the places it is looked from, in standard errors for white noise. Of 160 drops four had a lower minimum
beside that of all starts: 60 finds all of them, 25 three and 10 two."""


def searched_nearby(problem: Problem, starts: Starts, whole: np.ndarray) -> Starts:
    """Starts with those from around their best minimum, if one of these ended lower; then around that one, too.

    Parameters
    ----------
    problem : Problem
    starts : Starts
    whole : (1, n_record) int
        Samples of each record.
    """
    layout, counts, every = problem.layout, np.repeat(whole, STARTS_AT_ONCE, axis=0), thinning(problem)
    low, high = (np.array([getattr(slot.range, end) for slot, _ in layout.entries]) for end in ("lower", "upper"))
    for number in range(ROUNDS):
        values, cost = starts.best
        places = values + AWAY * rough_errors(problem, values, cost) * _signs(len(values), number)
        began, width = np.clip(places, low, high), widths(problem, layout.free(values))
        free, active = layout.free(began), np.ones(STARTS_AT_ONCE, dtype=bool)
        if every > 1:
            free, active = _lower_of_few(problem.thinned(every), np.array([layout.free(values), *free]), width, counts)
        if not active.any():
            break
        found = _ends(problem, free, width, counts, active, layout.free(values))
        lower = cost - np.asarray(found.cost).min() > FIT_TOLERANCE
        if not lower and not number:
            return starts
        starts = with_further_starts(
            starts, layout, began[active], Descent(*(np.asarray(leaf)[active] for leaf in found))
        )
        if not lower:
            break
    return starts


def _ends(
    problem: Problem, free: np.ndarray, width: np.ndarray, counts: np.ndarray, active: np.ndarray, best: np.ndarray
) -> Descent:
    """Ends of descents; those that come back to the best place ``(n_free,)`` are followed no further than that."""
    rough = descend_all(problem, free, width, counts, active, Stopping(np.asarray(FOR_A_HORIZON)))
    further = active & ~(np.max(np.abs(np.asarray(rough.free) - best) / width, axis=-1) < SAME_PLACE)
    if not further.any():
        return rough
    found = descend_all(problem, free, width, counts, further, Stopping(np.asarray(TO_THE_END)))
    return Descent(
        *(
            with_rows(old, further, new[further])
            for old, new in zip(map(np.asarray, rough), map(np.asarray, found), strict=True)
        )
    )


def with_further_starts(starts: Starts, layout: Layout, began: np.ndarray, found: Descent) -> Starts:
    """The starts with others, that began at `began` ``(n, n_free)``."""
    shared = [i for i, (_, record) in enumerate(layout.entries) if record is None]
    with np.errstate(invalid="ignore"):
        ended = layout.values(found.free)
    costs = np.append(starts.cost, found.cost)
    return replace(
        starts,
        began=np.concatenate([starts.began, began[:, shared]]),
        ended=np.concatenate([starts.ended, ended[:, shared]]),
        values=np.concatenate([starts.values, ended]),
        cost=costs,
        steps=np.append(starts.steps, found.steps),
        basin=basins_of(costs),
        planned=starts.planned + len(began),
    )


def _lower_of_few(
    thin: Problem, free: np.ndarray, width: np.ndarray, counts: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Ends ``(STARTS_AT_ONCE, n_free)`` of descents in few of many samples; which lie lower than the first place's own.

    Parameters
    ----------
    thin : Problem
    free : (1 + STARTS_AT_ONCE, n_free) free coordinates
        Of the best place, and of those that are looked from.
    width : (n_free,) unit of the steps of all samples
    counts : (STARTS_AT_ONCE, n_record) int, of all samples
    """
    fewer = np.asarray(thin.observations.experiment.count)
    every = float(counts[0].sum() / fewer.sum())
    wider, stopping = np.sqrt(every) * width, Stopping(np.asarray(TO_THE_END))
    fewer = np.repeat(fewer[None], STARTS_AT_ONCE, axis=0)
    own = descend_all(thin, np.resize(free[0], free[1:].shape), wider, fewer, np.arange(STARTS_AT_ONCE) < 1, stopping)
    others = descend_all(thin, free[1:], wider, fewer, np.ones(STARTS_AT_ONCE, dtype=bool), stopping)
    ends, costs = np.asarray(others.free), np.asarray(others.cost)
    lowest = int(np.argmin(costs))
    same = np.max(np.abs(ends - ends[lowest]) / wider, axis=-1) < SAME_PLACE
    lower = float(np.asarray(own.cost).min()) - costs > FIT_TOLERANCE / every
    return ends, lower & (~same | (np.arange(STARTS_AT_ONCE) == lowest))


def _signs(size: int, number: int) -> np.ndarray:
    """Ways from a place, ``(STARTS_AT_ONCE, size)`` of one and minus one: Walsh functions, other ones at each look."""
    rows, places = np.arange(1, STARTS_AT_ONCE // 2 + 1) + number * STARTS_AT_ONCE // 2, np.arange(size)
    odd = np.array([[(int(row) & int(place)).bit_count() % 2 for place in places] for row in rows])
    return np.concatenate([1.0 - 2.0 * odd, 2.0 * odd - 1.0])


def rough_errors(problem: Problem, values: np.ndarray, cost: float) -> np.ndarray:
    """Standard errors ``(n_free,)`` under white noise of the residuals' size; a small step where data see nothing."""
    root = gram_root(gram_at(problem, values))[:, :-1]
    scale = np.linalg.norm(root, axis=0)
    seen = scale > 0.0
    inverse = np.linalg.pinv(root / np.where(seen, scale, 1.0), rcond=1e-8) / np.where(seen, scale, 1.0)[:, None]
    errors = np.linalg.norm(inverse, axis=1) * np.sqrt(cost / problem.n_measured)
    return np.where(seen & (errors > 0.0), errors, np.maximum(1e-3 * np.abs(values), 1e-9))
