from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import GuideLaw, quantity


class QuadraticDrag(GuideLaw):
    """Drag that grows with the square of speed.

    Law
    ---
    ``+ c_2 v |v|`` against the motion.

    Valid range
    -----------
    Turbulent flow about the weight; small Reynolds numbers give `guide.viscous_friction` instead.

    Source
    ------
    Hoerner, Fluid-Dynamic Drag (1965).
    """

    name: ClassVar[str] = "guide.quadratic_drag"
    drag_coefficient: jax.Array = quantity(
        "N s^2/m^2", "quadratic drag of the weight", 10.0, lower=0.0, upper=2e3, symbol="c_2"
    )

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """c_2 v |v|."""
        return self.drag_coefficient * velocity * jnp.abs(velocity)
