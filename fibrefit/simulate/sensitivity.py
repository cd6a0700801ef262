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
from fibrefit.simulate.steps import Mode, State, System, explicit, flow, plus
from fibrefit.simulate.stiff import stiff_map
from fibrefit.simulate.switched import ARCS, Arcs, Inputs, Solution, integrate, select, take


class _Linear(NamedTuple):
    """One linear map ``d -> factor d + offset`` for each step or arc; `offset` is linear in the tangents given."""

    factor: jax.Array
    offset: jax.Array


class _Piece(NamedTuple):
    """A smooth piece of the motion: a whole step of the grid, or an arc."""

    step: jax.Array
    start: jax.Array
    end: jax.Array
    state: State
    reached: State
    mode: Mode


def _apply(factor: jax.Array, vector: jax.Array) -> jax.Array:
    # A sum of products stays one fused kernel inside a loop, where a matrix product would be a call of its own.
    return jnp.sum(factor * vector[..., None, :], axis=-1)


def _linearise(function: Any, point: jax.Array, parameters: Any, tangents: Any) -> _Linear:
    factor = jax.jacfwd(lambda y: function(y, *parameters))(point)
    _, offset = jax.jvp(lambda *q: function(point, *q), parameters, tangents)
    return _Linear(factor, offset)


def _flow_maps(system: System, times: jax.Array, inputs: Inputs, pieces: _Piece, tangents: Any) -> _Linear:
    """Linear maps from the start to the end of pieces, both at fixed instants."""
    unravel = ravel_pytree(take(pieces.state, 0))[1]

    def smooth(piece: _Piece) -> _Linear:
        def move(state: jax.Array, system: System, inputs: Inputs) -> jax.Array:
            arc = (piece.step, piece.start, piece.end)
            return ravel_pytree(explicit(system, unravel(state), piece.mode, inputs, times, arc))[0]

        return _linearise(move, ravel_pytree(piece.state)[0], (system, inputs), tangents)

    def stiff(piece: _Piece) -> _Linear:
        span, ends = (piece.start, piece.end), (piece.state, piece.reached)
        return _Linear(*stiff_map(system, inputs, piece.mode, times, piece.step, span, ends, tangents))

    if (is_stiff := system.stiff()) is None:
        return jax.vmap(smooth)(pieces)
    return jax.lax.cond(is_stiff, lambda: jax.vmap(stiff)(pieces), lambda: jax.vmap(smooth)(pieces))


def _step_maps(system: System, times: jax.Array, inputs: Inputs, solution: Solution, tangents: Any) -> _Linear:
    """Linear maps of all steps of the grid, as if none held a switch."""
    first, last = (take(solution.states, slice(*ends)) for ends in ((None, -1), (1, None)))
    modes = take(solution.modes, slice(None, -1))
    steps = _Piece(jnp.arange(times.shape[0] - 1), times[:-1], times[1:], first, last, modes)
    return _flow_maps(system, times, inputs, steps, tangents)


def _arc_maps(system: System, times: jax.Array, inputs: Inputs, arcs: Arcs, tangents: Any) -> _Linear:
    """Linear maps of the arcs, on states with the instant appended."""

    def reach(arc: Arcs) -> State:
        return flow(system, arc.state, arc.mode, inputs, times, (arc.step, arc.start, arc.end))

    reached = jax.vmap(reach)(arcs)
    pieces = _Piece(arcs.step, arcs.start, arcs.end, arcs.state, reached, arcs.mode)
    flows = _flow_maps(system, times, inputs, pieces, tangents)

    def one(arc: Arcs, reached: State, flow: _Linear) -> _Linear:
        end = _linearise(partial(_arc_end, times, arc, reached), ravel_pytree(reached)[0], (system, inputs), tangents)
        # An arc that starts later has less time: its start moves back along the motion.
        rate = system.derivative(arc.state, arc.mode, inputs_at(inputs, times, arc.step, arc.start))
        late = -_apply(flow.factor, ravel_pytree(rate)[0])
        carried = jnp.concatenate([flow.factor, late[:, None]], axis=1)
        factor = jnp.sum(end.factor[:, :, None] * carried[None], axis=1)
        return _Linear(factor, _apply(end.factor, flow.offset) + end.offset)

    return jax.vmap(one)(arcs, reached, flows)


def _arc_end(times: jax.Array, arc: Arcs, reached: State, flat: jax.Array, system: System, inputs: Inputs) -> jax.Array:
    """State after an arc, and the instant of its end, as a function of the state `flat` at the end that was found.

    An arc that the grid ends has a fixed end. One that a switch ends moves with the margin: the value of the
    correction is nil, its derivative is that of the root.
    """
    state = ravel_pytree(reached)[1](flat)

    def margin(state: State, instant: jax.Array) -> jax.Array:
        here = inputs_at(inputs, times, arc.step, instant)
        return jnp.stack(jax.tree.leaves(system.margins(state, arc.mode, here)))[arc.ended_by]

    here = inputs_at(inputs, times, arc.step, arc.end)
    rate = jax.lax.stop_gradient(system.derivative(state, arc.mode, here))
    value, slope = jax.jvp(margin, (state, arc.end), (rate, jnp.ones(())))
    slope = jax.lax.stop_gradient(slope)
    moves = (arc.ended_by >= 0) & (jnp.abs(slope) > 1e-12)
    shift = jnp.where(moves, -(value - jax.lax.stop_gradient(value)) / jnp.where(moves, slope, 1.0), 0.0)
    moved = plus(state, shift, rate)
    switches, tree = jax.tree.flatten(arc.mode)
    crossed = jax.tree.unflatten(tree, [arc.ended_by == i for i in range(len(switches))])
    switched, _ = system.switch(moved, arc.mode, crossed, here)
    return jnp.append(ravel_pytree(select(arc.ended_by >= 0, switched, moved))[0], arc.end + shift)


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
    mode : pytree of () int
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
