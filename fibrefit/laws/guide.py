"""Laws of the guide: forces that grow with speed, the level of Coulomb friction, bristles, a spring, a loose mass."""

from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability, inverse_of
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


class Presliding(GuideLaw):
    """Presliding, as of LuGre's bristles: the weight moves a little before it breaks away.

    Law
    ---
    Friction ``σ_0 z + σ_1 z'`` with ``z' = v - σ_0 |v| z/level(v)`` instead of one that is there at once; the level is
    that of all other laws of the guide. Without damping this is Dahl's law.

    Valid range
    -----------
    Moves before break-away, level/σ_0, that the position channel can see: micrometres and more.

    Source
    ------
    Canudas de Wit, Olsson, Åström and Lischinsky, IEEE Trans. Automatic Control 40 (1995) 419-425.
    """

    name: ClassVar[str] = "guide.presliding"
    creeps: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    # The bristles follow the faster, the faster the weight: from step to step by no more than a factor.
    speeds: ClassVar[tuple[float, ...]] = (5e-4, 2e-3, 8e-3, 32e-3, 128e-3)
    bristle_stiffness: jax.Array = quantity(
        "N/m",
        "stiffness of the guide before it breaks away",
        2e5,
        lower=1e3,
        null=math.inf,
        reciprocal=True,
        symbol="σ_0",
    )
    bristle_damping: jax.Array = quantity("N s/m", "damping of the bristles", 50.0, lower=0.0, upper=1e4, symbol="σ_1")

    def compliance(self) -> jax.Array:
        """1/σ_0."""
        return inverse_of(self.bristle_stiffness)

    def bristle_damping_coefficient(self) -> jax.Array:
        """The damping σ_1."""
        return self.bristle_damping


class Spring(GuideLaw):
    """A spring between the mass in a guide and the ground.

    Law
    ---
    Force ``k (u - u0)`` against the + direction.

    Valid range
    -----------
    Any; the spring pulls and pushes.

    Source
    ------
    Hooke's law.
    """

    name: ClassVar[str] = "guide.spring"
    stands_for: ClassVar[tuple[str, ...]] = ("force_offset",)
    spring_stiffness: jax.Array = quantity(
        "N/m", "stiffness of a spring to ground", 500.0, lower=0.0, upper=1e7, symbol="k"
    )
    spring_zero: jax.Array = quantity(
        "m",
        "position at which the spring is at rest; a constant force moves it alike",
        1e-2,
        lower=-100.0,
        upper=100.0,
        symbol="u0",
    )

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """``k (u - u0)``."""
        return self.spring_stiffness * (position - self.spring_zero)


class LooseMass(GuideLaw):
    """A part of the weight that hangs loosely on it and swings along the guide.

    Law
    ---
    A share μ of the mass on a spring and a damper: ``w'' = -ω^2 (w - u) - 2 ζ ω (w' - u')``, ω = 2π f, w from
    where it hangs at rest; ``μ m (ω^2 (w - u) + 2 ζ ω (w' - u'))`` on the rest of the weight.

    Valid range
    -----------
    Motion along the guide, without stops. A part that is held fast (large f) changes nothing.

    Source
    ------
    Den Hartog, Mechanical Vibrations (1956), ch. 3: the auxiliary mass.
    """

    name: ClassVar[str] = "guide.loose_mass"
    # In windows that begin anew it would have to be known how far it has swung.
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    carries: ClassVar[bool] = True
    loose_share: jax.Array = quantity(
        "-", "share of the mass that hangs loosely", 0.05, lower=0.0, upper=0.9, symbol="μ"
    )
    frequency: jax.Array = quantity(
        "Hz",
        "its own frequency on a weight that is held",
        20.0,
        lower=0.5,
        upper=300.0,
        log=True,
        starts=(4.0, 8.0, 16.0, 32.0, 64.0),
        symbol="f",
    )
    damping_ratio: jax.Array = quantity("-", "its damping ratio", 0.05, lower=1e-3, upper=2.0, symbol="ζ")

    def loose(self) -> tuple[jax.Array, jax.Array, jax.Array]:
        """Share, angular frequency and damping ratio."""
        return self.loose_share, 2.0 * jnp.pi * self.frequency, self.damping_ratio
