"""Damping as a power of the rate of stretch."""

from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.effects.law import FibreLaw, quantity
from fibrefit.effects.speed_curve import power


class DampingPowerLaw(FibreLaw):
    """Damping as a power of the rate of stretch.

    Law
    ---
    Damping coefficient ``b max(0.05, 1 + A (|e'|/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

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
    Fractional power dampers, e.g. Soong and Dargush, Passive Energy Dissipation Systems (1997), ch. 6.
    """

    name: ClassVar[str] = "fibre.damping_power_law"
    sought: ClassVar[frozenset[str]] = frozenset()
    change: jax.Array = quantity("-", "relative change of damping at 0.1 m/s", 0.5, lower=-0.95, upper=20.0)
    exponent: jax.Array = quantity("-", "exponent", 0.7, lower=0.2, upper=3.0)

    def damping_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + A w."""
        return jnp.maximum(1.0 + self.change * power(rate, self.exponent), 0.05)
