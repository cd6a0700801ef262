from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import FibreLaw, quantity

REFERENCE_RATE = 0.1
"""v_ref, in m/s."""


class RateDependentStiffness(FibreLaw):
    """Stiffness that depends on the rate of stretch.

    Law
    ---
    Elastic tension ``k e (1 + γ |ė|/v_ref)``, ``v_ref`` = 0.1 m/s.

    Valid range
    -----------
    1 + γ |ė|/v_ref positive at the rates that occur.

    Source
    ------
    Series expansion about zero rate; polymers and coated fibres stiffen with strain rate.
    """

    name: ClassVar[str] = "fibre.rate_dependent_stiffness"
    stiffness_rate_factor: jax.Array = quantity(
        "-", "relative change of stiffness at 0.1 m/s of stretching", 0.03, lower=-0.1, upper=2.0, symbol="γ"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + γ |ė|/v_ref."""
        return 1.0 + self.stiffness_rate_factor * jnp.abs(rate) / REFERENCE_RATE
