"""A saved fit, cut into records and channels for drawing: its summary and the groups of its ``result.h5``."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fibrefit.core.declarations import HELD, REST
from fibrefit.plots.records import Compared
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.part import AXES, Groups, conditions_text
from fibrefit.study.summaries.results import FitResultSummary, Gap

MARGIN = 0.15
"""Rest that is shown on either side of a motion, as a share of it."""
MOST = 0.9
"""Share of a record from which all of it is shown: it is not worth cutting."""


class Fitted:
    """Records and one model of them.

    Parameters
    ----------
    groups : Groups
        ``observed_data``, ``constant_data``, and the predictions and the motion of the model.
    record_gaps : mapping of record to Gap
    stage : str
        End of the names of the model's groups.
    """

    def __init__(self, groups: Groups, gap: Gap, record_gaps: Mapping[str, Gap], stage: str = "") -> None:
        observed = groups["observed_data"]
        self.gap, self.record_gaps = gap, record_gaps
        self.records: tuple[str, ...] = tuple(map(str, observed["record"].values))
        self.channels: tuple[str, ...] = tuple(name for name in gap.channels if name in observed)
        self.counts = groups["constant_data"]["samples"].values.astype(int)
        self.phases = groups[f"motion{stage}"]["phase"].values.astype(int)
        self.states = {
            name.replace("_", " "): one
            for name, one in groups[f"motion{stage}"].items()
            if name not in (*AXES, "phase")
        }
        self._times = observed["time"].values
        self._measured = {name: observed[name].values for name in self.channels}
        self._simulated = {name: groups[f"predictions{stage}"][name].values for name in self.channels}
        self._errors = {
            name: one.values
            for name in self.channels
            if (one := groups[f"predictions{stage}"].get(f"{name}_error")) is not None
        }
        self._constants = groups["constant_data"]

    @classmethod
    def of(cls, summary: FitResultSummary, groups: Groups) -> Fitted:
        """The model a fit, or a search, ends with."""
        return cls(groups, summary.gap, {name: one.gap for name, one in summary.records.items()})

    @classmethod
    def before(cls, summary: DiscoverySummary, groups: Groups) -> Fitted:
        """The model a search begins with."""
        assert summary.before is not None
        return cls(groups, summary.before.gap, summary.before.records, "_before")

    def times(self, record: int) -> np.ndarray:
        """Instants ``(n_time,)`` of a record, in s."""
        return self._times[record, : self.counts[record]]

    def phase(self, record: int) -> np.ndarray:
        """Phase ``(n_time,)`` of the simulated motion of a record."""
        return self.phases[record, : self.counts[record]]

    def noise(self, record: int, channel: str) -> float:
        """Noise rms of a channel in a record, in SI units; NaN where it is not known."""
        noise = self.record_gaps[self.records[record]].channels[channel].noise
        return float("nan") if noise is None else noise

    def compared(self, record: int) -> list[Compared]:
        """Channels of a record."""
        span = slice(0, self.counts[record])
        return [
            Compared(
                name,
                self.gap.channels[name].unit,
                self.times(record),
                self._measured[name][record, span],
                self._simulated[name][record, span],
                self.noise(record, name),
                self._errors[name][record, span] if name in self._errors else None,
            )
            for name in self.channels
        ]

    def residuals(self, channel: str) -> np.ndarray:
        """Measured minus simulated over the noise, ``(n_record, n_time)``; NaN where nothing counts."""
        noise = np.array([self.noise(r, channel) for r in range(len(self.records))])
        return (self._measured[channel] - self._simulated[channel]) / noise[:, None]

    def worst(self, most: int) -> list[int]:
        """Records that are explained worst, in their order."""
        # One that cannot be simulated is explained worst of all.
        sizes = [np.inf if (total := self.record_gaps[name].total) is None else total for name in self.records]
        return sorted(sorted(range(len(sizes)), key=lambda r: -sizes[r])[:most])

    def conditions(self, record: int) -> str:
        """What tells a record from its neighbours: ``lift 10 mm, inclination 45°``."""
        return conditions_text(self._constants, record)

    def motion_ends(self, record: int) -> tuple[float, float]:
        """Begin and end of what is worth seeing of a record: its motion, with some rest on either side."""
        times, phase = self.times(record), self.phase(record)
        moving = np.flatnonzero(~np.isin(phase, (HELD, REST)))
        if not moving.size:
            return float(times[0]), float(times[-1])
        first, last = float(times[moving[0]]), float(times[moving[-1]])
        margin = MARGIN * max(last - first, 1e-9)
        ends = max(first - margin, float(times[0])), min(last + margin, float(times[-1]))
        return ends if ends[1] - ends[0] < MOST * (times[-1] - times[0]) else (float(times[0]), float(times[-1]))
