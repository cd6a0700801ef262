"""Minima beside the one where all starts ended.

Starts that follow a motion contact by contact are led alike, and may all be led into the same wrong order of small late
bounces, or past a turn at which the guide holds the weight. From far off its error bars, and over the whole record at
once, a descent may come down on the other side.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fibrefit.fitting.result import Starts
from fibrefit.fitting.search.multistart import CHUNK, basins_of
from fibrefit.fitting.search.solve import EXACT, Care, descend_all, gram_at, widths
from fibrefit.fitting.thresholds import SETTLED
from fibrefit.problem.statement.problem import Problem, gram_root

LOOKS = 3
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
    layout, counts = problem.layout, np.repeat(whole, CHUNK, axis=0)
    low, high = (np.array([getattr(slot.range, end) for slot, _ in layout.entries]) for end in ("lower", "upper"))
    for look in range(LOOKS):
        best = int(np.argmin(starts.cost))
        values, cost = starts.values[best], float(starts.cost[best])
        places = values + AWAY * rough_errors(problem, values, cost) * _signs(len(values), look)
        began, width = np.clip(places, low, high), widths(problem, layout.free(values))
        active, care = np.ones(CHUNK, dtype=bool), Care(np.asarray(EXACT))
        found = descend_all(problem, layout.free(began), width, counts, active, care)
        ends = np.asarray(found.cost)
        lower = cost - ends.min() > SETTLED
        if not lower and not look:
            return starts
        shared = [i for i, (_, record) in enumerate(layout.entries) if record is None]
        with np.errstate(invalid="ignore"):
            ended = layout.values(np.asarray(found.free))
        costs = np.append(starts.cost, ends)
        starts = replace(
            starts,
            began=np.concatenate([starts.began, began[:, shared]]),
            ended=np.concatenate([starts.ended, ended[:, shared]]),
            values=np.concatenate([starts.values, ended]),
            cost=costs,
            steps=np.append(starts.steps, np.asarray(found.steps)),
            basin=basins_of(costs),
            planned=starts.planned + CHUNK,
        )
        if not lower:
            break
    return starts


def _signs(size: int, look: int) -> np.ndarray:
    """Ways from a place, ``(CHUNK, size)`` of one and minus one: Walsh functions, other ones at each look."""
    rows, places = np.arange(1, CHUNK // 2 + 1) + look * CHUNK // 2, np.arange(size)
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
