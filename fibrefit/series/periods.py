"""A pendulum under a harmonic drive, period by period: its steady state, the extremes of it, and its stability."""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.custom_batching import sequential_vmap
from jax.flatten_util import ravel_pytree

from fibrefit.rigs.inverted_pendulum import INVERTED_PENDULUM, InvertedPendulum
from fibrefit.rigs.rig import Start
from fibrefit.simulation.inputs import Course, Signals, courses, inputs_at
from fibrefit.simulation.sensitivity import solve
from fibrefit.simulation.switched import Grid, select

WATCHED = 12
"""Periods over which a motion that is not periodic is evaluated."""
MOST_PERIODS = 4
"""Longest period of a motion that is called periodic, in periods of the drive."""
NEAR = 1e-3
"""Change of the state over a period, as a share of its size, below which Newton's method finds the steady state."""
FARTHEST = 0.1
"""Longest such Newton step, as a share of the size of the state."""
TRIES = 12
SETTLED = 1e-8
"""Change of the state over a period, as a share of its size, below which a motion has settled."""
SAME = 1e-4
"""Share of its size within which a state has come back to what it was."""
OVERTURNED = 0.5 * jnp.pi
"""Angle in rad beyond which the rod hangs rather than stands."""
CHANNELS = INVERTED_PENDULUM.channels


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


class _Course(NamedTuple):
    """What is known of a motion so far; `recent` and `begun` hold its last periods, the latest in front.

    Waiting for it to settle; closing: the derivative of the motion over its last cycle is gathered; done.
    """

    state: Any
    mode: Any
    first: tuple[jax.Array, jax.Array]
    recent: tuple[jax.Array, jax.Array]
    begun: Any
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
    course = _Course(
        state=state,
        mode=mode,
        first=(far, -far),
        recent=(rows(far, WATCHED), rows(-far, WATCHED)),
        begun=jax.tree.map(lambda leaf: rows(leaf + jnp.inf, MOST_PERIODS), state),
        number=zero,
        tries=zero,
        stage=zero,
        periods=zero,
        remaining=zero,
        product=jnp.eye(size),
        trouble=jnp.array(False),
    )
    advance = partial(_advance, system, drive, patience)
    course = jax.lax.while_loop(lambda course: course.stage != DONE, advance, course)
    single = course.periods == 1
    lowest, highest = (
        jnp.where(single, kept[0], best(kept, axis=0))
        for kept, best in zip(course.recent, (jnp.min, jnp.max), strict=True)
    )
    largest = jnp.max(jnp.abs(_eigenvalues(course.product)))
    return SteadyState(
        state=course.state,
        mode=course.mode,
        lowest=lowest,
        highest=highest,
        first_lowest=course.first[0],
        first_highest=course.first[1],
        periods=course.periods,
        multiplier=jnp.where(course.periods > 0, largest, jnp.nan),
        overturned=_max_angle(*course.first) >= OVERTURNED,
        trouble=course.trouble,
        time=course.number * drive.period,
    )


def _advance(system: InvertedPendulum, drive: Drive, patience: jax.Array, course: _Course) -> _Course:
    """One period more."""
    start, mode = course.state, course.mode
    solution = _period(system, drive, start, mode)
    end, end_mode = _end(solution, drive)
    extremes = _extremes(system, drive, solution)
    change, waiting = _distance(end, start), course.stage == WAITING
    settled = change < SETTLED
    near = waiting & (change < NEAR) & (course.tries < TRIES)
    slope = jax.lax.cond(
        near | settled | ~waiting,
        lambda: _slope(system, drive, start, mode),
        lambda: jnp.zeros_like(course.product),
    )
    goal, sound = _goal(start, end, slope)
    stage, periods, remaining = _stage(course, drive, patience, settled, extremes, end)
    pushed = lambda kept, new: jnp.concatenate([new[None], kept[:-1]])  # noqa: E731
    closing, jumped = course.stage == CLOSING, near & ~settled & sound
    at_start = drive.at(jnp.int32(0), drive.times[0])
    return _Course(
        state=select(jumped, goal, end),
        mode=select(jumped, system.mode_of(goal, at_start), end_mode),
        first=_wider(course.first, extremes),
        recent=(pushed(course.recent[0], extremes[0]), pushed(course.recent[1], extremes[1])),
        begun=jax.tree.map(pushed, course.begun, start),
        number=course.number + 1,
        tries=course.tries + near,
        stage=stage,
        periods=periods,
        remaining=remaining,
        product=jnp.where(closing, slope @ course.product, jnp.where(settled, slope, course.product)),
        trouble=course.trouble | solution.trouble,
    )


