"""Normal equations about a place: what is unknown, where it is, and the arrowhead matrices of slopes there.

What records share comes first, what belongs to each follows; products of slopes of different records vanish.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fibrefit.problem.estimate.gram import Gram

DIFFERENCE_STEP = 1e-6
"""Difference step of a coordinate."""
STEADY_SIZE = 0.01
"""Size below which a difference step no longer falls with its coordinate."""
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
        A coordinate is ``log((value + offset) / reference)`` or ``(value - reference) / scale``.
    mean : (n_shared,)
        Of the prior of each coordinate.
    precision : (n_shared, n_shared)
        Inverse of the covariance of that prior.
    lower, upper : (n_shared,)
        Bounds of the coordinates.
    size : (n_each,) in SI units
        Typical size of each record's own values.
    offset : (n_shared,) in SI units
        Of logarithms: one for a relative change, zero for all else.
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
    size: np.ndarray
    offset: np.ndarray | float = 0.0

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
            spanning = self.reference * np.exp(np.where(self.log, z, 0.0)) - self.offset
            return np.where(self.log, spanning, self.reference + self.scale * z)

    def coordinate(self, value: np.ndarray) -> np.ndarray:
        """Coordinates of values ``(..., n_shared)`` in SI units, inside their bounds."""
        ratio = (value + self.offset) / np.where(self.log, self.reference, 1.0)
        z = np.where(self.log, np.log(np.maximum(ratio, 1e-300)), (value - self.reference) / self.scale)
        return np.clip(z, self.lower, self.upper)

    def holding(self, places: np.ndarray | int, z: np.ndarray) -> Unknowns:
        """The same with some of the shared coordinates held where they are.

        Parameters
        ----------
        places : (n_held,) int
        z : (n_shared,)
        """
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[places] = upper[places] = z[places]
        return replace(self, lower=lower, upper=upper)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """Change of values with their coordinates ``(n_shared,)``, in SI units."""
        return np.where(self.log, self.value(z) + self.offset, self.scale)


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
    normal : Arrowhead
        There.
    sigma : (n_scattering,)
    predicted_reduction : float
        Reduction of Q predicted of one more step within reach.
    steps : int
        Evaluations.
    unmet : float
        Reduction of Q that slopes predict of a step as far as they say, and that no step brought. Where Q is kinked,
        the reach shrinks and this stays.
    """

    unknowns: Unknowns
    place: Place
    normal: Arrowhead
    sigma: np.ndarray
    predicted_reduction: float
    steps: int
    unmet: float = 0.0

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
    local : (n_record, n_local) in SI units
        The shared values are their means over the records, geometric where they are logarithmic.
    eta : (n_record, n_scattering), optional
        Deviations the values hold, whose mean need not be nothing; what the values themselves show by default.
    """
    z = unknowns.coordinate(local[:, unknowns.shared])
    if eta is not None:
        z[:, unknowns.scattering] -= eta
    middle = np.clip(z.mean(axis=0), unknowns.lower, unknowns.upper)
    found = (z - middle)[:, unknowns.scattering] if eta is None else eta
    return Place(middle, local[:, unknowns.each] / unknowns.size, found, local.copy())


def shared_coordinates(unknowns: Unknowns, place: Place) -> np.ndarray:
    """Coordinates ``(n_record, n_shared)`` of shared values in each record, its deviations among them."""
    z = np.repeat(place.z[None], len(place.eta), axis=0)
    z[:, unknowns.scattering] += place.eta
    return z


def local_of(unknowns: Unknowns, place: Place) -> np.ndarray:
    """Values of each record, ``(n_record, n_local)`` in SI units."""
    local = place.rest.copy()
    local[:, unknowns.each] = place.own * unknowns.size
    z = shared_coordinates(unknowns, place)
    local[:, unknowns.shared] = unknowns.value(z)
    return local


def penalty(unknowns: Unknowns, place: Place, sigma: np.ndarray) -> float:
    """What the priors add to the sum of squares, under standard deviations between records ``(n_scattering,)``."""
    deviation, away = place.eta / np.maximum(sigma, RIGID), place.z - unknowns.mean
    return float(np.sum(deviation**2) + away @ unknowns.precision @ away)


def arrowhead(unknowns: Unknowns, place: Place, gram: Gram) -> Arrowhead:
    """Normal equations about a place."""
    return arranged(unknowns, local_grams(unknowns, place, gram))


def begun_at(unknowns: Unknowns, place: Place, gram: Gram, sigma: np.ndarray) -> PosteriorMode:
    """Where a descent begins, or none is made, under standard deviations between records ``(n_scattering,)``."""
    return PosteriorMode(unknowns, place, arrowhead(unknowns, place, gram), sigma, np.inf, 1)


class Differences(NamedTuple):
    """What slopes at a place are differences over; the parameters of a `Gram` first.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
    columns : (n_column,) int
    targets : (n_record, n_column) in SI units
        Where the columns go.
    rate : (n_record, n_column + 1)
        Of changes per unit of the coordinates; one of the residuals, which come last.
    """

    local: np.ndarray
    columns: np.ndarray
    targets: np.ndarray
    rate: np.ndarray

    def per_unit(self, grams: np.ndarray) -> np.ndarray:
        """Products ``(n_record, n_column + 1, n_column + 1)`` of changes, per unit of the coordinates."""
        return grams * self.rate[:, :, None] * self.rate[:, None, :]


def differences(unknowns: Unknowns, place: Place, further: tuple[np.ndarray, np.ndarray] | None = None) -> Differences:
    """What slopes at a place are differences over.

    Parameters
    ----------
    further : ((n_direction,) int, (n_direction,) in SI units), optional
        Columns after those of the unknowns, and where they go: as they are, not per unit of anything.
    """
    local, shared = local_of(unknowns, place), len(unknowns.shared)
    columns, steps = unknowns.columns, coordinate_steps(unknowns, place)
    there = unknowns.value(shared_coordinates(unknowns, place) + steps[:, :shared])
    targets = np.concatenate([there, (place.own + steps[:, shared:]) * unknowns.size], axis=1)
    rate = 1.0 / steps
    if further is not None:
        columns = np.concatenate([columns, further[0]])
        targets = np.concatenate([targets, np.repeat(further[1][None], len(local), axis=0)], axis=1)
    rate = np.concatenate([rate, np.ones((len(local), len(columns) - rate.shape[1] + 1))], axis=1)
    return Differences(local, columns, targets, rate)


def local_grams(
    unknowns: Unknowns, place: Place, gram: Gram, further: tuple[np.ndarray, np.ndarray] | None = None
) -> np.ndarray:
    """Products of slopes and residuals of each record, per unit of its coordinates; residuals come last.

    Parameters
    ----------
    further : ((n_direction,) int, (n_direction,) in SI units), optional
        See `differences`.
    """
    at = differences(unknowns, place, further)
    return at.per_unit(gram(at.local, at.columns, at.targets))


def coordinate_steps(unknowns: Unknowns, place: Place) -> np.ndarray:
    """What slopes are differences over, ``(n_record, n_column)`` in units of the coordinates: shared ones first."""
    shared = np.where(unknowns.log, DIFFERENCE_STEP, DIFFERENCE_STEP * np.maximum(np.abs(place.z), STEADY_SIZE))
    own = DIFFERENCE_STEP * np.maximum(np.abs(place.own), STEADY_SIZE)
    return np.concatenate([np.repeat(shared[None], len(own), axis=0), own], axis=1)


def arranged(unknowns: Unknowns, grams: np.ndarray) -> Arrowhead:
    """Products of slopes ``(n_record, n_column + 1, n_column + 1)`` sorted into shared ones and each record's own."""
    n, mine, held = len(unknowns.shared), unknowns.own, held_places(unknowns)
    pulls = np.where(held, 0.0, grams[:, mine, -1])
    blocks = np.where(held[:, :, None] | held[:, None, :], np.eye(len(mine)), grams[:, mine[:, None], mine])
    cross = np.where(held[:, None, :], 0.0, grams[:, :n][:, :, mine])
    # Where slopes are no numbers a record is lost, as it is where its motion is.
    costs = np.where(np.isfinite(grams).all(axis=(1, 2)), grams[:, -1, -1], np.inf)
    whole = grams[:, :n].sum(axis=0)
    return Arrowhead(whole[:, :n], cross, blocks, whole[:, -1], pulls, float(costs.sum()), costs)


