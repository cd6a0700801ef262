from __future__ import annotations

from typing import ClassVar

import jax

from fibrefit.core.declarations import Capability
from fibrefit.laws.law import Channels, SensorLaw, of_force, quantity


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
