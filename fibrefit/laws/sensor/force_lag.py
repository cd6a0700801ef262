from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import SensorLaw, quantity


class ForceLag(SensorLaw):
    """A force channel behind a first-order low-pass filter.

    Law
    ---
    Reading y with ``τ y' + y = F``.

    Valid range
    -----------
    Any; the filter is at rest when the record begins.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.force_lag"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    dynamic: ClassVar[bool] = True
    time_constant: jax.Array = quantity(
        "s", "time constant of the force amplifier", 1e-3, lower=0.0, upper=0.5, symbol="τ"
    )

    def lags(self) -> tuple[tuple[jax.Array, jax.Array], ...]:
        """One lag of weight 1."""
        return ((jnp.ones_like(self.time_constant), self.time_constant),)
