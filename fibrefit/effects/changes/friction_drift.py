"""Friction that grows or falls while a record lasts, as in a guide that warms up."""

from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.effects.law import LEAST, GuideLaw, Moment, quantity


class FrictionDrift(GuideLaw):
    """Friction that grows or falls while a record lasts, as in a guide that warms up.

    Law
    ---
    Level ``F_c max(0.02, 1 + a t)``, t from the first sample.

    Parameters
    ----------
    drift : () in 1/s
        a.

    Valid range
    -----------
    Records short against the time in which it would come to rest.

    Source
    ------
    First term of a series in time; warming lubricants: Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134
    (2012) 051013.
    """

    name: ClassVar[str] = "guide.friction_drift"
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("1/s", "relative growth of Coulomb friction over time", -0.1, lower=-2.0, upper=10.0)

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(moment.time)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c (max(0.02, 1 + a t) - 1)."""
        return coulomb * jnp.maximum(LEAST - 1.0, self.drift)
