"""What an identification holds, cut into records and channels for drawing; plain NumPy."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from fibrefit.core.units import format_quantity
from fibrefit.plots.quantities import spelt
from fibrefit.plots.records import Compared

if TYPE_CHECKING:
    from fibrefit.fitting.result import Identification

CONDITIONS = ("lift", "inclination", "added_mass")
"""Conditions worth a word beside a record's name."""


class Fitted:
    """Records of an identification.

    Parameters
    ----------
    found : Identification
    """

    def __init__(self, found: Identification) -> None:
        data = found.problem.observations
        self.found = found
        self.records: tuple[str, ...] = found.problem.layout.records
        self.channels: tuple[str, ...] = found.problem.model.rig.channels
        self.counts = np.asarray(data.experiment.count)
        self._times = np.asarray(data.experiment.times)
        self._conditions = {name: np.asarray(values) for name, values in data.experiment.conditions.items()}
        self._units = {condition.name: condition.unit for condition in found.problem.model.rig.conditions}
        self._measured = {
            name: np.where(np.asarray(data.weight[name]) > 0.0, np.asarray(data.measured[name]), np.nan)
            for name in self.channels
        }

    def times(self, record: int) -> np.ndarray:
        """Instants ``(n_time,)`` of a record, in s."""
        return self._times[record, : self.counts[record]]

    def phase(self, record: int) -> np.ndarray:
        """Phase ``(n_time,)`` of the simulated motion of a record."""
        return self.found.motion.phase[record, : self.counts[record]]

    def compared(self, record: int) -> list[Compared]:
        """Channels of a record."""
        count, name = self.counts[record], self.records[record]
        return [
            Compared(
                channel,
                self.found.gap[channel].unit,
                self.times(record),
                self._measured[channel][record, :count],
                self.found.readings[channel][record, :count],
                self.found.record_gaps[name][channel].noise,
            )
            for channel in self.channels
        ]

    def conditions(self, record: int) -> str:
        """What tells a record from its neighbours: ``lift 10 mm, inclination 45°``."""
        said = []
        for name in CONDITIONS:
            values = self._conditions.get(name)
            if values is not None and values[record] != 0.0:
                said.append(
                    f"{name.replace('_', ' ')} {spelt(format_quantity(float(values[record]), self._units[name]))}"
                )
        return ", ".join(said)

    def _shown(self, condition: str, value: float) -> str:
        return spelt(format_quantity(value, self._units[condition]))
