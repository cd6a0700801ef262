"""Laws that go with speed: three things that a law changes, each as a curve, a power added, or a power by itself."""

from __future__ import annotations

import inspect
import types
from typing import ClassVar, NamedTuple

import jax
import jax.numpy as jnp

from fibrefit.laws.law import Effect, FibreLaw, GuideLaw, quantity

SLOW, MEDIUM, TOP = 0.05, 0.2, 0.8
"""Speeds in m/s of the knots of a monotone curve."""
REFERENCE = 0.1
"""Speed in m/s at which a power law is one."""
SMOOTH = 1e-3
"""Speed in m/s below which a power law bends into a parabola: a root has no slope at rest."""
LEAST = 0.05
"""What a law with an added power leaves of the base law."""


class FunctionOfSpeed(Effect):
    """A relative change that goes with speed.

    A form of it says how (`relative`), a place what is changed; a law is one of each. The docstring of a form is the
    page of its laws, with words of the place in braces; the first parameter has limits for each place.

    Attributes
    ----------
    form : str
        Name of the form, the end of that of its laws.
    """

    form: ClassVar[str]

    def relative(self, speed: jax.Array) -> jax.Array:
        """The relative change at a `speed` in m/s of either sign."""
        raise NotImplementedError

    def factor(self, speed: jax.Array) -> jax.Array:
        """What is changed, as a multiple of what it is without the law."""
        return 1.0 + self.relative(speed)


class CurveOfSpeed(FunctionOfSpeed):
    """{title} as a fitted curve of {speed}.

    Law
    ---
    {level} (1 + A w({symbol}))``, w a monotone cubic of the speed that is 0 at rest, 1 at 0.8 m/s and beyond, and has
    two knots between, at 0.05 and 0.2 m/s.

    Valid range
    -----------
    Speeds to well above 0.2 m/s in the records; below, only one knot is determined. Falls too, where A is negative.

    Source
    ------
    Monotone piecewise cubic interpolation: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
    """

    form: ClassVar[str] = "speed_curve"
    change: jax.Array = quantity("-", "relative change of {word} at 0.8 m/s", 0.5, symbol="A")
    slow_share: jax.Array = quantity("-", "change at 0.05 m/s over that at 0.2 m/s", 0.4, lower=0.0, upper=1.0)
    medium_share: jax.Array = quantity("-", "change at 0.2 m/s over that at 0.8 m/s", 0.4, lower=0.0, upper=1.0)

    def relative(self, speed: jax.Array) -> jax.Array:
        """A times the curve."""
        return self.change * monotone(jnp.abs(speed), self.slow_share, self.medium_share)


class PowerOfSpeed(FunctionOfSpeed):
    """{title} as a power of {speed}.

    Law
    ---
    {level} max(0.05, 1 + A ({symbol}/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Valid range
    -----------
    Speeds of more than a decade in the records: otherwise A and p cannot be distinguished.

    Source
    ------
    {power}
    """

    form: ClassVar[str] = "power_law"
    change: jax.Array = quantity("-", "relative change of {word} at 0.1 m/s", 0.5, symbol="A")
    exponent: jax.Array = quantity("-", "exponent", 0.7, lower=0.2, upper=3.0, symbol="p")

    def relative(self, speed: jax.Array) -> jax.Array:
        """A times the power."""
        return self.change * power(speed, self.exponent)

    def factor(self, speed: jax.Array) -> jax.Array:
        """No less than `LEAST`: a power knows no limit."""
        return jnp.maximum(1.0 + self.relative(speed), LEAST)


class ScalingWithSpeed(FunctionOfSpeed):
    """{title} in proportion to a power of {speed}.

    Law
    ---
    {level} ({symbol}/v_ref)^p``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Valid range
    -----------
    Speeds of more than an octave in the records: otherwise p is not distinguished from the value at 0.1 m/s.

    Source
    ------
    {scaling}
    """

    form: ClassVar[str] = "speed_exponent"
    exponent: jax.Array = quantity("-", "exponent of {word}", 0.3, symbol="p")

    def relative(self, speed: jax.Array) -> jax.Array:
        """The power, less one."""
        return jnp.expm1(0.5 * self.exponent * jnp.log((speed**2 + SMOOTH**2) / (REFERENCE**2 + SMOOTH**2)))


