from __future__ import annotations

from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, quantity


class PositionRipple(SensorLaw):
    """A displacement gauge with an error that repeats over its scale, as encoders and magnetic strips have it.

    Law
    ---
    ``u + a sin(2π u/p) + b cos(2π u/p)``.

    Valid range
    -----------
    Amplitudes well below p/2π, so that the reading still grows with the position.

    Source
    ------
    Heydemann, Applied Optics 20 (1981) 3382-3384.
    """

    name: ClassVar[str] = "sensor.position_ripple"
    strength: ClassVar[tuple[str, ...]] = ("sine", "cosine")
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.PLACE})
    sine: jax.Array = quantity("m", "amplitude of the sine", 5e-5, lower=-5e-3, upper=5e-3, symbol="a")
    cosine: jax.Array = quantity("m", "amplitude of the cosine", 5e-5, lower=-5e-3, upper=5e-3, symbol="b")
    period: jax.Array = quantity(
        "m", "length over which the error repeats", 5e-3, lower=1e-4, upper=0.2, log=True, symbol="p"
    )

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """``u + a sin(2π u/p) + b cos(2π u/p)``."""
        position = channels["position"]
        phase = 2.0 * jnp.pi * position / self.period
        return channels | {"position": position + self.sine * jnp.sin(phase) + self.cosine * jnp.cos(phase)}
