from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.forms_of_change import ByRecord, OfFriction
from fibrefit.laws.law import ALWAYS_LEFT, quantity


class FrictionTrend(ByRecord, OfFriction):
    """Friction that grows or falls from record to record, as in a guide that is run in.

    Law
    ---
    Level ``F_c max(0.02, 1 + a (n - 1))`` in the n-th record of the study.

    Valid range
    -----------
    Records that stand in the study in the order in which they were taken.

    Source
    ------
    First term of a series in the number of the test; running-in: Blau, Wear 155 (1992) 29-43.
    """

    name: ClassVar[str] = "guide.friction_trend"
    trend: jax.Array = quantity(
        "-", "relative growth of Coulomb friction a record", 0.1, lower=-0.3, upper=5.0, symbol="a"
    )

    def relative(self) -> jax.Array:
        """max(0.02, 1 + a (n - 1)) - 1."""
        return jnp.maximum(ALWAYS_LEFT - 1.0, self.trend)
