"""Laws that change the level of Coulomb friction: with direction, place, pull and speed."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
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


class StribeckFriction(GuideLaw):
    """Friction that falls as sliding sets in.

    Law
    ---
    Level ``F_c + F_x exp(-(v/v_s)^2)`` instead of F_c, at rest too.

    Valid range
    -----------
    Boundary and mixed lubrication; v_s is seldom outside 1 to 100 mm/s.

    Source
    ------
    Stribeck (1902) in the form of Bo and Pavelescu, Wear 82 (1982) 277-289.
    """

    name: ClassVar[str] = "guide.stribeck_friction"
    breakaway_excess: jax.Array = quantity(
        "N", "excess of the friction at rest", 3.0, lower=0.0, upper=200.0, symbol="F_x"
    )
    stribeck_velocity: jax.Array = quantity(
        "m/s", "speed at which the excess has fallen to 1/e", 0.02, lower=1e-3, upper=0.5, log=True, symbol="v_s"
    )

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_x exp(-(v/v_s)^2)."""
        return self.breakaway_excess * jnp.exp(-((velocity / self.stribeck_velocity) ** 2))
