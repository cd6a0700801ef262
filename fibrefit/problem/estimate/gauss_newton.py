"""One Gauss-Newton for values, nuisances and deviations between records: arrowhead matrices, a trust region, bounds.

All that is asked of the records are, for each, the products of its whitened slopes and residuals. Fits, candidates of
a search and the mode of a posterior differ in who supplies them and in which values are unknown.

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

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fibrefit.problem.estimate.gram import Corrected, Gram
from fibrefit.problem.estimate.schur import eliminated, solved

STEP = 1e-6
"""Difference step of a coordinate."""
STEADY = 0.01
"""Size below which a difference step no longer falls with its coordinate."""
SETTLED = 0.02
"""Promised fall of Q that is not taken any more; two are a factor e in probability."""
STEPS = 40
STIFFEST = 1e8
RIGID = 1e-7
"""Standard deviation that stands for no deviations at all."""


@dataclass(frozen=True)
class Unknowns:
    """Which of the records' values are unknown, and what is believed of them.

    Parameters
    ----------
    names : tuple of str
        Of the shared values, then of each record's own.
    shared : (n_shared,) int
        Places of the shared values among a record's values.
    each : (n_each,) int
        Places of the values of each record's own.
    free : (n_record, n_each) bool
        Which of those are unknown; the others are held.
    scattering : (n_scattering,) int
        Places among the shared values, all logarithmic, of those that deviate from record to record.
    log : (n_shared,) bool
    reference, scale : (n_shared,) in SI units
        A coordinate is ``log(value / reference)`` or ``(value - reference) / scale``.
    mean : (n_shared,)
        Of the prior of each coordinate.
    precision : (n_shared, n_shared)
        Inverse of the covariance of that prior.
    lower, upper : (n_shared,)
        Bounds of the coordinates.
    one_sided : (n_shared,) bool
        Whether a bound lies at the prior's mean: half of the prior is cut off.
    size : (n_each,) in SI units
        Typical size of each record's own values.
    """

    names: tuple[str, ...]
    shared: np.ndarray
    each: np.ndarray
    free: np.ndarray
    scattering: np.ndarray
    log: np.ndarray
    reference: np.ndarray
    scale: np.ndarray
    mean: np.ndarray
    precision: np.ndarray
    lower: np.ndarray
    upper: np.ndarray
    one_sided: np.ndarray
    size: np.ndarray

    @property
    def columns(self) -> np.ndarray:
        """Places of all unknown values of a record."""
        return np.concatenate([self.shared, self.each])

    @property
    def own(self) -> np.ndarray:
        """Columns of what belongs to one record: its own values, then its deviations."""
        return np.concatenate([len(self.shared) + np.arange(len(self.each)), self.scattering]).astype(int)

    def value(self, z: np.ndarray) -> np.ndarray:
        """Values in SI units of coordinates ``(..., n_shared)``."""
        with np.errstate(over="ignore"):
            return np.where(
                self.log, self.reference * np.exp(np.where(self.log, z, 0.0)), self.reference + self.scale * z
            )

    def coordinate(self, value: np.ndarray) -> np.ndarray:
        """Coordinates of values ``(..., n_shared)`` in SI units, inside their bounds."""
        ratio = value / np.where(self.log, self.reference, 1.0)
        z = np.where(self.log, np.log(np.maximum(ratio, 1e-300)), (value - self.reference) / self.scale)
        return np.clip(z, self.lower, self.upper)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """Change of values with their coordinates ``(n_shared,)``, in SI units."""
        return np.where(self.log, self.value(z), self.scale)


class Place(NamedTuple):
    """A set of unknowns.

    Parameters
    ----------
    z : (n_shared,)
    own : (n_record, n_each) in units of their sizes
    eta : (n_record, n_scattering)
    rest : (n_record, n_local) in SI units
        Values that are held.
    """

    z: np.ndarray
    own: np.ndarray
    eta: np.ndarray
    rest: np.ndarray


class Arrowhead(NamedTuple):
    """Normal equations about a place, the deviations' prior left out.

    Parameters
    ----------
    shared : (n_shared, n_shared)
    cross : (n_record, n_shared, n_own)
    blocks : (n_record, n_own, n_own)
    pull : (n_shared,)
        Half the gradient of the cost with respect to the shared coordinates.
    pulls : (n_record, n_own)
    cost : float
        Sum of squared residuals.
    costs : (n_record,)
    """

    shared: np.ndarray
    cross: np.ndarray
    blocks: np.ndarray
    pull: np.ndarray
    pulls: np.ndarray
    cost: float
    costs: np.ndarray


@dataclass(frozen=True)
class PosteriorMode:
    """Where Q is smallest.

    Parameters
    ----------
    unknowns : Unknowns
    place : Place
    normal : Arrowhead
        There.
    sigma : (n_scattering,)
    promised : float
        Fall of Q that one more step promises.
    steps : int
        Evaluations.
    """

    unknowns: Unknowns
    place: Place
    normal: Arrowhead
    sigma: np.ndarray
    promised: float
    steps: int

    @property
    def local(self) -> np.ndarray:
        """Values of each record, ``(n_record, n_local)`` in SI units."""
        return local_of(self.unknowns, self.place)

    @property
    def values(self) -> np.ndarray:
        """Shared values, ``(n_shared,)`` in SI units."""
        return self.unknowns.value(self.place.z)

    @property
    def objective(self) -> float:
        """Q."""
        return self.normal.cost + penalty(self.unknowns, self.place, self.sigma)


def place_of(unknowns: Unknowns, local: np.ndarray, eta: np.ndarray | None = None) -> Place:
    """Unknowns at given values.

    Parameters
    ----------
    unknowns : Unknowns
    local : (n_record, n_local) in SI units
        The shared values are their means over the records, geometric where they are logarithmic.
    eta : (n_record, n_scattering), optional
        Deviations; what the values themselves show by default.
    """
    z = unknowns.coordinate(local[:, unknowns.shared])
    middle = np.clip(z.mean(axis=0), unknowns.lower, unknowns.upper)
    found = (z - middle)[:, unknowns.scattering] if eta is None else eta
    return Place(middle, local[:, unknowns.each] / unknowns.size, found, local.copy())


def local_of(unknowns: Unknowns, place: Place) -> np.ndarray:
    """Values of each record, ``(n_record, n_local)`` in SI units."""
    local = place.rest.copy()
    local[:, unknowns.each] = place.own * unknowns.size
    z = np.repeat(place.z[None], len(local), axis=0)
    z[:, unknowns.scattering] += place.eta
    local[:, unknowns.shared] = unknowns.value(z)
    return local


def penalty(unknowns: Unknowns, place: Place, sigma: np.ndarray) -> float:
    """What the priors add to the sum of squares."""
    deviation, away = place.eta / np.maximum(sigma, RIGID), place.z - unknowns.mean
    return float(np.sum(deviation**2) + away @ unknowns.precision @ away)


def arrowhead(unknowns: Unknowns, place: Place, gram: Gram) -> Arrowhead:
    """Normal equations about a place."""
    return arranged(unknowns, local_grams(unknowns, place, gram))


def local_grams(
    unknowns: Unknowns, place: Place, gram: Gram, further: tuple[np.ndarray, np.ndarray] | None = None
) -> np.ndarray:
    """Products of slopes and residuals of each record, per unit of its coordinates; residuals come last.

    Parameters
    ----------
    unknowns : Unknowns
    place : Place
    gram : callable
    further : ((n_direction,) int, (n_direction,) in SI units), optional
        Columns after those of the unknowns, and where they go: as they are, not per unit of anything.
    """
    local = local_of(unknowns, place)
    z = np.repeat(place.z[None], len(local), axis=0)
    z[:, unknowns.scattering] += place.eta
    shared = np.where(unknowns.log, STEP, STEP * np.maximum(np.abs(place.z), STEADY))
    steps = np.repeat(shared[None], len(local), axis=0)
    own = STEP * np.maximum(np.abs(place.own), STEADY)
    targets = np.concatenate([unknowns.value(z + steps), (place.own + own) * unknowns.size], axis=1)
    columns, rate = unknowns.columns, np.concatenate([1.0 / steps, 1.0 / own], axis=1)
    if further is not None:
        columns = np.concatenate([columns, further[0]])
        targets = np.concatenate([targets, np.repeat(further[1][None], len(local), axis=0)], axis=1)
    rate = np.concatenate([rate, np.ones((len(local), len(columns) - rate.shape[1] + 1))], axis=1)
    return gram(local, columns, targets) * rate[:, :, None] * rate[:, None, :]


def arranged(unknowns: Unknowns, grams: np.ndarray) -> Arrowhead:
    """Products of slopes sorted into what is shared and what belongs to each record."""
    n, mine, held = len(unknowns.shared), unknowns.own, held_places(unknowns)
    pulls = np.where(held, 0.0, grams[:, mine, -1])
    blocks = np.where(held[:, :, None] | held[:, None, :], np.eye(len(mine)), grams[:, mine[:, None], mine])
    cross = np.where(held[:, None, :], 0.0, grams[:, :n][:, :, mine])
    # Where slopes are no numbers a record is lost, as it is where its motion is.
    costs = np.where(np.isfinite(grams).all(axis=(1, 2)), grams[:, -1, -1], np.inf)
    whole = grams[:, :n].sum(axis=0)
    return Arrowhead(whole[:, :n], cross, blocks, whole[:, -1], pulls, float(costs.sum()), costs)


def held_places(unknowns: Unknowns) -> np.ndarray:
    """Which of the records' own unknowns are held, ``(n_record, n_own)``; deviations never are."""
    deviations = np.zeros((len(unknowns.free), len(unknowns.scattering)), dtype=bool)
    return np.concatenate([~unknowns.free, deviations], axis=1)


