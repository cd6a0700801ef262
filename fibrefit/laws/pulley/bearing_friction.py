from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import PulleyLaw, quantity


class BearingFriction(PulleyLaw):
    """A pulley whose bearing rubs, and holds it at rest.

    Law
    ---
    ``- F_b Sign(s')`` on the rim, which has the mass that `pulley.inertia` gives it, else 0.05 kg.

    Valid range
    -----------
    The fibre does not slip on the rim.

    Source
    ------
    Coulomb friction, as of the guide.
    """

    name: ClassVar[str] = "pulley.bearing_friction"
    turns: ClassVar[bool] = True
    rubs: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    # With the least friction comes the whole mass of a rim.
    singular: ClassVar[float] = 1.0
    bearing_friction: jax.Array = quantity(
        "N", "friction of the pulley's bearing at the rim", 1.0, lower=0.0, upper=100.0, symbol="F_b"
    )

    def rubbing(self) -> jax.Array:
        """F_b."""
        return self.bearing_friction
