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

from fibrefit.simulate.inputs import Signals, inputs_at
from fibrefit.simulate.steps import Mode, State, System, flow

Inputs = dict[str, Signals]
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
    ended_by : (ARCS,) int, the switch that ended the arc; -1 where the grid did
    """

    step: jax.Array
    start: jax.Array
    state: State
    mode: Mode
    end: jax.Array
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


class _Bracket(NamedTuple):
    """Where a switch lies: a margin that holds at `low`, and does not at `high`, with the state there."""

    low: jax.Array
    high: jax.Array
    at_low: jax.Array
    at_high: jax.Array
    state: State
    tries: jax.Array


def _locate(trial: Any, bracket: _Bracket) -> _Bracket:
    """Narrow a bracket to rounding: false position with the Illinois rule.

    ``trial(time)`` gives the state and the smallest margin there. The end that counts lies on the far side of the
    switch, so that the mode that follows finds itself valid.
    """

    def narrow(b: _Bracket) -> _Bracket:
        ratio = b.at_low / (b.at_low - b.at_high)
        # Far from convergence the secant may stall at one end; every third step halves instead.
        ratio = jnp.where((b.tries % 3 == 2) | ~jnp.isfinite(ratio), 0.5, ratio)
        middle = b.low + jnp.clip(ratio, 1e-3, 1.0 - 1e-3) * (b.high - b.low)
        state, value = trial(middle)
        inside = value >= 0.0
        return _Bracket(
            jnp.where(inside, middle, b.low),
            jnp.where(inside, b.high, middle),
            jnp.where(inside, value, 0.5 * b.at_low),
            jnp.where(inside, 0.5 * b.at_high, value),
            select(inside, b.state, state),
            b.tries + 1,
        )

    def wide(b: _Bracket) -> jax.Array:
        return (b.at_high < 0.0) & (b.high - b.low > 1e-15 + 4e-16 * jnp.abs(b.high)) & (b.tries < 60)

    return jax.lax.while_loop(wide, narrow, bracket)


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
        end = times[run.step + 1]
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


def _finish_step(system: System, inputs: Inputs, times: jax.Array, run: _Run) -> _Run:
    """The rest of the present step, arc by arc, through every switch it holds."""
    step, end = run.step, times[run.step + 1]

    def arc(carry: tuple[_Run, jax.Array]) -> tuple[_Run, jax.Array]:
        run, count = carry

        def worst(state: State, time: jax.Array) -> jax.Array:
            return _worst(system.margins(state, run.mode, inputs_at(inputs, times, step, time)))

        def trial(time: jax.Array) -> tuple[State, jax.Array]:
            state = flow(system, run.state, run.mode, inputs, times, (step, run.time, time))
            return state, worst(state, time)

        state, at_end = trial(end)
        patient = count < SWITCHES_A_STEP
        violated = (at_end < 0.0) & patient
        at_end = jnp.where(violated, at_end, 0.0)
        found = _locate(trial, _Bracket(run.time, end, worst(run.state, run.time), at_end, state, jnp.int32(0)))
        instant, state = found.high, found.state
        here = inputs_at(inputs, times, step, instant)
        margins = system.margins(state, run.mode, here)
        crossed = jax.tree.map(lambda margin: violated & (margin < 0.0), margins)
        switched, mode = system.switch(state, run.mode, crossed, here)
        ended_by = jnp.where(violated, jnp.argmin(jnp.stack(jax.tree.leaves(margins))), -1).astype(jnp.int32)
        row = Arcs(step, run.time, run.state, run.mode, instant, ended_by)
        run = run._replace(
            time=instant,
            state=select(violated, switched, state),
            mode=select(violated, mode, run.mode),
            arcs=put(run.arcs, run.n_arcs, row),
            n_arcs=run.n_arcs + 1,
            going=violated,
            trouble=run.trouble | ~patient,
        )
        return run, count + 1

    run, _ = jax.lax.while_loop(lambda carry: carry[0].going, arc, (run._replace(going=jnp.array(True)), jnp.int32(0)))
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
    arcs = Arcs(step, start_time, start, mode, start_time, jnp.int32(-1))
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