def own_precision(unknowns: Unknowns, sigma: np.ndarray) -> np.ndarray:
    """What the priors add to the blocks of each record's own unknowns, ``(..., n_own)``: nothing but of deviations.

    Parameters
    ----------
    sigma : (..., n_scattering)
    """
    nothing = np.zeros((*sigma.shape[:-1], len(unknowns.each)))
    return np.concatenate([nothing, np.maximum(sigma, RIGID) ** -2.0], axis=-1)


def with_priors(unknowns: Unknowns, place: Place, normal: Arrowhead, sigma: np.ndarray) -> Arrowhead:
    """Normal equations of Q about a place, from those of the residuals; the costs stay those of the residuals.

    Parameters
    ----------
    sigma : (n_scattering,)
    """
    precision = own_precision(unknowns, sigma)
    return normal._replace(
        shared=normal.shared + unknowns.precision,
        blocks=normal.blocks + np.diag(precision),
        pull=normal.pull + unknowns.precision @ (place.z - unknowns.mean),
        pulls=normal.pulls + np.concatenate([np.zeros_like(place.own), place.eta], axis=1) * precision,
    )


def held_places(unknowns: Unknowns) -> np.ndarray:
    """Which of the records' own unknowns are held, ``(n_record, n_own)``; deviations never are."""
    deviations = np.zeros((len(unknowns.free), len(unknowns.scattering)), dtype=bool)
    return np.concatenate([~unknowns.free, deviations], axis=1)
