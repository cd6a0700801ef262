from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, quantity


class ToeRegion(FibreLaw):
    """A fibre that is soft until its strands have straightened.

    Law
    ---
    Elastic tension ``k e (1 - ϑ exp(-e/λ))``.

    Valid range
    -----------
    0 ≤ ϑ < 1; λ below the largest stretch, else it is hardening.

    Source
    ------
    The toe of ropes and tendons, e.g. Fung, Biomechanics (1993), ch. 7.
    """

    name: ClassVar[str] = "fibre.toe_region"
    toe_depth: jax.Array = quantity(
        "-", "share of stiffness missing at small stretch", 0.4, lower=0.0, upper=0.98, symbol="ϑ"
    )
    toe_length: jax.Array = quantity(
        "m", "stretch over which it recovers", 5e-4, lower=2e-5, upper=2e-2, log=True, symbol="λ"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 - ϑ exp(-e/λ); a slack fibre, whose stretch is negative, has no say."""
        return 1.0 - self.toe_depth * jnp.exp(-jnp.maximum(stretch, 0.0) / self.toe_length)
