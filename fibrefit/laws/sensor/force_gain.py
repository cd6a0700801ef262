from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, of_force, quantity


class ForceGain(SensorLaw):
    """A force gauge whose calibration is off.

    Law
    ---
    ``g F``.

    Valid range
    -----------
    Linear gauge.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.force_gain"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    gain: jax.Array = quantity("-", "gain of the force gauge", 1.02, lower=0.5, upper=2.0, null=1.0, symbol="g")

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """Force times g."""
        return of_force(channels, lambda force: self.gain * force)
