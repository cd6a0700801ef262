"""Integrator for systems that switch: taut and slack, stick and slip, hold and release.

Between switches a step of the grid is one Runge-Kutta step of a smooth system in a fixed mode. A step in which a
margin of the mode turns negative is taken apart: the instant is located, the arc ends there, the mode changes, and the
rest of the step follows in the new mode, as often as needed. Only those few steps pay for switching.
"""

from __future__ import annotations

import functools
import operator
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.custom_batching import sequential_vmap

from fibrefit.rigs.rig import Start
from fibrefit.simulation.inputs import Course, inputs_at, row
from fibrefit.simulation.steps import Mode, State, System, flow

Inputs = dict[str, Course]
ARCS = 768
"""Arcs there is room for; a motion that needs more is reported as trouble."""
SWITCHES_A_STEP = 24
"""More switches than this inside one step of the grid is chatter; the step is then finished as it is and flagged."""
USUAL_TRIES, MOST_TRIES = 8, 100
BEYOND = 1e-3
"""Share of the distance to a located switch by which the next trial goes beyond it."""
FIRST_REACH, GROWTH = 1.0 / 64.0, 4.0
"""Share of a step that an arc after a switch is long where the system is stiff, and by how much the next ones grow.

A whole step of the L-stable method leaves up to a sixth of what ought to die out within it, arcs that grow a hundredth.
"""
MOST_CALMED = 512
"""Arcs from which on a switch is followed by whole steps, so that a motion of very many switches is followed at all."""
LEAST_SHARE = 0.1
"""Least margin at the start of a search, as a share of the violation at its end."""


class Grid(NamedTuple):
    """Instants at which a motion is evaluated, and what drives it.

    Parameters
    ----------
    times : (n_time,) in s
        Increasing. A point is also a bound on the step: nothing finer than a few steps is resolved.
    count : () int
        Number of points that matter; the rest is padding and keeps the starting state.
    inputs : dict of Course
        Measured inputs, between the same points.
    """

    times: jax.Array
    count: jax.Array  # type: ignore[assignment]
    inputs: Inputs


class Arcs(NamedTuple):
    """Pieces of the steps that hold a switch, in the order of time.

    Parameters
    ----------
    step : (ARCS,) int, step of the grid
    start, end : (ARCS,) in s
    state : pytree of (ARCS, ...), state at the start
    mode : pytree of (ARCS,) int, mode while the arc lasts
    reached : pytree of (ARCS, ...), state at the end, before the switch
    ended_by : (ARCS,) int, the switch that ended the arc; -1 where none did: the grid, or a stiff system that calms
    """

    step: jax.Array
    start: jax.Array
    state: State
    mode: Mode
    end: jax.Array
    reached: State
    ended_by: jax.Array


class Solution(NamedTuple):
    """The motion: states at the points of the grid, and what happened between them.

    Parameters
    ----------
    states : pytree of (n_time, ...)
    modes : pytree of (n_time,) int, mode that follows each point
    switches : () int, number of located switches
    trouble : () bool, whether a step chattered or the list of arcs overflowed
    rest : () int, point from which the state stays as it is; the last one where it never rests
    n_arcs : () int, rows of `arcs` that are filled
    """

    states: State
    modes: Mode
    switches: jax.Array
    trouble: jax.Array
    rest: jax.Array
    arcs: Arcs
    n_arcs: jax.Array


def _worst(margins: Mode) -> jax.Array:
    return functools.reduce(jnp.minimum, jax.tree.leaves(margins))


def select(condition: jax.Array, yes: Any, no: Any) -> Any:
    """One of two pytrees."""
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def write(store: Any, index: jax.Array, item: Any) -> Any:
    """Pytree of arrays with the row `index` replaced, which is known to be inside the range."""

    def put_in(array: jax.Array, value: Any) -> jax.Array:
        return jax.lax.dynamic_update_index_in_dim(array, value, index, 0, allow_negative_indices=False)

    return jax.tree.map(put_in, store, item)


def take(store: Any, index: Any) -> Any:
    """Rows of a pytree of arrays."""
    return jax.tree.map(lambda array: array[index], store)


class _Run(NamedTuple):
    """Everything the outer loops carry; `still` when nothing will move any more.

    An arc is no longer than `reach` [s], which matters after the switches of a stiff system.
    """

    step: jax.Array
    time: jax.Array
    state: State
    mode: Mode
    states: State
    modes: Mode
    arcs: Arcs
    n_arcs: jax.Array
    going: jax.Array
    still: jax.Array
    trouble: jax.Array
    reach: jax.Array


class _Plain(NamedTuple):
    """What whole steps carry: the state at `step`, the one before it, and whether the mode held up to there."""

    step: jax.Array
    state: State
    before: State
    going: jax.Array
    still: jax.Array
    states: State
    modes: Mode


