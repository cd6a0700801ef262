"""Friction of the guide as a fitted curve of speed."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.effects.law import GuideLaw, quantity
from fibrefit.effects.speed_curve import monotone


class FrictionSpeedCurve(GuideLaw):
    """Friction of the guide as a fitted curve of speed.

    Law
    ---
    Level of friction ``F_c (1 + A w(|v|))``, w a monotone cubic that is 0 at rest, 1 at 0.4 m/s and beyond, and has
    two knots between, at 0.03 and 0.12 m/s.

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

    name: ClassVar[str] = "guide.friction_speed_curve"
    sought: ClassVar[frozenset[str]] = frozenset()
    change: jax.Array = quantity("-", "relative change of friction at 0.4 m/s", 0.5, lower=-0.95, upper=20.0)
    slow_share: jax.Array = quantity("-", "change at 0.03 m/s over that at 0.12 m/s", 0.4, lower=0.0, upper=1.0)
    medium_share: jax.Array = quantity("-", "change at 0.12 m/s over that at 0.4 m/s", 0.4, lower=0.0, upper=1.0)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c A w."""
        return coulomb * self.change * monotone(jnp.abs(velocity), self.slow_share, self.medium_share)
