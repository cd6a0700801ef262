"""Derivatives of the switched integrator.

They are those of the true hybrid flow: the instant of a switch moves with the parameters, and the implicit function
theorem at the located margin carries this through (the "saltation" of the hybrid-systems literature). They come from
the stored states, all steps at once; what remains sequential is a linear recurrence.
"""

from __future__ import annotations

import math
from functools import partial
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax.flatten_util import ravel_pytree

from fibrefit.simulate.inputs import inputs_at
from fibrefit.simulate.steps import Mode, State, System, plus
from fibrefit.simulate.switched import ARCS, SWITCHES_A_STEP, Arcs, Inputs, Solution, integrate, select, take
from fibrefit.simulate.variation import Piece, explicit_maps, stiff_maps


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


def _flow_maps(system: System, times: jax.Array, inputs: Inputs, pieces: Piece, tangents: Any) -> _Linear:
    """Linear maps from the start to the end of pieces, both at fixed instants."""

    def smooth() -> Any:
        return explicit_maps(system, inputs, times, pieces, tangents)

    def stiff() -> Any:
        return stiff_maps(system, inputs, times, pieces, tangents)

    # What a branch returns is in memory. A stack of unfinished formulas would be worked out anew for each element.
    factor, offset = smooth() if (is_stiff := system.stiff()) is None else jax.lax.cond(is_stiff, stiff, smooth)
    return _Linear(jnp.stack(factor).transpose(2, 0, 1), jnp.stack(offset, axis=1))


def _maps(
    system: System, times: jax.Array, inputs: Inputs, solution: Solution, tangents: Any
) -> tuple[_Linear, _Linear, _Linear]:
    """Linear maps of all steps of the grid, as if none held a switch; of the arcs; and to the states they reached.

    Those of arcs go from and to states with the instant appended.
    """
    arcs, n_steps = solution.arcs, times.shape[0] - 1
    first, last = (take(solution.states, slice(*ends)) for ends in ((None, -1), (1, None)))
    modes = take(solution.modes, slice(None, -1))
    steps = Piece(jnp.arange(n_steps, dtype=arcs.step.dtype), times[:-1], times[1:], first, last, modes)
    of_arcs = Piece(arcs.step, arcs.start, arcs.end, arcs.state, arcs.reached, arcs.mode)
    # In one batch, so that the step is compiled only once.
    pieces = jax.tree.map(lambda a, b: jnp.concatenate([a, b]), steps, of_arcs)
    flows = _flow_maps(system, times, inputs, pieces, tangents)
    step_maps, arc_flows = take(flows, slice(None, n_steps)), take(flows, slice(n_steps, None))

    def to_end(arc: Arcs, flow: _Linear) -> _Linear:
        state = ravel_pytree(arc.reached)[0]
        end = _linearise(partial(_arc_end, times, arc), state, (system, inputs), tangents)
        # An arc that starts later has less time: its start moves back along the motion.
        rate = system.derivative(arc.state, arc.mode, inputs_at(inputs, times, arc.step, arc.start))
        late = -_apply(flow.factor, ravel_pytree(rate)[0])
        carried = jnp.concatenate([flow.factor, late[:, None]], axis=1)
        factor = jnp.sum(end.factor[:, :, None] * carried[None], axis=1)
        return _Linear(factor, _apply(end.factor, flow.offset) + end.offset)

    ends = jax.vmap(to_end)(arcs, arc_flows)
    size = flows.offset.shape[-1] + 1
    return step_maps, *(take(ends, (slice(None), part)) for part in (slice(None, size), slice(size, None)))


def _arc_end(times: jax.Array, arc: Arcs, flat: jax.Array, system: System, inputs: Inputs) -> jax.Array:
    """State after an arc, the instant of its end, and the state before the switch, from the state that was found there.

    An arc that the grid ends has a fixed end. One that a switch ends moves with the margin: the value of the
    correction is nil, its derivative is that of the root.
    """
    state = ravel_pytree(arc.reached)[1](flat)

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
    after = select(arc.ended_by >= 0, switched, moved)
    return jnp.concatenate([ravel_pytree(after)[0], (arc.end + shift)[None], ravel_pytree(moved)[0]])


def _after(later: _Linear, earlier: _Linear) -> _Linear:
    """One map after another."""
    factor = jnp.zeros_like(later.factor)
    for k in range(factor.shape[-1]):
        factor += later.factor[..., :, k, None] * earlier.factor[..., None, k, :]
    return _Linear(factor, _apply(later.factor, earlier.offset) + later.offset)


def _chain(arcs: Arcs, maps: _Linear, start: jax.Array) -> tuple[_Linear, _Linear]:
    """Maps from the beginning of a step to the start and to the end of each arc in it, on states with time appended.

    The first step starts from `start`, the tangent of the initial state and time, which enters its offset.
    """
    row = jnp.arange(ARCS)
    begins = (row == 0) | (jnp.roll(arcs.ended_by, 1) < 0)
    maps = maps._replace(offset=maps.offset.at[0].add(_apply(maps.factor[0], start)))

    def whole(flag: jax.Array, yes: _Linear, no: _Linear) -> _Linear:
        return _Linear(
            jnp.where(flag[:, None, None], yes.factor, no.factor), jnp.where(flag[:, None], yes.offset, no.offset)
        )

    def double(carry: tuple[_Linear, jax.Array], shift: jax.Array) -> Any:
        # Each row reaches twice as far back as before, unless a step begins in between.
        def join(ends: _Linear, complete: jax.Array) -> tuple[_Linear, jax.Array]:
            earlier, its = jax.tree.map(lambda rows: jnp.roll(rows, shift, axis=0), (ends, complete))
            return whole(complete, ends, _after(ends, earlier)), complete | its

        return jax.lax.cond(jnp.all(carry[1]), lambda *same: same, join, *carry), None

    reach = 2 ** jnp.arange(math.ceil(math.log2(SWITCHES_A_STEP + 1)))
    (ends, _), _ = jax.lax.scan(double, (maps, begins), reach)
    nothing = _Linear(jnp.broadcast_to(jnp.eye(start.shape[0]), ends.factor.shape), jnp.zeros_like(ends.offset))
    starts = whole(begins, nothing, jax.tree.map(lambda rows: jnp.roll(rows, 1, axis=0), ends))
    return starts._replace(offset=starts.offset.at[0].set(start)), ends


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
    inputs : dict of Course
        Measured inputs, between the same points.

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
    steps, maps, to_reached = _maps(system, times, inputs, solution, (d_system, d_inputs))
    before, after = _chain(arcs, maps, jnp.append(d_first, d_start_time))
    d_grid = _recur(d_first, _grid_maps(solution, steps, after, count))

    d_step = jnp.where((arcs.step == arcs.step[0])[:, None], 0.0, d_grid[arcs.step])
    d_step = jnp.concatenate([d_step, jnp.zeros((ARCS, 1))], axis=1)
    d_begin, d_end = (_apply(maps.factor, d_step) + maps.offset for maps in (before, after))
    unravel = jax.vmap(ravel_pytree(start)[1])
    blank = jax.tree.map(_no_tangent, solution)
    d_arcs = blank.arcs._replace(
        start=d_begin[:, -1],
        state=unravel(d_begin[:, :-1]),
        end=d_end[:, -1],
        reached=unravel(_apply(to_reached.factor, d_begin) + to_reached.offset),
    )
    return solution, blank._replace(states=unravel(d_grid), arcs=d_arcs)


def _no_tangent(value: jax.Array) -> Any:
    return np.zeros(value.shape, jax.dtypes.float0)