def _plain_steps(system: System, inputs: Inputs, times: jax.Array, last: jax.Array, run: _Run) -> _Run:
    """Whole steps of the grid in one mode, up to the first whose end violates it, or to rest."""

    def body(plain: _Plain) -> _Plain:
        step, state = plain.step, plain.state
        start, end = row(times, step), row(times, step + 1)
        trial = flow(system, state, run.mode, inputs, times, (step, start, end))
        going = _worst(system.margins(trial, run.mode, inputs_at(inputs, times, step, end))) >= 0.0
        # Taken on trial: a step that has to be taken back is rare, and the next need not wait for its margins.
        return _Plain(
            step + 1,
            trial,
            state,
            going,
            jnp.array(False) if inputs else jax.tree.reduce(jnp.logical_and, jax.tree.map(operator.eq, state, trial)),
            write(plain.states, step + 1, trial),
            write(plain.modes, step + 1, run.mode),
        )

    def on(plain: _Plain) -> jax.Array:
        return (plain.step < last) & plain.going & ~plain.still

    # What a switch has stirred up in a stiff system is followed until it is calm.
    calm = run.reach >= row(times, run.step + 1) - run.time
    until, no = jnp.where(calm, last, run.step), jnp.array(False)
    last = last if system.stiff() is None else until
    end = jax.lax.while_loop(
        on, body, _Plain(run.step, run.state, run.state, jnp.array(True), no, run.states, run.modes)
    )
    return run._replace(
        step=jnp.where(end.going, end.step, end.step - 1),
        time=row(times, jnp.where(end.going, end.step, end.step - 1)),
        state=select(end.going, end.state, end.before),
        states=end.states,
        modes=end.modes,
        still=end.going & end.still,
    )


class _Search(NamedTuple):
    """Where the next switch lies: the mode holds at `low` and does not at `high`, with state and margins there.

    `third` is the end that was given up last. The first of the `tries` is the end of the step.
    """

    low: jax.Array
    high: jax.Array
    third: jax.Array
    at_low: jax.Array
    at_high: jax.Array
    at_third: jax.Array
    state: State
    margins: Mode
    tries: jax.Array


def _next_trial(search: _Search) -> jax.Array:
    """Instant to try: inverse quadratic interpolation, a little beyond the root it sees, so that both ends close in."""
    low, high, at_low, at_high = search.low, search.high, search.at_low, search.at_high
    least = 0.25 * _resolution(high)
    slope = (high - low) / (at_high - at_low)
    bend = ((search.third - high) / (search.at_third - at_high) - slope) / (search.at_third - at_low)
    secant = low - at_low * slope
    root = secant + at_low * at_high * bend
    root = jnp.where((root > low) & (root < high), root, secant)
    far, near = root - low, high - root
    root = jnp.where(far < near, root + jnp.maximum(BEYOND * far, least), root - jnp.maximum(BEYOND * near, least))
    root = jnp.clip(root, low + least, high - least)
    # A margin that bends too sharply for that is found by halves.
    halve = ((search.tries > USUAL_TRIES) & (search.tries % 2 == 0)) | ~jnp.isfinite(root)
    return jnp.where(halve, 0.5 * (low + high), root)


def _resolution(instant: jax.Array) -> jax.Array:
    return 1e-15 + 4e-16 * jnp.abs(instant)


def _locate(system: System, inputs: Inputs, times: jax.Array, run: _Run, end: jax.Array, patient: jax.Array) -> _Search:
    """The first switch between now and the `end` of the step, or that end; without patience that end in any case."""

    def wide(search: _Search) -> jax.Array:
        apart = search.high - search.low > _resolution(search.high)
        violated = patient & (search.at_high < 0.0)
        return (search.tries == 0) | (violated & apart & (search.tries <= MOST_TRIES))

    def narrow(search: _Search) -> _Search:
        time = jnp.where(search.tries == 0, end, _next_trial(search))
        state = flow(system, run.state, run.mode, inputs, times, (run.step, run.time, time))
        margins = system.margins(state, run.mode, inputs_at(inputs, times, run.step, time))
        value = _worst(margins)
        first, inside = search.tries == 0, value >= 0.0
        outside = first | ~inside
        # Just after a switch the margin is zero and says nothing of where it will be again.
        at_low = jnp.where(first, jnp.maximum(search.at_low, -LEAST_SHARE * value), search.at_low)
        return _Search(
            jnp.where(outside, search.low, time),
            jnp.where(outside, time, search.high),
            jnp.where(outside, search.high, search.low),
            jnp.where(outside, at_low, value),
            jnp.where(outside, value, search.at_high),
            # Where there is no third yet, the secant is left.
            jnp.where(first, jnp.nan, jnp.where(inside, search.at_low, search.at_high)),
            select(outside, state, search.state),
            select(outside, margins, search.margins),
            search.tries + 1,
        )

    margins = system.margins(run.state, run.mode, inputs_at(inputs, times, run.step, run.time))
    now, zero = run.time, jnp.zeros(())
    return jax.lax.while_loop(
        wide, narrow, _Search(now, end, now, _worst(margins), zero, zero, run.state, margins, jnp.int32(0))
    )


