"""Laws of the sensors: gauges that read wrongly at every instant, force channels that are late, a dial gauge."""

from __future__ import annotations

import math
from typing import ClassVar

import jax
import jax.numpy as jnp

from fibrefit.core.declarations import Capability, inverse_of
from fibrefit.laws.law import Channels, GuideLaw, SensorLaw, of_force, quantity


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


class AccelerationCrosstalk(SensorLaw):
    """A force gauge that feels the acceleration of the weight besides the force.

    Law
    ---
    ``F + m_x u''``, u'' of the weight in its + direction.

    Valid range
    -----------
    Frequencies well below the gauge's own.

    Source
    ------
    Mass of the transducer itself: Ewins, Modal Testing (2000), ch. 3.
    """

    name: ClassVar[str] = "sensor.acceleration_crosstalk"
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.FIBRE, Capability.GUIDE})
    feels: ClassVar[tuple[str, ...]] = ("acceleration",)
    seismic_mass: jax.Array = quantity(
        "kg",
        "force read per acceleration of the weight: a mass that the gauge would carry along",
        0.03,
        lower=-5.0,
        upper=5.0,
        symbol="m_x",
    )

    def measure(self, channels: Channels, times: jax.Array) -> Channels:
        """F + m_x u''."""
        return of_force(channels, lambda force: force + self.seismic_mass * channels["acceleration"])


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


class DialGaugeForce(GuideLaw):
    """A dial gauge that pushes on the weight whose position it measures.

    Law
    ---
    ``- (F_d + k_d u)`` on the weight.

    Valid range
    -----------
    The plunger keeps contact: F_d + k_d u > 0; u counts from where the fibre is just taut.

    Source
    ------
    Measuring force of mechanical dial gauges, ISO 463.
    """

    name: ClassVar[str] = "sensor.dial_gauge_force"
    strength: ClassVar[tuple[str, ...]] = ("gauge_force", "gauge_spring")
    acts_on: ClassVar[frozenset[Capability]] = frozenset({Capability.GUIDE, Capability.FIBRE})
    gauge_force: jax.Array = quantity(
        "N", "push of the dial gauge where the fibre is just taut", 1.0, lower=0.0, upper=50.0, symbol="F_d"
    )
    gauge_spring: jax.Array = quantity("N/m", "rate of its spring", 30.0, lower=0.0, upper=5e3, symbol="k_d")

    def force(self, position: jax.Array, velocity: jax.Array) -> jax.Array:
        """F_d + k_d u."""
        return self.gauge_force + self.gauge_spring * position
