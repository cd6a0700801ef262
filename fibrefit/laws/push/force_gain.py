from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import quantity
from fibrefit.laws.pushes import PushLaw


class PushGain(PushLaw):
    """A force channel that is off by a factor from the force on the mass.

    Law
    ---
    ``g F`` pushes, F is measured.

    Valid range
    -----------
    Records of which some have a known mass added; else mass, friction and offset take the factor up.

    Source
    ------
    A motor constant, or the sensitivity of a load cell.
    """

    name: ClassVar[str] = "push.force_gain"
    gain: jax.Array = quantity(
        "-", "force on the mass per measured force", 1.1, lower=0.0, upper=1e4, null=1.0, symbol="g"
    )

    def applied(self, force: jax.Array, rates: jax.Array, times: jax.Array) -> tuple[jax.Array, jax.Array]:
        """``g F``."""
        return self.gain * force, self.gain * rates * jnp.ones_like(times)

    def commanded(self, force: jax.Array, times: jax.Array) -> jax.Array:
        """F over g."""
        return force / self.gain
