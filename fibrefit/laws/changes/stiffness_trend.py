from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.laws.forms_of_change import ByRecord
from fibrefit.laws.law import ALWAYS_LEFT, FibreLaw, quantity


class StiffnessTrend(ByRecord, FibreLaw):
    """A stiffness that grows or fades from record to record.

    Law
    ---
    Elastic tension ``k e max(0.02, 1 + a (n - 1))`` in the n-th record of the study.

    Valid range
    -----------
    Records that stand in the study in the order in which they were taken.

    Source
    ------
    First term of a series in the number of the test.
    """

    name: ClassVar[str] = "fibre.stiffness_trend"
    trend: jax.Array = quantity(
        "-", "relative growth of the stiffness a record", -0.01, lower=-0.3, upper=1.0, symbol="a"
    )

    def stiffness_factor(self, stretch: jax.Array, rate: jax.Array) -> jax.Array:
        """max(0.02, 1 + a (n - 1))."""
        return jnp.maximum(ALWAYS_LEFT, 1.0 + self.trend)
