"""Laws of what turns: the fibre on its pulley, the rim and its bearing, the pivot of a pendulum."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.law import DriveLaw, PivotLaw, PulleyLaw, quantity

SLIP_SPEED = 1e-4
"""Speed of slipping at which half of the friction acts, in m/s."""


class CapstanFriction(PulleyLaw):
    """A locked pulley over which the fibre slips.

    Law
    ---
    ``T_2 = T_1 exp(-μ φ σ)``, ``σ = v/(|v| + 10^-4 m/s)``; φ is the wrap angle, v the speed of the weight.

    Valid range
    -----------
    A pulley that does not turn; friction that does not hold at rest.

    Source
    ------
    Euler (1769) and Eytelwein (1808).
    """

    name: ClassVar[str] = "pulley.capstan_friction"
    stiff: ClassVar[bool] = True
    speeds: ClassVar[tuple[float, ...]] = tuple(SLIP_SPEED * ratio for ratio in (0.5, 2.0, 8.0, 32.0, 128.0))
    capstan_coefficient: jax.Array = quantity(
        "-", "friction between fibre and pulley", 0.03, lower=0.0, upper=1.0, symbol="μ"
    )

    def grip(self, wrap_angle: jax.Array, velocity: jax.Array) -> jax.Array:
        """exp(-μ φ σ)."""
        slip = velocity / (jnp.abs(velocity) + SLIP_SPEED)
        return jnp.exp(-self.capstan_coefficient * wrap_angle * slip)


class Eccentricity(DriveLaw):
    """A pulley that does not run true.

    Law
    ---
    Fibre taken in ``x + ε sin(x/R)`` instead of x.

    Valid range
    -----------
    |ε| well below the radius R. The phase is that of a pulley that stands level at x = 0.

    Source
    ------
    Kinematics.
    """

    name: ClassVar[str] = "pulley.eccentricity"
    eccentricity: jax.Array = quantity("m", "eccentricity of the pulley", 3e-4, lower=-5e-3, upper=5e-3, symbol="ε")

    def travel(self, position: jax.Array, rate: jax.Array, radius: jax.Array) -> tuple[jax.Array, jax.Array]:
        """Travel and rate of the fibre at the drive."""
        angle = position / radius
        taken_in = position + self.eccentricity * jnp.sin(angle)
        return taken_in, rate * (1.0 + self.eccentricity / radius * jnp.cos(angle))


class PulleyInertia(PulleyLaw):
    """Inertia of the pulley, which has to be set in motion.

    Law
    ---
    ``(J/R^2) s'' = T_1 - T_2``; the rim travels s, and the fibre on either side of it stretches by itself.

    Valid range
    -----------
    The fibre does not slip on the rim. A light rim is fast, and followed all the same. The fibre's own mass changes the
    records of a drive almost as a rim of as much mass does (cosine 0.99 of what either changes beyond the base model).

    Source
    ------
    Euler's law of angular momentum.
    """

    name: ClassVar[str] = "pulley.inertia"
    turns: ClassVar[bool] = True
    stiff: ClassVar[bool] = True
    singular: ClassVar[float] = 0.1
    rim_mass: jax.Array = quantity(
        "kg", "inertia of the pulley, as a mass at its rim", 0.05, lower=0.0, upper=5.0, symbol="J/R^2"
    )

    def inertia(self) -> jax.Array:
        """The mass at the rim."""
        return self.rim_mass


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


class QuadraticDamping(PivotLaw):
    """Drag of a pendulum that grows with the square of its rate.

    Law
    ---
    Torque ``d φ' |φ'|`` against the motion.

    Valid range
    -----------
    Air or a liquid around bodies that are not slender, at Reynolds numbers above some hundred.

    Source
    ------
    Nelson and Olsson, Am. J. Phys. 54 (1986), 112: the pendulum, rich physics from a simple system.
    """

    name: ClassVar[str] = "pivot.quadratic_damping"
    drag: jax.Array = quantity("N m s^2", "drag per square of the rate", 1e-3, lower=0.0, symbol="d")

    def torque(self, angle: jax.Array, rate: jax.Array) -> jax.Array:
        """``d φ' |φ'|``."""
        return self.drag * rate * jnp.abs(rate)
