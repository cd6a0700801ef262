"""Friction of a guide that differs between the two directions."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

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


class AsymmetricViscousFriction(GuideLaw):
    """Viscous friction that differs between the two directions.

    Law
    ---
    ``c (1 + a_v sign v) v``, c from `guide.viscous_friction`.

    Valid range
    -----------
    |a_v| < 1, so that the force opposes the motion both ways.

    Source
    ------
    Seen on prismatic robot axes, e.g. Janot, Gautier and Brunot, data set and reference models of EMPS (2019).
    """

    name: ClassVar[str] = "guide.asymmetric_viscous_friction"
    needs: ClassVar[tuple[str, ...]] = ("guide.viscous_friction",)
    viscous_asymmetry: jax.Array = quantity(
        "-",
        "half the relative difference of viscous friction between the directions; positive: more in the + direction",
        0.2,
        lower=-0.95,
        upper=0.95,
        symbol="a_v",
    )

    def viscosity_factor(self, velocity: jax.Array) -> jax.Array:
        """1 + a_v sign v."""
        return 1.0 + self.viscous_asymmetry * jnp.sign(velocity)
