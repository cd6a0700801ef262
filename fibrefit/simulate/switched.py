"""Integrator for systems that switch: taut and slack, stick and slip, hold and release.

Between switches a step of the grid is one Runge-Kutta step of a smooth system in a fixed mode. A step in which a
margin of the mode turns negative is taken apart: the instant is located, the arc ends there, the mode changes, and the
rest of the step follows in the new mode, as often as needed. Only those few steps pay for switching.
"""

from __future__ import annotations

import functools
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
from jax.custom_batching import sequential_vmap

from fibrefit.simulate.inputs import Course, inputs_at, row
from fibrefit.simulate.inputs import Signals as Signals
from fibrefit.simulate.steps import Mode, State, System, flow

Inputs = dict[str, Course]
ARCS = 512
SWITCHES_A_STEP = 24
"""More switches than this inside one step of the grid is chatter; the step is then finished as it is and flagged."""


class Arcs(NamedTuple):
    """Pieces of the steps that hold a switch, in the order of time.

    Parameters
    ----------
    step : (ARCS,) int, step of the grid
    start, end : (ARCS,) in s
    state : pytree of (ARCS, ...), state at the start
    mode : pytree of (ARCS,) int, mode while the arc lasts
    reached : pytree of (ARCS, ...), state at the end, before the switch
    ended_by : (ARCS,) int, the switch that ended the arc; -1 where the grid did
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
    arcs : Arcs
    n_arcs : () int, rows of `arcs` that are filled
    """

    states: State
    modes: Mode
    switches: jax.Array
    trouble: jax.Array
    arcs: Arcs
    n_arcs: jax.Array


def _worst(margins: Mode) -> jax.Array:
    return functools.reduce(jnp.minimum, jax.tree.leaves(margins))


def select(condition: jax.Array, yes: Any, no: Any) -> Any:
    """One of two pytrees."""
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def put(store: Any, index: jax.Array, item: Any) -> Any:
    """Pytree of arrays with the row `index` replaced; nothing happens outside the range."""
    return jax.tree.map(lambda array, value: array.at[index].set(value, mode="drop"), store, item)


def take(store: Any, index: Any) -> Any:
    """Rows of a pytree of arrays."""
    return jax.tree.map(lambda array: array[index], store)


class _Run(NamedTuple):
    """Everything the loops carry."""

    step: jax.Array
    time: jax.Array
    state: State
    mode: Mode
    states: State
    modes: Mode
    arcs: Arcs
    n_arcs: jax.Array
    going: jax.Array
    trouble: jax.Array


def _plain_steps(system: System, inputs: Inputs, times: jax.Array, last: jax.Array, run: _Run) -> _Run:
    """Whole steps of the grid in one mode, up to the first whose end violates it."""

    def body(run: _Run) -> _Run:
        end = row(times, run.step + 1)
        trial = flow(system, run.state, run.mode, inputs, times, (run.step, run.time, end))
        at_end = inputs_at(inputs, times, run.step, end)
        going = _worst(system.margins(trial, run.mode, at_end)) >= 0.0
        state = select(going, trial, run.state)
        step = run.step + going
        return run._replace(
            step=step,
            time=jnp.where(going, end, run.time),
            state=state,
            states=put(run.states, step, state),
            modes=put(run.modes, step, run.mode),
            going=going,
        )

    return jax.lax.while_loop(lambda run: (run.step < last) & run.going, body, run._replace(going=jnp.array(True)))


class _Search(NamedTuple):
    """Where the next switch lies: the mode holds at `low` and does not at `high`, with the state there.

    While nothing is known of a switch, `on` is False and `high` is the end of the step.
    """

    on: jax.Array
    low: jax.Array
    high: jax.Array
    at_low: jax.Array
    at_high: jax.Array
    state: State
    margins: Mode
    tries: jax.Array


def _next_trial(search: _Search, end: jax.Array) -> jax.Array:
    """Instant to try: the end of the step, then false position with the Illinois rule."""
    ratio = search.at_low / (search.at_low - search.at_high)
    # Far from convergence the secant may stall at one end; every third step halves instead.
    ratio = jnp.where((search.tries % 3 == 2) | ~jnp.isfinite(ratio), 0.5, ratio)
    middle = search.low + jnp.clip(ratio, 1e-3, 1.0 - 1e-3) * (search.high - search.low)
    return jnp.where(search.on, middle, end)