def mode(
    unknowns: Unknowns,
    start: Place | PosteriorMode,
    gram: Gram,
    sigma: np.ndarray,
    settled: float = SETTLED,
    max_steps: int = STEPS,
) -> PosteriorMode:
    """Minimise Q from a place.

    Parameters
    ----------
    unknowns : Unknowns
    start : Place or PosteriorMode
        With its normal equations, where they are known.
    gram : callable
        See `Gram` and `Corrected` in `gram`.
    sigma : (n_scattering,)
        Standard deviations of the deviations between records.
    settled : float
        Promised fall of Q at which it stops.
    max_steps : int
        Evaluations at the most.
    """
    if isinstance(start, PosteriorMode):
        found = replace(start, sigma=sigma, promised=np.inf, steps=1)
    else:
        place = start._replace(z=np.clip(start.z, unknowns.lower, unknowns.upper))
        found = PosteriorMode(unknowns, place, arrowhead(unknowns, place, gram), sigma, np.inf, 1)
    corrected = gram if isinstance(gram, Corrected) else None
    exact = corrected is None or isinstance(start, PosteriorMode) or corrected.exact
    damping, promised = 1e-4, np.inf
    # From where a motion is lost no step leads anywhere.
    while np.isfinite(found.normal.cost) and found.steps < max_steps:
        trial, promised = _trial(found, damping)
        arrived = not promised > settled
        if arrived and exact:
            break
        if not arrived:
            there = arrowhead(unknowns, trial, gram)
            moved = replace(found, place=trial, normal=there, steps=found.steps + 1)
            fall = found.objective - moved.objective
            if np.isfinite(fall) and fall > 0.0:
                found, damping = moved, max(damping / 10.0, 1e-12)
                exact = corrected is None or corrected.exact
                continue
            found = replace(found, steps=found.steps + 1)
        if exact:
            damping *= 10.0
            if damping > STIFFEST:
                break
        else:
            found, exact = _again(found, gram), True
    if not exact and np.isfinite(found.normal.cost):
        found = _again(found, gram)  # evidence is that of the slopes there are, not of those that were foreseen
        promised = _trial(found, damping)[1]
    return replace(found, promised=float(promised))


