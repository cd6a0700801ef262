"""Gauges that read wrongly at every instant: gain, offset, drift, nonlinearity, cross-talk."""

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
