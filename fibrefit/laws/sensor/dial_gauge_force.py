from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import GuideLaw, quantity


class DialGaugeForce(GuideLaw):
    """A dial gauge that pushes on the weight whose position it measures.

    Law
    ---
    ``- (F_d + k_d u)`` on the weight.

    Valid range
    -----------
    The plunger keeps contact: F_d + k_d u > 0; u counts from where the fibre is just taut.

    Source
    ------
    Measuring force of mechanical dial gauges, ISO 463.
    """

    name: ClassVar[str] = "sensor.dial_gauge_force"
    strength: ClassVar[tuple[str, ...]] = ("gauge_force", "gauge_spring")
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    gauge_force: jax.Array = quantity(
        "N", "push of the dial gauge where the fibre is just taut", 1.0, lower=0.0, upper=50.0, symbol="F_d"
    )
    gauge_spring: jax.Array = quantity("N/m", "rate of its spring", 30.0, lower=0.0, upper=5e3, symbol="k_d")

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """F_d + k_d u."""
        return self.gauge_force + self.gauge_spring * position
