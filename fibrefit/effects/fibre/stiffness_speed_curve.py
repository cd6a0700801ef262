"""Stiffness as a fitted curve of the rate of stretch."""

from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.effects.law import FibreLaw, quantity
from fibrefit.effects.speed_curve import SpeedCurve


class StiffnessSpeedCurve(SpeedCurve, FibreLaw):
    """Stiffness as a fitted curve of the rate of stretch.

    Law
    ---
    Elastic tension ``k e (1 + A w(|e'|))``,
    """

    name: ClassVar[str] = "fibre.stiffness_speed_curve"
    change: jax.Array = quantity("-", "relative change of stiffness at 0.4 m/s", 0.05, lower=-0.5, upper=3.0)

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + A w."""
        return 1.0 + self.changed(rate)
