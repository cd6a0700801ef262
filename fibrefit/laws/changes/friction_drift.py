from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.laws.law import GuideLaw, Moment, quantity


class FrictionDrift(GuideLaw):
    """Friction that grows or falls while a record lasts, as in a guide that warms up.

    Law
    ---
    Level ``F_c (1 + a (1 - exp(-t/τ)))``, t from the first sample.

    Parameters
    ----------
    drift : () a pure number
        a, what it comes to.
    settling_time : () in s
        τ; long against the record, the change is a steady one.

    Valid range
    -----------
    τ from some samples on; of a much longer one, only a/τ is known.

    Source
    ------
    Approach to a new state; warming lubricants: Bittencourt and Gunnarsson, J. Dyn. Syst. Meas. Control 134
    (2012) 051013.
    """

    name: ClassVar[str] = "guide.friction_drift"
    timed: ClassVar[bool] = True
    drift: jax.Array = quantity("-", "relative change of Coulomb friction in the end", -0.3, lower=-0.98, upper=20.0)
    settling_time: jax.Array = quantity("s", "time in which it settles", 1.0, lower=0.01, upper=100.0, log=True)

    def as_of(self, moment: Moment) -> Self:
        """What has come together by then."""
        return self.scaled(-jnp.expm1(-moment.time / self.settling_time))

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """Change of the level."""
        return coulomb * self.drift
