"""The one place that knows the order of a problem's numbers: names to vector and back."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.problem.statement.arrays import RAN_AWAY, functions_for
from fibrefit.problem.statement.belief import Belief
from fibrefit.problem.statement.equilibration import equilibrated, scale_of
from fibrefit.problem.statement.transform import Range


@RAN_AWAY
def assembled(local: Any, columns: Any, size: int) -> Any:
    """Sum of the records' own matrices in the places of the free values; NumPy or JAX.

    Parameters
    ----------
    local : (n_record, n_local, n_local)
    columns : (n_record, n_local) int
        Places; one beyond `size` stands for nothing.

    Returns
    -------
    (size, size)
    """
    places = columns[:, :, None], columns[:, None, :]
    if (xp := functions_for(local)) is not np:
        return xp.zeros((size, size)).at[places].add(local, mode="drop")
    whole = np.zeros((max(size, int(columns.max(initial=0)) + 1),) * 2)
    np.add.at(whole, places, local)
    return whole[:size, :size]


@RAN_AWAY
def gathered(local: np.ndarray, columns: np.ndarray, size: int) -> np.ndarray:
    """Sum of the records' own rows ``(n_record, n_local, ...)`` in the places of the free values, ``(size, ...)``."""
    whole = np.zeros((max(size, int(columns.max(initial=0)) + 1), *local.shape[2:]))
    np.add.at(whole, columns, local)
    return whole[:size]


def normal_equations(
    layout: Layout, slopes: np.ndarray, residuals: np.ndarray, belief: np.ndarray | None = None
) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix ``(n_free, n_free)`` and gradient ``(n_free,)`` of a linear least-squares problem.

    Parameters
    ----------
    slopes : (n_record, n_channel, n_time, n_local_free)
    residuals : (n_record, n_channel, n_time)
    belief : (n_free + 1, n_free + 1), optional
        See `Layout.prior_gram`.
    """
    columns, size = layout.local_columns, layout.size
    normal = assembled(np.einsum("rcti,rctj->rij", slopes, slopes), columns, size)
    gradient = gathered(np.einsum("rcti,rct->ri", slopes, residuals), columns, size)
    return (normal, gradient) if belief is None else (normal + belief[:-1, :-1], gradient + belief[:-1, -1])


def least_squares(normal: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution ``(n,)`` of normal equations whose rows may have any units; the smallest where several solve them.

    Not a number where the equations hold what is none, as slopes are of a motion that the least change leads elsewhere.
    """
    if not (np.isfinite(normal).all() and np.isfinite(right).all()):
        return np.full(len(right), np.nan)
    scale = scale_of(normal)
    return np.linalg.lstsq(equilibrated(normal, scale), right / scale, rcond=1e-10)[0] / scale


@dataclass(frozen=True)
class Slot:
    """What is known of one parameter before the data speak.

    Parameters
    ----------
    shared : bool
        One value for all records, or one for each.
    fixed : tuple of float or None
        Its value(s) in SI units where it is not free: one, or one for each record, None where that record's is free.
    belief : Belief or None
        What a fit believes of it beforehand; None: nothing.
    """

    name: str
    unit: str
    range: Range
    shared: bool = True
    fixed: tuple[float | None, ...] = ()
    belief: Belief | None = None

    def held(self, record: int) -> float | None:
        """Value held in a record, in SI units; None where it is free."""
        return None if not self.fixed else self.fixed[0] if len(self.fixed) == 1 else self.fixed[record]

    @property
    def free(self) -> bool:
        """Whether it is free in any record."""
        return not self.fixed or None in self.fixed


