from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, of_force, quantity


class GaugeNonlinearity(SensorLaw):
    """A force gauge whose reading is not proportional to the force.

    Law
    ---
    ``F (1 + ν F)``.

    Valid range
    -----------
    |ν F| well below 1: the first term beyond the calibration.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.gauge_nonlinearity"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    nonlinearity: jax.Array = quantity(
        "1/N", "relative growth of the gain over the force", 2e-4, lower=-0.01, upper=0.01, symbol="ν"
    )

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """F (1 + ν F)."""
        return of_force(channels, lambda force: force * (1.0 + self.nonlinearity * force))
