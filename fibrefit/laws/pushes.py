"""Laws between a force that was measured and the mass it pushes: the one kind that sees a whole course at once."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Effect


class PushLaw(Effect):
    """A change between a force that was measured and the force that pushes the mass."""

    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PUSH})

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Force on the mass ``(n_time,)`` in N and its rate, from the measured one, at `times` [s]."""
        return force, rates

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """Force ``(n_time,)`` in N to be measured, from that on the mass: the inverse of `applied`."""
        return force


def between_samples(
    values: jax.Array, rates: jax.Array, times: jax.Array, instants: jax.Array
) -> tuple[jax.Array, jax.Array]:
    """A course and its rate at some instants, by cubics between samples; constant beyond its ends.

    Parameters
    ----------
    values, rates : (n_time,)
    times : (n_time,) in s
    instants : (n,) in s

    Returns
    -------
    values, rates : (n,)
        Where an instant is a sample, that sample to the last bit.
    """
    inside = jnp.clip(instants, times[0], times[-1])
    step = jnp.clip(jnp.searchsorted(times, inside, side="right") - 1, 0, times.shape[0] - 2)
    length, t = times[step + 1] - times[step], inside - times[step]
    rise = (values[step + 1] - values[step]) / length
    square = (3.0 * rise - 2.0 * rates[step] - rates[step + 1]) / length
    cube = (rates[step] + rates[step + 1] - 2.0 * rise) / length**2
    value = values[step] + t * (rates[step] + t * (square + t * cube))
    rate = rates[step] + t * (2.0 * square + t * (3.0 * cube))
    # The last sample is the end of a step: there the cubic is right but for its rounding.
    end = (inside == times[-1]) & (t == length)
    value = jnp.where(end, values[-1] + (value - jax.lax.stop_gradient(value)), value)
    rate = jnp.where(end, rates[-1] + (rate - jax.lax.stop_gradient(rate)), rate)
    return value, jnp.where((instants < times[0]) | (instants > times[-1]), 0.0, rate)


def ahead_of(values: jax.Array, times: jax.Array, lead: jax.Array) -> jax.Array:
    """A course ``(n_time,)`` some time [s] later, by lines between samples; constant beyond its ends."""
    return jnp.interp(times + lead, times, values)