@dataclass(frozen=True)
class Layout:
    """Order of the free values: shared ones first, then those of each record, record after record.

    Parameters
    ----------
    slots : tuple of Slot
        In the order in which a record's values are listed.
    records : tuple of str
        Names of the records. Layouts that differ in names alone are equal: one compiled program serves them.
    """

    slots: tuple[Slot, ...]
    records: tuple[str, ...] = field(compare=False)
    number: int = field(init=False, repr=False)
    """Of records."""

    def __post_init__(self) -> None:
        object.__setattr__(self, "number", len(self.records))

    @cached_property
    def names(self) -> tuple[str, ...]:
        """Names of a record's values, in their order."""
        return tuple(slot.name for slot in self.slots)

    @cached_property
    def local_free(self) -> tuple[int, ...]:
        """Which of a record's values are free."""
        return tuple(i for i, slot in enumerate(self.slots) if slot.free)

    @cached_property
    def entries(self) -> tuple[tuple[Slot, int | None], ...]:
        """Slot and record (None if shared) of each free value."""
        free = [self.slots[i] for i in self.local_free]
        shared: list[tuple[Slot, int | None]] = [(slot, None) for slot in free if slot.shared]
        own = [slot for slot in free if not slot.shared]
        each: list[tuple[Slot, int | None]] = [
            (slot, r) for r in range(len(self.records)) for slot in own if slot.held(r) is None
        ]
        return tuple(shared + each)

    @cached_property
    def shared_places(self) -> list[int]:
        """Places of the free values that all records share."""
        return [i for i, (_, record) in enumerate(self.entries) if record is None]

    @cached_property
    def free_names(self) -> tuple[str, ...]:
        """Name of each free value; ``name[record]`` where each record has its own."""
        return tuple(
            slot.name if record is None else f"{slot.name}[{self.records[record]}]" for slot, record in self.entries
        )

    @cached_property
    def believed(self) -> tuple[tuple[int, Belief], ...]:
        """Places of the free values of which something is believed beforehand, and what."""
        return tuple((i, slot.belief) for i, (slot, _) in enumerate(self.entries) if slot.belief is not None)

    def of_parameters(
        self, parameters: Sequence[Parameter], range_of: Callable[[Parameter], Range] = Range.of
    ) -> Layout:
        """Layout of a model with further parameters, one value each for all records.

        Parameters
        ----------
        parameters : sequence of Parameter
            All of the model, in its order; what else there is a slot of follows them.
        range_of : callable
            Range of one that has no slot yet.
        """
        known, names = {slot.name: slot for slot in self.slots}, {p.name for p in parameters}
        slots = [known.get(p.name) or Slot(p.name, p.unit, range_of(p)) for p in parameters]
        return Layout((*slots, *(slot for slot in self.slots if slot.name not in names)), self.records)

    def prior_gram(self, values: Any) -> Any:
        """Products of the slopes and the values of the residuals that beliefs are, as `Problem.gram` has them.

        Parameters
        ----------
        values : (n_free,) in SI units, NumPy or JAX

        Returns
        -------
        (n_free + 1, n_free + 1), per SI units of the values; the last row and column are those of the residuals
        """
        unit = np.eye(self.size + 1)
        whole = functions_for(values).zeros((self.size + 1,) * 2)
        for i, belief in self.believed:
            row = unit[i] * belief.slope(values[i]) + unit[-1] * belief.residual(values[i])
            whole = whole + row[:, None] * row
        return whole

    @property
    def size(self) -> int:
        """Number of free values."""
        return len(self.entries)

    @cached_property
    def _gather(self) -> tuple[np.ndarray, np.ndarray]:
        """Index (n_record, n_local) into free values followed by fixed ones, and the fixed ones."""
        place = {(slot.name, record): i for i, (slot, record) in enumerate(self.entries)}
        fixed: list[float] = []
        index = np.zeros((len(self.records), len(self.slots)), dtype=int)
        for j, slot in enumerate(self.slots):
            for r in range(len(self.records)):
                value = slot.held(r)
                if value is None:
                    index[r, j] = place[slot.name, None if slot.shared else r]
                else:
                    index[r, j] = self.size + len(fixed)
                    fixed.append(value)
        return index, np.array(fixed)

    @cached_property
    def local_columns(self) -> np.ndarray:
        """Place of each record's own values among all free ones, ``(n_record, n_local_free)``.

        A value held in this record but free in another has the place ``size + 1``: behind the free values and the
        column of residuals that is appended to them.
        """
        columns = self._gather[0][:, list(self.local_free)]
        return np.where(columns < self.size, columns, self.size + 1)

    def local(self, values: Any) -> Any:
        """Values of every record, ``(n_record, n_local)`` in SI units, from the free values ``(n_free,)`` in SI."""
        index, fixed = self._gather
        return functions_for(values).concatenate([values, fixed])[index]

    @cached_property
    def _by_range(self) -> dict[Range, np.ndarray]:
        """Places of the free values that share a range, so that each map is applied once."""
        places: dict[Range, list[int]] = {}
        for i, (slot, _) in enumerate(self.entries):
            places.setdefault(slot.range, []).append(i)
        return {limits: np.array(index) for limits, index in places.items()}

    @cached_property
    def _order(self) -> np.ndarray:
        """Puts values that were taken range by range back into their order."""
        return np.argsort(np.concatenate([*self._by_range.values(), np.empty(0, dtype=int)]))

    def values(self, free: Any) -> Any:
        """Free values in SI units, from free coordinates; ``(..., n_free)`` both, NumPy or JAX."""
        parts = [limits.value(free[..., index]) for limits, index in self._by_range.items()]
        return functions_for(free).concatenate([*parts, free[..., :0]], axis=-1)[..., self._order]

    def free(self, values: Any) -> Any:
        """Free coordinates from free values in SI units; ``(..., n_free)`` both, NumPy or JAX."""
        parts = [limits.free(values[..., index]) for limits, index in self._by_range.items()]
        return functions_for(values).concatenate([*parts, values[..., :0]], axis=-1)[..., self._order]

    def pack(self, named: Mapping[str, float | np.ndarray]) -> np.ndarray:
        """Free values, ``(n_free,)`` in SI units, from one number a name or one for each record."""
        packed = []
        for slot, record in self.entries:
            value = np.asarray(named[slot.name], dtype=float)
            packed.append(float(value.mean() if record is None else value if value.ndim == 0 else value[record]))
        return np.array(packed)

    def means_of(self, local: np.ndarray) -> np.ndarray:
        """Free values ``(n_free,)`` from those of each record ``(n_record, n_local)``: of shared ones the mean."""
        return self.pack({name: local[:, j] for j, name in enumerate(self.names)})
