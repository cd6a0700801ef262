"""Frequency sweep of a pendulum under a harmonic drive: its steady states, their extremes and their stability.

At each frequency it is started from rest, and continued from the motion at the next lower and at the next higher one.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from functools import partial
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from jax.custom_batching import sequential_vmap
from jax.flatten_util import ravel_pytree

from fibrefit.core.threads import THREADS, thread_pool
from fibrefit.problem import LENGTH_STEP
from fibrefit.rigs.inverted_pendulum import INVERTED_PENDULUM, InvertedPendulum
from fibrefit.rigs.rig import Start
from fibrefit.series.jumps import Extremes
from fibrefit.simulation.inputs import Course, Signals, courses, inputs_at
from fibrefit.simulation.model import Model, corrected_conditions
from fibrefit.simulation.sensitivity import solve
from fibrefit.simulation.switched import Grid, select

BRANCHES = ("rest", "up", "down")
"""Ways to come to a frequency: from rest, and from the motion at the next lower or higher frequency."""
MOST_PERIODS = 4
"""Longest period of a motion that is called periodic, in periods of the drive."""
CHANNELS = INVERTED_PENDULUM.channels


@dataclass(frozen=True)
class Conditions:
    """One curve of a sweep.

    Parameters
    ----------
    name : str
    amplitude : float in m
        Of the driven ends.
    rig : mapping of str to float in SI units
        The rig's conditions.
    """

    name: str
    amplitude: float
    rig: Mapping[str, float]


@dataclass(frozen=True)
class Plan:
    """What a sweep goes through.

    Parameters
    ----------
    frequencies : (n_frequency,) in Hz, increasing
    settle : float in s
        Longest time a motion is given to settle.
    rate : float in Hz
        Steps of the simulation.
    """

    frequencies: np.ndarray
    settle: float
    rate: float

    @property
    def size(self) -> int:
        """Points of the longest period, with some to spare: sweeps of like length share a compiled program."""
        return -(-(math.ceil(self.rate / float(self.frequencies[0])) + 2) // LENGTH_STEP) * LENGTH_STEP


@dataclass(frozen=True)
class Branch(Extremes):
    """The motions of one branch; all arrays run over the frequencies, NumPy, SI units.

    Parameters
    ----------
    lowest, highest, first_lowest, first_highest : (n_frequency, 3)
        Of angle and of both forces.
    periods : (n_frequency,) int
        Periods of the drive after which the motion repeats itself; 0 where it does not.
    multiplier : (n_frequency,)
        Largest modulus of a Floquet multiplier; the motion is stable below 1.
    overturned, trouble : (n_frequency,) bool
    time : (n_frequency,) in s
        That was simulated until it had settled.
    """

    periods: np.ndarray
    multiplier: np.ndarray
    overturned: np.ndarray
    trouble: np.ndarray
    time: np.ndarray


@dataclass(frozen=True)
class SweptCurve:
    """One curve of a sweep.

    Parameters
    ----------
    conditions : Conditions
        With the ``name`` of the curve.
    frequencies : (n_frequency,) in Hz
        Of the drive.
    natural_frequency : float
        Of small motions, in Hz.
    branches : mapping of str to Branch
        ``up``, ``down`` and ``rest``: what the sweep up, the sweep down and starts from rest found.

    Examples
    --------
    >>> curve = swept.curves[0]
    >>> sorted(curve.branches), curve.branches["up"].amplitude.shape == curve.frequencies.shape
    (['down', 'rest', 'up'], True)
    """

    conditions: Conditions
    frequencies: np.ndarray
    natural_frequency: float
    branches: Mapping[str, Branch]


def sweep(
    model: Model,
    values: Mapping[str, float],
    curves: Sequence[Conditions],
    plan: Plan,
    progress: Callable[[float], None] | None = None,
) -> tuple[SweptCurve, ...]:
    """Run a pendulum over all frequencies, for all curves.

    Parameters
    ----------
    model : Model
        Of an inverted pendulum.
    values : mapping of str to float in SI units
        Of the model's parameters.
    curves : sequence of Conditions
    plan : Plan
    progress : callable, optional
        Called with the share that is done.
    """
    systems = []
    for curve in curves:
        named, stated = (
            {name: jnp.asarray(float(value)) for name, value in given.items()} for given in (values, curve.rig)
        )
        laws = model.laws(named)
        conditions = corrected_conditions(stated, named, laws)
        systems.append(model.rig.build(named, conditions, laws, model.tension_law))
    stacked = jax.tree.map(lambda *leaves: jnp.stack(leaves), *systems)
    amplitudes = jnp.array([curve.amplitude for curve in curves])
    up = jnp.asarray(plan.frequencies)
    follow = partial(_follow, rate=plan.rate, size=plan.size, patience=plan.settle)
    rest_of = partial(_from_rest, rate=plan.rate, size=plan.size, patience=plan.settle)
    jobs: list[Callable[[], Any]] = []
    for i in range(len(curves)):
        one = jax.tree.map(lambda leaf, i=i: leaf[i], (stacked, amplitudes))
        jobs += [partial(follow, *one, up), partial(follow, *one, up[::-1])]
    jobs += [partial(rest_of, *part) for part in _parts(stacked, amplitudes, up)]
    results = []
    with thread_pool(THREADS) as pool:
        for result in pool.map(lambda job: jax.tree.map(np.asarray, job()), jobs):
            results.append(result)
            if progress:
                progress(len(results) / len(jobs))

    continued, rested = results[: 2 * len(curves)], results[2 * len(curves) :]
    rest = jax.tree.map(lambda *rows: np.concatenate(rows), *rested)
    swept = []
    for i, curve in enumerate(curves):
        rows = slice(i * len(up), (i + 1) * len(up))
        states = {
            "rest": jax.tree.map(lambda leaf, rows=rows: leaf[rows], rest),
            "up": continued[2 * i],
            "down": jax.tree.map(lambda leaf: leaf[::-1], continued[2 * i + 1]),
        }
        branches = {}
        for name in BRANCHES:
            found = {one.name: getattr(states[name], one.name) for one in fields(Branch)}
            overturned = found["overturned"][:, None]
            for extreme in ("lowest", "highest"):
                found[extreme] = np.where(overturned, np.nan, found[extreme])
            branches[name] = Branch(**found)
        swept.append(SweptCurve(curve, plan.frequencies, natural_frequency(systems[i]), branches))
    return tuple(swept)


def natural_frequency(system: InvertedPendulum) -> float:
    """Linear natural frequency about the upright position, in Hz; zero where that does not hold.

    Law
    ---
    ``ω² = (n k r² - m g l/2)/I``, lever ``r = a d/sqrt(a² + d²)``: with a preload both fibres pull, n = 2, and what it
    does to their direction is left out; without one, one of them at a time, n = 1.
    """
    lever = system.distance * system.height / jnp.hypot(system.distance, system.height)
    fibres = jnp.where(system.preload > 0.0, 2.0, 1.0)
    spring = fibres * system.fibre.stiffness * lever**2 - system.tipping
    return float(jnp.sqrt(jnp.maximum(spring, 0.0) / system.moment_of_inertia) / (2.0 * jnp.pi))


def _parts(systems: Any, amplitudes: jax.Array, frequencies: jax.Array) -> list[Any]:
    """Runs from rest, curve after curve, in parts of equal length, some for each core."""
    size, number = len(frequencies), len(amplitudes)
    rows = np.arange(size * number)
    # Four parts a core. The last one is filled up with the last run: parts of one length are one program.
    length = -(-len(rows) // min(4 * THREADS, len(rows)))
    parts = -(-len(rows) // length)
    padded = np.minimum(np.arange(length * parts), len(rows) - 1).reshape(parts, length)
    return [
        (
            jax.tree.map(lambda leaf, part=part: leaf[part // size], systems),
            amplitudes[part // size],
            frequencies[part % size],
        )
        for part in padded
    ]


@eqx.filter_jit
def _from_rest(
    systems: InvertedPendulum, amplitudes: jax.Array, frequencies: jax.Array, rate: float, size: int, patience: float
) -> SteadyState:
    """Runs from rest, all in one batch; leaves ``(n_run, ...)`` in and out."""

    def one(system: InvertedPendulum, amplitude: jax.Array, frequency: jax.Array) -> SteadyState:
        drive = Drive.of(frequency, amplitude, rate, size)
        return steady_state(system, drive, *_rest(system, drive), jnp.asarray(patience))

    return jax.vmap(one)(systems, amplitudes, frequencies)


@eqx.filter_jit
def _follow(
    system: InvertedPendulum, amplitude: jax.Array, frequencies: jax.Array, rate: float, size: int, patience: float
) -> SteadyState:
    """Runs that go on from one another, from rest at the first; leaves ``(n_run, ...)`` out.

    A pendulum that has overturned is put upright before the next.
    """

    def one(carry: Any, frequency: jax.Array) -> Any:
        (state, mode), fallen = carry
        drive = Drive.of(frequency, amplitude, rate, size)
        begin = jax.tree.map(lambda new, old: jnp.where(fallen, new, old), _rest(system, drive), (state, mode))
        found = steady_state(system, drive, *begin, jnp.asarray(patience))
        return ((found.state, found.mode), found.overturned), found

    first = _rest(system, Drive.of(frequencies[0], amplitude, rate, size))
    return jax.lax.scan(one, (first, jnp.array(False)), frequencies)[1]


def _rest(system: InvertedPendulum, drive: Drive) -> tuple[Any, Any]:
    zero = jnp.zeros(())
    return system.begin(zero, zero, drive.at(jnp.int32(0), drive.times[0]))


class Drive(NamedTuple):
    """One period of ``x = x_0 sin 2π f t`` on a grid.

    Parameters
    ----------
    times : (n_time,) in s
        Those behind `count` are padding.
    count : () int
    inputs : dict of Course
    period : () in s
    """

    times: jax.Array
    count: jax.Array  # type: ignore[assignment]
    inputs: dict[str, Course]
    period: jax.Array

    @classmethod
    def of(cls, frequency: jax.Array, amplitude: jax.Array, rate: float, size: int) -> Drive:
        """Period at `frequency` [Hz] and `amplitude` [m], sampled at `rate` [Hz] or a little faster."""
        steps = jnp.ceil(rate / frequency).astype(jnp.int32)
        period = 1.0 / frequency
        times = jnp.arange(size) * (period / steps)
        angle = 2.0 * jnp.pi * jnp.arange(size) / steps
        signal = Signals(amplitude * jnp.sin(angle), amplitude * 2.0 * jnp.pi * frequency * jnp.cos(angle))
        return cls(times, steps + 1, courses({"drive": signal}, times), period)

    def at(self, step: jax.Array, time: jax.Array) -> dict[str, Any]:
        """Value and rate of the drive."""
        return inputs_at(self.inputs, self.times, step, time)


class SteadyState(NamedTuple):
    """Steady state a motion came to.

    Parameters
    ----------
    state, mode : pytrees
        Where it ended, at the beginning of a period.
    lowest, highest : (3,) in rad, N, N
        Extremes of angle and of both forces in the watched periods.
    first_lowest, first_highest : (3,) in rad, N, N
        The same, transient included.
    periods : () int
        Period of the motion, in periods of the drive; 0 where it is not periodic.
    multiplier : () a pure number
        Largest Floquet multiplier by its modulus; below 1 the motion is stable. NaN where it is not periodic.
    overturned : () bool
    trouble : () bool
        Whether the integrator had to give up on locating switches somewhere.
    time : () in s
        That was simulated until it had settled or was no longer waited for; less than a motion takes by itself, as
        Newton's method leads there.
    """

    state: Any
    mode: Any
    lowest: jax.Array
    highest: jax.Array
    first_lowest: jax.Array
    first_highest: jax.Array
    periods: jax.Array
    multiplier: jax.Array
    overturned: jax.Array
    trouble: jax.Array
    time: jax.Array


WAITING, CLOSING, DONE = range(3)


class _Motion(NamedTuple):
    """What is known of a motion so far; `recent` and `starts` hold its last periods, the latest in front.

    Waiting for it to settle; closing: the derivative of the motion over its last cycle is gathered; done.
    """

    state: Any
    mode: Any
    first: tuple[jax.Array, jax.Array]
    recent: tuple[jax.Array, jax.Array]
    starts: Any
    number: jax.Array
    tries: jax.Array
    stage: jax.Array
    periods: jax.Array
    remaining: jax.Array
    product: jax.Array
    trouble: jax.Array


@sequential_vmap
def steady_state(system: InvertedPendulum, drive: Drive, state: Any, mode: Any, patience: jax.Array) -> SteadyState:
    """Simulate until steady state, and find its extremes and Floquet multipliers.

    Once the motion hardly changes from period to period, the motion it tends to is found by Newton's method, whose
    matrix is that of Floquet; a motion that is not stable is not sought, only met.

    Parameters
    ----------
    system : InvertedPendulum
    drive : Drive
    state, mode : pytrees
        At the beginning of a period.
    patience : () in s
        Time for which it is waited at most.
    """
    size = ravel_pytree(state)[0].size
    far = jnp.full(len(CHANNELS), jnp.inf)
    rows = lambda leaf, number: jnp.broadcast_to(leaf, (number, *jnp.shape(leaf)))  # noqa: E731
    zero = jnp.int32(0)
    motion = _Motion(
        state=state,
        mode=mode,
        first=(far, -far),
        # A motion that is not periodic is evaluated over its last twelve periods.
        recent=(rows(far, 12), rows(-far, 12)),
        starts=jax.tree.map(lambda leaf: rows(leaf + jnp.inf, MOST_PERIODS), state),
        number=zero,
        tries=zero,
        stage=zero,
        periods=zero,
        remaining=zero,
        product=jnp.eye(size),
        trouble=jnp.array(False),
    )
    advance = partial(_advance, system, drive, patience)
    motion = jax.lax.while_loop(lambda motion: motion.stage != DONE, advance, motion)
    single = motion.periods == 1
    lowest, highest = (
        jnp.where(single, kept[0], best(kept, axis=0))
        for kept, best in zip(motion.recent, (jnp.min, jnp.max), strict=True)
    )
    largest = jnp.max(jnp.abs(_eigenvalues(motion.product)))
    return SteadyState(
        state=motion.state,
        mode=motion.mode,
        lowest=lowest,
        highest=highest,
        first_lowest=motion.first[0],
        first_highest=motion.first[1],
        periods=motion.periods,
        multiplier=jnp.where(motion.periods > 0, largest, jnp.nan),
        overturned=_overturned(*motion.first),
        trouble=motion.trouble,
        time=motion.number * drive.period,
    )


def _advance(system: InvertedPendulum, drive: Drive, patience: jax.Array, motion: _Motion) -> _Motion:
    """One period more."""
    start, mode = motion.state, motion.mode
    solution = _period(system, drive, start, mode)
    end, end_mode = _end(solution, drive)

    # Extremes of the readings, without the padding.
    steps = jnp.minimum(jnp.arange(drive.times.shape[0]), drive.times.shape[0] - 2)
    here = jax.vmap(drive.at)(steps, drive.times)
    readings = jax.vmap(lambda *point: INVERTED_PENDULUM.observe(system, *point))(solution.states, solution.modes, here)
    inside = jnp.arange(drive.times.shape[0]) < drive.count
    rows = jnp.stack([jnp.where(inside, readings[channel], readings[channel][0]) for channel in CHANNELS])
    lowest, highest = rows.min(axis=1), rows.max(axis=1)

    # Near a steady state, where the state changes by less than a thousandth of its size, Newton's method leads there;
    # the derivative of the state after a period by that before it is Floquet's matrix.
    change, waiting = _distance(end, start), motion.stage == WAITING
    settled = change < 1e-8
    near = waiting & (change < 1e-3) & (motion.tries < 12)

    def slope_of_period() -> jax.Array:
        flat, unravel = ravel_pytree(start)
        after = lambda flat: ravel_pytree(_end(_period(system, drive, unravel(flat), mode), drive)[0])[0]  # noqa: E731
        return jax.jacfwd(after)(flat)

    slope = jax.lax.cond(near | settled | ~waiting, slope_of_period, lambda: jnp.zeros_like(motion.product))
    # The state from which the motion would come back to itself, where that is stable and not far.
    (flat, unravel), target = ravel_pytree(start), ravel_pytree(end)[0]
    step = jnp.linalg.solve(jnp.eye(flat.size) - slope, target - flat)
    small = jnp.max(jnp.abs(step)) < 0.1 * jnp.max(jnp.abs(flat))
    goal, sound = unravel(flat + step), small & (jnp.max(jnp.abs(_eigenvalues(slope))) < 1.0)

    # The next stage, the periods of a cycle, and how many of them remain.
    first = jnp.minimum(motion.first[0], lowest), jnp.maximum(motion.first[1], highest)
    fallen = _overturned(*first)
    late = (motion.number + 1) * drive.period >= patience
    starts = jax.tree.map(lambda now, kept: jnp.concatenate([now[None], kept[:-1]]), motion.state, motion.starts)
    # A state that has come back to what it was within a ten-thousandth of its size.
    back = jax.vmap(lambda earlier: _distance(end, earlier))(starts) < 1e-4
    repeats = jnp.where(back.any(), jnp.argmax(back) + 1, 0)
    repeats = jnp.where(fallen | (motion.number < MOST_PERIODS), 0, repeats)
    periods = jnp.where(waiting, jnp.where(settled, 1, jnp.where(late, repeats, 0)), motion.periods)
    begins_cycle = waiting & late & ~settled & (periods > 0)
    remaining = jnp.where(begins_cycle, periods, motion.remaining - 1)
    over = jnp.where(waiting, settled | fallen | (late & (periods == 0)), remaining <= 0)
    stage = jnp.where(over, DONE, jnp.where(begins_cycle | ~waiting, CLOSING, WAITING))

    pushed = lambda kept, new: jnp.concatenate([new[None], kept[:-1]])  # noqa: E731
    closing, jumped = motion.stage == CLOSING, near & ~settled & sound
    at_start = drive.at(jnp.int32(0), drive.times[0])
    return _Motion(
        state=select(jumped, goal, end),
        mode=select(jumped, system.mode_of(goal, at_start), end_mode),
        first=first,
        recent=(pushed(motion.recent[0], lowest), pushed(motion.recent[1], highest)),
        starts=jax.tree.map(pushed, motion.starts, start),
        number=motion.number + 1,
        tries=motion.tries + near,
        stage=stage.astype(jnp.int32),
        periods=jnp.where(fallen, 0, periods).astype(jnp.int32),
        remaining=remaining.astype(jnp.int32),
        product=jnp.where(closing, slope @ motion.product, jnp.where(settled, slope, motion.product)),
        trouble=motion.trouble | solution.trouble,
    )


def _overturned(lowest: jax.Array, highest: jax.Array) -> jax.Array:
    """Whether the rod has hung rather than stood: a maximum |angle| of a right angle or more."""
    return jnp.maximum(-lowest[0], highest[0]) >= 0.5 * jnp.pi


def _period(system: InvertedPendulum, drive: Drive, state: Any, mode: Any) -> Any:
    return solve(system, Start(state, mode, drive.times[0]), Grid(drive.times, drive.count, drive.inputs))


def _end(solution: Any, drive: Drive) -> tuple[Any, Any]:
    return jax.tree.map(lambda rows: rows[drive.count - 1], (solution.states, solution.modes))


def _distance(one: Any, other: Any) -> jax.Array:
    """Difference of two states, as a share of their size."""
    first, second = (ravel_pytree(state)[0] for state in (one, other))
    return jnp.max(jnp.abs(first - second)) / (jnp.max(jnp.abs(first)) + 1e-12)


def _eigenvalues(matrix: jax.Array) -> jax.Array:
    """Of a 2 x 2 matrix in closed form, else by the library."""
    if matrix.shape[0] != 2:
        return jnp.linalg.eigvals(matrix)
    half, determinant = 0.5 * jnp.trace(matrix), matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    root = jnp.sqrt((half**2 - determinant).astype(complex))
    return jnp.stack([half + root, half - root])
