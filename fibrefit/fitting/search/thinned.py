"""Records with fewer samples, for a search that begins far off: where a minimum lies, every tenth sample may tell.

What a fit reports, its values, error bars and checks, is found from all samples.
"""

from __future__ import annotations

import numpy as np

from fibrefit.problem.statement.problem import Problem

FEWEST_KEPT = 4096
"""Samples that the shortest record keeps: a drop of four seconds at 1 kHz, which leads starts as well as more do."""
MISSED_BETWEEN = 1.5
"""What a straight line between the samples that are kept misses of those between, over the noise, at the most. Noise
alone has 1.3 of itself, from three readings; above, the motion would be given by too few samples, and followed with too
long steps."""


def thinning(problem: Problem) -> int:
    """One sample of how many a search may keep: a power of two, one where all are needed.

    What happens between the samples of a measured input would be lost, so that those keep all.

    Parameters
    ----------
    problem : Problem
    """
    data = problem.observations
    kept = int(np.asarray(data.experiment.count).min()) // FEWEST_KEPT
    if data.experiment.inputs or kept < 2:
        return 1
    every = 1 << (kept.bit_length() - 1)
    while every > 1 and _missed(problem, every) > MISSED_BETWEEN:
        every //= 2
    return every


def _missed(problem: Problem, every: int) -> float:
    """Rms over the noise of what straight lines between kept samples miss of the others, of the worst channel."""
    data = problem.observations
    share, worst = np.arange(1, every) / every, 0.0
    for channel, weights in data.weight.items():
        values, weight = np.asarray(data.measured[channel]), np.asarray(weights)
        whole = (values.shape[1] - 1) // every * every
        left, right = values[:, :whole:every, None], values[:, every : whole + 1 : every, None]
        held = (weight[:, :whole:every, None] > 0.0) & (weight[:, every : whole + 1 : every, None] > 0.0)
        between, counted = (rows[:, :whole].reshape(len(rows), -1, every)[..., 1:] for rows in (values, weight))
        off = (between - left - share * (right - left)) * np.where(held, counted, 0.0)
        worst = max(worst, float(np.sqrt(np.sum(off**2) / max(np.count_nonzero(off), 1))))
    return worst
