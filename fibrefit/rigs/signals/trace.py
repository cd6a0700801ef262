"""One record as its rig takes it: what is explained, what drives it, what was known of it."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np


class Trace(NamedTuple):
    """One record, ready to be compared with a model; NumPy arrays, SI units.

    Parameters
    ----------
    times : (n_time,) in s
    channels : dict of (n_time,)
        Measured channels that are explained; NaN where a sample is not valid.
    inputs : dict of (n_time, 3)
        Measured inputs, smoothed; their rates; and as they were measured.
    """

    name: str
    times: np.ndarray
    channels: dict[str, np.ndarray]
    inputs: dict[str, np.ndarray]
    conditions: dict[str, float]

    @property
    def step(self) -> float:
        """Mean time in s from one sample to the next."""
        return float(np.diff(self.times).mean())

    @property
    def rate(self) -> float:
        """Samples a second, in Hz."""
        return 1.0 / self.step

    @property
    def duration(self) -> float:
        """From the first sample to the last, in s."""
        return float(self.times[-1] - self.times[0])
