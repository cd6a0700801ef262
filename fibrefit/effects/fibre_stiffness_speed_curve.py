"""Stiffness as a fitted curve of the rate of stretch."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.effects.law import FibreLaw, quantity
from fibrefit.effects.speed_curve import monotone


class StiffnessSpeedCurve(FibreLaw):
    """Stiffness as a fitted curve of the rate of stretch.

    Law
    ---
    Elastic tension ``k e (1 + A w(|e'|))``, w a monotone cubic that is 0 at rest, 1 at 0.4 m/s and beyond, and has
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

    name: ClassVar[str] = "fibre.stiffness_speed_curve"
    sought: ClassVar[frozenset[str]] = frozenset()
    change: jax.Array = quantity("-", "relative change of stiffness at 0.4 m/s", 0.05, lower=-0.5, upper=3.0)
    slow_share: jax.Array = quantity("-", "change at 0.03 m/s over that at 0.12 m/s", 0.4, lower=0.0, upper=1.0)
    medium_share: jax.Array = quantity("-", "change at 0.12 m/s over that at 0.4 m/s", 0.4, lower=0.0, upper=1.0)

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + A w."""
        return 1.0 + self.change * monotone(jnp.abs(rate), self.slow_share, self.medium_share)
