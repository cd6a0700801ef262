from __future__ import annotations

from typing import ClassVar, Self

import jax
import jax.numpy as jnp

from fibrefit.laws.law import LEAST, GuideLaw, quantity


class FrictionTrend(GuideLaw):
    """Friction that grows or falls from record to record, as in a guide that is run in.

    Law
    ---
    Level ``F_c max(0.02, 1 + a (n - 1))`` in the n-th record of the study.

    Parameters
    ----------
    trend : () a pure number
        a.

    Valid range
    -----------
    Records that stand in the study in the order in which they were taken.

    Source
    ------
    First term of a series in the number of the test; running-in: Blau, Wear 155 (1992) 29-43.
    """

    name: ClassVar[str] = "guide.friction_trend"
    trend: jax.Array = quantity("-", "relative growth of Coulomb friction a record", 0.1, lower=-0.3, upper=5.0)

    def in_record(self, number: jax.Array, duration: jax.Array) -> Self:
        """What has come together by then; the first record is as the base model says."""
        return self.scaled(number - 1.0)

    def friction(self, coulomb: jax.Array, direction: jax.Array, velocity: jax.Array, tension: jax.Array) -> jax.Array:
        """F_c (max(0.02, 1 + a (n - 1)) - 1)."""
        return coulomb * jnp.maximum(LEAST - 1.0, self.trend)
