"""Curves over speed that rise, or fall, all the way: nil at rest, one at a speed of reference."""

from __future__ import annotations

from typing import Any, ClassVar

import jax
import jax.numpy as jnp

from fibrefit.effects.law import Effect, quantity

SLOW, MEDIUM, TOP = 0.03, 0.12, 0.4
"""Speeds in m/s of the knots of a monotone curve."""
REFERENCE = 0.1
"""Speed in m/s at which a power law is one."""
SMOOTH = 1e-3
"""Speed in m/s below which a power law bends into a parabola: a root has no slope at rest."""


_PAGE = """w a monotone cubic of the speed that is 0 at rest, 1 at 0.4 m/s and beyond, and has two knots between,
    at 0.03 and 0.12 m/s.

    Parameters
    ----------
    change : () a pure number
        A, relative change at 0.4 m/s; either sign.
    slow_share : () a pure number
        Value of w at the first knot over that at the second.
    medium_share : () a pure number
        Value of w at the second knot.

    Valid range
    -----------
    Speeds to well above 0.12 m/s in the records; below, only one knot is told. Falls too, where A is negative.

    Source
    ------
    Monotone piecewise cubic interpolation: Fritsch and Butland, SIAM J. Sci. Stat. Comput. 5 (1984).
    """
"""What the page of every such effect goes on with after its law."""


class SpeedCurve(Effect):
    """A relative change that goes with speed as a fitted curve.

    An effect says what is changed: the law in its docstring, a method, and `change` with limits of its own.
    """

    sought: ClassVar[frozenset[str]] = frozenset()
    change: jax.Array = quantity("-", "relative change at 0.4 m/s", 0.5)
    slow_share: jax.Array = quantity("-", "change at 0.03 m/s over that at 0.12 m/s", 0.4, lower=0.0, upper=1.0)
    medium_share: jax.Array = quantity("-", "change at 0.12 m/s over that at 0.4 m/s", 0.4, lower=0.0, upper=1.0)

    def __init_subclass__(cls, **keywords: Any) -> None:
        super().__init_subclass__(**keywords)
        cls.__doc__ = f"{(cls.__doc__ or '').rstrip()} {_PAGE}"

    def changed(self, speed: jax.Array) -> jax.Array:
        """A w, the relative change at a `speed` in m/s of either sign."""
        return self.change * monotone(jnp.abs(speed), self.slow_share, self.medium_share)


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