class FrictionWithSpeed(FunctionOfSpeed, GuideLaw):
    """The level of the guide's friction."""

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """What the law adds to F_c."""
        return coulomb * (self.factor(velocity) - 1.0)


class StiffnessWithRate(FunctionOfSpeed, FibreLaw):
    """The stiffness of the fibre."""

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """Factor at that rate."""
        return self.factor(rate)


class DampingWithRate(FunctionOfSpeed, FibreLaw):
    """The damping of the fibre."""

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """Factor at that rate."""
        return self.factor(rate)


class _Place(NamedTuple):
    """What is changed: its port, the law's class there, and words for pages; sources of both kinds of power."""

    port: str
    law: type[FunctionOfSpeed]
    word: str
    title: str
    speed: str
    symbol: str
    level: str
    power: str
    scaling: str


_WARD = """Power laws of strain rate for the modulus of polymer fibres, e.g. Ward and Sweeney, Mechanical Properties of
Solid Polymers (2012), ch. 11."""
_SOONG = "Fractional power dampers, e.g. Soong and Dargush, Passive Energy Dissipation Systems (1997), ch. 6."
_FLOW = (
    "Herschel and Bulkley's law of flow, Kolloid-Zeitschrift 39 (1926).",
    "Ostwald's law of flow, Kolloid-Zeitschrift 36 (1925).",
)
_AT_RATE = ("the rate of stretch", "|e'|")
_FRICTION = _Place(
    "guide", FrictionWithSpeed, "friction", "Friction of the guide", "speed", "|v|", "Level of friction ``F_c", *_FLOW
)
_STIFFNESS = _Place(
    "fibre", StiffnessWithRate, "stiffness", "Stiffness", *_AT_RATE, "Elastic tension ``k e", _WARD, _WARD
)
_DAMPING = _Place("fibre", DampingWithRate, "damping", "Damping", *_AT_RATE, "Damping coefficient ``b", _SOONG, _SOONG)


def _law(
    form: type[FunctionOfSpeed], place: _Place, typical: float, lower: float, upper: float
) -> type[FunctionOfSpeed]:
    """The law of a form at a place, with what is usual of its first parameter."""
    first, words = form.parameters[0], place._asdict()
    content = {
        "__module__": __name__,
        "__doc__": inspect.cleandoc(form.__doc__ or "").format(**words),
        "__annotations__": {first.name: jax.Array},
        "name": f"{place.port}.{place.word}_{form.form}",
        first.name: quantity("-", first.doc.format(**words), typical, lower=lower, upper=upper, symbol=first.symbol),
    }
    name = "".join(word.capitalize() for word in f"{place.word}_{form.form}".split("_"))
    return types.new_class(name, (form, place.law), exec_body=lambda body: body.update(content))


FrictionSpeedCurve = _law(CurveOfSpeed, _FRICTION, 0.5, -0.95, 20.0)
FrictionPowerLaw = _law(PowerOfSpeed, _FRICTION, 0.5, -0.95, 20.0)
FrictionSpeedExponent = _law(ScalingWithSpeed, _FRICTION, 0.2, -0.5, 2.0)
StiffnessSpeedCurve = _law(CurveOfSpeed, _STIFFNESS, 0.05, -0.5, 3.0)
StiffnessPowerLaw = _law(PowerOfSpeed, _STIFFNESS, 0.03, -0.1, 3.0)
StiffnessSpeedExponent = _law(ScalingWithSpeed, _STIFFNESS, 0.02, -0.2, 0.5)
DampingSpeedCurve = _law(CurveOfSpeed, _DAMPING, 0.5, -0.95, 20.0)
DampingPowerLaw = _law(PowerOfSpeed, _DAMPING, 0.5, -0.95, 20.0)
DampingSpeedExponent = _law(ScalingWithSpeed, _DAMPING, 0.3, -1.0, 2.0)


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
        width = knots[i + 1] - knots[i]
        s, rise = (speed - knots[i]) / width, values[i + 1] - values[i]
        m0, m1 = slopes[i] * width, slopes[i + 1] * width
        piece = values[i] + s * (m0 + s * (3.0 * rise - 2.0 * m0 - m1 + s * (m0 + m1 - 2.0 * rise)))
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