def _again(found: PosteriorMode, gram: Gram) -> PosteriorMode:
    """The same place with all slopes simulated there."""
    if isinstance(gram, Corrected):
        gram.renew()
    return replace(found, normal=arrowhead(found.unknowns, found.place, gram), steps=found.steps + 1)


def _trial(found: PosteriorMode, damping: float) -> tuple[Place, float]:
    """Place after a damped step inside the bounds, and the fall of Q it promises."""
    unknowns, place = found.unknowns, found.place
    whole = _with_priors(found)
    stuck = ((place.z <= unknowns.lower) & (whole.pull > 0.0)) | ((place.z >= unknowns.upper) & (whole.pull < 0.0))
    free = ~stuck & (np.diag(whole.shared) > 0.0)
    held = np.zeros(len(place.z))
    for _ in range(len(free) + 1):
        dz, own = _solved(whole, damping, free, held)
        outside = free & ((place.z + dz < unknowns.lower) | (place.z + dz > unknowns.upper))
        if not outside.any():
            break
        # What would leave its bounds is brought to them, and the others move with it held there.
        held = np.where(outside, np.clip(place.z + dz, unknowns.lower, unknowns.upper) - place.z, held)
        free &= ~outside
    n = len(unknowns.each)
    way = Place(place.z + dz, place.own + own[:, :n], place.eta + own[:, n:], place.rest)
    linear = whole.pull @ dz + np.sum(whole.pulls * own)
    bend = dz @ whole.shared @ dz + 2.0 * np.einsum("i,rij,rj->", dz, whole.cross, own)
    bend += np.einsum("ri,rij,rj->", own, whole.blocks, own)
    return way, float(-2.0 * linear - bend)


