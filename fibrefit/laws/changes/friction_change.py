from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import GuideLaw, quantity


class FrictionChange(GuideLaw):
    """Friction that is another one from one record on.

    Law
    ---
    Level ``F_c (1 + a)`` in that record and all that follow in the study.

    Parameters
    ----------
    change : () a pure number
        a.

    Valid range
    -----------
    a > -1.

    Source
    ------
    Coulomb friction, with two levels.
    """

    name: ClassVar[str] = "guide.friction_change"
    family: ClassVar[str] = "since"
    change: jax.Array = quantity("-", "relative change of Coulomb friction", 0.5, lower=-0.95, upper=20.0)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """A F_c."""
        return self.change * coulomb
