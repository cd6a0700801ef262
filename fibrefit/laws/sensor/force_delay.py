from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import SensorLaw, quantity


class ForceDelay(SensorLaw):
    """A force channel that is late against the others.

    Law
    ---
    ``F(t - δ)``.

    Valid range
    -----------
    Shorter than the record; before its first sample the force is taken as constant.

    Source
    ------
    Multiplexed loggers, and digital filters of constant group delay.
    """

    name: ClassVar[str] = "sensor.force_delay"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    dynamic: ClassVar[bool] = True
    delay: jax.Array = quantity("s", "time by which the force reading is late", 1e-3, lower=0.0, upper=0.05, symbol="δ")

    def late_by(self) -> jax.Array:
        """δ."""
        return self.delay
