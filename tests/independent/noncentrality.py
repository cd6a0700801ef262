"""What a perfect whitened test gains where an effect is hidden: its noncentrality.

The change of the readings that an effect makes is projected off all that a model without it can do as well: base
parameters, what each record has for itself (zero of position, release or load at the start, lines of the mains) and, on
the driven rig, errors of the measured drive at the price of their prior; base parameters that differ from record to
record pay theirs. What is left, whitened by the true spectrum of the noise and squared, is the gain in twice the log
likelihood that is to be expected, but for the one or two that chance adds.

Approximations. All is to first order about the rig without the effect, by differences so small that no reading changes
by more than about its noise: on the driven rig bounces multiply any change, and what fits the readings stays near them.
Effects of the sensors, which do not touch the motion, and the mass of a fibre count at full strength. Samples next to
one at which the fibre becomes taut are left out, since the force jumps there. Errors of the drive are those below 60 Hz
(see `drive_error`). Noise of heavy tails is weighed by its variance alone, and rounding as white noise.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import block_diag, solve_triangular

from tests.independent.drive_error import responses
from tests.independent.laws import CHAIN, DRIVE, DROP, EFFECTS, values_at
from tests.independent.sensors import Noise
from tests.independent.series import Plan
from tests.independent.simulate import OF_READINGS, Base, Channels, Conditions, Effects, simulate
from tests.independent.whitening import Whitening, whitening

STEP, FINE = 2.5e-5, 1e-5
STIFF = {"pulley.inertia", "fibre.mass", "guide.presliding", "drive.compliance", "sensor.gauge_resonance"}
FREE = 1e3
"""What has no prior may be this many times as large as usual."""
FIRST = (1e-4, 1e-3, 1e-3)
"""Relative change of stiffness, damping and friction that differences begin with."""
FIRST_OWN = {DROP: 1e-6, DRIVE: 1e-3}
"""Of what a record has for itself: s by which it is released later; N by which the fibre carries more at the start."""
FIRST_STRENGTH = 1e-3
TURN = 0.1
"""Share by which a shape parameter is changed to see how a direction turns."""
SMALL, LARGE = 0.05, 1.0
"""Range of the largest change of a reading, in units of the noise, from which a difference is taken."""
SINGULAR = 1e-3
"""Least strength from which differences of a stiff law are taken."""


class Hidden(NamedTuple):
    """An effect with its strength, of which 0 is none, and its shape parameters."""

    name: str
    strength: float
    shape: Mapping[str, float]

    def values(self, stiffness: float) -> dict[str, float]:
        """Its parameters, by the names of the catalogue."""
        return values_at(self.name, self.strength, self.shape, stiffness)


class Projected(NamedTuple):
    """Whitened columns of one record, and the part of them that its free inputs and lines account for."""

    rows: np.ndarray
    taken: np.ndarray

    def dot(self, other: Projected) -> np.ndarray:
        """Inner products of the columns of both."""
        return self.rows.T @ other.rows - self.taken.T @ other.taken


@dataclass(frozen=True)
class Yardstick:
    """The metric of one record: noise whitened, zero of position, lines and errors of the drive free at their price.

    Parameters
    ----------
    plan : of the record
    base : base parameters
    noise : of the logger
    """

    plan: Plan
    base: Base
    noise: Noise

    @cached_property
    def _clean(self) -> np.ndarray:
        """Force without the effect."""
        return simulate(self.plan.conditions, self.base, {}, self.plan.times, STEP).force

    @cached_property
    def _whiten(self) -> tuple[Whitening, Whitening]:
        rate = 1.0 / (self.plan.times[1] - self.plan.times[0])
        force, position = (whitening(self.noise, channel, self._clean, rate) for channel in ("force", "position"))
        return force, position

    @cached_property
    def smooth(self) -> np.ndarray:
        """Samples of the force at which it does not jump."""
        found = np.ones(self.plan.times.size, bool)
        found[self._snaps] = False
        return found

    @property
    def _snaps(self) -> np.ndarray:
        """Samples near which the fibre becomes taut: the force jumps there, before or after a sample."""
        begins = np.flatnonzero((self._clean[1:] > 0.0) & (self._clean[:-1] <= 0.0))
        near = np.unique(begins[:, None] + np.arange(-1, 3))
        return near[(near >= 0) & (near < self._clean.size)]

    def whitened(self, force: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Innovations of columns of both channels, one below the other."""
        return np.concatenate([self._whiten[0](force), self._whiten[1](position)])

    @cached_property
    def _free(self) -> tuple[np.ndarray, np.ndarray]:
        """Whitened columns of all that is free, and the factor of their normal matrix with the prior's."""
        times, snaps = self.plan.times, self._snaps
        zero = np.full((times.size, 1), FREE * self.noise.rms["position"])
        jumps = np.zeros((times.size, snaps.size))
        jumps[snaps, np.arange(snaps.size)] = FREE * self.noise.rms["force"]
        columns = [(np.zeros_like(zero), zero), (jumps, np.zeros_like(jumps))]
        for channel in ("force", "position"):
            for frequency, size in self.noise.all_lines(channel):
                if size > 0.0:
                    angle = 2.0 * math.pi * frequency * times
                    waves = FREE * size * np.column_stack([np.cos(angle), np.sin(angle)])
                    pair = (waves, np.zeros_like(waves))
                    columns.append(pair if channel == "force" else pair[::-1])
        prior = np.eye(sum(force.shape[1] for force, _ in columns))
        if self.plan.conditions.kind == DRIVE:
            *both, precision = responses(self.plan.conditions, self.base, times, self.noise)
            columns.append((both[0], both[1]))
            prior = block_diag(prior, precision)
        rows = self.whitened(*(np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)))
        sizes = 1.0 / np.linalg.norm(rows, axis=0)
        rows *= sizes
        return rows, np.linalg.cholesky(rows.T @ rows + sizes[:, None] * prior * sizes)

    def project(self, force: np.ndarray, position: np.ndarray) -> Projected:
        """Columns ``(n, m)`` of both channels as the metric sees them."""
        rows = self.whitened(force, position)
        free, factor = self._free
        return Projected(rows, solve_triangular(factor, free.T @ rows, lower=True))


