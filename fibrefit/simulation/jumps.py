"""Readings that jump: a fibre that goes taut at speed bears its damping force at once."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.simulation.switched import ARCS, Solution

Observe = Callable[[Any, Any, Any], dict[str, jax.Array]]
Sides = tuple[dict[str, jax.Array], dict[str, jax.Array]]


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
    observe: Observe,
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
