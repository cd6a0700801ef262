"""Profile-likelihood intervals: where the best fit with one value held becomes significantly worse.

Source
------
Venzon and Moolgavkar, Appl. Stat. 37 (1988). The threshold is widened by the square of what correlated noise does to
the standard error, as a composite likelihood's is (Pace, Salvan and Sartori, Stat. Sinica 21 (2011)).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fibrefit.fitting.search.solve import descend
from fibrefit.fitting.uncertainty import Scores, sandwich
from fibrefit.problem.statement.problem import Problem

CHI2_95 = 3.841459
"""Rise of the deviance at either end of a 95 % interval: the square of `Z_95`."""
NEAR = 1.96
"""Standard errors from the best value at which an end is looked for first: on a parabola it is there."""
FARTHEST = 8.0
"""Distance in standard errors beyond which an end of the interval is not searched."""


Cost = Callable[[np.ndarray], float]
"""Smallest deviance, twice a negative log likelihood, with one value held, from values ``(n_free,)`` in SI units to
begin at."""


def plain_cost(
    problem: Problem, values: np.ndarray, index: int, width: np.ndarray, whole: np.ndarray
) -> tuple[Cost, float]:
    """Cost of plain least squares with the value at `index` held, and the standard error that it has by this cost.

    Squares, priors among them, are counted over the variance that the best fit leaves: by this cost residuals that are
    larger than the noise make a prior as much wider, which error bars that are reported do not.

    Parameters
    ----------
    values : (n_free,) in SI units
        Of the best fit.
    width : (n_free,)
        Unit of the solver's steps, see `solve.widths`.
    whole : (1, n_record) int
        Samples of each record.
    """
    held = np.where(np.arange(len(width)) == index, 0.0, width)

    def squares(at: np.ndarray) -> float:
        return float(descend(problem, problem.layout.free(at), held, whole).cost)

    variance = squares(values) / problem.n_measured
    linear = problem.followed(np.asarray(problem.layout.local(values)))[0]
    normal = Scores.of(problem, linear, values).normal_matrix()
    own = float(np.sqrt(variance * sandwich(normal, normal)[index, index]))
    return lambda at: squares(at) / variance, own


def profile_interval(
    problem: Problem, values: np.ndarray, index: int, cost: Cost, own: float, reported: float
) -> tuple[float, float]:
    """95 % interval of one free value.

    Parameters
    ----------
    values : (n_free,) in SI units
        Of the best fit.
    index : int
        The value's place.
    cost : callable
        Deviance of the best fit with the value held.
    own, reported : float
        Its standard error if the noise were what this cost takes it for, and for the noise as it is, in SI units.

    Returns
    -------
    tuple of float
        In SI units; the limit of the parameter where the cost never rises enough within reach.
    """
    lowest = cost(values)
    rise = CHI2_95 * (reported / own) ** 2

    def excess(value: float) -> float:
        return cost(np.where(np.arange(len(values)) == index, value, values)) - lowest - rise

    limits = problem.layout.entries[index][0].range
    low = _crossing(excess, values[index], -NEAR * reported, max(limits.lower, values[index] - FARTHEST * reported))
    high = _crossing(excess, values[index], NEAR * reported, min(limits.upper, values[index] + FARTHEST * reported))
    return low if low is not None else limits.lower, high if high is not None else limits.upper


def _crossing(excess: Callable[[float], float], centre: float, step: float, last: float) -> float | None:
    """Where the excess turns positive on the way from `centre` past ``centre + step`` to `last`; None if nowhere."""
    from scipy.optimize import brentq

    inner, outer = centre, centre + step
    while True:
        outer = max(outer, last) if step < 0.0 else min(outer, last)
        if excess(outer) > 0.0:
            return float(brentq(excess, inner, outer, xtol=1e-3 * abs(step), rtol=1e-12))
        if outer == last:
            return None
        inner, outer = outer, outer + step