Change = Callable[[float], Sequence[Channels]]


@dataclass(frozen=True)
class Ideal:
    """The perfect test for series of one design.

    Parameters
    ----------
    plans : of the records
    base : true base parameters
    noise : of the logger
    scatter : relative standard deviation of the base parameters between records
    """

    plans: Sequence[Plan]
    base: Base
    noise: Noise
    scatter: float = 0.0
    _directions: dict = field(default_factory=dict, repr=False, compare=False)

    @cached_property
    def yardsticks(self) -> tuple[Yardstick, ...]:
        """Of all records."""
        return tuple(Yardstick(plan, self.base, self.noise) for plan in self.plans)

    @cached_property
    def _slopes(self) -> tuple[list[Projected], ...]:
        """Changes by the base parameters and by what each record has for itself, record by record."""
        kind, columns = self.plans[0].conditions.kind, []
        for i, first in enumerate(FIRST):
            columns.append(
                self._derivative(lambda size, i=i: self._respond({}, STEP, base=_grown(self.base, i, size)), first)
            )
        columns.append(self._derivative(lambda size: self._respond({}, STEP, later=size), FIRST_OWN[kind]))
        return tuple(columns)

    def _respond(self, effects: Effects, step: float, base: Base | None = None, later: float = 0.0) -> list[Channels]:
        return [
            simulate(_moved(plan.conditions, later), base or self.base, effects, plan.times, step)
            for plan in self.plans
        ]

    def _derivative(self, change: Change, first: float, from_size: float = 0.0, least: float = 0.0) -> list[Projected]:
        """Projected changes of the readings per unit, by a difference of suitable size."""
        here, size = change(from_size), first
        for _ in range(6):
            there = change(from_size + size)
            parts = [
                (t.force - h.force, t.position - h.position - (t.position - h.position).mean())
                for t, h in zip(there, here, strict=True)
            ]
            largest = max(
                max(
                    np.abs(force[y.smooth]).max() / self.noise.rms["force"],
                    np.abs(position).max() / self.noise.rms["position"],
                )
                for y, (force, position) in zip(self.yardsticks, parts, strict=True)
            )
            if SMALL < largest < LARGE or (largest >= LARGE and size <= least):
                break
            size = max(size * min(max(0.3 * LARGE / max(largest, 1e-12), 1e-4), 100.0), least)
        return [
            y.project(force[:, None] / size, position[:, None] / size)
            for y, (force, position) in zip(self.yardsticks, parts, strict=True)
        ]

    def direction(self, hidden: Hidden) -> list[Projected]:
        """Changes of the readings per unit of an effect's strength."""
        full = hidden.name in OF_READINGS or hidden.name == CHAIN
        key = (
            hidden.name,
            tuple(hidden.shape.items()),
            hidden.strength if full else math.copysign(1.0, hidden.strength),
        )
        if key not in self._directions:
            self._directions[key] = self._direction(hidden, full)
        return self._directions[key]

    def _direction(self, hidden: Hidden, full: bool) -> list[Projected]:
        step = FINE if hidden.name in STIFF else STEP

        def change(size: float) -> list[Channels]:
            effect = hidden._replace(strength=math.copysign(size, hidden.strength))
            return self._respond({hidden.name: effect.values(self.base.stiffness)} if size else {}, step)

        if full:
            size = abs(hidden.strength)
            return [
                y.project((t.force - h.force)[:, None] / size, (t.position - h.position)[:, None] / size)
                for y, t, h in zip(self.yardsticks, change(size), change(0.0), strict=True)
            ]
        if hidden.name in STIFF:
            return self._derivative(change, 10.0 * SINGULAR, from_size=SINGULAR, least=SINGULAR)
        return self._derivative(change, FIRST_STRENGTH)

    def _turned(self, known: Hidden) -> Iterator[list[Projected]]:
        """How the direction of an effect turns as each of its shape parameters grows."""
        here = self.direction(known)
        for name, value in known.shape.items():
            there = self.direction(known._replace(shape={**known.shape, name: value * (1.0 + TURN)}))
            turned = [Projected(*(b - a for a, b in zip(*pair, strict=True))) for pair in zip(here, there, strict=True)]
            # A shape that changes nothing here, as a speed that no record reaches, frees nothing.
            if any(np.any(one.rows) for one in turned):
                yield turned

    def noncentrality(self, hidden: Sequence[Hidden], known: Sequence[Hidden] = ()) -> float:
        """Gain in twice the log likelihood over a model that has the `known` effects only, of free strength and shape.

        Parameters
        ----------
        hidden : what the model lacks
        known : what it has, as strong as it is
        """
        if not hidden:
            return 0.0
        own = 1 + 3 * (self.scatter > 0.0)
        free = [column for one in known for column in (self.direction(one), *self._turned(one))]
        columns = [*self._slopes[:3], *free, self._slopes[3]]
        shared, count = len(columns) - 1, len(self.plans)
        normal, gradient, length = np.zeros((shared + own * count,) * 2), np.zeros(shared + own * count), 0.0
        for r in range(count):
            mine = _joined([column[r] for column in columns])
            lacking = _joined([self.direction(one)[r] for one in hidden])
            sizes = np.array([abs(one.strength) for one in hidden])
            # Deviations of a record change it as the shared parameters do.
            order = [*range(shared + 1), *range(own - 1)]
            places = np.array([*range(shared), *range(shared + r * own, shared + (r + 1) * own)])
            normal[np.ix_(places, places)] += mine.dot(mine)[np.ix_(order, order)]
            gradient[places] += mine.dot(lacking)[order] @ sizes
            length += sizes @ lacking.dot(lacking) @ sizes
        if own > 1:
            deviations = np.array([shared + r * own + i for r in range(count) for i in range(1, own)])
            normal[deviations, deviations] += self.scatter**-2
        scale = 1.0 / np.sqrt(np.diag(normal))
        # A base parameter that others imitate altogether must not blow up.
        inner = normal * np.outer(scale, scale) + 1e-12 * np.eye(scale.size)
        return float(length - (scale * gradient) @ np.linalg.solve(inner, scale * gradient))


