"""A second solver that shares neither code nor coordinates with the first: SciPy's trust-region reflective method."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fibrefit.fitting.search.solve import gram_at
from fibrefit.problem.statement.problem import Problem, gram_root

TOLERANCE = 1e-10
"""Share of the cost that ends the search: a step that gains less moves no value by a hundredth of its error."""


@dataclass(frozen=True)
class SecondOpinion:
    """Where the other solver ended.

    Parameters
    ----------
    values : (n_free,) in SI units
    cost : float
        Sum of squared residuals.
    """

    values: np.ndarray
    cost: float


def second_opinion(problem: Problem, start: np.ndarray, scale: np.ndarray) -> SecondOpinion:
    """Fit again, in SI units with true bounds.

    Parameters
    ----------
    problem : Problem
    start : (n_free,) in SI units
    scale : (n_free,) in SI units
        A small step of each value.
    """
    from scipy.optimize import least_squares

    ranges = [slot.range for slot, _ in problem.layout.entries]
    lower, upper = np.array([r.lower for r in ranges]), np.array([r.upper for r in ranges])
    # A step where the data see nothing can be wider than the range itself.
    margin = 1e-9 * np.minimum(scale, upper - lower)
    root, begun = _Root(problem), np.clip(start, lower + margin, upper - margin)
    if not np.isfinite(root(begun)).all():
        return SecondOpinion(begun, np.inf)
    found = least_squares(
        lambda x: root(x)[:, -1],
        begun,
        jac=lambda x: root(x)[:, :-1],
        bounds=(lower, upper),
        x_scale=scale,
        method="trf",
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=100,
    )
    return SecondOpinion(found.x, float(2.0 * found.cost))


class _Root:
    """Residuals and Jacobian of the size of the problem; SciPy asks for both at the same place."""

    def __init__(self, problem: Problem) -> None:
        self._problem = problem
        self._place: np.ndarray | None = None
        self._root = np.empty(0)

    def __call__(self, values: np.ndarray) -> np.ndarray:
        if self._place is None or not np.array_equal(values, self._place):
            gram = gram_at(self._problem, values)
            # Where a motion runs away there are no residuals: SciPy takes a shorter step.
            there = bool(np.isfinite(gram).all())
            self._place, self._root = values.copy(), gram_root(gram) if there else np.full_like(gram, np.nan)
        return self._root
