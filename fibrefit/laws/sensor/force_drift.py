from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, of_force, quantity


class ForceDrift(SensorLaw):
    """A force gauge whose zero drifts while it is read.

    Law
    ---
    ``F + d t``, t from the first sample.

    Valid range
    -----------
    Records short against the time of warming up.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.force_drift"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    drift: jax.Array = quantity("N/s", "drift of the force gauge", 0.2, lower=-50.0, upper=50.0, symbol="d")

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """F + d t."""
        return of_force(channels, lambda force: force + self.drift * (times - times[0]))