def _with_priors(found: PosteriorMode) -> Arrowhead:
    """Normal equations of Q at a place."""
    unknowns, place, normal = found.unknowns, found.place, found.normal
    precision, n = 1.0 / np.maximum(found.sigma, RIGID) ** 2, len(unknowns.each)
    blocks, pulls = normal.blocks.copy(), normal.pulls.copy()
    index = n + np.arange(len(precision))
    blocks[:, index, index] += precision
    pulls[:, n:] += place.eta * precision
    pull = normal.pull + unknowns.precision @ (place.z - unknowns.mean)
    return normal._replace(shared=normal.shared + unknowns.precision, blocks=blocks, pull=pull, pulls=pulls)


def _solved(whole: Arrowhead, damping: float, free: np.ndarray, held: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Steps of shared and own unknowns; those that are not free go where they are held."""
    dz, shared, blocks = np.where(free, 0.0, held), _damped(whole.shared, damping), _damped(whole.blocks, damping)
    schur, right = eliminated(shared, whole.cross, blocks, whole.pull, whole.pulls)
    right = right + schur @ dz
    if free.any():
        scale = np.sqrt(np.maximum(np.diag(whole.shared)[free], 1e-300))
        inside = schur[np.ix_(free, free)] / np.outer(scale, scale)
        dz[free] = -np.linalg.lstsq(inside, right[free] / scale, rcond=1e-13)[0] / scale
    return dz, _own_step(whole, dz, damping)


def _own_step(whole: Arrowhead, dz: np.ndarray, damping: float) -> np.ndarray:
    right = -(whole.pulls + np.einsum("i,rij->rj", dz, whole.cross))
    return solved(_damped(whole.blocks, damping), right[..., None])[..., 0]


def _damped(matrix: np.ndarray, damping: float) -> np.ndarray:
    return matrix + damping * np.eye(matrix.shape[-1]) * matrix
