"""Force channels that follow the force late: by a delay, behind a filter, or ringing."""

from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability, inverse_of
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