def _narrow(search: _Search, start: jax.Array, time: jax.Array, state: State, margins: Mode) -> _Search:
    """Search after a trial at `time`; `start` is that of the arc."""
    value = _worst(margins)
    inside, on = value >= 0.0, search.on
    return _Search(
        on | ~inside,
        jnp.where(on & inside, time, jnp.where(on, search.low, start)),
        jnp.where(inside, search.high, time),
        jnp.where(on & inside, value, jnp.where(on, 0.5 * search.at_low, -value)),
        jnp.where(inside, 0.5 * search.at_high, value),
        select(on & inside, search.state, state),
        select(on & inside, search.margins, margins),
        search.tries + on,
    )


def _narrow_enough(search: _Search) -> jax.Array:
    close = search.high - search.low <= 1e-15 + 4e-16 * jnp.abs(search.high)
    return ~search.on | close | (search.tries >= 60)


def _finish_step(system: System, inputs: Inputs, times: jax.Array, run: _Run) -> _Run:
    """The rest of the present step, arc by arc, through every switch it holds; one trial at a time.

    The end of an arc lies on the far side of its switch, so that the mode that follows finds itself valid.
    """
    step, end = run.step, row(times, run.step + 1)

    def blank(run: _Run) -> _Search:
        high = jnp.asarray(end)
        margins = jax.tree.map(lambda _: jnp.zeros(()), run.mode)
        return _Search(jnp.array(False), run.time, high, high, high, run.state, margins, jnp.int32(0))

    def body(carry: tuple[_Run, _Search, jax.Array]) -> tuple[_Run, _Search, jax.Array]:
        run, search, switches = carry
        time = _next_trial(search, end)
        state = flow(system, run.state, run.mode, inputs, times, (step, run.time, time))
        margins = system.margins(state, run.mode, inputs_at(inputs, times, step, time))
        patient = switches < SWITCHES_A_STEP
        found = _narrow(search, run.time, time, state, margins)
        # Out of patience, the step is finished in one piece, as it is.
        found = found._replace(on=found.on & patient, high=jnp.where(patient, found.high, end))
        ready = _narrow_enough(found)

        here = inputs_at(inputs, times, step, found.high)
        crossed = jax.tree.map(lambda margin: found.on & (margin < 0.0), found.margins)
        switched, mode = system.switch(found.state, run.mode, crossed, here)
        ended_by = jnp.where(found.on, jnp.argmin(jnp.stack(jax.tree.leaves(found.margins))), -1).astype(jnp.int32)
        row = Arcs(step, run.time, run.state, run.mode, found.high, found.state, ended_by)
        run = run._replace(
            time=jnp.where(ready, found.high, run.time),
            state=select(ready, select(found.on, switched, found.state), run.state),
            mode=select(ready & found.on, mode, run.mode),
            arcs=put(run.arcs, jnp.where(ready, run.n_arcs, ARCS), row),
            n_arcs=run.n_arcs + ready,
            going=~ready | found.on,
            trouble=run.trouble | ~patient,
        )
        return run, select(ready, blank(run), found), switches + ready

    start = (run._replace(going=jnp.array(True)), blank(run), jnp.int32(0))
    run = jax.lax.while_loop(lambda carry: carry[0].going, body, start)[0]
    return run._replace(
        step=step + 1,
        time=end,
        states=put(run.states, step + 1, run.state),
        modes=put(run.modes, step + 1, run.mode),
    )


def _integrate(
    system: System, start: State, mode: Mode, start_time: jax.Array, times: jax.Array, count: jax.Array, inputs: Inputs
) -> Solution:
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
        trouble=jnp.array(False),
    )
    last = (count - 1).astype(jnp.int32)

    def stretch(run: _Run) -> _Run:
        run = _finish_step(system, inputs, times, run)
        return _plain_steps(system, inputs, times, last, run)

    run = jax.lax.while_loop(lambda run: run.step < last, stretch, run)
    valid = jnp.arange(ARCS) < run.n_arcs
    switches = jnp.sum(valid & (run.arcs.ended_by >= 0))
    return Solution(run.states, run.modes, switches, run.trouble | (run.n_arcs > ARCS), run.arcs, run.n_arcs)


# Lanes of a batch switch at different instants; run in lock step each would wait for all others at every switch.
integrate = sequential_vmap(_integrate)
