"""Identification together with the errors of measured inputs: Gauss-Newton on both, the errors eliminated."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np

from fibrefit.problem.inputs.errors_in_variables import (
    Eliminated,
    InputCoefficients,
    InputErrors,
    corrected,
    eliminate,
    eliminate_from,
    error_rms,
    expanded,
    left_over,
    no_errors,
    residuals,
)
from fibrefit.problem.inputs.linearity_weights import counted, downweighted, downweights
from fibrefit.problem.statement.layout import Layout, assembled
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task

STEPS = 20
SETTLED = 0.05
"""Fall of the cost a further step promises below which the search ends, in units where 1 is one standard error.

At this scale the cost of a motion that sticks and bounces is rough.
"""
COARSE = 1e-3
"""The same as a share of what the residuals have beyond the noise: a model that lacks something has no exact best."""
HOPELESS = 4.0
"""Variance that even the best errors of the inputs would leave, from which they are not what the model lacks.

They stay nil then, and the values those for inputs as they were measured.
"""
LACKING = 1.3
"""Variance of the residuals from which a model lacks too much to follow a motion that bounces."""
STUCK = 1.0
"""Promised fall of the cost beyond which a descent has not arrived."""
LENGTHS = (1.0, 0.5, 0.25, 0.12, 0.06, 0.03)
"""Shares of a step that are tried for each record by itself."""
SETTLING = 2
TRIALS = 3
GOOD = 0.2
"""Share of the promised fall that makes a step good enough."""
WHOLE = 0.99
"""Factor on a sample's weight from which it counts as a whole one."""
LOOKS = 3
"""How often it is looked which samples can be predicted: where a descent is stuck they may be others than before."""
SLOW, CRAWLING = 0.1, 3
"""Share of the promised fall below which a step is slow; so many of them in turn end a descent."""
DRAWS = 2


@dataclass(frozen=True)
class Joint:
    """Values and input errors that explain the records together.

    Parameters
    ----------
    problem : Problem
        With the errors taken off its inputs.
    values : (n_free,) in SI units
    linear : Eliminated
        At these values.
    coefficients : mapping of input to (n_record, n_wave)
        The errors, before they are given their colour.
    promised : float
        Fall of the cost that one more step promises.
    error_rms : mapping of input to float, in SI units
    predicted : float
        Rms of what is left and of the errors, in units of their noise, over the samples that can be predicted.
    """

    problem: Problem
    values: np.ndarray
    linear: Eliminated
    coefficients: InputCoefficients
    promised: float
    error_rms: Mapping[str, float]
    predicted: float

    @property
    def gap(self) -> float:
        """Rms of the residuals in units of the noise."""
        return float(np.sqrt(np.sum(self.linear.residuals**2) / self.problem.n_measured))

    @property
    def prior(self) -> np.ndarray:
        """``X'X`` with X the slopes of the coefficients, ``(n_record, n_local_free, n_local_free)``."""
        return sum(np.einsum("rwi,rwj->rij", slopes, slopes) for slopes in self.linear.wave_slopes.values())


def joint(
    task: Task,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients | None = None,
    *,
    whole: bool = True,
) -> Joint:
    """Best values and input errors, from the values that suit the inputs as they were measured.

    Parameters
    ----------
    task : Task
    known : mapping of input to InputErrors
    values : (n_free,) in SI units
    coefficients : mapping of input to (n_record, n_wave), optional
        Where to begin; inputs as they were measured by default.
    whole : bool
        Go on with the samples that cannot be predicted, once those that can be are explained.

    Returns
    -------
    Joint
    """
    problem = task.problem
    place, downweight = _Place(values, no_errors(known) if coefficients is None else coefficients), np.ones(())
    for _ in range(LOOKS):
        parts = expanded(problem, known, *place)
        downweight = np.minimum(
            downweight, downweights(problem, known, *place, [sensitivities for _, _, sensitivities in parts])
        )
        weaker = downweighted(problem, downweight)
        linear = eliminate_from(known, parts, place.coefficients, downweight)
        cost = float(_sums(linear.residuals, place.coefficients).sum())
        end = _end(problem.layout, place, linear, cost, SETTLED if whole else STUCK)
        number = counted(problem, downweight).sum()
        hopeless = whole and end.cost - end.promised > HOPELESS * number
        end = end if hopeless else _descended(weaker, known, end)
        if hopeless or end.promised <= max(STUCK * end.variance, end.enough):
            break
        place = end.place
    if whole and end.promised > end.enough and end.variance > LACKING and not hopeless:
        # A model that lacks something and cannot be brought to rest with errors of its inputs is left without them.
        end, hopeless = _at(weaker, known, _Place(values, no_errors(known))), True
    predicted = float(np.sqrt(end.cost / number))
    if whole and downweight.min() < WHOLE:
        end = _with_all_samples(problem, known, end)
    place = end.place
    rms = error_rms(problem, known, place.coefficients)
    return Joint(
        problem=corrected(problem, known, place.coefficients),
        values=place.values,
        linear=end.linear,
        coefficients=place.coefficients,
        promised=0.0 if hopeless or end.promised <= end.enough else end.promised / end.variance,
        error_rms=rms,
        predicted=predicted,
    )


