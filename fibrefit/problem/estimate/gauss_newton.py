"""One Gauss-Newton for values, nuisances and deviations between records: arrowhead matrices, a trust region, bounds.

All that is needed of the records are, for each, the products of its whitened slopes and residuals. Fits, candidates of
a search and how records differ in a posterior vary in who supplies them and in which values are unknown. The mode of
a posterior, whose noise levels are unknown too, has a search of its own (`sampling.mode`). What is minimised is
the ``Q`` of `fibrefit.problem.linear_model`.

A descent ends in the nearest minimum, and a record may have two: a weight that sticks comes to rest at one of its
reversals, a motion that bounces lands once more or does not, tens of nats apart. Which of them a hypothesis meets is
chance, and a comparison of two that met different ones compares minima. Along each deviation the cost of a record is
therefore taken a standard deviation away, on both sides. Where it is far below the parabola that slopes predict, the
record is begun there, with all that records share fixed: they are independent then. Each keeps the better of its two
minima (`better_minima`).

Source
------
Levenberg, Q. Appl. Math. 2 (1944); Marquardt, J. SIAM 11 (1963); More, Numerical Analysis, Lecture Notes in Mathematics
630 (1978), whose numbers are those of the trust region.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.arrays import RAN_AWAY
from fibrefit.core.matrices import equilibrated, solved
from fibrefit.problem.linear_model.normal_equations import Arrowhead, PosteriorMode, eliminated
from fibrefit.problem.linear_model.unknowns import Corrected, Gram, Place, Unknowns
from fibrefit.problem.linear_model.view import View

MODE_TOLERANCE = 0.02
"""Predicted reduction of Q that is not taken any more; two are a factor e in probability."""
NOTICEABLE_FALL = 1.0
"""Fall of Q that is worth further evaluations."""
STEPS = 40
"""Evaluations at the most."""
LEAST_DAMPING, CAUTIOUS, STIFFEST = 1e-10, 1e-4, 1e16
"""Damping of a step whose size nothing limits, of the first one, and beyond which there is no step."""
SHORTEST_STEP = 0.1
"""Share of a step that led nowhere, below which the next one is not shortened at once."""
ON_RADIUS = 1.1
"""Factor to which a step has the size of the radius."""
FIRST_SIGMA = 0.004
"""Standard deviation a search begins with."""
BROAD = 0.02
"""Standard deviation between records with which the noise is first looked for: what they differ by is not in it."""
ROUGH_TOLERANCE = 0.1
"""Predicted reduction of Q at which a record-wise start ends."""
FAR_BELOW = 0.8
"""Share of the rise that slopes predict, below which a record is begun on that side: of five drops one had another
minimum, and rose on that side by 0.4 to 0.7 of what it did on the other; both sides of the others were within 1 %."""


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
        return found.objective <= self.worthless and fall >= max(NOTICEABLE_FALL, so_far)


EVERYTHING = Effort()
"""To the end."""
NEARBY = Effort(steps=12)
"""How long the other minimum of a record is looked for: it is near, or it is none."""


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
        found = PosteriorMode.at(unknowns, place, gram, sigma)
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
            there = Arrowhead.at(unknowns, step.place, gram)
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
    return replace(found, normal=Arrowhead.at(found.unknowns, found.place, gram), steps=found.steps + 1)


class DampedStep(NamedTuple):
    """A step inside the bounds and within reach.

    Parameters
    ----------
    place : Place
        Where it leads.
    predicted_reduction : float
        Fall of Q.
    slope : float
        What Q would fall by if it fell on as it does at the start of the step.
    size : float
        Norm, each coordinate in units of what one of residuals it changes by one.
    """

    place: Place
    predicted_reduction: float
    slope: float
    size: float


def radius_after(step: DampedStep, fall: float, radius: float) -> float:
    """Radius of the trust region after a step, by how much Q fell of the predicted reduction."""
    if not np.isfinite(fall):
        return SHORTEST_STEP * step.size
    if fall > 0.75 * step.predicted_reduction:
        return max(radius if np.isfinite(radius) else 0.0, 2.0 * step.size)
    if fall > 0.25 * step.predicted_reduction:
        return step.size if np.isinf(radius) else radius
    # Where the parabola through both ends, with the slope at the first, is lowest.
    return float(np.clip(0.5 * step.slope / (step.slope - fall), SHORTEST_STEP, 0.5)) * step.size


def step_within(found: PosteriorMode, radius: float) -> DampedStep:
    """The damped step of a size that is no more than a radius.

    Its damping is the one for which it has the size of the radius, to a tenth.
    """
    low, high = np.log10(LEAST_DAMPING), np.log10(STIFFEST)
    first = _trial(found, CAUTIOUS if np.isinf(radius) else LEAST_DAMPING)
    if first.size <= ON_RADIUS * radius:
        return first
    while high - low > 1e-3:
        middle = 0.5 * (low + high)
        step = _trial(found, 10.0**middle)
        if step.size > ON_RADIUS * radius:
            low = middle
        elif step.size < radius / ON_RADIUS:
            high = middle
        else:
            return step
    return step


def _trial(found: PosteriorMode, damping: float) -> DampedStep:
    """A damped step inside the bounds."""
    unknowns, place = found.unknowns, found.place
    whole = found.normal.with_priors(unknowns, place, found.sigma)
    shared, blocks = (matrix + damping * np.eye(matrix.shape[-1]) * matrix for matrix in (whole.shared, whole.blocks))
    schur, pull = eliminated(shared, whole.cross, blocks, whole.pull, whole.pulls)
    stuck = ((place.z <= unknowns.lower) & (whole.pull > 0.0)) | ((place.z >= unknowns.upper) & (whole.pull < 0.0))
    free = ~stuck & (np.diag(whole.shared) > 0.0)
    fixed = np.zeros(len(place.z))
    for _ in range(len(free) + 1):
        dz = np.where(free, 0.0, fixed)
        right = pull + schur @ dz
        if free.any():
            scale = np.sqrt(np.maximum(np.diag(whole.shared)[free], 1e-300))
            inside, wanted = equilibrated(schur[np.ix_(free, free)], scale), right[free] / scale
            # Where slopes are lost though the motion is not, no step leads anywhere.
            known = np.isfinite(inside).all() and np.isfinite(wanted).all()
            dz[free] = -np.linalg.lstsq(inside, wanted, rcond=1e-13)[0] / scale if known else np.nan
        outside = free & ((place.z + dz < unknowns.lower) | (place.z + dz > unknowns.upper))
        if not outside.any():
            break
        # What would leave its bounds is brought to them, and the others move with it fixed there.
        fixed = np.where(outside, np.clip(place.z + dz, unknowns.lower, unknowns.upper) - place.z, fixed)
        free &= ~outside
    own = solved(blocks, -(whole.pulls + np.einsum("i,rij->rj", dz, whole.cross))[..., None])[..., 0]
    n = len(unknowns.each)
    there = Place(place.z + dz, place.own + own[:, :n], place.eta + own[:, n:], place.rest)
    slope = -2.0 * float(whole.pull @ dz + np.sum(whole.pulls * own))
    bend = dz @ whole.shared @ dz + 2.0 * np.einsum("i,rij,rj->", dz, whole.cross, own)
    bend += np.einsum("ri,rij,rj->", own, whole.blocks, own)
    size = np.diag(whole.shared) @ dz**2 + np.sum(np.einsum("rii->ri", whole.blocks) * own**2)
    return DampedStep(there, slope - float(bend), slope, float(np.sqrt(size)))


def record_wise_start(unknowns: Unknowns, places: Sequence[Place], seen: View, horizons: np.ndarray) -> Place:
    """Where records that may differ are best in plain least squares.

    A record that differs may have been matched in the wrong bounce, and leave hardly more than noise there: all are
    fitted over horizons that grow once more, and each is taken from where it is best.

    Parameters
    ----------
    places : sequence of Place
        Where to begin.
    seen : View
        Without a whitening.
    horizons : (n_way, n_stage, n_record) int
        See `Task`.
    """
    sigma = np.full(len(unknowns.scattering), BROAD)
    found = [mode(unknowns, place, seen.gram(unknowns), sigma, ROUGH_TOLERANCE) for place in places]
    for way in horizons:
        there = places[0]._replace(eta=np.zeros_like(places[0].eta))
        for counts in way:
            shorter = replace(seen, problem=seen.problem.until(np.asarray(counts)))
            end = mode(unknowns, there, shorter.gram(unknowns), sigma, ROUGH_TOLERANCE)
            there = end.place
        found.append(end)
    best = np.argmin([end.normal.costs for end in found], axis=0)
    local = np.stack([found[i].local[r] for r, i in enumerate(best)])
    found.append(mode(unknowns, unknowns.place_of(local), seen.gram(unknowns), sigma, ROUGH_TOLERANCE))
    return min(found, key=lambda end: end.objective if np.isfinite(end.objective) else np.inf).place


def better_minima(found: PosteriorMode, gram: Gram, descent: Gram) -> Place | None:
    """Each record in the better one of two minima; None where none of them has a better one.

    Parameters
    ----------
    found : PosteriorMode
    gram : callable
        Products of changes however large, see `Gram`.
    descent : callable
        The same for a descent.
    """
    away = beyond_the_parabola(found, gram)
    if not away.any():
        return None
    unknowns, place = found.unknowns, found.place
    fixed = unknowns.fixed_at(np.arange(len(unknowns.shared)), place.z)
    there = mode(fixed, place._replace(eta=place.eta + away), descent, found.sigma, effort=NEARBY)
    better = there.record_costs() < found.record_costs() - NOTICEABLE_FALL
    if not better.any():
        return None
    own, eta = (
        np.where(better[:, None], new, old) for new, old in ((there.place.own, place.own), (there.place.eta, place.eta))
    )
    return place._replace(own=own, eta=eta)


def beyond_the_parabola(found: PosteriorMode, gram: Gram) -> np.ndarray:
    """Where records are begun anew: changes of their deviations ``(n_record, n_scattering)``, none of most.

    Of several sides the one whose cost is the smallest share of what slopes predict.
    """
    unknowns, place, normal = found.unknowns, found.place, found.normal
    nothing = np.zeros_like(place.eta)
    differing = np.flatnonzero(found.sigma > 0.0)
    if not differing.size or not np.isfinite(normal.cost):
        return nothing
    which = np.repeat(differing, 2)
    steps = np.maximum(found.sigma[which], FIRST_SIGMA) * np.tile([1.0, -1.0], differing.size)
    columns = unknowns.scattering[which]
    z = unknowns.shared_coordinates(place)
    # Of each side only the column that moves: with all coordinates moved at once values are the same.
    targets = np.stack([unknowns.value(z + step)[:, i] for i, step in zip(columns, steps, strict=True)], axis=1)
    grams = gram(unknowns.local_of(place), unknowns.shared[columns], targets)
    rise = np.einsum("rii->ri", grams)[:, :-1] + 2.0 * grams[:, :-1, -1]
    mine = len(unknowns.each) + which
    predicted = normal.blocks[:, mine, mine] * steps**2 + 2.0 * normal.pulls[:, mine] * steps
    known = predicted > NOTICEABLE_FALL
    share = np.where(known, rise / np.where(known, predicted, 1.0), np.inf)
    best = np.argmin(np.where(np.isfinite(share), share, np.inf), axis=1)
    there = share[np.arange(len(share)), best] < FAR_BELOW
    nothing[np.flatnonzero(there), which[best[there]]] = steps[best[there]]
    return nothing
