"""Derivatives of the switched integrator.

They are those of the true hybrid flow: the instant of a switch moves with the parameters, and the implicit function
theorem at the located margin carries this through (the "saltation" of the hybrid-systems literature). They come from
the stored states, all steps at once; what remains sequential is a linear recurrence.
"""

from __future__ import annotations

from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from fibrefit.simulate.inputs import inputs_at
from fibrefit.simulate.steps import Mode, State, System, flow, plus
from fibrefit.simulate.switched import ARCS, Arcs, Inputs, Solution, integrate, select, take


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
    state = plus(reached, shift, rate)
    crossed = tuple((arc.ended_by == i) for i in range(len(arc.mode)))
    here = inputs_at(inputs, times, arc.step, arc.end)
    switched, _ = system.switch(state, arc.mode, crossed, here)
    return select(arc.ended_by >= 0, switched, state), arc.end + shift


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
    unravel = ravel_pytree(take(solution.states, 0))[1]

    def one(step: jax.Array, state: jax.Array, mode: Mode) -> _Linear:
        def move(state: jax.Array, system: System, inputs: Any) -> jax.Array:
            arc = (step, times[step], times[step + 1])
            return ravel_pytree(flow(system, unravel(state), mode, inputs, times, arc))[0]

        return _linearise(move, state, (system, inputs), tangents)

    steps = jnp.arange(times.shape[0] - 1)
    return jax.vmap(one)(steps, flat[:-1], take(solution.modes, slice(None, -1)))


def _arc_maps(system: System, times: jax.Array, inputs: Any, arcs: Arcs, tangents: Any) -> _Linear:
    """Linear maps of the arcs, on states with the time of their end appended."""
    unravel = ravel_pytree(take(arcs.state, 0))[1]

    def one(arc: Arcs) -> _Linear:
        def move(point: jax.Array, system: System, inputs: Any) -> jax.Array:
            state, end = _arc_end(system, inputs, times, arc, unravel(point[:-1]), point[-1])
            return jnp.append(ravel_pytree(state)[0], end)

        start = jnp.append(ravel_pytree(arc.state)[0], arc.start)
        return _linearise(move, start, (system, inputs), tangents)

    return jax.vmap(one)(arcs)


def _chain(arcs: Arcs, maps: _Linear, start: jax.Array) -> tuple[_Linear, _Linear]:
    """Maps from the beginning of a step to the start and to the end of each arc in it, on states with time appended.

    The first step starts from `start`, the tangent of the initial state and time, which enters its offset.
    """
    size = start.shape[-1]

    def chain(carry: tuple[_Linear, jax.Array], row: Any) -> Any:
        whole, fresh = carry
        factor, offset, is_first, ended_by = row
        factor_before = jnp.where(fresh, jnp.eye(size), whole.factor)
        offset_before = jnp.where(is_first, start, jnp.where(fresh, 0.0, whole.offset))
        now = _Linear(jnp.sum(factor[:, :, None] * factor_before[None], axis=1), _apply(factor, offset_before) + offset)
        return (now, ended_by < 0), (_Linear(factor_before, offset_before), now)

    rows = (maps.factor, maps.offset, jnp.arange(ARCS) == 0, arcs.ended_by)
    blank = _Linear(jnp.eye(size), jnp.zeros_like(start))
    return jax.lax.scan(chain, (blank, jnp.array(True)), rows)[1]


def _grid_maps(solution: Solution, steps: _Linear, ends: _Linear, count: jax.Array) -> _Linear:
    """Maps of all steps of the grid, those that hold a switch replaced by the chain of their arcs."""
    arcs = solution.arcs
    complete = (jnp.arange(ARCS) < solution.n_arcs) & (arcs.ended_by < 0)
    index = jnp.arange(steps.offset.shape[0])
    # Rows that are not wanted go out of range, each to a place of its own: scattering backwards needs that.
    where = jnp.where(complete, arcs.step, index.size + jnp.arange(ARCS))
    held = (index < arcs.step[0]) | (index >= count - 1)
    factor = jnp.where(held[:, None, None], jnp.eye(steps.offset.shape[1]), steps.factor)
    offset = jnp.where(held[:, None], 0.0, steps.offset)
    factor = factor.at[where].set(ends.factor[:, :-1, :-1], mode="drop", unique_indices=True)
    offset = offset.at[where].set(ends.offset[:, :-1], mode="drop", unique_indices=True)
    # The first step has the tangent of the start in its offset already.
    return _Linear(factor.at[arcs.step[0]].set(0.0), offset)


def _recur(first: jax.Array, maps: _Linear) -> jax.Array:
    """Tangents of the states at all points of the grid, ``(n_time, n_state)``."""

    def forward(d: jax.Array, step: _Linear) -> tuple[jax.Array, jax.Array]:
        d = _apply(step.factor, d) + step.offset
        return d, d

    return jnp.concatenate([first[None], jax.lax.scan(forward, first, maps)[1]])


@partial(jax.custom_jvp)
def solve(
    system: System, start: State, start_time: jax.Array, mode: Mode, times: jax.Array, count: jax.Array, inputs: Inputs
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
    inputs : dict of Signals
        Measured inputs, on the same points.

    Returns
    -------
    Solution
        Its states and arcs are differentiable in `system`, `start`, `start_time` and `inputs`, forward and backward.
    """
    return integrate(system, start, mode, start_time, times, count, inputs)


@solve.defjvp
def _solve_jvp(primals: Any, tangents: Any) -> tuple[Solution, Solution]:
    system, start, start_time, mode, times, count, inputs = primals
    d_system, d_start, d_start_time, *_, d_inputs = tangents
    solution = integrate(system, start, mode, start_time, times, count, inputs)
    arcs = solution.arcs

    d_first = ravel_pytree(d_start)[0]
    steps = _step_maps(system, times, inputs, solution, (d_system, d_inputs))
    maps = _arc_maps(system, times, inputs, arcs, (d_system, d_inputs))
    before, after = _chain(arcs, maps, jnp.append(d_first, d_start_time))
    d_grid = _recur(d_first, _grid_maps(solution, steps, after, count))

    d_step = jnp.where((arcs.step == arcs.step[0])[:, None], 0.0, d_grid[arcs.step])
    d_step = jnp.concatenate([d_step, jnp.zeros((ARCS, 1))], axis=1)
    d_begin, d_end = (_apply(maps.factor, d_step) + maps.offset for maps in (before, after))
    unravel = ravel_pytree(start)[1]
    blank = jax.tree.map(_no_tangent, solution)
    d_arcs = blank.arcs._replace(start=d_begin[:, -1], state=jax.vmap(unravel)(d_begin[:, :-1]), end=d_end[:, -1])
    return solution, blank._replace(states=jax.vmap(unravel)(d_grid), arcs=d_arcs)


def _no_tangent(value: jax.Array) -> Any:
    return np.zeros(value.shape, jax.dtypes.float0)
