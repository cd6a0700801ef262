from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import GuideLaw, quantity


class ViscousFriction(GuideLaw):
    """Friction proportional to speed, as of a lubricated guide.

    Law
    ---
    ``+ c v`` against the motion.

    Valid range
    -----------
    Full film lubrication, or air damping that is small: no limit of speed within the rigs' range.

    Source
    ------
    Armstrong-Hélouvry, Dupont and Canudas de Wit, Automatica 30 (1994) 1083-1138.
    """

    name: ClassVar[str] = "guide.viscous_friction"
    viscous_coefficient: jax.Array = quantity(
        "N s/m", "viscous friction of the guide", 3.0, lower=0.0, upper=500.0, symbol="c"
    )

    def viscosity(self) -> jax.Array:
        """The coefficient c."""
        return self.viscous_coefficient
