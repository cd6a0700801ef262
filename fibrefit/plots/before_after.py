"""One record before and after: measured, both simulations on the same axes, both residuals, the disagreement shaded."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.plots.fitted import Fitted
from fibrefit.plots.lines import draw_line, mark_masked, thinned
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.records import BAND, Compared, crop
from fibrefit.plots.spectrum import spectrum_of_channel
from fibrefit.plots.style import FIRST, MEASURED, PALE, PLACE, SIMULATED, SMALL, label, legend, stacked_figure, title
from fibrefit.study.summaries.discovery import GapPlace
from fibrefit.study.summaries.part import Variable

TALL, LOW = 32.0, 22.0
"""Heights in mm of readings and residuals: the smaller signal has the smaller room."""
SMOOTH = 0.004
"""Length in s over which residuals are averaged, so that what is systematic stands out of the noise."""


def before_after_figure(
    before: Fitted, after: Fitted | None, record: int, places: Sequence[GapPlace], spectrum: Mapping[str, Variable]
) -> Figure:
    """Channels of one record.

    Parameters
    ----------
    before, after : Fitted
        Of the model the search began with and of the final one; None where they are the same.
    places : sequence of GapPlace
        Where the first model goes wrong in this record.
    spectrum : mapping of str to Variable
        ``residual_spectrum`` of ``result.h5``, for the noise.
    """
    channels = before.compared(record)
    finals = after.compared(record) if after else [None] * len(channels)
    heights = [TALL, LOW] * len(channels)
    figure, axes = stacked_figure(heights)
    heading = f"{before.records[record]}: {_gaps_in_words(channels, finals)}"
    title(figure, heading, _beside(before, record, bool(places)))
    label(axes[-1], x="time / s")
    crop(axes[0], channels[0].times, before.motion_ends(record))
    for i, (first, final) in enumerate(zip(channels, finals, strict=True)):
        upper, lower = axes[2 * i], axes[2 * i + 1]
        mine = [place for place in places if place.channel == first.name]
        for panel in (upper, lower):
            for place in mine:
                panel.axvspan(place.from_s, place.to_s, facecolor=PLACE, alpha=0.35, edgecolor="none", zorder=0)
        _shares(upper, mine)
        _curves(upper, first, final)
        _residuals(lower, first, final, averaged_noise(spectrum, first))
    legend(axes[0], loc="lower right", bbox_to_anchor=(1.005, 1.0), ncols=4)
    figure.align_ylabels(axes)
    return figure


def _shares(axes: Axes, places: Sequence[GapPlace]) -> None:
    """The share of the whole gap that lies in each place, unless it is too small to be read beside the others."""
    first, last = axes.get_xlim()
    for place in places:
        begin, end = max(place.from_s, first), min(place.to_s, last)
        if place.share >= 0.03 and begin < end:
            axes.text(
                0.5 * (begin + end), 0.97, f"{100 * place.share:.0f} %",
                transform=axes.get_xaxis_transform(), fontsize=SMALL, color="0.3", ha="center", va="top",
            )  # fmt: skip


def _curves(axes: Axes, first: Compared, final: Compared | None) -> None:
    unit, worth = readable_unit(np.concatenate([first.measured, first.simulated]), first.unit)
    draw_line(axes, first.times, first.measured / worth, label="measured", **MEASURED)
    colour = {**SIMULATED, "color": FIRST}
    draw_line(axes, first.times, first.simulated / worth, label="first model" if final else "the model", **colour)
    if final is not None:
        draw_line(axes, final.times, final.simulated / worth, label="final model", **SIMULATED)
    mark_masked(axes, first.times, np.isnan(first.measured))
    label(axes, y=axis_label(first.name, unit))
    axes.margins(y=0.12)


def _gaps_in_words(channels: Sequence[Compared], finals: Sequence[Compared | None]) -> str:
    said = []
    for first, final in zip(channels, finals, strict=True):
        then = "" if final is None else f" \N{RIGHTWARDS ARROW} {final.gap:.2f}"
        said.append(f"{first.name} {first.gap:.2f}{then}")
    return f"residuals over the noise, {', '.join(said)}"


def _beside(before: Fitted, record: int, places: bool) -> str:
    shaded = "shaded: where the first model goes wrong, with its share of the gap" if places else ""
    return "; ".join(filter(None, [before.conditions(record), shaded]))


def averaged_noise(spectrum: Mapping[str, Variable], channel: Compared) -> float:
    """Rms of the noise of a channel after the running mean, in SI units: less than that of the noise itself.

    Source
    ------
    Power density of the noise through the mean's transfer function, Dirichlet's kernel.
    """
    found = spectrum_of_channel(spectrum, channel.name)
    step, width = _window(channel)
    half = np.pi * found.frequency * step
    passed = (np.sin(width * half) / (width * np.sin(half))) ** 2
    power = np.trapezoid(found.floor * passed, found.frequency)
    # The spectrum begins above zero: what is below is as loud as its first frequency.
    return float(np.sqrt(power + found.floor[0] * found.frequency[0]))


def _window(channel: Compared) -> tuple[float, int]:
    """Step in s, and samples of the running mean."""
    step = float(np.median(np.diff(channel.times)))
    return step, max(round(SMOOTH / step), 1)


def _residuals(axes: Axes, first: Compared, final: Compared | None, noise: float) -> None:
    width = _window(first)[1]
    shown = [_smooth(first.measured - first.simulated, width)]
    if final is not None:
        shown.append(_smooth(final.measured - final.simulated, width))
    largest = max(float(np.nanmax(np.abs(line), initial=0.0)) for line in shown)
    unit, worth = readable_unit(np.array([max(largest, noise)]), first.unit)
    axes.axhspan(-BAND * noise / worth, BAND * noise / worth, facecolor=PALE, edgecolor="none", zorder=0.5)
    axes.axhline(0.0, color="0.5", linewidth=0.4)
    x, y = thinned(first.times, shown[0] / worth)
    axes.fill_between(x, y, 0.0, facecolor=FIRST, alpha=0.45, edgecolor="none")
    axes.plot(x, y, color=FIRST, linewidth=0.4)
    if len(shown) > 1:
        draw_line(axes, first.times, shown[1] / worth, **{**SIMULATED, "linewidth": 0.5})
    reach = max(1.08 * largest, 1.5 * BAND * noise) / worth
    axes.set_ylim(-reach, reach)
    label(axes, y=axis_label("residual", unit))
    said = f"measured \N{MINUS SIGN} simulated, mean over {1e3 * SMOOTH:.0f} ms;"
    said = f"{said} band: ±{BAND:.0f} rms of the noise so averaged"
    axes.text(1.0, 1.02, said, transform=axes.transAxes, fontsize=SMALL, ha="right", va="bottom", color="0.25")


def _smooth(values: np.ndarray, width: int) -> np.ndarray:
    """Running mean; missing samples are left out of it."""
    known = np.isfinite(values)
    window = np.ones(width)
    number = np.convolve(known, window, mode="same")
    with np.errstate(invalid="ignore"):
        return np.where(number > 0, np.convolve(np.where(known, values, 0.0), window, mode="same") / number, np.nan)
