"""Integrator for systems that switch: taut and slack, stick and slip, hold and release.

Between switches a step of the grid is one Runge-Kutta step of a smooth system in a fixed mode. A step in which a
margin of the mode turns negative is taken apart: the instant is located, the arc ends there, the mode changes, and the
rest of the step follows in the new mode, as often as needed. Only those few steps pay for switching.

Derivatives are those of the true hybrid flow: the instant of a switch moves with the parameters, and the implicit
function theorem at the located margin carries this through (the "saltation" of the hybrid-systems literature). They
come from the stored states, all steps at once; what remains sequential is a linear recurrence.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple, Protocol

import jax
import jax.numpy as jnp
from jax.custom_batching import sequential_vmap
from jax.flatten_util import ravel_pytree

State = Any
Mode = tuple[jax.Array, ...]
ARCS = 512
SWITCHES_A_STEP = 24
"""More switches than this inside one step of the grid is chatter; the step is then finished as it is and flagged."""


class Signals(NamedTuple):
    """A measured input as a cubic between the points of the grid.

    Parameters
    ----------
    values : (n_time,) in SI units of the input
    slopes : (n_time,) its rate, per second
    """

    values: jax.Array
    slopes: jax.Array


class System(Protocol):
    """What the integrator needs to know of a mechanical system.

    A system is a pytree whose leaves are its parameter values; states are pytrees of scalars or arrays, a mode is a
    tuple of integer scalars, one for each switch.
    """

    def derivative(self, state: State, mode: Mode, inputs: Any) -> State:
        """Rate of the state while the mode lasts."""

    def margins(self, state: State, mode: Mode, inputs: Any) -> tuple[jax.Array, ...]:
        """One number for each switch, negative where its mode no longer holds."""

    def switch(self, state: State, mode: Mode, crossed: tuple[jax.Array, ...], inputs: Any) -> tuple[State, Mode]:
        """State and mode after the switches `crossed` have left their modes."""


class Solution(NamedTuple):
    """States at the points of the grid.

    Parameters
    ----------
    states : pytree of (n_time, ...)
    modes : tuple of (n_time,) int, mode that follows each point
    switches : () int, number of located switches
    trouble : () bool, whether a step chattered or the list of arcs overflowed
    """

    states: State
    modes: Mode
    switches: jax.Array
    trouble: jax.Array


class Arcs(NamedTuple):
    """Pieces of the steps that hold a switch: start, mode, end, and the switch that ended them (-1: the grid did)."""

    step: jax.Array
    start: jax.Array
    state: State
    mode: Mode
    end: jax.Array
    ended_by: jax.Array


def inputs_at(inputs: Any, times: jax.Array, step: jax.Array, time: jax.Array) -> Any:
    """Value and rate of each input at `time`, which lies in step `step` of the grid.

    Returns
    -------
    pytree like `inputs`, each `Signals` replaced by ``(value, rate)``.
    """
    length = times[step + 1] - times[step]
    s = (time - times[step]) / length

    def cubic(signal: Signals) -> tuple[jax.Array, jax.Array]:
        p0, p1 = signal.values[step], signal.values[step + 1]
        m0, m1 = signal.slopes[step] * length, signal.slopes[step + 1] * length
        c2, c3 = 3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1
        return p0 + s * (m0 + s * (c2 + s * c3)), (m0 + s * (2.0 * c2 + 3.0 * s * c3)) / length

    return jax.tree.map(cubic, inputs, is_leaf=lambda node: isinstance(node, Signals))


def _plus(state: State, factor: jax.Array, rate: State) -> State:
    return jax.tree.map(lambda y, d: y + factor * d, state, rate)


def runge_kutta(system: System, state: State, mode: Mode, span: Any, length: jax.Array) -> State:
    """Classical fourth-order step of `length` [s]; `span` gives the inputs at its start, middle and end."""
    first, middle, last = span
    d1 = system.derivative(state, mode, first)
    d2 = system.derivative(_plus(state, 0.5 * length, d1), mode, middle)
    d3 = system.derivative(_plus(state, 0.5 * length, d2), mode, middle)
    d4 = system.derivative(_plus(state, length, d3), mode, last)
    return jax.tree.map(lambda y, a, b, c, d: y + (length / 6.0) * (a + 2.0 * (b + c) + d), state, d1, d2, d3, d4)


def flow(system: System, state: State, mode: Mode, inputs: Any, times: jax.Array, arc: Any) -> State:
    """State after the arc ``(step, start, end)``: one smooth step inside one mode, within one step of the grid."""
    step, start, end = arc
    span = tuple(inputs_at(inputs, times, step, time) for time in (start, 0.5 * (start + end), end))
    return runge_kutta(system, state, mode, span, end - start)


def _worst(margins: tuple[jax.Array, ...]) -> jax.Array:
    worst = margins[0]
    for margin in margins[1:]:
        worst = jnp.minimum(worst, margin)
    return worst


def _select(condition: jax.Array, yes: Any, no: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.where(condition, a, b), yes, no)


def _put(store: Any, index: jax.Array, item: Any) -> Any:
    return jax.tree.map(lambda array, value: array.at[index].set(value, mode="drop"), store, item)


def _take(store: Any, index: Any) -> Any:
    return jax.tree.map(lambda array: array[index], store)


def _locate(margin_at: Any, start: jax.Array, end: jax.Array) -> jax.Array:
    """First instant, to rounding, at which the smallest margin is negative: false position with the Illinois rule.

    The end that is returned lies on the far side of the switch, so that the mode that follows finds itself valid.
    """

    def narrow(carry: Any) -> Any:
        low, high, at_low, at_high, count = carry
        ratio = at_low / (at_low - at_high)
        # Far from convergence the secant may stall at one end; every third step halves instead.
        ratio = jnp.where((count % 3 == 2) | ~jnp.isfinite(ratio), 0.5, ratio)
        middle = low + jnp.clip(ratio, 1e-3, 1.0 - 1e-3) * (high - low)
        value = margin_at(middle)
        inside = value >= 0.0
        return (
            jnp.where(inside, middle, low),
            jnp.where(inside, high, middle),
            jnp.where(inside, value, 0.5 * at_low),
            jnp.where(inside, 0.5 * at_high, value),
            count + 1,
        )

    def wide(carry: Any) -> jax.Array:
        low, high, _, _, count = carry
        return (high - low > 1e-15 + 4e-16 * jnp.abs(high)) & (count < 60)

    first = (start, end, margin_at(start), margin_at(end), 0)
    return jax.lax.while_loop(wide, narrow, first)[1]


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


def _plain_steps(system: System, inputs: Any, times: jax.Array, last: jax.Array, run: _Run) -> _Run:
    """Whole steps of the grid in one mode, up to the first whose end violates it."""

    def body(run: _Run) -> _Run:
        end = times[run.step + 1]
        trial = flow(system, run.state, run.mode, inputs, times, (run.step, run.time, end))
        at_end = inputs_at(inputs, times, run.step, end)
        going = _worst(system.margins(trial, run.mode, at_end)) >= 0.0
        state = _select(going, trial, run.state)
        step = run.step + going
        return run._replace(
            step=step,
            time=jnp.where(going, end, run.time),
            state=state,
            states=_put(run.states, step, state),
            modes=_put(run.modes, step, run.mode),
            going=going,
        )

    return jax.lax.while_loop(lambda run: (run.step < last) & run.going, body, run._replace(going=jnp.array(True)))


def _finish_step(system: System, inputs: Any, times: jax.Array, run: _Run) -> _Run:
    """The rest of the present step, arc by arc, through every switch it holds."""
    step, end = run.step, times[run.step + 1]

    def after(run: _Run, instant: jax.Array) -> State:
        return flow(system, run.state, run.mode, inputs, times, (step, run.time, instant))

    def arc(carry: tuple[_Run, jax.Array]) -> tuple[_Run, jax.Array]:
        run, count = carry

        def margin_at(instant: jax.Array) -> jax.Array:
            here = inputs_at(inputs, times, step, instant)
            return _worst(system.margins(after(run, instant), run.mode, here))

        patient = count < SWITCHES_A_STEP
        violated = (margin_at(end) < 0.0) & patient
        instant = jax.lax.cond(violated, lambda: _locate(margin_at, run.time, end), lambda: end)
        state = after(run, instant)
        here = inputs_at(inputs, times, step, instant)
        margins = system.margins(state, run.mode, here)
        crossed = tuple(violated & (margin < 0.0) for margin in margins)
        switched, mode = system.switch(state, run.mode, crossed, here)
        ended_by = jnp.where(violated, jnp.argmin(jnp.stack(margins)), -1).astype(jnp.int32)
        row = Arcs(step, run.time, run.state, run.mode, instant, ended_by)
        run = run._replace(
            time=instant,
            state=_select(violated, switched, state),
            mode=_select(violated, mode, run.mode),
            arcs=_put(run.arcs, run.n_arcs, row),
            n_arcs=run.n_arcs + 1,
            going=violated,
            trouble=run.trouble | ~patient,
        )
        return run, count + 1

    run, _ = jax.lax.while_loop(lambda carry: carry[0].going, arc, (run._replace(going=jnp.array(True)), 0))
    return run._replace(
        step=step + 1,
        time=end,
        states=_put(run.states, step + 1, run.state),
        modes=_put(run.modes, step + 1, run.mode),
    )


def _integrate(
    system: System, start: State, mode: Mode, start_time: jax.Array, times: jax.Array, count: jax.Array, inputs: Any
) -> tuple[Solution, Arcs, jax.Array]:
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
    solution = Solution(run.states, run.modes, switches, run.trouble | (run.n_arcs > ARCS))
    return solution, run.arcs, run.n_arcs


# Lanes of a batch switch at different instants; run in lock step each would wait for all others at every switch.
_integrate_lanes = sequential_vmap(_integrate)


def _arc_end(system: System, inputs: Any, times: jax.Array, arc: Arcs, state: State, start: jax.Array) -> Any:
    """End of an arc as a differentiable function of its start.

    An arc that the grid ends has a fixed end. One that a switch ends moves with the margin: the value of the
    correction is nil, its derivative is that of the root.
    """

    def at(instant: jax.Array) -> State:
        return flow(system, state, arc.mode, inputs, times, (arc.step, start, instant))

    def margin(system: System, inputs: Any, state: State, instant: jax.Array) -> jax.Array:
        here = inputs_at(inputs, times, arc.step, instant)
        return jnp.stack(system.margins(state, arc.mode, here))[arc.ended_by]

    reached = at(arc.end)
    rate = system.derivative(reached, arc.mode, inputs_at(inputs, times, arc.step, arc.end))
    fixed = jax.lax.stop_gradient((system, inputs, reached, rate))
    _, slope = jax.jvp(partial(margin, fixed[0], fixed[1]), (fixed[2], arc.end), (fixed[3], jnp.ones(())))
    value = margin(system, inputs, reached, arc.end)
    moves = (arc.ended_by >= 0) & (jnp.abs(slope) > 1e-12)
    shift = jnp.where(moves, -(value - jax.lax.stop_gradient(value)) / jnp.where(moves, slope, 1.0), 0.0)
    state = _plus(reached, shift, rate)
    crossed = tuple((arc.ended_by == i) for i in range(len(arc.mode)))
    here = inputs_at(inputs, times, arc.step, arc.end)
    switched, _ = system.switch(state, arc.mode, crossed, here)
    return _select(arc.ended_by >= 0, switched, state), arc.end + shift


class _Linear(NamedTuple):
    """One linear map ``d -> factor d + offset`` for each step or arc; `offset` is linear in the tangents given."""

    factor: jax.Array
    offset: jax.Array


def _apply(factor: jax.Array, vector: jax.Array) -> jax.Array:
    # A sum of products stays one fused kernel inside a loop, where a matrix product would be a call of its own.
    return jnp.sum(factor * vector[..., None, :], axis=-1)


def _linearise(function: Any, point: jax.Array, parameters: Any, tangents: Any) -> _Linear:
    factor = jax.jacfwd(lambda y: function(y, *parameters))(point)
    _, offset = jax.jvp(lambda *q: function(point, *q), parameters, tangents)
    return _Linear(factor, offset)


def _step_maps(system: System, times: jax.Array, inputs: Any, solution: Solution, tangents: Any) -> _Linear:
    """Linear maps of all steps of the grid, as if none held a switch."""
    flat = jax.vmap(lambda state: ravel_pytree(state)[0])(solution.states)
    unravel = ravel_pytree(_take(solution.states, 0))[1]

    def one(step: jax.Array, state: jax.Array, mode: Mode) -> _Linear:
        def move(state: jax.Array, system: System, inputs: Any) -> jax.Array:
            arc = (step, times[step], times[step + 1])
            return ravel_pytree(flow(system, unravel(state), mode, inputs, times, arc))[0]

        return _linearise(move, state, (system, inputs), tangents)

    steps = jnp.arange(times.shape[0] - 1)
    return jax.vmap(one)(steps, flat[:-1], _take(solution.modes, slice(None, -1)))


def _arc_maps(system: System, times: jax.Array, inputs: Any, arcs: Arcs, tangents: Any) -> _Linear:
    """Linear maps of the arcs, on states with the time of their end appended."""
    unravel = ravel_pytree(_take(arcs.state, 0))[1]

    def one(arc: Arcs) -> _Linear:
        def move(point: jax.Array, system: System, inputs: Any) -> jax.Array:
            state, end = _arc_end(system, inputs, times, arc, unravel(point[:-1]), point[-1])
            return jnp.append(ravel_pytree(state)[0], end)

        start = jnp.append(ravel_pytree(arc.state)[0], arc.start)
        return _linearise(move, start, (system, inputs), tangents)

    return jax.vmap(one)(arcs)


def _arcs_to_steps(arcs: Arcs, count: jax.Array, maps: _Linear, start: jax.Array) -> tuple[jax.Array, _Linear]:
    """Chain the arcs of each step into the map of that step.

    Returns the steps, ``(ARCS,)``, out of range where a row is not the end of a step, and their maps. The first step
    starts from `start`, the tangent of the initial state and time, which enters its offset.
    """
    size = start.shape[-1]

    def chain(carry: tuple[_Linear, jax.Array], row: Any) -> Any:
        whole, fresh = carry
        factor, offset, is_first, ended_by = row
        before = jnp.where(fresh, jnp.eye(size), whole.factor)
        ahead = jnp.where(is_first, start, jnp.where(fresh, 0.0, whole.offset))
        now = _Linear(jnp.sum(factor[:, :, None] * before[None], axis=1), _apply(factor, ahead) + offset)
        return (now, ended_by < 0), now

    rows = (maps.factor, maps.offset, jnp.arange(ARCS) == 0, arcs.ended_by)
    blank = _Linear(jnp.eye(size), jnp.zeros_like(start))
    _, chained = jax.lax.scan(chain, (blank, jnp.array(True)), rows)
    complete = (jnp.arange(ARCS) < count) & (arcs.ended_by < 0)
    steps = jnp.where(complete, arcs.step, jnp.iinfo(jnp.int32).max)
    return steps, _Linear(chained.factor[:, :-1, :-1], chained.offset[:, :-1])


@partial(jax.custom_jvp)
def solve(
    system: System, start: State, start_time: jax.Array, mode: Mode, times: jax.Array, count: jax.Array, inputs: Any
) -> Solution:
    """Integrate a switched system over a grid of instants.

    Parameters
    ----------
    system : System
        Pytree of parameter values.
    start : pytree
        State at `start_time`; it is held until then.
    start_time : () in s
        Not before ``times[0]``.
    mode : tuple of () int
        Mode at `start_time`.
    times : (n_time,) in s
        Increasing. A point is also a bound on the step: nothing finer than a few steps is resolved.
    count : () int
        Number of points that matter; the rest is padding and keeps the starting state.
    inputs : pytree of Signals
        Measured inputs, on the same points.

    Returns
    -------
    Solution
        Differentiable in `system`, `start`, `start_time` and `inputs`, forward and backward.
    """
    return _integrate_lanes(system, start, mode, start_time, times, count, inputs)[0]


@solve.defjvp
def _solve_jvp(primals: Any, tangents: Any) -> tuple[Solution, Solution]:
    system, start, start_time, mode, times, count, inputs = primals
    d_system, d_start, d_start_time, *_, d_inputs = tangents
    solution, arcs, n_arcs = _integrate_lanes(system, start, mode, start_time, times, count, inputs)

    d_first = ravel_pytree(d_start)[0]
    steps = _step_maps(system, times, inputs, solution, (d_system, d_inputs))
    maps = _arc_maps(system, times, inputs, arcs, (d_system, d_inputs))
    where, switched = _arcs_to_steps(arcs, n_arcs, maps, jnp.append(d_first, d_start_time))

    index = jnp.arange(times.shape[0] - 1)
    held = (index < arcs.step[0]) | (index >= count - 1)
    factor = jnp.where(held[:, None, None], jnp.eye(d_first.shape[0]), steps.factor)
    offset = jnp.where(held[:, None], 0.0, steps.offset)
    factor = factor.at[where].set(switched.factor, mode="drop")
    offset = offset.at[where].set(switched.offset, mode="drop")
    # The first step has the tangent of the start in its offset already.
    factor = factor.at[arcs.step[0]].set(0.0)

    def forward(d: jax.Array, step: _Linear) -> tuple[jax.Array, jax.Array]:
        d = _apply(step.factor, d) + step.offset
        return d, d

    _, rest = jax.lax.scan(forward, d_first, _Linear(factor, offset))
    d_states = jax.vmap(ravel_pytree(start)[1])(jnp.concatenate([d_first[None], rest]))
    blank = jax.tree.map(_no_tangent, solution)
    return solution, blank._replace(states=d_states)


def _no_tangent(value: jax.Array) -> Any:
    import numpy as np

    return np.zeros(value.shape, jax.dtypes.float0)
