"""What a perfect whitened test gains where an effect is hidden: its noncentrality.

It is the least cost, in twice the log likelihood, at which a model without the effect accounts for clean readings with it:
base parameters, what each record has for itself and errors of the measured drive are free, the last at the price of their
prior; parameters that differ from record to record pay theirs. Noise is whitened by its true spectrum. For a faint effect
this is the squared length of the effect's change of the readings off all that; for others the projection is
repeated about where it leads, as Gauss and Newton do.

Approximations: errors of the drive act to first order and as in the rig without the effect; parameters that scatter do so
about the base values; noise of heavy tails is weighed by its variance alone, and rounding as white noise.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import NamedTuple

import numpy as np
from scipy.linalg import solve_triangular

from tests.independent.drive_error import responses
from tests.independent.laws import DRIVE, DROP, EFFECTS, values_at
from tests.independent.sensors import Noise
from tests.independent.series import Plan
from tests.independent.simulate import Base, Channels, Effects, simulate

STEP = 2e-5
FINE = 1e-5
STIFF = {"pulley.inertia", "pulley.bearing_friction", "drive.compliance", "fibre.mass", "guide.presliding"}
FREE = 1e3
"""What has no prior may be this many times as large as usual."""
NUDGES = (5e-4, 5e-3, 1e-2)
"""Relative change of stiffness, damping and friction by which slopes are taken: large enough to move switches by more
than the step within which they fall, small against a bounce."""
OWN_NUDGES = {DROP: 1e-5, DRIVE: 0.02}
"""Of what a record has for itself: s by which it is released later; N by which the fibre carries more at the start."""
STRENGTH_NUDGE = 0.02
ROUNDS, HALVINGS = 15, 5
SETTLED = 2e-3
LEAST = 1e-3


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
    def _whiten(self) -> tuple:
        from tests.independent.whitening import whitening

        clean = simulate(self.plan.conditions, self.base, {}, self.plan.times, STEP)
        rate = 1.0 / (self.plan.times[1] - self.plan.times[0])
        return tuple(whitening(self.noise, channel, clean.force, rate) for channel in ("force", "position"))

    def whitened(self, force: np.ndarray, position: np.ndarray) -> np.ndarray:
        """Innovations of columns of both channels, one below the other."""
        return np.concatenate([self._whiten[0](force), self._whiten[1](position)])

    @cached_property
    def _free(self) -> tuple[np.ndarray, np.ndarray]:
        """Whitened columns of all that is free, by their prior, and the factor of their normal matrix."""
        times, columns = self.plan.times, []
        nothing = np.zeros((times.size, 1))
        columns.append((nothing, np.full((times.size, 1), FREE * self.noise.rms["position"])))
        for channel in ("force", "position"):
            for frequency, size in self.noise.all_lines(channel):
                if size > 0.0:
                    angle = 2.0 * math.pi * frequency * times
                    waves = FREE * size * np.column_stack([np.cos(angle), np.sin(angle)])
                    zero = np.zeros_like(waves)
                    columns.append((waves, zero) if channel == "force" else (zero, waves))
        if self.plan.conditions.kind == DRIVE:
            columns.append(responses(self.plan.conditions, self.base, times, self.noise))
        rows = self.whitened(*(np.concatenate(parts, axis=1) for parts in zip(*columns, strict=True)))
        return rows, np.linalg.cholesky(np.eye(rows.shape[1]) + rows.T @ rows)

    def project(self, force: np.ndarray, position: np.ndarray) -> Projected:
        """Columns ``(n, m)`` of both channels as the metric sees them."""
        rows = self.whitened(force, position)
        free, factor = self._free
        return Projected(rows, solve_triangular(factor, free.T @ rows, lower=True))


class Account(NamedTuple):
    """How well a model without an effect accounts for readings with it.

    Parameters
    ----------
    noncentrality : in twice the log likelihood
    point : logarithms of base parameters over the true ones, strengths of the known effects over the true ones less one,
        then for each record what it has for itself and its own deviations
    """

    noncentrality: float
    point: np.ndarray


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

    @cached_property
    def yardsticks(self) -> tuple[Yardstick, ...]:
        """Of all records."""
        return tuple(Yardstick(plan, self.base, self.noise) for plan in self.plans)

    def respond(self, effects: Effects, step: float, point: np.ndarray | None = None, shared: int = 3) -> list[Channels]:
        """Clean readings of all records at a point."""
        own = 1 + 3 * (self.scatter > 0.0)
        found = []
        for i, plan in enumerate(self.plans):
            base, conditions = self.base, plan.conditions
            if point is not None:
                mine = point[shared + i * own : shared + (i + 1) * own]
                logs = point[:3] + (mine[1:] if own > 1 else 0.0)
                base = Base(*(value * math.exp(log) for value, log in zip(self.base, logs, strict=True)))
                conditions = _moved(conditions, mine[0])
            found.append(simulate(conditions, base, effects, plan.times, step))
        return found

    def account(self, hidden: Sequence[Hidden], known: Sequence[Hidden] = (), start: np.ndarray | None = None) -> Account:
        """How well a model with the `known` effects, of free strength, accounts for readings with them and the hidden.

        Parameters
        ----------
        hidden : what the model lacks
        known : what it has
        start : a point near the answer
        """
        search = _Search(self, tuple(known), FINE if STIFF & {one.name for one in (*hidden, *known)} else STEP)
        effects = {one.name: one.values(self.base.stiffness) for one in (*known, *hidden)}
        return search.least(self.respond(effects, search.step), start)


def _moved(conditions, by: float):
    """The same conditions with the weight released later, or with the fibre carrying more before the drive starts."""
    if conditions.kind == DROP:
        return replace(conditions, release=conditions.release + by)
    return replace(conditions, start_excess=conditions.start_excess + by)


@dataclass(frozen=True)
class _Search:
    """Gauss-Newton steps of a model towards given readings.

    Parameters
    ----------
    ideal : what is known of the series
    known : effects of the model
    step : of the simulator
    """

    ideal: Ideal
    known: tuple[Hidden, ...]
    step: float

    @property
    def shared(self) -> int:
        """Number of unknowns that all records share."""
        return 3 + len(self.known)

    @property
    def own(self) -> int:
        """Number of unknowns of one record."""
        return 1 + 3 * (self.ideal.scatter > 0.0)

    @property
    def size(self) -> int:
        """Number of all unknowns."""
        return self.shared + self.own * len(self.ideal.plans)

    def model(self, point: np.ndarray) -> list[Channels]:
        """Readings of the model."""
        strengths = zip(self.known, point[3 : self.shared], strict=True)
        effects = {
            one.name: one._replace(strength=_possible(one, more)).values(self.ideal.base.stiffness)
            for one, more in strengths
        }
        return self.ideal.respond(effects, self.step, point, self.shared)

    def slopes(self, point: np.ndarray, here: Sequence[Channels]) -> list[Projected]:
        """Of each record: by what is shared, then by what it has for itself but for its deviations."""
        nudges = [*NUDGES, *[STRENGTH_NUDGE] * len(self.known), OWN_NUDGES[self.ideal.plans[0].conditions.kind]]
        columns = []
        for i, nudge in enumerate(nudges):
            moved = point.copy()
            if i < self.shared:
                moved[i] += nudge
            else:
                # Each record's own unknown changes only that record: all at once.
                moved[self.shared :: self.own] += nudge
            columns.append(self.model(moved))
        return [
            yardstick.project(
                np.column_stack([(c[r].force - here[r].force) / d for c, d in zip(columns, nudges, strict=True)]),
                np.column_stack([(c[r].position - here[r].position) / d for c, d in zip(columns, nudges, strict=True)]),
            )
            for r, yardstick in enumerate(self.ideal.yardsticks)
        ]

    def left(self, truth: Sequence[Channels], model: Sequence[Channels]) -> list[Projected]:
        """What the model leaves of each record."""
        return [
            yardstick.project((t.force - m.force)[:, None], (t.position - m.position)[:, None])
            for yardstick, t, m in zip(self.ideal.yardsticks, truth, model, strict=True)
        ]

    def price(self, point: np.ndarray) -> np.ndarray:
        """Precision of the prior of each unknown."""
        found = np.zeros(self.size)
        if self.own > 1:
            for i in range(1, self.own):
                found[self.shared + i :: self.own] = self.ideal.scatter**-2
        return found

    def cost(self, point: np.ndarray, left: Sequence[Projected]) -> float:
        """What is left, and what the deviations cost."""
        return sum(one.dot(one).item() for one in left) + float(self.price(point) @ point**2)

    def least(self, truth: Sequence[Channels], start: np.ndarray | None) -> Account:
        """The least cost."""
        point = np.zeros(self.size) if start is None else start.copy()
        here = self.model(point)
        left = self.left(truth, here)
        cost, slopes = self.cost(point, left), self.slopes(point, here)
        fresh = True
        for _ in range(ROUNDS):
            step = self.newton(point, slopes, left)
            moved, better = None, cost
            for halving in range(HALVINGS if fresh else 2):
                trial = point + 0.5**halving * step
                there = self.model(trial)
                rest = self.left(truth, there)
                if (better := self.cost(trial, rest)) < cost:
                    moved = trial, there, rest
                    break
            gain = cost - better if moved else 0.0
            if moved:
                (point, here, left), cost = moved, better
            if gain < max(SETTLED * cost, LEAST):
                if fresh or gain < 0.1 * max(SETTLED * cost, LEAST) and moved:
                    break
                slopes, fresh = self.slopes(point, here), True
            else:
                # Slopes that lead nearly all the way are good enough for another step.
                fresh = gain < 0.5 * (cost + gain)
                if fresh:
                    slopes = self.slopes(point, here)
        return Account(cost, point)

    def newton(self, point: np.ndarray, slopes: Sequence[Projected], left: Sequence[Projected]) -> np.ndarray:
        """Step to the least cost if readings changed by `slopes`."""
        normal = np.diag(self.price(point) + 1e-12)
        gradient = -self.price(point) * point
        for r, (mine, rest) in enumerate(zip(slopes, left, strict=True)):
            own = self.shared + r * self.own
            columns = [*range(self.shared + 1), *range(3)] if self.own > 1 else [*range(self.shared + 1)]
            places = np.array([*range(self.shared), *range(own, own + self.own)])
            inner = mine.dot(mine)[np.ix_(columns, columns)]
            normal[np.ix_(places, places)] += inner
            gradient[places] += mine.dot(rest)[columns, 0]
        scale = 1.0 / np.sqrt(np.diag(normal))
        # A damper that base parameters imitate altogether must not send the step away.
        return scale * np.linalg.solve(normal * np.outer(scale, scale) + 1e-10 * np.eye(self.size), scale * gradient)


def _possible(one: Hidden, more: float) -> float:
    """Strength of a known effect inside what is physical."""
    limits = EFFECTS[one.name]
    size = abs(one.strength) * (1.0 + more)
    return math.copysign(min(max(size, max(limits.least, 1e-6)), limits.most), one.strength)


class Found(NamedTuple):
    """An effect as strong as was asked for, and its noncentrality; less where even its greatest strength has less."""

    hidden: Hidden
    noncentrality: float


def strength_for(
    ideal: Ideal, hidden: Hidden, wanted: float, *, known: Sequence[Hidden] = (), close: float = 0.01
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
    account, best = None, None
    seen: list[tuple[float, float]] = []
    for _ in range(14):
        trial = hidden._replace(strength=sign * size)
        start = None if account is None else account.point * size / seen[-1][0]
        account = ideal.account([trial], known, start)
        reached = max(account.noncentrality, 1e-9)
        seen.append((size, reached))
        if best is None or abs(math.log(reached / wanted)) < abs(math.log(best.noncentrality / wanted)):
            best = Found(trial, reached)
        if abs(reached / wanted - 1.0) < close or size == (limits.most if reached < wanted else limits.least):
            break
        low, high = (size, high) if reached < wanted else (low, size)
        size = min(max(_guess(seen, wanted, low, high), limits.least), limits.most)
    assert best is not None
    return best


def _guess(seen: Sequence[tuple[float, float]], wanted: float, low: float, high: float) -> float:
    """Next strength, by the power with which the noncentrality grew last, between what is too little and too much."""
    size, reached = seen[-1]
    power = 2.0
    if len(seen) > 1 and seen[-2][0] != size:
        power = min(max(math.log(reached / seen[-2][1]) / math.log(size / seen[-2][0]), 1.0), 6.0)
    guess = size * min(max((wanted / reached) ** (1.0 / power), 0.05), 20.0)
    if not low < guess < high:
        guess = math.sqrt(low * high) if low > 0.0 else 0.3 * high
    return guess
