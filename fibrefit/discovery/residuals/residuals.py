"""What a fit leaves, channel by channel and record by record."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fibrefit.problem import Motion, Noise, Problem, ResidualSet

SHORTEST_WINDOW = 0.010
"""Length in s of the shortest windows whose gap is compared: a fraction of a contact."""


def residual_set_at(problem: Problem, values: np.ndarray, noise: Mapping[str, Noise]) -> ResidualSet:
    """What values leave of a problem whose inputs are taken as they are.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) or, where records differ, (n_record, n_local) in SI units
    noise : mapping of channel to Noise
    """
    moved, data = Motion.of(problem, values), problem.observations
    channels = problem.model.rig.channels
    residuals = np.stack(
        [np.asarray(data.weight[c]) * (moved.readings[c] - np.asarray(data.measured[c])) for c in channels], axis=1
    )
    return ResidualSet(problem, residuals, moved, noise)


class ChannelResidual(NamedTuple):
    """One channel of one record.

    Parameters
    ----------
    record, channel : int
    residual : (n_sample,) in units of the noise
    counted : (n_sample,) bool
    times : (n_sample,) in s
    phase : (n_sample,) int
    sigma : float
        Noise rms, in SI units.
    noise : Noise
    """

    record: int
    channel: int
    residual: np.ndarray
    counted: np.ndarray
    times: np.ndarray
    phase: np.ndarray
    sigma: float
    noise: Noise

    @property
    def rate(self) -> float:
        """Sampling rate in Hz."""
        return float((len(self.times) - 1) / (self.times[-1] - self.times[0]))

    @property
    def window(self) -> int:
        """Samples of the shortest windows that are compared."""
        return max(round(SHORTEST_WINDOW * self.rate), 4)

    @property
    def excess(self) -> np.ndarray:
        """Squared residuals beyond what noise leaves on average, ``(n_sample,)``; 0 where a sample does not count."""
        return np.where(self.counted, self.residual**2 - 1.0, 0.0)


def channel_residuals(found: ResidualSet) -> list[ChannelResidual]:
    """All channels of all records, without the padding."""
    counted, sigma = found.counted, found.sigma
    return [
        ChannelResidual(
            r,
            c,
            found.residuals[r, c, :count],
            counted[r, c, :count],
            found.times[r, :count],
            found.motion.phase[r, :count],
            float(sigma[r, c]),
            found.noise[channel],
        )
        for r, count in enumerate(found.counts)
        for c, channel in enumerate(found.channels)
    ]