def _stage(
    course: _Course, drive: Drive, patience: jax.Array, settled: jax.Array, extremes: Any, end: Any
) -> tuple[jax.Array, jax.Array, jax.Array]:
    """The next stage, the periods of a cycle, and how many of them remain."""
    waiting = course.stage == WAITING
    fallen = _max_angle(*_wider(course.first, extremes)) >= OVERTURNED
    late = (course.number + 1) * drive.period >= patience
    repeats = jnp.where(fallen | (course.number < MOST_PERIODS), 0, _repeats(course, end))
    periods = jnp.where(waiting, jnp.where(settled, 1, jnp.where(late, repeats, 0)), course.periods)
    closing = waiting & late & ~settled & (periods > 0)
    remaining = jnp.where(closing, periods, course.remaining - 1)
    over = jnp.where(waiting, settled | fallen | (late & (periods == 0)), remaining <= 0)
    stage = jnp.where(over, DONE, jnp.where(closing | ~waiting, CLOSING, WAITING)).astype(jnp.int32)
    return stage, jnp.where(fallen, 0, periods).astype(jnp.int32), remaining.astype(jnp.int32)


def _goal(start: Any, end: Any, slope: jax.Array) -> tuple[Any, jax.Array]:
    """State from which the motion would come back to itself, and whether it is stable and not far."""
    (flat, unravel), target = ravel_pytree(start), ravel_pytree(end)[0]
    step = jnp.linalg.solve(jnp.eye(flat.size) - slope, target - flat)
    small = jnp.max(jnp.abs(step)) < FARTHEST * jnp.max(jnp.abs(flat))
    return unravel(flat + step), small & (jnp.max(jnp.abs(_eigenvalues(slope))) < 1.0)


def _wider(one: Any, other: Any) -> tuple[jax.Array, jax.Array]:
    return jnp.minimum(one[0], other[0]), jnp.maximum(one[1], other[1])


def _max_angle(lowest: jax.Array, highest: jax.Array) -> jax.Array:
    """Maximum |angle|, in rad."""
    return jnp.maximum(-lowest[0], highest[0])


def _period(system: InvertedPendulum, drive: Drive, state: Any, mode: Any) -> Any:
    return solve(system, Start(state, mode, drive.times[0]), Grid(drive.times, drive.count, drive.inputs))


def _end(solution: Any, drive: Drive) -> tuple[Any, Any]:
    return jax.tree.map(lambda rows: rows[drive.count - 1], (solution.states, solution.modes))


def _inside(values: jax.Array, drive: Drive) -> jax.Array:
    """Values without the padding."""
    return jnp.where(jnp.arange(values.shape[0]) < drive.count, values, values[0])


def _distance(one: Any, other: Any) -> jax.Array:
    """Difference of two states, as a share of their size."""
    first, second = (ravel_pytree(state)[0] for state in (one, other))
    return jnp.max(jnp.abs(first - second)) / (jnp.max(jnp.abs(first)) + 1e-12)


def _extremes(system: InvertedPendulum, drive: Drive, solution: Any) -> tuple[jax.Array, jax.Array]:
    steps = jnp.minimum(jnp.arange(drive.times.shape[0]), drive.times.shape[0] - 2)
    here = jax.vmap(drive.at)(steps, drive.times)
    readings = jax.vmap(lambda *point: INVERTED_PENDULUM.observe(system, *point))(solution.states, solution.modes, here)
    rows = jnp.stack([_inside(readings[channel], drive) for channel in CHANNELS])
    return rows.min(axis=1), rows.max(axis=1)


def _repeats(course: _Course, end: Any) -> jax.Array:
    """Number of periods after which the motion is what it was; 0 where there is none up to `MOST_PERIODS`."""
    begun = jax.tree.map(lambda now, kept: jnp.concatenate([now[None], kept[:-1]]), course.state, course.begun)
    back = jax.vmap(lambda earlier: _distance(end, earlier))(begun) < SAME
    return jnp.where(back.any(), jnp.argmax(back) + 1, 0)


def _slope(system: InvertedPendulum, drive: Drive, state: Any, mode: Any) -> jax.Array:
    """Derivative of the state after a period by that before it."""
    flat, unravel = ravel_pytree(state)

    def after(flat: jax.Array) -> jax.Array:
        return ravel_pytree(_end(_period(system, drive, unravel(flat), mode), drive)[0])[0]

    return jax.jacfwd(after)(flat)


def _eigenvalues(matrix: jax.Array) -> jax.Array:
    """Of a 2 x 2 matrix in closed form, else by the library."""
    if matrix.shape[0] != 2:
        return jnp.linalg.eigvals(matrix)
    half, determinant = 0.5 * jnp.trace(matrix), matrix[0, 0] * matrix[1, 1] - matrix[0, 1] * matrix[1, 0]
    root = jnp.sqrt((half**2 - determinant).astype(complex))
    return jnp.stack([half + root, half - root])
