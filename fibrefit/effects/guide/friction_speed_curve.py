"""Friction of the guide as a fitted curve of speed."""

from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.effects.law import GuideLaw, quantity
from fibrefit.effects.speed_curve import SpeedCurve


class FrictionSpeedCurve(SpeedCurve, GuideLaw):
    """Friction of the guide as a fitted curve of speed.

    Law
    ---
    Level of friction ``F_c (1 + A w(|v|))``,
    """

    name: ClassVar[str] = "guide.friction_speed_curve"
    change: jax.Array = quantity("-", "relative change of friction at 0.4 m/s", 0.5, lower=-0.95, upper=20.0)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c A w."""
        return coulomb * self.changed(velocity)
