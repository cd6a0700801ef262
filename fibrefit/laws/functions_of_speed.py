"""Laws that go with speed: three things that a law changes, each as a curve, a power added, or a power by itself."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.forms_of_change import OfOneForm
from fibrefit.laws.law import FibreLaw, GuideLaw, quantity

SLOW, MEDIUM, TOP = 0.05, 0.2, 0.8
"""Speeds in m/s of the knots of a monotone curve."""
REFERENCE = 0.1
"""Speed in m/s at which a power law is one."""
SMOOTH = 1e-3
"""Speed in m/s below which a power law bends into a parabola: a root has no slope at rest."""
LEAST = 0.05
"""What a law with an added power leaves of the base law."""


class FunctionOfSpeed(OfOneForm):
    """A relative change that goes with speed.

    A form of it says how (`relative`), a place what is changed; a law is one of each and has a `change` with limits of
    its own.
    """

    def relative(self, speed: jax.Array) -> jax.Array:
        """The relative change at a `speed` in m/s of either sign."""
        raise NotImplementedError

    def factor(self, speed: jax.Array) -> jax.Array:
        """What is changed, as a multiple of what it is without the law."""
        return 1.0 + self.relative(speed)


class CurveOfSpeed(FunctionOfSpeed):
    """A relative change as a fitted curve, at most its value at the last knot."""

    page: ClassVar[
        str
    ] = """ w a monotone cubic of the speed that is 0 at rest, 1 at 0.8 m/s and beyond, and has two knots between,
at 0.05 and 0.2 m/s.

Valid range
-----------
Speeds to well above 0.2 m/s in the records; below, only one knot is determined. Falls too, where A is negative.

Source
------
Monotone piecewise cubic interpolation: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
"""
    change: jax.Array = quantity("-", "relative change at 0.8 m/s", 0.5, symbol="A")
    slow_share: jax.Array = quantity("-", "change at 0.05 m/s over that at 0.2 m/s", 0.4, lower=0.0, upper=1.0)
    medium_share: jax.Array = quantity("-", "change at 0.2 m/s over that at 0.8 m/s", 0.4, lower=0.0, upper=1.0)

    def relative(self, speed: jax.Array) -> jax.Array:
        """A times the curve."""
        return self.change * monotone(jnp.abs(speed), self.slow_share, self.medium_share)


class PowerOfSpeed(FunctionOfSpeed):
    """A relative change as a power."""

    page: ClassVar[str] = """

Valid range
-----------
Speeds of more than a decade in the records: otherwise A and p cannot be distinguished.

"""
    change: jax.Array = quantity("-", "relative change at 0.1 m/s", 0.5, symbol="A")
    exponent: jax.Array = quantity("-", "exponent", 0.7, lower=0.2, upper=3.0, symbol="p")

    def relative(self, speed: jax.Array) -> jax.Array:
        """A times the power."""
        return self.change * power(speed, self.exponent)

    def factor(self, speed: jax.Array) -> jax.Array:
        """No less than `LEAST`: a power knows no limit."""
        return jnp.maximum(1.0 + self.relative(speed), LEAST)


class ScalingWithSpeed(FunctionOfSpeed):
    """All of it goes with a power of speed."""

    page: ClassVar[str] = """

Valid range
-----------
Speeds of more than an octave in the records: otherwise p is not distinguished from the value at 0.1 m/s.

"""
    exponent: jax.Array = quantity("-", "exponent", 0.3, symbol="p")

    def relative(self, speed: jax.Array) -> jax.Array:
        """The power, less one."""
        return jnp.expm1(0.5 * self.exponent * jnp.log((speed**2 + SMOOTH**2) / (REFERENCE**2 + SMOOTH**2)))


class _Friction(FunctionOfSpeed, GuideLaw):
    """The level of the guide's friction."""

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """What the law adds to F_c."""
        return coulomb * (self.factor(velocity) - 1.0)


class _Stiffness(FunctionOfSpeed, FibreLaw):
    """The stiffness of the fibre."""

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """Factor at that rate."""
        return self.factor(rate)


class _Damping(FunctionOfSpeed, FibreLaw):
    """The damping of the fibre."""

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """Factor at that rate."""
        return self.factor(rate)


class FrictionSpeedCurve(CurveOfSpeed, _Friction):
    """Friction of the guide as a fitted curve of speed.

    Law
    ---
    Level of friction ``F_c (1 + A w(|v|))``,
    """

    name: ClassVar[str] = "guide.friction_speed_curve"
    change: jax.Array = quantity(
        "-", "relative change of friction at 0.8 m/s", 0.5, lower=-0.95, upper=20.0, symbol="A"
    )


class FrictionPowerLaw(PowerOfSpeed, _Friction):
    """Friction of the guide as a power of speed.

    Law
    ---
    Level of friction ``F_c max(0.05, 1 + A (|v|/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Source
    ------
    Herschel and Bulkley's law of flow, Kolloid-Zeitschrift 39 (1926).
    """

    name: ClassVar[str] = "guide.friction_power_law"
    change: jax.Array = quantity(
        "-", "relative change of friction at 0.1 m/s", 0.5, lower=-0.95, upper=20.0, symbol="A"
    )


class StiffnessSpeedCurve(CurveOfSpeed, _Stiffness):
    """Stiffness as a fitted curve of the rate of stretch.

    Law
    ---
    Elastic tension ``k e (1 + A w(|e'|))``,
    """

    name: ClassVar[str] = "fibre.stiffness_speed_curve"
    change: jax.Array = quantity(
        "-", "relative change of stiffness at 0.8 m/s", 0.05, lower=-0.5, upper=3.0, symbol="A"
    )