def _grown(base: Base, which: int, size: float) -> Base:
    """Base parameters of which one is greater by a share."""
    return Base(*(value * math.exp(size * (i == which)) for i, value in enumerate(base)))


def _moved(conditions: Conditions, by: float) -> Conditions:
    """The same conditions with the weight released later, or with the fibre carrying more before the drive starts."""
    if conditions.kind == DROP:
        return replace(conditions, release=conditions.release + by)
    return replace(conditions, start_excess=conditions.start_excess + by)


def _joined(columns: Sequence[Projected]) -> Projected:
    return Projected(*(np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)))


class Found(NamedTuple):
    """An effect as strong as was asked for, and its noncentrality; less where even its greatest strength has less."""

    hidden: Hidden
    noncentrality: float


def strength_for(
    ideal: Ideal, hidden: Hidden, wanted: float, *, known: Sequence[Hidden] = (), close: float = 0.005
) -> Found:
    """The effect at the strength that has the noncentrality `wanted`.

    Parameters
    ----------
    ideal : the perfect test
    hidden : the effect, with a first guess of its strength, whose sign is kept
    wanted : noncentrality
    known : effects that the model has
    close : relative error of the noncentrality that is good enough
    """
    limits, sign = EFFECTS[hidden.name], math.copysign(1.0, hidden.strength)
    size, low, high = min(max(abs(hidden.strength), limits.least), limits.most), 0.0, math.inf
    best: Found | None = None
    for _ in range(25):
        trial = hidden._replace(strength=sign * size)
        found = Found(trial, ideal.noncentrality([trial], known))
        reached = max(found.noncentrality, 1e-9)
        if best is None or abs(math.log(reached / wanted)) < abs(math.log(max(best.noncentrality, 1e-9) / wanted)):
            best = found
        if abs(reached / wanted - 1.0) < close or size == (limits.most if reached < wanted else limits.least):
            break
        low, high = (size, high) if reached < wanted else (low, size)
        # The noncentrality grows with the square of the strength, or with a higher power.
        size = min(max(size * min(max(math.sqrt(wanted / reached), 0.02), 50.0), limits.least), limits.most)
        if not low < size < high:
            size = math.sqrt(low * high) if low > 0.0 else 0.3 * high
    assert best is not None
    return best
