"""One Gauss-Newton for values, nuisances and deviations between records: arrowhead matrices, a trust region, bounds.

All that is needed of the records are, for each, the products of its whitened slopes and residuals. Fits, candidates of
a search and how records differ in a posterior vary in who supplies them and in which values are unknown. The mode of
a posterior, whose noise levels are unknown too, has a search of its own (`sampling.mode.mode`).

Law
---
Residuals ``e_r(z, eta_r, nu_r)`` with shared coordinates ``z ~ N(mean, P^-1)``, random effects of a record,
its relative deviations ``eta_r ~ N(0, diag sigma^2)``, and nuisances ``nu_r`` of which nothing is known. Minimised is
``Q = sum |e_r|^2 + sum (eta_r / sigma)^2 + (z - mean)' P (z - mean)``. A coordinate is the logarithm of a value over
its reference, or its distance from there in units of its scale; a deviation is added to the logarithm.

Source
------
Levenberg, Q. Appl. Math. 2 (1944); Marquardt, J. SIAM 11 (1963).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.problem.estimate.gram import Corrected, Gram
from fibrefit.problem.estimate.normal_equations import Place, PosteriorMode, Unknowns, arrowhead, begun_at
from fibrefit.problem.estimate.trust_region import radius_after, step_within
from fibrefit.problem.statement.arrays import RAN_AWAY

MODE_TOLERANCE = 0.02
"""Predicted reduction of Q that is not taken any more; two are a factor e in probability."""
NOTICED = 1.0
"""Fall of Q that is worth further evaluations."""
STEPS = 40
"""Evaluations at the most."""


@dataclass(frozen=True)
class Effort:
    """How long a minimum is looked for.

    Parameters
    ----------
    steps : int
        Evaluations at the most.
    patience : int
        Evaluations in which Q has to fall noticeably. A cost with kinks, as bounces make them, is crept down else.
    worthless : float
        Q above which a minimum is of no use once patience has ended.
    share : float
        Of the fall below `before` so far; a fall that is less is not noticeable either.
    before : float
        Q of what the model contains.
    """

    steps: int = STEPS
    patience: int = STEPS
    worthless: float = np.inf
    share: float = 0.0
    before: float = np.inf

    def goes_on(self, found: PosteriorMode, lowest: Sequence[float]) -> bool:
        """Whether there is another step.

        Parameters
        ----------
        lowest : sequence of float
            Q before each step so far.
        """
        if found.steps >= self.steps:
            return False
        if len(lowest) < self.patience:
            return True
        so_far = self.share * (self.before - found.objective) if np.isfinite(self.before) else 0.0
        fall = lowest[-self.patience] - found.objective
        return found.objective <= self.worthless and fall >= max(NOTICED, so_far)


EVERYTHING = Effort()
"""To the end."""


@RAN_AWAY
def mode(
    unknowns: Unknowns,
    start: Place | PosteriorMode,
    gram: Gram,
    sigma: np.ndarray,
    tolerance: float = MODE_TOLERANCE,
    effort: Effort = EVERYTHING,
) -> PosteriorMode:
    """Minimise Q from a place.

    Parameters
    ----------
    start : Place or PosteriorMode
        With its normal equations, where they are known.
    gram : callable
        See `Gram` and `Corrected` in `gram`.
    sigma : (n_scattering,)
        Standard deviations of the deviations between records.
    tolerance : float
        Predicted reduction of Q at which it stops.
    """
    if isinstance(start, PosteriorMode):
        found = replace(start, sigma=sigma, predicted_reduction=np.inf, steps=1)
    else:
        place = start._replace(z=np.clip(start.z, unknowns.lower, unknowns.upper))
        found = begun_at(unknowns, place, gram, sigma)
    corrected = gram if isinstance(gram, Corrected) else None
    exact = corrected is None or isinstance(start, PosteriorMode) or corrected.exact
    radius, step, lowest = np.inf, None, list[float]()
    # From where a motion is lost no step leads anywhere.
    while np.isfinite(found.normal.cost) and effort.goes_on(found, lowest):
        lowest.append(found.objective)
        step = step_within(found, radius)
        arrived = not step.predicted_reduction > tolerance
        if arrived and exact:
            break
        if not arrived:
            there = arrowhead(unknowns, step.place, gram)
            moved = replace(found, place=step.place, normal=there, steps=found.steps + 1)
            fall = found.objective - moved.objective
            if np.isfinite(fall) and fall > 0.0:
                found, radius = moved, radius_after(step, fall, radius)
                exact = corrected is None or corrected.exact
                continue
            found = replace(found, steps=found.steps + 1)
        if exact:
            radius = radius_after(step, fall, radius)
        else:
            found, exact = _again(found, gram), True
    if not exact and np.isfinite(found.normal.cost):
        found = _again(found, gram)  # evidence is that of the slopes there are, not of those that were predicted
    # Slopes that were predicted may be numbers where those that are simulated are none.
    if step is None or not np.isfinite(found.normal.cost) or np.isnan(step.predicted_reduction):
        return replace(found, predicted_reduction=np.inf)
    return replace(
        found,
        predicted_reduction=step_within(found, radius).predicted_reduction,  # the last step may have led here
        unmet=max(step_within(found, np.inf).predicted_reduction, 0.0),
    )


def _again(found: PosteriorMode, gram: Gram) -> PosteriorMode:
    """The same place with all slopes simulated there."""
    if isinstance(gram, Corrected):
        gram.renew()
    return replace(found, normal=arrowhead(found.unknowns, found.place, gram), steps=found.steps + 1)
