"""A whitened estimate, and how its cost rises around it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from fibrefit.fitting import uncertainty
from fibrefit.fitting.search.solve import linearised
from fibrefit.problem.estimate.gls import inverse, whitened
from fibrefit.problem.noise.whitening import Whitening
from fibrefit.problem.statement.problem import Linearised, Problem

STEPS = 6
SETTLED = 0.03
"""Step in standard errors that is not taken any more."""


@dataclass(frozen=True)
class Sharp:
    """A whitened estimate.

    Parameters
    ----------
    values : (n_free,) in SI units
    linear : Linearised
        There, not whitened.
    scores : Scores
        Of the innovations.
    whitening : Whitening
    level : (n_channel,)
        Noise over what the whitening assumes.
    """

    values: np.ndarray
    linear: Linearised
    scores: uncertainty.Scores
    whitening: Whitening
    level: np.ndarray


def length(step: np.ndarray, covariance: np.ndarray) -> float:
    """Largest step in standard errors; infinite where it is none."""
    error = np.sqrt(np.clip(np.diag(covariance), 0.0, None))
    longest = np.max(np.abs(step) / np.where(error > 0.0, error, np.inf), initial=0.0)
    return float(longest) if np.isfinite(longest) else np.inf


def cost_with_one_held(problem: Problem, sharp: Sharp, index: int) -> Callable[[np.ndarray], float]:
    """Smallest sum of squared innovations with the value at `index` held, as a function of values to begin at."""
    layout = problem.layout
    free = np.arange(layout.size) != index

    def cost(values: np.ndarray) -> float:
        for _ in range(STEPS):
            here = whitened(layout, linearised(problem, values), sharp.whitening, sharp.level)
            covariance = inverse(here.normal[np.ix_(free, free)])
            step = -covariance @ here.gradient[free]
            if length(step, covariance) < SETTLED:
                break
            values = values.copy()
            values[free] += step
        return here.cost + float(here.gradient[free] @ step)

    return cost
