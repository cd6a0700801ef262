"""Damping as a fitted curve of the rate of stretch."""

from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.effects.law import FibreLaw, quantity
from fibrefit.effects.speed_curve import SpeedCurve


class DampingSpeedCurve(SpeedCurve, FibreLaw):
    """Damping as a fitted curve of the rate of stretch.

    Law
    ---
    Damping coefficient ``b (1 + A w(|e'|))``,
    """

    name: ClassVar[str] = "fibre.damping_speed_curve"
    change: jax.Array = quantity("-", "relative change of damping at 0.4 m/s", 0.5, lower=-0.95, upper=20.0)

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + A w."""
        return 1.0 + self.changed(rate)
