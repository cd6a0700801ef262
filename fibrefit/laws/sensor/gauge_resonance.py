from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability, inverse_of
from fibrefit.laws.law import SensorLaw, quantity


class GaugeResonance(SensorLaw):
    """A force gauge that rings at its own frequency.

    Law
    ---
    Reading y with ``y'' + 2 ζ ω y' + ω^2 y = ω^2 F``, ``ω = 2π f_0``: the real part of a
    lag of time constant ``(ζ + i s)/ω`` and weight ``(s - i ζ)/s``, ``s = sqrt(1 - ζ^2)``.

    Valid range
    -----------
    ζ < 1. The gauge is at rest when the record begins.

    Source
    ------
    Doebelin, Measurement Systems (2003), ch. 3.
    """

    name: ClassVar[str] = "sensor.gauge_resonance"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE})
    dynamic: ClassVar[bool] = True
    natural_frequency: jax.Array = quantity(
        "Hz", "natural frequency of the force gauge", 200.0, lower=5.0, null=math.inf, reciprocal=True, symbol="f_0"
    )
    damping_ratio: jax.Array = quantity("-", "its damping ratio", 0.05, lower=1e-3, upper=0.95, log=True, symbol="ζ")

    def lags(self) -> tuple[tuple[jax.Array, jax.Array], ...]:
        """One complex lag."""
        zeta, period = self.damping_ratio, inverse_of(self.natural_frequency) / (2.0 * jnp.pi)
        s = jnp.sqrt(1.0 - zeta**2)
        return ((jax.lax.complex(s, -zeta) / s, period * jax.lax.complex(zeta, s)),)
