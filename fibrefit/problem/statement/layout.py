"""The one place that knows the order of a problem's numbers, their limits and what is believed of them.

Every limit is kept by a change of variable (`Range`): a solver moves in coordinates without limits, each scaled so that
a step of one is a large but sensible change. What is believed of a value before the records speak (`Belief`) is one
more residual of a least-squares fit.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from fibrefit.core.arrays import assembled, functions_for, gathered
from fibrefit.core.declarations import Parameter

if TYPE_CHECKING:  # its module needs pydantic, which this one does not
    from fibrefit.study.parameters import ParameterSetting


NUDGE = 1e-4
"""Least distance from a limit at which a start is put: in units of the scale, or of the logarithm."""


@dataclass(frozen=True)
class Range:
    """Where a free parameter may lie, in SI units, and how it is scaled.

    Parameters
    ----------
    lower, upper : float
        Infinite where there is no limit.
    scale : float
        Typical size.
    log : bool
        Whether it is moved on a logarithmic scale; `lower` must then not be negative.
    """

    lower: float
    upper: float
    scale: float
    log: bool = False

    @classmethod
    def of(cls, parameter: Parameter) -> Range:
        """Range a parameter declares for itself."""
        # One that vanishes at infinity spans decades too.
        log = parameter.log or parameter.reciprocal
        size = abs(parameter.typical)
        return cls(parameter.lower, parameter.upper, size if math.isfinite(size) and size > 0.0 else 1.0, log)

    def within(self, lower: float | None, upper: float | None) -> Range:
        """The part of the range between limits a person has set."""
        low = self.lower if lower is None else max(self.lower, lower)
        high = self.upper if upper is None else min(self.upper, upper)
        return Range(low, high, self.scale, self.log)

    @property
    def bounded(self) -> tuple[bool, bool]:
        """Whether there is a limit below and above, on the scale it is moved on."""
        low = self.lower > 0.0 if self.log else math.isfinite(self.lower)
        return low, math.isfinite(self.upper)

    def line(self, value: Any) -> Any:
        """Value on the scale it is moved on: its logarithm, or the value in units of `scale`."""
        return functions_for(value).log(value / self.scale) if self.log else value / self.scale

    def value(self, free: Any) -> Any:
        """Value in SI units of a free coordinate.

        Law
        ---
        No limit: y = x. One: y = low + sqrt(x^2 + 1) - 1, which reaches the limit at x = 0. Two:
        y = low + (high - low) / (1 + exp(-4 x / (high - low))), of slope 1 in the middle.
        """
        low, high = self._limits()
        xp = functions_for(free)
        if all(self.bounded):
            width = high - low
            # The logistic curve in a form that neither overflows nor loses digits at its foot.
            position = low + width * xp.exp(-xp.logaddexp(0.0, -4.0 * free / width))
        elif self.bounded[0]:
            position = low + xp.sqrt(free**2 + 1.0) - 1.0
        elif self.bounded[1]:
            position = high - xp.sqrt(free**2 + 1.0) + 1.0
        else:
            position = free
        # Back from `line`.
        return xp.exp(position) * self.scale if self.log else position * self.scale

    def free(self, value: Any) -> Any:
        """Free coordinate of a value; one nearer to a limit than `NUDGE` is put that far off, for want of a slope."""
        low, high = self._limits()
        position = self.line(value)
        xp = functions_for(position)
        if all(self.bounded):
            width = high - low
            share = xp.clip((position - low) / width, NUDGE / width, 1.0 - NUDGE / width)
            return 0.25 * width * xp.log(share / (1.0 - share))
        if self.bounded[0]:
            return xp.sqrt((xp.maximum(position - low, NUDGE) + 1.0) ** 2 - 1.0)
        if self.bounded[1]:
            return xp.sqrt((xp.maximum(high - position, NUDGE) + 1.0) ** 2 - 1.0)
        return position

    def at_bound(self, value: float, tolerance: float) -> bool:
        """Whether `value` lies within `tolerance` (SI) of a limit."""
        return bool(value - self.lower < tolerance or self.upper - value < tolerance)

    def _limits(self) -> tuple[float, float]:
        with np.errstate(divide="ignore"):
            line = lambda v: float(np.log(v / self.scale)) if self.log else v / self.scale  # noqa: E731
            return line(self.lower) if self.bounded[0] else -math.inf, line(self.upper) if self.bounded[1] else math.inf


@dataclass(frozen=True)
class Belief:
    """A normal density of a value, or of its logarithm.

    Parameters
    ----------
    centre : float
        Mean, or median where `log`; in SI units.
    spread : float
        Standard deviation, of the logarithm where `log`.
    """

    centre: float
    spread: float
    log: bool = False

    @classmethod
    def of(cls, setting: ParameterSetting) -> Belief | None:
        """What a fit believes of a parameter beforehand: a normal density that the study states, or a log-normal one.

        An even density says nothing within its limits, and a value that each record has for itself is left to its
        record.
        """
        stated = setting.prior
        if stated is None or setting.fixed or not setting.shared or stated.kind in ("uniform", "log_uniform"):
            return None
        return cls(stated.centre, stated.spread, stated.kind == "log_normal")

    def residual(self, value: Any) -> Any:
        """Distance of a value ``()`` from the centre in standard deviations; NumPy or JAX."""
        if self.log:
            return functions_for(value).log(value / self.centre) / self.spread
        return (value - self.centre) / self.spread

    def slope(self, value: Any) -> Any:
        """Change of the residual with the value ``()``, per SI unit; NumPy or JAX."""
        return (1.0 / value if self.log else 1.0) / self.spread

    def of_coordinate(self, log: bool, reference: float, scale: float) -> tuple[float, float]:
        """Mean and standard deviation on a coordinate, see `Unknowns`; logarithmic only where the belief is.

        Parameters
        ----------
        log : bool
        reference, scale : float, in SI units
        """
        if log:
            return math.log(self.centre / reference), self.relative
        return (self.centre - reference) / scale, self.spread * (self.centre if self.log else 1.0) / scale

    @property
    def relative(self) -> float:
        """Standard deviation as a share of the centre; infinite about zero."""
        if self.log:
            return self.spread
        return abs(self.spread / self.centre) if self.centre else float("inf")


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

    def fixed_in(self, record: int) -> float | None:
        """Value fixed in a record, in SI units; None where it is free."""
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
            (slot, r) for r in range(len(self.records)) for slot in own if slot.fixed_in(r) is None
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
    def beliefs(self) -> tuple[tuple[int, Belief], ...]:
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
        for i, belief in self.beliefs:
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
                value = slot.fixed_in(r)
                if value is None:
                    index[r, j] = place[slot.name, None if slot.shared else r]
                else:
                    index[r, j] = self.size + len(fixed)
                    fixed.append(value)
        return index, np.array(fixed)

    @cached_property
    def local_columns(self) -> np.ndarray:
        """Place of each record's own values among all free ones, ``(n_record, n_local_free)``.

        A value fixed in this record but free in another has the place ``size + 1``: behind the free values and the
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
