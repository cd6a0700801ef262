from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import PivotLaw, quantity


class QuadraticDamping(PivotLaw):
    """Drag of a pendulum that grows with the square of its rate.

    Law
    ---
    Torque ``d φ' |φ'|`` against the motion.

    Valid range
    -----------
    Air or a liquid around bodies that are not slender, at Reynolds numbers above some hundred.

    Source
    ------
    Nelson and Olsson, Am. J. Phys. 54 (1986), 112: the pendulum, rich physics from a simple system.
    """

    name: ClassVar[str] = "pivot.quadratic_damping"
    drag: jax.Array = quantity("N m s^2", "drag per square of the rate", 1e-3, lower=0.0, symbol="d")

    def torque(self, angle: jax.Array, rate: jax.Array) -> jax.Array:
        """``d φ' |φ'|``."""
        return self.drag * rate * jnp.abs(rate)