def expected_gap(task: Task, known: Mapping[str, InputErrors], found: Joint, seed: int = 0) -> tuple[float, np.ndarray]:
    """Gap a perfect model leaves, in all and by record and channel: input errors that are fitted take noise with them.

    Parameters
    ----------
    task : Task
    known : mapping of input to InputErrors
    found : Joint
    seed : int
        Of the draws of noise.

    Returns
    -------
    (float, (n_record, n_channel))
    """
    random, problem = np.random.default_rng(seed), task.problem
    data, channels = problem.observations, problem.model.rig.channels
    seen = np.stack([np.asarray(data.weight[channel]) > 0.0 for channel in channels], axis=1)
    noise = np.zeros((DRAWS, *seen.shape))
    for r, trace in enumerate(task.traces):
        size, rate = len(trace.times), 1.0 / float(np.diff(trace.times).mean())
        for c, channel in enumerate(channels):
            for draw in noise:
                wave = task.noise[channel].draw(2 * size, rate, random)[:size]
                draw[r, c, :size] = wave / max(wave.std(), 1e-300)
    coefficients = {name: random.standard_normal((DRAWS, *wave.shape)) for name, wave in found.coefficients.items()}
    left = left_over(found.problem, known, found.values, coefficients, noise)
    squares, number = np.sum(np.where(seen, left, 0.0) ** 2, axis=-1).mean(axis=0), seen.sum(axis=-1)
    return float(np.sqrt(squares.sum() / number.sum())), np.sqrt(squares / np.maximum(number, 1))


def _with_all_samples(problem: Problem, known: Mapping[str, InputErrors], end: _End) -> _End:
    """The descent, begun with samples that can be predicted, to its end with all of them."""
    place = end.place
    if end.variance < LACKING:
        whole = _at(problem, known, place)
        if whole.promised > whole.enough:
            place = _settled(problem, known, place)[0]
            whole = _descended(problem, known, _at(problem, known, place))
        if whole.promised < max(STUCK * whole.variance, whole.enough):
            return whole
        place = whole.place
    # What is known of the values comes from what can be predicted; the residuals are those of all samples.
    return end._replace(place=place, linear=end.linear._replace(residuals=residuals(problem, known, *place)))


class _Place(NamedTuple):
    """Values ``(n_free,)`` and coefficients."""

    values: np.ndarray
    coefficients: InputCoefficients


class _End(NamedTuple):
    """Where a descent ended.

    Parameters
    ----------
    place : _Place
    linear : Eliminated
        The linearised problem there.
    cost : float
    goal : _Place
        Where the linearised problem is best.
    promised : float
        Fall of the cost on the way to it.
    variance : float
        Of the residuals; at least that of the noise.
    enough : float
        Promised fall below which there is nothing to go on for: little beside the errors of the values, or beside what
        the model lacks.
    settled : float
        Where the errors of the values are what counts, that fall for residuals of variance one.
    """

    place: _Place
    linear: Eliminated
    cost: float
    goal: _Place
    promised: float
    variance: float
    enough: float
    settled: float


def _descended(problem: Problem, known: Mapping[str, InputErrors], end: _End) -> _End:
    """Gauss-Newton steps on values and coefficients, from where an earlier descent ended."""
    layout = problem.layout
    costs = lambda trial: _costs(problem, known, trial)  # noqa: E731
    slow = 0
    for _ in range(STEPS):
        if end.promised <= end.enough or slow == CRAWLING:
            break
        found = _towards(end, lambda trial: float(costs(trial).sum()))
        found = found or _each_by_itself(layout, end.place, end.linear, costs)
        if not found[1] < end.cost - end.enough:
            break
        slow = slow + 1 if end.cost - found[1] < SLOW * end.promised else 0
        end = _end(layout, found[0], eliminate(problem, known, *found[0]), found[1], end.settled)
    return end


def _at(problem: Problem, known: Mapping[str, InputErrors], place: _Place) -> _End:
    """A descent that has not begun."""
    cost = float(_costs(problem, known, place).sum())
    return _end(problem.layout, place, eliminate(problem, known, *place), cost)


def _end(layout: Layout, place: _Place, linear: Eliminated, cost: float, settled: float = SETTLED) -> _End:
    goal, lowest = _goal(layout, place, linear)
    squares = np.sum(linear.residuals**2) / max(np.count_nonzero(linear.residuals), 1)
    variance = max(1.0, float(squares))
    enough = max(settled * variance, COARSE * (variance - 1.0) * np.count_nonzero(linear.residuals))
    return _End(place, linear, cost, goal, cost - lowest, variance, enough, settled)


def _settled(problem: Problem, known: Mapping[str, InputErrors], place: _Place) -> tuple[_Place, float]:
    """Records brought to their best, each by itself, with shared values held; and the cost there."""
    for _ in range(SETTLING):
        linear = eliminate(problem, known, *place)
        place, cost = _each_by_itself(problem.layout, place, linear, lambda trial: _costs(problem, known, trial))
    return place, cost


