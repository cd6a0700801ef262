"""Posterior predictive bands of one record, on what was measured."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import in_words
from fibrefit.plots.lines import MOST, draw_line, thinned
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    FINAL,
    GREY,
    MEASURED,
    RESIDUAL,
    SIMULATED,
    SKY,
    SMALL,
    label,
    legend,
    stacked_figure,
    title,
)

TALL, LOW = 33.0, 25.0
"""Heights in mm of the readings and of what is off their median: three channels stand on a page."""


@dataclass(frozen=True)
class Banded:
    """One channel of one record with its bands.

    Parameters
    ----------
    name, unit : str
        The unit in SI.
    times, measured : (n_time,)
        Measured is NaN where a sample does not count.
    model, predicted : (3, n_time)
        Lower end, middle and upper end of the band of the model's readings, and of new measurements.
    """

    name: str
    unit: str
    times: np.ndarray
    measured: np.ndarray
    model: np.ndarray
    predicted: np.ndarray

    @property
    def covered(self) -> float:
        """Share of the samples inside the band of new measurements."""
        counted = np.isfinite(self.measured)
        inside = (self.measured >= self.predicted[0]) & (self.measured <= self.predicted[2])
        return float(np.mean(inside[counted])) if counted.any() else float("nan")


def bands_figure(heading: str, channels: list[Banded], beside: str = "bands hold 90 %") -> Figure:
    """Channels of one record: the readings, and under them how far measurement and bands lie from the median.

    Parameters
    ----------
    beside : str
        What the bands are.
    """
    heights = [TALL, LOW] * len(channels)
    figure, axes = stacked_figure(heights)
    inside = in_words(f"{100 * channel.covered:.1f} % ({channel.name})" for channel in channels)
    title(figure, f"{heading}: {inside} of the samples lie inside the band", beside)
    for number, channel in enumerate(channels):
        _readings(axes[2 * number], channel)
        _around(axes[2 * number + 1], channel)
    legend(axes[0], loc="upper right")
    legend(axes[1], loc="lower right", bbox_to_anchor=(1.0, 0.98))
    label(axes[-1], x="time / s")
    axes[0].set_xlim(channels[0].times[0], channels[0].times[-1])
    figure.align_ylabels(axes)
    return figure


def _readings(axes: Axes, channel: Banded) -> None:
    unit, worth = readable_unit(channel.model[1], channel.unit)
    draw_line(axes, channel.times, channel.measured / worth, label="measured", **MEASURED)
    draw_line(axes, channel.times, channel.model[1] / worth, label="model, median", **SIMULATED)
    label(axes, y=axis_label(channel.name, unit))
    axes.margins(y=0.08)


def _around(axes: Axes, channel: Banded) -> None:
    middle = channel.model[1]
    measured, model, predicted = channel.measured - middle, channel.model - middle, channel.predicted - middle
    unit, worth = readable_unit(predicted, channel.unit)
    draw_line(axes, channel.times, measured / worth, **(RESIDUAL | {"color": SKY}))
    _band(axes, channel.times, predicted[[0, 2]] / worth, GREY, 0.35, "new measurements")
    _band(axes, channel.times, model[[0, 2]] / worth, FINAL, 0.8, "model")
    # A switch that comes a sample earlier or later makes a spike, which says nothing of the rest.
    reach = 1.25 * float(np.nanquantile(np.abs(measured), 0.999)) / worth if np.isfinite(measured).any() else 1.0
    axes.set_ylim(-reach, reach)
    label(axes, y=axis_label("off median", unit))
    said = f"{100 * channel.covered:.1f} % of the samples inside the band of new measurements"
    axes.text(0.0, 1.02, said, transform=axes.transAxes, fontsize=SMALL, ha="left", va="bottom", color="0.25")


def _band(axes: Axes, times: np.ndarray, ends: np.ndarray, colour: str, alpha: float, says: str) -> None:
    if len(times) > MOST:
        (coarse, low), (_, high) = thinned(times, ends[0]), thinned(times, ends[1])
        times, ends = coarse[::2], np.stack([low[::2], high[1::2]])
    axes.fill_between(
        times, ends[0], ends[1], facecolor=colour, alpha=alpha, linewidth=0.3, edgecolor=colour, label=says
    )
