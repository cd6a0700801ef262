from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, of_force, quantity


class ForceOffset(SensorLaw):
    """A force gauge that does not read zero at zero force.

    Law
    ---
    ``F + o``.

    Valid range
    -----------
    Any.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.force_offset"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    offset: jax.Array = quantity(
        "N", "reading of the force gauge at zero force", 0.5, lower=-100.0, upper=100.0, symbol="o"
    )

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """F + o."""
        return of_force(channels, lambda force: force + self.offset)
