"""Noise of a force that grows with the load, as that of a gauge on a rig that shakes with its load does.

Law
---
``sigma(F) = sigma_0 (1 + g |F| / F_max)``, found from high differences of the readings. Those let nothing through
that is slower than a fourth of the sampling rate: neither motion nor the ringing of a gauge, which third ones show.
Of the readings at each level of the load the median counts: contacts are few.
"""

from __future__ import annotations

from collections.abc import Sequence
from math import comb

import numpy as np

from fibrefit.problem.noise.rounding import coarse_step
from fibrefit.problem.thresholds import GROWS, LEVEL_READINGS
from fibrefit.rigs.signals.trace import Trace

ORDER = 6
"""Of the differences."""
LEVELS = 8
"""Of the load, equal parts of its range, at which the noise is looked at."""
SPREAD = 2.07
"""Relative error of a median of absolute values of such differences times the square root of their number: 1.16 if they
were independent, and neighbours are alike (the sum of their squared correlations is 3.2)."""
LOUDEST_LOADED = 3.0
"""Noise over that without load, at the most: what is louder still says nothing of the noise."""


def growth_with_load(traces: Sequence[Trace], channel: str) -> float:
    """Share by which noise of a force is larger at the largest load than at none; zero where that is not clear."""
    growth, error = growth_and_error(traces, channel)
    return growth if growth > GROWS * error else 0.0


def growth_and_error(traces: Sequence[Trace], channel: str) -> tuple[float, float]:
    """The same, whether it is clear or not, and its standard error; ``(0, inf)`` where readings do not tell."""
    if coarse_step(traces, channel) is not None:
        return 0.0, np.inf
    parts = [_levels(trace.channels[channel]) for trace in traces]
    load, size = (np.concatenate(rows) for rows in zip(*parts, strict=True))
    if not load.size or not np.median(size) > 0.0:
        return 0.0, np.inf
    number = np.minimum((LEVELS * load / load.max()).astype(int), LEVELS - 1)
    seen = [level for level in range(LEVELS) if np.count_nonzero(number == level) >= LEVEL_READINGS]
    at = np.array([load[number == level].mean() for level in seen]) / load.max()
    noise = np.array([np.median(size[number == level]) for level in seen])
    if len(seen) < 3 or not np.all(noise > 0.0):
        return 0.0, np.inf
    counts = np.array([np.count_nonzero(number == level) for level in seen])
    columns = np.stack([np.ones_like(at), at], axis=1) * (np.sqrt(counts) / SPREAD / noise)[:, None]
    covariance = np.linalg.inv(columns.T @ columns)
    still, more = covariance @ columns.T @ (np.sqrt(counts) / SPREAD)
    if not still > 0.0:
        return 0.0, np.inf
    return float(more / still), float(np.sqrt(covariance[1, 1]) / still)


def louder_under_load(trace: Trace, channel: str, growth: float, largest: float) -> np.ndarray:
    """Noise of each reading over that without load, ``(n_time,)``.

    Parameters
    ----------
    growth : float
        See `growth_with_load`.
    largest : float
        Load in SI units at which it is reached.
    """
    return np.minimum(1.0 + growth * _load(trace.channels[channel]) / largest, LOUDEST_LOADED)


def largest_load(traces: Sequence[Trace], channel: str) -> float:
    """In SI units."""
    return max(float(_load(trace.channels[channel]).max()) for trace in traces)


def _levels(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Load, and size of the differences, where there are any."""
    size = np.abs(np.diff(values, ORDER)) / np.sqrt(comb(2 * ORDER, ORDER))
    load = _load(values)[ORDER // 2 : len(values) - ORDER // 2]
    seen = np.isfinite(size)
    return load[seen], size[seen]


def _load(values: np.ndarray) -> np.ndarray:
    """Size of the readings, the mean of some neighbours."""
    seen, window = np.isfinite(values), np.ones(ORDER + 1)
    number = np.convolve(seen, window, "same")
    return np.abs(np.convolve(np.where(seen, values, 0.0), window, "same")) / np.maximum(number, 1.0)
