"""Forces of a guide that grow with speed: in proportion to it, to its square, and not alike both ways."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

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


class QuadraticDrag(GuideLaw):
    """Drag that grows with the square of speed.

    Law
    ---
    ``+ c_2 v |v|`` against the motion.

    Valid range
    -----------
    Turbulent flow about the weight; small Reynolds numbers give `guide.viscous_friction` instead.

    Source
    ------
    Hoerner, Fluid-Dynamic Drag (1965).
    """

    name: ClassVar[str] = "guide.quadratic_drag"
    drag_coefficient: jax.Array = quantity(
        "N s^2/m^2", "quadratic drag of the weight", 10.0, lower=0.0, upper=2e3, symbol="c_2"
    )

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """c_2 v |v|."""
        return self.drag_coefficient * velocity * jnp.abs(velocity)
