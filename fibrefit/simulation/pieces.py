"""A quantity between the points of the grid: a cubic on every smooth piece of the motion, and jumps at its switches.

A tension jumps where a fibre goes taut or slack, somewhere inside a step of the grid: one that goes taut at speed bears
its damping force at once. The pieces end there, so that what follows, a filter or a delay, meets a smooth quantity on
each of them.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.simulation.inputs import inputs_at
from fibrefit.simulation.steps import Mode, State, System
from fibrefit.simulation.switched import ARCS, Inputs, Solution, take

Cubic = tuple[jax.Array, ...]
Observe = Callable[[State, Mode, Any], jax.Array]
ObserveAll = Callable[[State, Mode, Any], dict[str, jax.Array]]
Sides = tuple[dict[str, jax.Array], dict[str, jax.Array]]


class Pieces(NamedTuple):
    """Pieces in the order of time, without gaps; those of no length fill the end.

    Parameters
    ----------
    start, end : (n_piece,) in s
    cubic : four of (n_piece,) in the unit of the quantity
        Coefficients of 1, s, s^2, s^3, where s runs from 0 to 1 over the piece.
    """

    start: jax.Array
    end: jax.Array
    cubic: Cubic


def pieces_of(
    observe: Observe, system: System, times: jax.Array, count: jax.Array, inputs: Inputs, solution: Solution
) -> Pieces:
    """Pieces of the scalar ``observe(state, mode, inputs)`` along a solution.

    Parameters
    ----------
    observe : callable
        Quantity at one instant, whose inputs are pairs of value and rate.
    system, times, count, inputs
        As given to `solve`.

    Returns
    -------
    Pieces
        ``n_time + ARCS`` of them.
    """

    def value_and_rate(step: jax.Array, mode: Mode, time: jax.Array, state: State) -> tuple[jax.Array, jax.Array]:
        def at(time: jax.Array, state: State) -> jax.Array:
            return observe(state, mode, inputs_at(inputs, times, step, time))

        change = system.derivative(state, mode, inputs_at(inputs, times, step, time))
        return jax.jvp(at, (time, state), (jnp.ones(()), change))

    n_steps, arcs = times.shape[0] - 1, solution.arcs
    steps = jnp.arange(n_steps, dtype=arcs.step.dtype)
    grid, modes = (times, solution.states), take(solution.modes, slice(None, -1))
    at_start = _joined((take(grid, slice(None, -1)), modes), ((arcs.start, arcs.state), arcs.mode))
    at_end = _joined(take(grid, slice(1, None)), (arcs.end, arcs.reached))
    which = jnp.concatenate([steps, arcs.step])
    # In a loop, so that the law is in the program once, and its values in memory before they are used.
    ends = jax.tree.map(lambda *both: jnp.stack(both), at_start[0], at_end)
    (p0, p1), (m0, m1) = jax.lax.map(lambda end: jax.vmap(value_and_rate)(which, at_start[1], *end), ends)
    length = at_end[0] - at_start[0][0]
    m0, m1 = m0 * length, m1 * length
    cubics = p0, m0, 3.0 * (p1 - p0) - 2.0 * m0 - m1, 2.0 * (p0 - p1) + m0 + m1
    of_steps, of_arcs = (tuple(term[part] for term in cubics) for part in (slice(None, n_steps), slice(n_steps, None)))
    held = (steps < arcs.step[0]) | (steps >= count - 1)
    of_steps = (of_steps[0], *(jnp.where(held, 0.0, term) for term in of_steps[1:]))
    waiting = _constant(of_arcs[0][0])
    return _in_order(solution, times, of_steps, of_arcs, waiting)


def _joined(steps: Any, arcs: Any) -> Any:
    return jax.tree.map(lambda a, b: jnp.concatenate([a, b]), steps, arcs)


def _in_order(solution: Solution, times: jax.Array, of_steps: Cubic, of_arcs: Cubic, waiting: Cubic) -> Pieces:
    """Steps without a switch, arcs, and the time the start is waited for inside the first step, sorted by time."""
    arcs, n_steps = solution.arcs, times.shape[0] - 1
    valid = jnp.arange(ARCS) < solution.n_arcs
    first = arcs.step[0]
    arcs_in = jnp.zeros(n_steps, jnp.int32).at[jnp.where(valid, arcs.step, n_steps)].add(1, mode="drop")
    pieces_in = jnp.maximum(arcs_in, 1).at[first].add(1)
    before = jnp.cumsum(pieces_in) - pieces_in
    rank = jnp.arange(ARCS) - (jnp.cumsum(arcs_in) - arcs_in)[arcs.step] + (arcs.step == first)
    size = n_steps + ARCS + 1
    # Rows that are not wanted go out of range, each to a place of its own: scattering backwards needs that.
    row_of_steps = jnp.where(arcs_in > 0, size + jnp.arange(n_steps), before)
    row_of_arcs = jnp.where(valid, before[arcs.step] + rank, size + jnp.arange(ARCS))

    def place(blank: jax.Array, steps: jax.Array, arcs: jax.Array, waiting: jax.Array) -> jax.Array:
        rows = jnp.broadcast_to(blank, (size,))
        rows = rows.at[row_of_steps].set(steps, mode="drop", unique_indices=True)
        rows = rows.at[row_of_arcs].set(arcs, mode="drop", unique_indices=True)
        return rows.at[before[first]].set(waiting, unique_indices=True)

    end = _constant(of_steps[0][-1] + of_steps[1][-1] + of_steps[2][-1] + of_steps[3][-1])
    return Pieces(
        place(times[-1], times[:-1], arcs.start, times[first]),
        place(times[-1], times[1:], arcs.end, arcs.start[0]),
        tuple(map(place, end, of_steps, of_arcs, waiting)),
    )


def _constant(value: jax.Array) -> Cubic:
    return value, jnp.zeros_like(value), jnp.zeros_like(value), jnp.zeros_like(value)


class Jumps(NamedTuple):
    """What the switches of a motion do to the readings.

    Parameters
    ----------
    instants : (ARCS,) in s
    heights : dict of (ARCS,) in SI units
        By channel; zero where a switch leaves the reading as it is, and in rows without a switch.
    number : () int
        Rows that may hold a switch.
    """

    instants: jax.Array
    heights: dict[str, jax.Array]
    number: jax.Array


def jumps_of(
    observe: ObserveAll,
    inputs_at: Callable[[jax.Array, jax.Array], Any],
    solution: Solution,
    sensed: Callable[[Sides, jax.Array], Sides] = lambda sides, _: sides,
) -> Jumps:
    """Jumps of the readings at all switches of a motion.

    Parameters
    ----------
    observe : callable ``(state, mode, inputs) -> {channel: value}``
    inputs_at : callable ``(step, instant) -> inputs``
    sensed : callable ``(sides, instants) -> sides``
        Readings before and after, of what is observed.
    """
    arcs = solution.arcs
    state, mode = jax.tree.map(lambda rows: jnp.roll(rows, -1, axis=0), (arcs.state, arcs.mode))
    inputs = jax.vmap(inputs_at)(arcs.step, arcs.end)
    felt = jax.vmap(observe)(state, arcs.mode, inputs), jax.vmap(observe)(state, mode, inputs)
    before, after = sensed(felt, arcs.end)
    switched = (arcs.ended_by >= 0) & (jnp.arange(ARCS) < solution.n_arcs - 1)
    heights = {channel: jnp.where(switched, value - before[channel], 0.0) for channel, value in after.items()}
    return Jumps(arcs.end, heights, jnp.minimum(solution.n_arcs, ARCS))
