"""Whether a few samples, each far from its neighbours, carry most of what a model leaves.

A model that lacks something is wrong for longer than a sample: a reading that stands alone is one of the logger's. One
such reading may leave more squares than all others together, and bend every value.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.fitting.thresholds import CARRIED_ALONE, STANDS_OUT
from fibrefit.problem.diagnose.motion import ResidualSet

NEIGHBOURS = 2
"""Samples on each side with which one is compared: two strays side by side are still found."""


class LoneSample(NamedTuple):
    """A reading that lies far off, and by how many times the noise.

    Parameters
    ----------
    time : float, in s
    size : float
    """

    record: str
    channel: str
    time: float
    size: float


class LoneSamples(NamedTuple):
    """The samples, largest first, and the share of what is left beyond the noise, in squares, that they carry."""

    samples: tuple[LoneSample, ...]
    share: float


def lone_samples(residual_set: ResidualSet) -> LoneSamples | None:
    """The few samples that carry most of the misfit; None where it is carried by more, or there is none."""
    residuals = np.where(residual_set.counted, residual_set.residuals, 0.0)
    squares = residuals**2
    beyond = float(squares.sum()) - int(residual_set.counted.sum())
    alone = stands_out(residuals, residual_set.counted)
    share = float(squares[alone].sum()) / beyond if beyond > 0.0 else 0.0
    if share < CARRIED_ALONE:
        return None
    places = sorted(np.argwhere(alone).tolist(), key=lambda place: -squares[tuple(place)])
    records, channels, times = residual_set.problem.layout.records, residual_set.channels, residual_set.times
    found = [
        LoneSample(records[r], channels[c], float(times[r, t]), abs(float(residuals[r, c, t]))) for r, c, t in places
    ]
    return LoneSamples(tuple(found), min(share, 1.0))


def stands_out(residuals: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Which residuals ``(..., n_time)`` in units of the noise are far beyond it, and beyond those beside them."""
    size = np.where(counted, np.abs(residuals), np.nan)
    padded = np.pad(size, [(0, 0)] * (size.ndim - 1) + [(NEIGHBOURS, NEIGHBOURS)], constant_values=np.nan)
    near = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1, axis=-1)
    # Where all are masked there is nothing to compare: the sample itself is masked, too.
    usual = np.ma.median(np.ma.masked_invalid(near), axis=-1).filled(np.inf)
    alone: np.ndarray = counted & (np.abs(residuals) > STANDS_OUT * np.maximum(usual, 1.0))
    return alone
