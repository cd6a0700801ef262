from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.laws.law import GuideLaw, quantity


class AsymmetricFriction(GuideLaw):
    """Coulomb friction that differs between the two directions.

    Law
    ---
    Level ``F_c (1 + a sign v)`` instead of F_c; at rest the direction that the net force points to counts.

    Valid range
    -----------
    |a| < 1, so that friction opposes the motion both ways.

    Source
    ------
    Seen on prismatic robot axes, e.g. Janot, Gautier and Brunot, data set and reference models of EMPS (2019).
    """

    name: ClassVar[str] = "guide.asymmetric_friction"
    asymmetry: jax.Array = quantity(
        "-",
        "half the relative difference of Coulomb friction between the directions; positive: more in the + direction",
        0.2,
        lower=-0.95,
        upper=0.95,
        symbol="a",
    )

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c a sign v."""
        return self.asymmetry * direction * coulomb
