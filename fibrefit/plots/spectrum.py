"""Residual spectrum: power of the residuals against the noise at rest, by frequency."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.discovery.residuals.residuals import strands
from fibrefit.discovery.residuals.spectrum import Spectrum, narrow_band, spectrum_of
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import BLUE, GREY, PALE, SMALL, VERMILLION, YELLOW, label, legend, new_figure, stack, title

LEFT, RIGHT, TOP, BOTTOM, GAP, HEIGHT = 18.0, 5.0, 17.0, 11.0, 6.0, 46.0
LOWEST = 0.2
"""Lowest power shown, as a share of the smallest of the noise."""


def spectrum_figure(before: Fitted, after: Fitted | None) -> Figure:
    """Power density of the residuals of each channel, all records together, before and after.

    Parameters
    ----------
    before, after : Fitted
        None where the model did not change.
    """
    channels = before.channels
    figure = new_figure(TOP + BOTTOM + len(channels) * (HEIGHT + GAP) - GAP)
    title(figure, "Residual spectrum", "mean over all records; grey: noise")
    panels = stack(figure, [HEIGHT] * len(channels), LEFT, RIGHT, TOP, GAP)
    for c, (axes, channel) in enumerate(zip(panels, channels, strict=True)):
        first = _spectrum(before, c)
        final = None if after is None else _spectrum(after, c)
        unit, worth = readable_unit(np.sqrt(first.power * first.frequency), before.found.gap[channel].unit)
        _floor(axes, first, worth)
        band = narrow_band(first, before.found.noise[channel])
        if band is not None:
            _band(axes, *band)
        for spectrum, colour, width, said in (
            (first, VERMILLION, 1.0, "first model"),
            (final, BLUE, 0.7, "final model"),
        ):
            if spectrum is not None:
                axes.plot(spectrum.frequency, spectrum.power / worth**2, color=colour, linewidth=width, label=said)
        axes.set_xscale("log")
        axes.set_yscale("log")
        axes.set_xlim(float(first.frequency[0]), float(first.frequency[-1]))
        axes.set_ylim(bottom=LOWEST * float(first.floor.min()) / worth**2)
        label(axes, y=axis_label(f"{channel} residual", f"({unit})²/Hz" if "/" in unit else f"{unit}²/Hz"))
    legend(panels[0], loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    label(panels[-1], x="frequency / Hz")
    figure.align_ylabels(panels)
    return figure


def _spectrum(fitted: Fitted, channel: int) -> Spectrum:
    return spectrum_of([strand for strand in strands(fitted.found) if strand.channel == channel])


def _floor(axes: Axes, found: Spectrum, worth: float) -> None:
    """Noise of the rests, with the band in which the power of as much noise lies at nineteen frequencies of twenty."""
    floor = found.floor / worth**2
    axes.fill_between(
        found.frequency, found.chance[0] * floor, found.chance[1] * floor, facecolor=PALE, edgecolor="none", zorder=0
    )
    axes.plot(found.frequency, floor, color=GREY, linewidth=0.7, linestyle=(0, (4, 2)), label="noise at rest")


def _band(axes: Axes, low: float, high: float, share: float) -> None:
    axes.axvspan(low, high, facecolor=YELLOW, alpha=0.35, edgecolor="none", zorder=0)
    axes.text(
        float(np.sqrt(low * high)), 0.97, f"{100 * share:.0f} %", transform=axes.get_xaxis_transform(),
        fontsize=SMALL, color="0.3", ha="center", va="top",
    )  # fmt: skip
