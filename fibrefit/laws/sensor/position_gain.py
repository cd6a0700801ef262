from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, quantity


class PositionGain(SensorLaw):
    """A displacement gauge whose calibration is off, or that stands askew.

    Law
    ---
    ``g u``.

    Valid range
    -----------
    Linear gauge.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.position_gain"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PLACE})
    gain: jax.Array = quantity(
        "-",
        "gain of the position channel; the cosine of the angle of a gauge that stands askew",
        1.01,
        lower=0.5,
        upper=2.0,
        null=1.0,
        symbol="g",
    )

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """Position times g."""
        return channels | {"position": self.gain * channels["position"]}
