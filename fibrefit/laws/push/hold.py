"""A force that a controller holds from one of its instants to the next."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import quantity
from fibrefit.laws.pushes import PushLaw, ahead_of, between_samples

SHORT = 1e-3
"""Share of a sample below which a mean over the period is taken from its first terms."""


class PushHold(PushLaw):
    """A force that a controller holds from one of its instants to the next (zero-order hold).

    Law
    ---
    ``p(t) = (1/T) ∫ F`` over the last T: the transfer function ``(1 - exp(-s T)) / (s T)`` of a hold.

    Valid range
    -----------
    Motions slow against the period: the steps themselves, above 1/(2 T), are left out.

    Source
    ------
    Franklin, Powell and Workman, Digital Control of Dynamic Systems (1998), ch. 5.
    """

    name: ClassVar[str] = "push.hold"
    period: jax.Array = quantity("s", "time for which a force is held", 2e-3, lower=0.0, upper=0.5, symbol="T")

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Mean over the last period, and its rate."""
        length = times[1:] - times[:-1]
        steps = 0.5 * length * (force[1:] + force[:-1]) + length**2 / 12.0 * (rates[:-1] - rates[1:])
        whole = jnp.concatenate([jnp.zeros(1), jnp.cumsum(steps)])
        short = self.period < SHORT * length[0]
        period = jnp.where(short, 1.0, self.period)
        then = times - period
        before, _ = between_samples(force, rates, times, then)
        mean = (whole - _integral(force, rates, times, whole, then)) / period
        bend = jnp.asarray(jnp.gradient(rates)) / length[0]
        value = jnp.where(short, force - 0.5 * self.period * rates, mean)
        return value, jnp.where(short, rates - 0.5 * self.period * bend, (force - before) / period)

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """The force on the mass half a period later: a hold, to first order in its period."""
        return ahead_of(force, times, 0.5 * self.period)


def _integral(force: jax.Array, rates: jax.Array, times: jax.Array, whole: jax.Array, instants: jax.Array) -> jax.Array:
    """Integral of the force from the first sample to each instant; before it the force is constant."""
    step = jnp.clip(jnp.searchsorted(times, instants, side="right") - 1, 0, times.shape[0] - 2)
    length = times[step + 1] - times[step]
    t = jnp.maximum(instants - times[step], 0.0)
    rise = (force[step + 1] - force[step]) / length
    square = (3.0 * rise - 2.0 * rates[step] - rates[step + 1]) / length
    cube = (rates[step] + rates[step + 1] - 2.0 * rise) / length**2
    inside = t * (force[step] + t * (rates[step] / 2.0 + t * (square / 3.0 + t * cube / 4.0)))
    return whole[step] + inside + jnp.minimum(instants - times[0], 0.0) * force[0]
