"""Curves over speed that rise, or fall, all the way: nil at rest, one at a speed of reference."""

from __future__ import annotations

import jax
import jax.numpy as jnp

SLOW, MEDIUM, TOP = 0.03, 0.12, 0.4
"""Speeds in m/s of the knots of a monotone curve."""
REFERENCE = 0.1
"""Speed in m/s at which a power law is one."""
SMOOTH = 1e-3
"""Speed in m/s below which a power law bends into a parabola: a root has no slope at rest."""


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