def _costs(problem: Problem, known: Mapping[str, InputErrors], place: _Place) -> np.ndarray:
    """Sum of squared residuals and coefficients of each record; infinite where its simulation breaks down."""
    costs = _sums(residuals(problem, known, *place), place.coefficients)
    return np.where(np.isfinite(costs), costs, np.inf)


def _sums(residuals: np.ndarray, coefficients: InputCoefficients) -> np.ndarray:
    return np.sum(residuals**2, axis=(1, 2)) + sum(np.sum(wave**2, axis=1) for wave in coefficients.values())


def _goal(layout: Layout, place: _Place, linear: Eliminated) -> tuple[_Place, float]:
    """Where the linearised problem is best inside the bounds, and its cost there."""
    size, records = layout.size, len(layout.records)
    index = np.concatenate([layout.local_columns, np.full((records, 1), size)], axis=1)
    gram = assembled(linear.gram, index, size + 1)
    normal, slope = gram[:size, :size], gram[:size, size]
    step = bounded_step(normal, slope, *_room(layout, place.values))
    padded = np.append(step, [0.0, 0.0])
    coefficients = {
        name: best + np.einsum("rwi,ri->rw", linear.wave_slopes[name], padded[layout.local_columns])
        for name, best in linear.best.items()
    }
    return _Place(place.values + step, coefficients), float(
        gram[size, size] + 2.0 * slope @ step + step @ normal @ step
    )


def _room(layout: Layout, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """How far each value may move down and up."""
    limits = [slot.range for slot, _ in layout.entries]
    return np.array([r.lower for r in limits]) - values, np.array([r.upper for r in limits]) - values


def bounded_step(normal: np.ndarray, slope: np.ndarray, lower: np.ndarray, upper: np.ndarray) -> np.ndarray:
    """Step that minimises ``2 slope's + s'normal s`` inside bounds; a value that would leave them stops there."""
    scale = np.sqrt(np.diag(normal))
    scale = np.where(scale > 0.0, scale, 1.0)
    step, free = np.zeros(len(slope)), np.ones(len(slope), dtype=bool)
    for _ in range(len(slope)):
        pull = -(slope + normal @ np.where(free, 0.0, step))[free] / scale[free]
        inside = normal[np.ix_(free, free)] / np.outer(scale[free], scale[free])
        step[free] = np.linalg.lstsq(inside, pull, rcond=1e-10)[0] / scale[free]
        outside = free & ((step < lower) | (step > upper))
        if not outside.any():
            break
        step[outside] = np.clip(step, lower, upper)[outside]
        free &= ~outside
    return step


def _towards(end: _End, cost_at: Callable[[_Place], float]) -> tuple[_Place, float] | None:
    """A place on the way to the goal that keeps some of what is promised, and its cost; None where none is found."""
    length = 1.0
    for _ in range(TRIALS):
        trial = _between(end.place, end.goal, length)
        there = cost_at(trial)
        if there < end.cost - GOOD * length * end.promised:
            return trial, there
        # Lowest point of the parabola through the cost and its slope here, and the cost there.
        bend = there - end.cost + 2.0 * length * end.promised
        length *= float(np.clip(length * end.promised / bend, 0.2, 0.7)) if np.isfinite(bend) and bend > 0.0 else 0.3
    return None


def _each_by_itself(
    layout: Layout, place: _Place, linear: Eliminated, costs: Callable[[_Place], np.ndarray]
) -> tuple[_Place, float]:
    """The same with shared values held, and for each record a length of its own.

    A motion that bounces is hard to predict: one such record would keep all others from moving.
    """
    goal = _goal_of_each(layout, place, linear)
    best, lowest = place, costs(place)
    for length in LENGTHS:
        trial = _between(place, goal, length)
        there = costs(trial)
        better = there < lowest
        own = np.array([record is not None and better[record] for _, record in layout.entries])
        coefficients = {
            name: np.where(better[:, None], trial.coefficients[name], wave) for name, wave in best.coefficients.items()
        }
        best = _Place(np.where(own, trial.values, best.values), coefficients)
        lowest = np.minimum(there, lowest)
    return best, float(lowest.sum())


def _goal_of_each(layout: Layout, place: _Place, linear: Eliminated) -> _Place:
    """Where each record's own values and coefficients are best with the shared values held."""
    shared = sum(record is None for _, record in layout.entries)
    values, coefficients = place.values.copy(), {name: best.copy() for name, best in linear.best.items()}
    lower, upper = _room(layout, place.values)
    for r, columns in enumerate(layout.local_columns):
        own = np.flatnonzero((columns >= shared) & (columns < layout.size))
        gram, places = linear.gram[r], columns[own]
        step = bounded_step(gram[np.ix_(own, own)], gram[own, -1], lower[places], upper[places])
        values[places] += step
        for name, slopes in linear.wave_slopes.items():
            coefficients[name][r] += slopes[r][:, own] @ step
    return _Place(values, coefficients)


def _between(place: _Place, goal: _Place, share: float) -> _Place:
    coefficients = {name: wave + share * (goal.coefficients[name] - wave) for name, wave in place.coefficients.items()}
    return _Place(place.values + share * (goal.values - place.values), coefficients)
