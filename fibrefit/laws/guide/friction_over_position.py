from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import GuideLaw, quantity


class FrictionOverPosition(GuideLaw):
    """Coulomb friction that differs along the guide.

    Law
    ---
    Level ``F_c + g u + h u²`` instead of F_c.

    Valid range
    -----------
    Where the level stays positive; u counts from where the fibre is just taut, and on a rig without
    a fibre from the zero of the position.

    Source
    ------
    The first terms of any smooth course, e.g. of a guide clamped harder at one end or in its middle.
    """

    name: ClassVar[str] = "guide.friction_over_position"
    strength: ClassVar[tuple[str, ...]] = ("gradient", "curvature")
    gradient: jax.Array = quantity("N/m", "change of Coulomb friction along the guide", 5.0, symbol="g")
    curvature: jax.Array = quantity("N/m^2", "change of that change along the guide", 5.0, symbol="h")

    def roughness(self, position: jax.Array) -> jax.Array:
        """``g u + h u²``."""
        return (self.gradient + self.curvature * position) * position
