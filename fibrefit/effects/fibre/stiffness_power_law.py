"""Stiffness as a power of the rate of stretch."""

from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.effects.law import FibreLaw, quantity
from fibrefit.effects.speed_curve import power


class StiffnessPowerLaw(FibreLaw):
    """Stiffness as a power of the rate of stretch.

    Law
    ---
    Elastic tension ``k e (1 + A (|e'|/v_ref)^p)``, ``v_ref`` = 0.1 m/s, smooth below 1 mm/s.

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
    Power laws of strain rate for the modulus of polymer fibres, e.g. Ward and Sweeney, Mechanical Properties of Solid
    Polymers (2012), ch. 11.
    """

    name: ClassVar[str] = "fibre.stiffness_power_law"
    sought: ClassVar[frozenset[str]] = frozenset()
    change: jax.Array = quantity("-", "relative change of stiffness at 0.1 m/s", 0.03, lower=-0.1, upper=3.0)
    exponent: jax.Array = quantity("-", "exponent", 0.7, lower=0.2, upper=3.0)

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """1 + A w."""
        return 1.0 + self.change * power(rate, self.exponent)
