from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import GuideLaw, quantity


class LoadDependentFriction(GuideLaw):
    """Friction that grows with the pull of the fibre, as when it draws the weight askew.

    Law
    ---
    Level ``F_c + μ T`` instead of F_c; T is the tension the weight feels.

    Valid range
    -----------
    μ < 1; Amontons' law with the normal force proportional to the tension.

    Source
    ------
    Amontons-Coulomb law, e.g. Popov, Contact Mechanics and Friction, ch. 10.
    """

    name: ClassVar[str] = "guide.load_dependent_friction"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    load_coefficient: jax.Array = quantity(
        "-", "friction of the guide per tension of the fibre", 0.05, lower=0.0, upper=0.9, symbol="μ"
    )

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """μ T; a fibre that pushes for a moment adds nothing."""
        return self.load_coefficient * jnp.maximum(tension, 0.0)
