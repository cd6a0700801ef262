"""What is unknown in records: coordinates, places, and a problem's free values as unknowns and back."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fibrefit.problem.statement.layout import Belief, Layout, Slot
from fibrefit.problem.thresholds import NOT_LOGARITHMIC

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


def coordinate_steps(unknowns: Unknowns, place: Place) -> np.ndarray:
    """What slopes are differences over, ``(n_record, n_column)`` in units of the coordinates: shared ones first."""
    shared = np.where(unknowns.log, DIFFERENCE_STEP, DIFFERENCE_STEP * np.maximum(np.abs(place.z), STEADY_SIZE))
    own = DIFFERENCE_STEP * np.maximum(np.abs(place.own), STEADY_SIZE)
    return np.concatenate([np.repeat(shared[None], len(own), axis=0), own], axis=1)


def own_precision(unknowns: Unknowns, sigma: np.ndarray) -> np.ndarray:
    """What the priors add to the blocks of each record's own unknowns, ``(..., n_own)``: nothing but of deviations.

    Parameters
    ----------
    sigma : (..., n_scattering)
    """
    nothing = np.zeros((*sigma.shape[:-1], len(unknowns.each)))
    return np.concatenate([nothing, np.maximum(sigma, RIGID) ** -2.0], axis=-1)


def held_places(unknowns: Unknowns) -> np.ndarray:
    """Which of the records' own unknowns are held, ``(n_record, n_own)``; deviations never are."""
    deviations = np.zeros((len(unknowns.free), len(unknowns.scattering)), dtype=bool)
    return np.concatenate([~unknowns.free, deviations], axis=1)


FLAT = 1e3
"""Standard deviation of the prior of a coordinate of which nothing is believed beforehand."""


MOST = 5
"""Parameters that may deviate at the most: those that are best known."""


def fit_unknowns(layout: Layout, values: np.ndarray, errors: np.ndarray) -> Unknowns:
    """What is unknown in a fit.

    Parameters
    ----------
    values, errors : (n_free,) in SI units
        From plain least squares.

    Law
    ---
    The rig's own parameters are given by their logarithms, and deviate from record to record; effects, and values with
    a prior, are the same in all records. Where there is but one record, nothing deviates.
    """
    entries = [(i, slot) for i, (slot, record) in enumerate(layout.entries) if record is None]
    rows = [_row(slot, float(values[i]), float(errors[i])) for i, slot in entries]
    log, reference, scale, lower, upper = (
        np.array([row[i] for row in rows], dtype=kind) for i, kind in enumerate((bool, float, float, float, float))
    )
    places = {name: i for i, name in enumerate(layout.names)}
    own = [slot for slot in layout.slots if slot.free and not slot.shared]
    records = len(layout.records)
    free = np.array([[slot.held(r) is None for slot in own] for r in range(records)], dtype=bool)
    beliefs = [prior_of(slot.belief, *row[:3]) for (_, slot), row in zip(entries, rows, strict=True)]
    return Unknowns(
        names=(*(slot.name for _, slot in entries), *(slot.name for slot in own)),
        shared=np.array([places[slot.name] for _, slot in entries], dtype=int),
        each=np.array([places[slot.name] for slot in own], dtype=int),
        free=free.reshape(records, len(own)),
        scattering=_scattering(entries, log, values, errors) if records > 1 else np.zeros(0, dtype=int),
        log=log,
        reference=reference,
        scale=scale,
        mean=np.array([mean for mean, _ in beliefs]),
        precision=np.diag([sd**-2.0 for _, sd in beliefs]),
        lower=lower,
        upper=upper,
        size=np.array([slot.range.scale for slot in own], dtype=float),
    )


def _row(slot: Slot, value: float, error: float) -> tuple[bool, float, float, float, float]:
    """Whether it is given by its logarithm, its reference and scale, and the bounds of its coordinate."""
    limits = slot.range
    spans = limits.log if "." in slot.name else limits.lower >= 0.0
    if slot.belief is not None:
        spans = slot.belief.log
    if spans and value > 0.0 and error < NOT_LOGARITHMIC * value:
        with np.errstate(divide="ignore"):
            return True, value, 1.0, float(np.log(max(limits.lower, 0.0) / value)), float(np.log(limits.upper / value))
    return False, value, limits.scale, (limits.lower - value) / limits.scale, (limits.upper - value) / limits.scale


def prior_of(
    belief: Belief | None, log: bool, reference: float, scale: float, otherwise: tuple[float, float] = (0.0, FLAT)
) -> tuple[float, float]:
    """Mean and standard deviation of the prior of a coordinate.

    Parameters
    ----------
    log, reference, scale
        Of the coordinate, see `Unknowns`; logarithmic only where a belief is.
    otherwise : (float, float)
        Where nothing is believed.
    """
    if belief is None:
        return otherwise
    if log:
        return math.log(belief.centre / reference), belief.relative
    return (belief.centre - reference) / scale, belief.spread * (belief.centre if belief.log else 1.0) / scale


def _scattering(entries: list[tuple[int, Slot]], log: np.ndarray, values: np.ndarray, errors: np.ndarray) -> np.ndarray:
    may = [k for k, (_, slot) in enumerate(entries) if log[k] and "." not in slot.name and slot.belief is None]
    places = [i for i, _ in entries]
    best = sorted(may, key=lambda k: float(errors[places[k]] / values[places[k]]))[:MOST]
    return np.array(sorted(best), dtype=int)


def free_values(layout: Layout, unknowns: Unknowns, shared: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Free values ``(n_free,)`` in SI units.

    Parameters
    ----------
    shared : (n_shared,) in SI units
    own : (n_record, n_each) in units of their sizes
    """
    places = {name: i for i, name in enumerate(unknowns.names)}
    found, number = np.empty(layout.size), len(unknowns.shared)
    for i, (slot, record) in enumerate(layout.entries):
        place = places[slot.name]
        found[i] = shared[place] if record is None else own[record, place - number] * unknowns.size[place - number]
    return found


def places_of(layout: Layout, unknowns: Unknowns) -> tuple[np.ndarray, np.ndarray]:
    """Places ``(n_free,)`` of the free values among shared coordinates and, record after record, own ones; and sizes.

    The second is what one unit of an own coordinate is in SI units, one for shared ones.
    """
    index = {name: i for i, name in enumerate(unknowns.names)}
    number, each = len(unknowns.shared), len(unknowns.each)
    places, sizes = np.zeros(layout.size, dtype=int), np.ones(layout.size)
    for i, (slot, record) in enumerate(layout.entries):
        place = index[slot.name]
        places[i] = place if record is None else place + record * each
        if record is not None:
            sizes[i] = unknowns.size[place - number]
    return places, sizes
