from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import DriveLaw, quantity


class Eccentricity(DriveLaw):
    """A pulley that does not run true.

    Law
    ---
    Fibre taken in ``x + ε sin(x/R)`` instead of x.

    Valid range
    -----------
    |ε| well below the radius R. The phase is that of a pulley that stands level at x = 0.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "pulley.eccentricity"
    eccentricity: jax.Array = quantity("m", "eccentricity of the pulley", 3e-4, lower=-5e-3, upper=5e-3, symbol="ε")

    def travel(self, position: jax.Array, rate: jax.Array, radius: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Travel and rate of the fibre at the drive."""
        angle = position / radius
        taken_in = position + self.eccentricity * jnp.sin(angle)
        return taken_in, rate * (1.0 + self.eccentricity / radius * jnp.cos(angle))
