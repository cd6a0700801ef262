"""Friction of the guide as a power of speed."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.effects.law import GuideLaw, quantity
from fibrefit.effects.speed_curve import power


class FrictionPowerLaw(GuideLaw):
    """Friction of the guide as a power of speed.

    Law
    ---
    Level of friction ``F_c max(0.05, 1 + A (|v|/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

    Parameters
    ----------
    change : () a pure number
        A, relative change at 0.1 m/s; either sign.
    exponent : () a pure number
        p.

    Valid range
    -----------
    Speeds of more than a decade in the records: otherwise A and p cannot be told apart.

    Source
    ------
    Herschel and Bulkley's law of flow, Kolloid-Zeitschrift 39 (1926).
    """

    name: ClassVar[str] = "guide.friction_power_law"
    sought: ClassVar[frozenset[str]] = frozenset()
    change: jax.Array = quantity("-", "relative change of friction at 0.1 m/s", 0.5, lower=-0.95, upper=20.0)
    exponent: jax.Array = quantity("-", "exponent", 0.7, lower=0.2, upper=3.0)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c A w."""
        return coulomb * jnp.maximum(self.change * power(velocity, self.exponent), -0.95)
