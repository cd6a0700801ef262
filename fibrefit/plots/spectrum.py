"""Residual spectrum: power of the residuals against the noise at rest, by frequency."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import in_words
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    FINAL,
    FIRST,
    GREY,
    PALE,
    PLACE,
    SMALL,
    label,
    legend,
    logarithmic,
    stacked_figure,
    title,
)
from fibrefit.study.summaries.part import Variable

HEIGHT = 46.0
"""Of a channel, in mm: four of them stand on a page."""
LOWEST = 0.2
"""Lowest power shown, as a share of the smallest of the noise."""


class _Spectrum(NamedTuple):
    """One channel of ``residual_spectrum``: powers ``(n_frequency,)`` in SI units."""

    frequency: np.ndarray
    first: np.ndarray
    final: np.ndarray
    floor: np.ndarray
    chance: np.ndarray
    band: np.ndarray


def spectrum_of_channel(group: Mapping[str, Variable], channel: str) -> _Spectrum:
    """Spectra of a channel and the noise under them."""
    c = [str(name) for name in group["channel"].values].index(channel)
    first, final = group["power"].values[:, c]
    rest = (group[name].values[c] for name in ("floor", "chance", "band"))
    return _Spectrum(group["frequency"].values, first, final, *rest)


def spectrum_figure(group: Mapping[str, Variable], fitted: Fitted, changed: bool) -> Figure:
    """Power density of the residuals of each channel, all records together, before and after.

    Parameters
    ----------
    group : mapping of str to Variable
        ``residual_spectrum`` of ``result.h5``.
    fitted : Fitted
        For its channels and units.
    changed : bool
        Whether the final model differs from the first.
    """
    channels = fitted.channels
    figure, panels = stacked_figure([HEIGHT] * len(channels))
    spectra = {channel: spectrum_of_channel(group, channel) for channel in channels}
    beside = "power of the residuals, mean over all records; grey: noise at rest and its 95 % band"
    title(figure, _heading(spectra, changed), beside)
    for axes, (channel, found) in zip(panels, spectra.items(), strict=True):
        unit, worth = readable_unit(np.sqrt(found.first * found.frequency), fitted.gap.channels[channel].unit)
        _floor(axes, found, worth)
        if np.isfinite(found.band).all():
            _band(axes, *found.band)
        axes.plot(found.frequency, found.first / worth**2, color=FIRST, linewidth=1.0, label="first model")
        if changed:
            axes.plot(found.frequency, found.final / worth**2, color=FINAL, linewidth=0.7, label="final model")
        logarithmic(axes, "x", "y")
        axes.set_xlim(float(found.frequency[0]), float(found.frequency[-1]))
        axes.set_ylim(bottom=LOWEST * float(found.floor.min()) / worth**2)
        label(axes, y=axis_label(f"{channel} residual", f"({unit})²/Hz" if "/" in unit else f"{unit}²/Hz"))
    legend(panels[0], loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3)
    label(panels[-1], x="frequency / Hz")
    figure.align_ylabels(panels)
    return figure


def _heading(spectra: Mapping[str, _Spectrum], changed: bool) -> str:
    """How often the residuals are louder than noise may be."""
    said = []
    for channel, found in spectra.items():
        shares = [np.mean(power > found.chance[1] * found.floor) for power in (found.first, found.final)]
        share = f"{100 * shares[0]:.0f} %" + (f", then {100 * shares[1]:.0f} %" if changed else "")
        said.append(f"{share} ({channel})")
    return f"Residuals exceed the noise at {in_words(said)} of all frequencies"


def _floor(axes: Axes, found: _Spectrum, worth: float) -> None:
    """Noise of the rests, with the band in which the power of as much noise lies at nineteen frequencies of twenty."""
    floor = found.floor / worth**2
    axes.fill_between(
        found.frequency, found.chance[0] * floor, found.chance[1] * floor, facecolor=PALE, edgecolor="none", zorder=0
    )
    axes.plot(found.frequency, floor, color=GREY, linewidth=0.7, linestyle=(0, (4, 2)), label="noise at rest")


def _band(axes: Axes, low: float, high: float, share: float) -> None:
    axes.axvspan(low, high, facecolor=PLACE, alpha=0.35, edgecolor="none", zorder=0)
    axes.text(
        float(np.sqrt(low * high)), 0.97, f"{100 * share:.0f} %", transform=axes.get_xaxis_transform(),
        fontsize=SMALL, color="0.3", ha="center", va="top",
    )  # fmt: skip