def _finish_step(system: System, inputs: Inputs, times: jax.Array, run: _Run) -> _Run:
    """The rest of the present step, arc by arc, through every switch it holds.

    The end of an arc lies on the far side of its switch, so that the mode that follows finds itself valid.
    """
    step, end = run.step, row(times, run.step + 1)
    fast = system.stiff()

    def arc(carry: tuple[_Run, jax.Array]) -> tuple[_Run, jax.Array]:
        run, switches = carry
        patient = switches < SWITCHES_A_STEP
        aim = end
        if fast is not None:
            aim = jnp.where(fast & patient & (run.time + 2.0 * run.reach < end), run.time + run.reach, end)
        found = _locate(system, inputs, times, run, aim, patient)
        on = patient & (_worst(found.margins) < 0.0)
        first = jnp.where(run.n_arcs < MOST_CALMED, FIRST_REACH * (end - row(times, step)), jnp.inf)
        here = inputs_at(inputs, times, step, found.high)
        crossed = jax.tree.map(lambda margin: on & (margin < 0.0), found.margins)
        switched, mode = system.switch(found.state, run.mode, crossed, here)
        ended_by = jnp.where(on, jnp.argmin(jnp.stack(jax.tree.leaves(found.margins))), -1).astype(jnp.int32)
        done = Arcs(step, run.time, run.state, run.mode, found.high, found.state, ended_by)
        # Nothing is written beyond the end of the list.
        at = lambda rows, value, index=run.n_arcs: rows.at[index].set(value, mode="drop")  # noqa: E731
        run = run._replace(
            time=found.high,
            state=select(on, switched, found.state),
            mode=select(on, mode, run.mode),
            arcs=jax.tree.map(at, run.arcs, done),
            n_arcs=run.n_arcs + 1,
            going=on | (found.high < end),
            trouble=run.trouble | ~patient,
            reach=jnp.where(on, first, jnp.where(2.0 * (found.high - run.time) < run.reach, 1.0, GROWTH) * run.reach),
        )
        return run, switches + on

    start = (run._replace(going=jnp.array(True)), jnp.int32(0))
    run = jax.lax.while_loop(lambda carry: carry[0].going, arc, start)[0]
    return run._replace(
        step=step + 1,
        time=end,
        states=write(run.states, step + 1, run.state),
        modes=write(run.modes, step + 1, run.mode),
    )


def _integrate(system: System, begin: Start, grid: Grid) -> Solution:
    (start, mode, start_time), (times, count, inputs) = begin, grid
    assert start_time is not None
    n_time = times.shape[0]
    step = jnp.clip(jnp.searchsorted(times, start_time, side="right") - 1, 0, n_time - 2).astype(jnp.int32)
    rows = lambda size: lambda value: jnp.broadcast_to(value, (size, *jnp.shape(value)))  # noqa: E731
    arcs = Arcs(step, start_time, start, mode, start_time, start, jnp.int32(-1))
    run = _Run(
        step=step,
        time=start_time,
        state=start,
        mode=mode,
        states=jax.tree.map(rows(n_time), start),
        modes=jax.tree.map(rows(n_time), mode),
        arcs=jax.tree.map(rows(ARCS), arcs),
        n_arcs=jnp.int32(0),
        going=jnp.array(True),
        still=jnp.array(False),
        trouble=jnp.array(False),
        reach=jnp.array(jnp.inf),
    )
    last = (count - 1).astype(jnp.int32)

    def stretch(run: _Run) -> _Run:
        run = _finish_step(system, inputs, times, run)
        return _plain_steps(system, inputs, times, last, run)

    run = jax.lax.while_loop(lambda run: (run.step < last) & ~run.still, stretch, run)
    index = jnp.arange(n_time)
    resting = run.still & (index > run.step) & (index <= last)
    states, modes = select(resting, (run.state, run.mode), (run.states, run.modes))
    valid = jnp.arange(ARCS) < run.n_arcs
    switches = jnp.sum(valid & (run.arcs.ended_by >= 0))
    trouble = run.trouble | (run.n_arcs > ARCS)
    rest = jnp.where(run.still, run.step - 1, last)
    return Solution(states, modes, switches, trouble, rest, run.arcs, run.n_arcs)


# Runs of a batch switch at different instants; in lock step each would wait for all others at every switch.
integrate = sequential_vmap(_integrate)
