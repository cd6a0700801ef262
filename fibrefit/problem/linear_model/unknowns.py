"""What is unknown in records: coordinates, places, and a problem's free values as unknowns and back."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import NamedTuple, Protocol, runtime_checkable

import numpy as np

from fibrefit.problem.statement.layout import Layout, Slot
from fibrefit.problem.thresholds import PROVEN_FACTOR

DIFFERENCE_STEP = 1e-6
"""Difference step of a coordinate."""
STEADY_SIZE = 0.01
"""Size below which a difference step no longer falls with its coordinate."""
RIGID = 1e-7
"""Standard deviation that stands for no deviations at all."""
FLAT = 1e3
"""Standard deviation of the prior of a coordinate of which nothing is believed beforehand."""
MOST = 5
"""Parameters that may deviate at the most: those that are best known."""

Gram = Callable[[np.ndarray, np.ndarray, np.ndarray], np.ndarray]
"""Products ``(n_record, n_column + 1, n_column + 1)`` of the changes of all residuals, and of the residuals, when the
columns ``(n_column,)`` of local values ``(n_record, n_local)`` go to targets ``(n_record, n_column)``."""


@runtime_checkable
class Corrected(Protocol):
    """A `Gram` whose slopes are not always simulated; `exact` tells whether those of the last products were."""

    exact: bool

    def renew(self) -> None:
        """Have all slopes simulated where products are needed next."""


class Place(NamedTuple):
    """A set of unknowns.

    Parameters
    ----------
    z : (n_shared,)
    own : (n_record, n_each) in units of their sizes
    eta : (n_record, n_scattering)
    rest : (n_record, n_local) in SI units
        Values that are fixed.
    """

    z: np.ndarray
    own: np.ndarray
    eta: np.ndarray
    rest: np.ndarray


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
        Which of those are unknown; the others are fixed.
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

    @classmethod
    def of_fit(cls, layout: Layout, values: np.ndarray, errors: np.ndarray) -> Unknowns:
        """What is unknown in a fit.

        Parameters
        ----------
        values, errors : (n_free,) in SI units
            From plain least squares.

        Law
        ---
        The rig's own parameters are given by their logarithms, and deviate from record to record; effects, and values
        with a prior, are the same in all records. Where there is but one record, nothing deviates.
        """
        entries = [(i, slot) for i, (slot, record) in enumerate(layout.entries) if record is None]
        rows = [_row(slot, float(values[i]), float(errors[i])) for i, slot in entries]
        log, reference, scale, lower, upper = (
            np.array([row[i] for row in rows], dtype=kind) for i, kind in enumerate((bool, float, float, float, float))
        )
        places = {name: i for i, name in enumerate(layout.names)}
        own = [slot for slot in layout.slots if slot.free and not slot.shared]
        records = len(layout.records)
        free = np.array([[slot.fixed_in(r) is None for slot in own] for r in range(records)], dtype=bool)
        beliefs = [
            slot.belief.of_coordinate(*row[:3]) if slot.belief else (0.0, FLAT)
            for (_, slot), row in zip(entries, rows, strict=True)
        ]
        may = [k for k, (_, slot) in enumerate(entries) if log[k] and "." not in slot.name and slot.belief is None]
        best = sorted(may, key=lambda k: float(errors[entries[k][0]] / values[entries[k][0]]))[:MOST]
        return cls(
            names=(*(slot.name for _, slot in entries), *(slot.name for slot in own)),
            shared=np.array([places[slot.name] for _, slot in entries], dtype=int),
            each=np.array([places[slot.name] for slot in own], dtype=int),
            free=free.reshape(records, len(own)),
            scattering=np.array(sorted(best) if records > 1 else [], dtype=int),
            log=log,
            reference=reference,
            scale=scale,
            mean=np.array([mean for mean, _ in beliefs]),
            precision=np.diag([sd**-2.0 for _, sd in beliefs]),
            lower=lower,
            upper=upper,
            size=np.array([slot.range.scale for slot in own], dtype=float),
        )

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

    def fixed_at(self, places: np.ndarray | int, z: np.ndarray) -> Unknowns:
        """The same with some of the shared coordinates fixed where they are.

        Parameters
        ----------
        places : (n_fixed,) int
        z : (n_shared,)
        """
        lower, upper = self.lower.copy(), self.upper.copy()
        lower[places] = upper[places] = z[places]
        return replace(self, lower=lower, upper=upper)

    def slope(self, z: np.ndarray) -> np.ndarray:
        """Change of values with their coordinates ``(n_shared,)``, in SI units."""
        return np.where(self.log, self.value(z) + self.offset, self.scale)

    def place_of(self, local: np.ndarray, eta: np.ndarray | None = None) -> Place:
        """Unknowns at given values.

        Parameters
        ----------
        local : (n_record, n_local) in SI units
            The shared values are their means over the records, geometric where they are logarithmic.
        eta : (n_record, n_scattering), optional
            Deviations the values hold, whose mean need not be nothing; what the values themselves show by default.
        """
        z = self.coordinate(local[:, self.shared])
        if eta is not None:
            z[:, self.scattering] -= eta
        middle = np.clip(z.mean(axis=0), self.lower, self.upper)
        found = (z - middle)[:, self.scattering] if eta is None else eta
        return Place(middle, local[:, self.each] / self.size, found, local.copy())

    def shared_coordinates(self, place: Place) -> np.ndarray:
        """Coordinates ``(n_record, n_shared)`` of shared values in each record, its deviations among them."""
        z = np.repeat(place.z[None], len(place.eta), axis=0)
        z[:, self.scattering] += place.eta
        return z

    def local_of(self, place: Place) -> np.ndarray:
        """Values of each record, ``(n_record, n_local)`` in SI units."""
        local = place.rest.copy()
        local[:, self.each] = place.own * self.size
        local[:, self.shared] = self.value(self.shared_coordinates(place))
        return local

    def penalty(self, place: Place, sigma: np.ndarray) -> float:
        """What the priors add to the sum of squares, under standard deviations between records ``(n_scattering,)``."""
        deviation, away = place.eta / np.maximum(sigma, RIGID), place.z - self.mean
        return float(np.sum(deviation**2) + away @ self.precision @ away)

    def coordinate_steps(self, place: Place) -> np.ndarray:
        """What slopes are differences over, ``(n_record, n_column)`` in units of the coordinates: shared ones first."""
        shared = np.where(self.log, DIFFERENCE_STEP, DIFFERENCE_STEP * np.maximum(np.abs(place.z), STEADY_SIZE))
        own = DIFFERENCE_STEP * np.maximum(np.abs(place.own), STEADY_SIZE)
        return np.concatenate([np.repeat(shared[None], len(own), axis=0), own], axis=1)

    def own_precision(self, sigma: np.ndarray) -> np.ndarray:
        """What the priors add to the blocks of each record's own unknowns, ``(..., n_own)``: nothing but of deviations.

        Parameters
        ----------
        sigma : (..., n_scattering)
        """
        nothing = np.zeros((*sigma.shape[:-1], len(self.each)))
        return np.concatenate([nothing, np.maximum(sigma, RIGID) ** -2.0], axis=-1)

    @property
    def fixed_own(self) -> np.ndarray:
        """Which of the records' own unknowns are fixed, ``(n_record, n_own)``; deviations never are."""
        deviations = np.zeros((len(self.free), len(self.scattering)), dtype=bool)
        return np.concatenate([~self.free, deviations], axis=1)

    def differences(self, place: Place, further: tuple[np.ndarray, np.ndarray] | None = None) -> Differences:
        """What slopes at a place are differences over.

        Parameters
        ----------
        further : ((n_direction,) int, (n_direction,) in SI units), optional
            Columns after those of the unknowns, and where they go: as they are, not per unit of anything.
        """
        local, shared = self.local_of(place), len(self.shared)
        columns, steps = self.columns, self.coordinate_steps(place)
        there = self.value(self.shared_coordinates(place) + steps[:, :shared])
        targets = np.concatenate([there, (place.own + steps[:, shared:]) * self.size], axis=1)
        rate = 1.0 / steps
        if further is not None:
            columns = np.concatenate([columns, further[0]])
            targets = np.concatenate([targets, np.repeat(further[1][None], len(local), axis=0)], axis=1)
        rate = np.concatenate([rate, np.ones((len(local), len(columns) - rate.shape[1] + 1))], axis=1)
        return Differences(local, columns, targets, rate)

    def local_grams(self, place: Place, gram: Gram, further: tuple[np.ndarray, np.ndarray] | None = None) -> np.ndarray:
        """Products of slopes and residuals of each record, per unit of its coordinates; residuals come last.

        Parameters
        ----------
        further : ((n_direction,) int, (n_direction,) in SI units), optional
            See `differences`.
        """
        at = self.differences(place, further)
        return at.per_unit(gram(at.local, at.columns, at.targets))

    def free_values(self, layout: Layout, shared: np.ndarray, own: np.ndarray) -> np.ndarray:
        """Free values ``(n_free,)`` in SI units.

        Parameters
        ----------
        shared : (n_shared,) in SI units
        own : (n_record, n_each) in units of their sizes
        """
        places = {name: i for i, name in enumerate(self.names)}
        found, number = np.empty(layout.size), len(self.shared)
        for i, (slot, record) in enumerate(layout.entries):
            place = places[slot.name]
            found[i] = shared[place] if record is None else own[record, place - number] * self.size[place - number]
        return found

    def places_in(self, layout: Layout) -> tuple[np.ndarray, np.ndarray]:
        """Places ``(n_free,)`` of the free values among shared coordinates and, record after record, own ones.

        Beside them what one unit of an own coordinate is in SI units, one for shared ones.
        """
        index = {name: i for i, name in enumerate(self.names)}
        number, each = len(self.shared), len(self.each)
        places, sizes = np.zeros(layout.size, dtype=int), np.ones(layout.size)
        for i, (slot, record) in enumerate(layout.entries):
            place = index[slot.name]
            places[i] = place if record is None else place + record * each
            if record is not None:
                sizes[i] = self.size[place - number]
        return places, sizes


def _row(slot: Slot, value: float, error: float) -> tuple[bool, float, float, float, float]:
    """Whether it is given by its logarithm, its reference and scale, and the bounds of its coordinate."""
    limits = slot.range
    spans = limits.log if "." in slot.name else limits.lower >= 0.0
    if slot.belief is not None:
        spans = slot.belief.log
    # A logarithm is normal where zero is far away; of other values no deviations are looked for either.
    if spans and value > PROVEN_FACTOR * error:
        with np.errstate(divide="ignore"):
            return True, value, 1.0, float(np.log(max(limits.lower, 0.0) / value)), float(np.log(limits.upper / value))
    return False, value, limits.scale, (limits.lower - value) / limits.scale, (limits.upper - value) / limits.scale
