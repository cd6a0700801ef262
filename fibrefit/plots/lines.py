"""Lines of long records, thinned to what a figure can show."""

from __future__ import annotations

from typing import Any

import numpy as np
from matplotlib.axes import Axes

from fibrefit.plots.style import MASKED
from fibrefit.rigs.signals.rest import runs

MOST = 6000
"""Samples beyond which a line is drawn by its extremes: more than a figure has dots across."""


def thinned(times: np.ndarray, values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The line itself, or the smallest and largest value of each of `MOST` / 2 stretches, where it is longer than that.

    Parameters
    ----------
    times, values : (n_time,)

    Returns
    -------
    times, values : (at most MOST,)
    """
    if len(values) <= MOST:
        return times, values
    length = -(-len(values) // (MOST // 2))
    edges = np.arange(0, len(values), length)
    empty = np.isnan(values)
    low = np.minimum.reduceat(np.where(empty, np.inf, values), edges)
    high = np.maximum.reduceat(np.where(empty, -np.inf, values), edges)
    extremes = np.column_stack([low, high]).ravel()
    return np.repeat(times[edges], 2), np.where(np.isfinite(extremes), extremes, np.nan)


def draw_line(axes: Axes, times: np.ndarray, values: np.ndarray, **style: Any) -> None:
    """Line over time; broken where a sample is missing."""
    x, y = thinned(times, values)
    axes.plot(x, y, **style)


def mark_masked(axes: Axes, times: np.ndarray, masked: np.ndarray) -> None:
    """Bars along the foot of the axes where samples do not count."""
    if not masked.any():
        return
    step = float(np.median(np.diff(times)))
    spans = [(times[a] - 0.5 * step, times[b - 1] - times[a] + step) for a, b in runs(masked)]
    axes.broken_barh(
        spans, (0.0, 0.03), transform=axes.get_xaxis_transform(), facecolor=MASKED, edgecolor=MASKED,
        linewidth=0.8, zorder=4, label=f"masked ({int(masked.sum())})",
    )  # fmt: skip
