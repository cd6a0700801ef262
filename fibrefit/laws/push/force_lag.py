"""A force that builds up behind what is recorded."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import quantity
from fibrefit.laws.pushes import PushLaw


class PushLag(PushLaw):
    """A force that builds up behind what is recorded, as the current of a motor does.

    Law
    ---
    ``τ p' + p = F``, p pushes. Solved for the difference ``F - p = τ e`` with the rate of F linear between samples.

    Valid range
    -----------
    Any; settled when the record begins.

    Source
    ------
    Armature circuits, e.g. Leonhard, Control of Electrical Drives (2001), ch. 5.
    """

    name: ClassVar[str] = "push.force_lag"
    time_constant: jax.Array = quantity(
        "s", "time constant with which the force builds up", 2e-3, lower=0.0, upper=1.0, symbol="τ"
    )

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """``p`` and its rate."""
        tau, length = self.time_constant, times[1:] - times[:-1]
        there = tau > 0.0
        left = jnp.where(there, jnp.exp(-length / jnp.where(there, tau, 1.0)), 0.0)
        bend = tau * (rates[1:] - rates[:-1]) / length

        def follow(e: jax.Array, step: tuple[jax.Array, ...]) -> tuple[jax.Array, jax.Array]:
            before, after, bend, left = step
            e = after - bend + (e - before + bend) * left
            return e, e

        _, later = jax.lax.scan(follow, rates[0], (rates[:-1], rates[1:], bend, left))
        lagging = jnp.concatenate([rates[:1], later])
        return force - tau * lagging, lagging

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """``p + τ p'``."""
        return force + self.time_constant * jnp.asarray(jnp.gradient(force)) / (times[1] - times[0])
