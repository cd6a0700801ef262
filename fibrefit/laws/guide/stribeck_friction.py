from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import GuideLaw, quantity


class StribeckFriction(GuideLaw):
    """Friction that falls as sliding sets in.

    Law
    ---
    Level ``F_c + F_x exp(-(v/v_s)^2)`` instead of F_c, at rest too.

    Valid range
    -----------
    Boundary and mixed lubrication; v_s is seldom outside 1 to 100 mm/s.

    Source
    ------
    Stribeck (1902) in the form of Bo and Pavelescu, Wear 82 (1982) 277-289.
    """

    name: ClassVar[str] = "guide.stribeck_friction"
    breakaway_excess: jax.Array = quantity(
        "N", "excess of the friction at rest", 3.0, lower=0.0, upper=200.0, symbol="F_x"
    )
    stribeck_velocity: jax.Array = quantity(
        "m/s", "speed at which the excess has fallen to 1/e", 0.02, lower=1e-3, upper=0.5, log=True, symbol="v_s"
    )

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_x exp(-(v/v_s)^2)."""
        return self.breakaway_excess * jnp.exp(-((velocity / self.stribeck_velocity) ** 2))