class StiffnessPowerLaw(PowerOfSpeed, _Stiffness):
    """Stiffness as a power of the rate of stretch.

    Law
    ---
    Elastic tension ``k e max(0.05, 1 + A (|e'|/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Source
    ------
    Power laws of strain rate for the modulus of polymer fibres, e.g. Ward and Sweeney, Mechanical Properties of Solid
    Polymers (2012), ch. 11.
    """

    name: ClassVar[str] = "fibre.stiffness_power_law"
    change: jax.Array = quantity(
        "-", "relative change of stiffness at 0.1 m/s", 0.03, lower=-0.1, upper=3.0, symbol="A"
    )


class DampingSpeedCurve(CurveOfSpeed, _Damping):
    """Damping as a fitted curve of the rate of stretch.

    Law
    ---
    Damping coefficient ``b (1 + A w(|e'|))``,
    """

    name: ClassVar[str] = "fibre.damping_speed_curve"
    change: jax.Array = quantity("-", "relative change of damping at 0.8 m/s", 0.5, lower=-0.95, upper=20.0, symbol="A")


class DampingPowerLaw(PowerOfSpeed, _Damping):
    """Damping as a power of the rate of stretch.

    Law
    ---
    Damping coefficient ``b max(0.05, 1 + A (|e'|/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Source
    ------
    Fractional power dampers, e.g. Soong and Dargush, Passive Energy Dissipation Systems (1997), ch. 6.
    """

    name: ClassVar[str] = "fibre.damping_power_law"
    change: jax.Array = quantity("-", "relative change of damping at 0.1 m/s", 0.5, lower=-0.95, upper=20.0, symbol="A")


class FrictionSpeedExponent(ScalingWithSpeed, _Friction):
    """Friction of the guide in proportion to a power of speed.

    Law
    ---
    Level of friction ``F_c (|v|/v_ref)^p``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Source
    ------
    Ostwald's law of flow, Kolloid-Zeitschrift 36 (1925).
    """

    name: ClassVar[str] = "guide.friction_speed_exponent"
    exponent: jax.Array = quantity("-", "exponent of friction", 0.2, lower=-0.5, upper=2.0, symbol="p")


class StiffnessSpeedExponent(ScalingWithSpeed, _Stiffness):
    """Stiffness in proportion to a power of the rate of stretch.

    Law
    ---
    Elastic tension ``k e (|e'|/v_ref)^p``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Source
    ------
    Power laws of strain rate for the modulus of polymer fibres, e.g. Ward and Sweeney, Mechanical Properties of Solid
    Polymers (2012), ch. 11.
    """

    name: ClassVar[str] = "fibre.stiffness_speed_exponent"
    exponent: jax.Array = quantity("-", "exponent of stiffness", 0.02, lower=-0.2, upper=0.5, symbol="p")


class DampingSpeedExponent(ScalingWithSpeed, _Damping):
    """Damping in proportion to a power of the rate of stretch.

    Law
    ---
    Damping coefficient ``b (|e'|/v_ref)^p``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Source
    ------
    Fractional power dampers, e.g. Soong and Dargush, Passive Energy Dissipation Systems (1997), ch. 6.
    """

    name: ClassVar[str] = "fibre.damping_speed_exponent"
    exponent: jax.Array = quantity("-", "exponent of damping", 0.3, lower=-1.0, upper=2.0, symbol="p")


def monotone(speed: jax.Array, slow: jax.Array, medium: jax.Array) -> jax.Array:
    """Monotone cubic through the knots, constant beyond the last.

    Parameters
    ----------
    speed : () in m/s, not negative
    slow : () a pure number, 0 to 1
        Value at the first knot over that at the second.
    medium : () a pure number, 0 to 1
        Value at the second knot over that at the last, which is 1.

    Source
    ------
    Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984): harmonic means of the neighbouring slopes.
    """
    knots = (0.0, SLOW, MEDIUM, TOP)
    values = (jnp.zeros(()), slow * medium, medium, jnp.ones(()))
    steep = [(values[i + 1] - values[i]) / (knots[i + 1] - knots[i]) for i in range(3)]
    slopes = [steep[0], _harmonic(steep[0], steep[1]), _harmonic(steep[1], steep[2]), jnp.zeros(())]
    value = values[3]
    for i in reversed(range(3)):
        piece = _cubic(speed, knots[i], knots[i + 1], values[i : i + 2], slopes[i : i + 2])
        value = jnp.where(speed < knots[i + 1], piece, value)
    return value


def power(speed: jax.Array, exponent: jax.Array) -> jax.Array:
    """``(v/v_ref)^p``, smooth at rest and one at `REFERENCE`; `speed` in m/s may have either sign."""
    smooth = lambda v: (v**2 + SMOOTH**2) ** (0.5 * exponent) - SMOOTH**exponent  # noqa: E731
    return smooth(speed) / smooth(REFERENCE)


def _harmonic(one: jax.Array, other: jax.Array) -> jax.Array:
    total = one + other
    safe = jnp.where(total > 0.0, total, 1.0)
    return jnp.where(total > 0.0, 2.0 * one * other / safe, 0.0)


def _cubic(x: jax.Array, low: float, high: float, values: tuple, slopes: list) -> jax.Array:
    width = high - low
    s, rise = (x - low) / width, values[1] - values[0]
    m0, m1 = slopes[0] * width, slopes[1] * width
    return values[0] + s * (m0 + s * (3.0 * rise - 2.0 * m0 - m1 + s * (m0 + m1 - 2.0 * rise)))
