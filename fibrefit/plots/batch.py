"""The values of many identifications, side by side."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.plots.figures import Figures
from fibrefit.plots.pooled import RecordValue, population_figure, trends_figure
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BLACK,
    ENDED,
    ENDED_AS,
    GREY,
    LETTER_SMALL,
    SMALL,
    in_own_style,
    is_wide,
    label,
    legend,
    logarithmic,
    stacked_figure,
    title,
)

if TYPE_CHECKING:
    from fibrefit.study.summaries.part import Measure
    from fibrefit.study.summaries.series import BatchItem, BatchSummary

ROW = 30.0
"""Height of a parameter, in mm: five of them and the gap stand on a page."""
MOST_NAMED = 30
"""Items whose names are written below the axis."""
NEARLY_ALL = (0.02, 0.98)
"""Quantiles of the values of usable items between which those lie that a panel is made for."""
FEWEST_FOR_LIMITS = 3
"""Usable items from which it is."""
MOST_LETTERS = 40
"""Letters of a name there is room for below the axis."""


@in_own_style
def batch_figures(summary: BatchSummary) -> Figures:
    """``parameters``: every free value of every item; ``population`` and ``trends`` where there are any."""
    figures = _parameters(summary.items)
    usable = {name: item for name, item in summary.items.items() if item.status in ("ok", "suspect")}
    values = {
        name: {
            key: RecordValue(one.value, one.std_error or np.nan, *_drawn(item.shrunk.get(key)))
            for key, one in item.parameters.items()
            if one.free
        }
        for name, item in usable.items()
    }
    if summary.population:
        figures["population"] = population_figure(summary.population, values)
    if summary.trends:
        figures["trends"] = trends_figure(summary.trends, values, summary.items)
    return figures


def _drawn(shrunk: Measure | None) -> tuple[float | None, float | None]:
    """Value drawn to the mean, and its standard deviation."""
    return (None, None) if shrunk is None else (shrunk.value, shrunk.error)


def _parameters(items: Mapping[str, BatchItem]) -> Figures:
    free = {name: found.unit for item in items.values() for name, found in item.parameters.items() if found.free}
    return Figures({"parameters": _figure(items, free)} if free else {})


def _figure(items: Mapping[str, BatchItem], free: Mapping[str, str]) -> Figure:
    named = len(items) <= MOST_NAMED
    below = LETTER_SMALL * max(min(len(name), MOST_LETTERS) for name in items) if named else 0.0
    figure, axes = stacked_figure([ROW] * (len(free) + 1), below)
    usable = sum(item.status in ("ok", "suspect") for item in items.values())
    title(figure, f"{usable} of {len(items)} identifications can be used", "bars: twice the standard error; below: gap")
    numbers = np.arange(1, len(items) + 1)
    for panel, (name, unit) in zip(axes, free.items(), strict=False):
        _values(panel, numbers, items, name, unit)
    _gaps(axes[-1], numbers, items)
    legend(axes[0], loc="lower right", bbox_to_anchor=(1.0, 1.0))
    axes[0].set_xlim(0.0, len(items) + 1.0)
    if named:
        axes[-1].set_xticks(numbers, [name[-40:] for name in items], rotation=90, fontsize=SMALL)
    else:
        label(axes[-1], x="item")
    figure.align_ylabels(axes)
    return figure


def _values(axes: Axes, numbers: np.ndarray, items: Mapping[str, BatchItem], name: str, si: str) -> None:
    found = [item.parameters.get(name) for item in items.values()]
    values = np.array([np.nan if one is None else one.value for one in found])
    errors = np.array([np.nan if one is None or one.std_error is None else one.std_error for one in found])
    states = np.array([item.status or "" for item in items.values()])
    usable = np.isin(states, ("ok", "suspect"))
    unit, worth = readable_unit(values[usable] if np.isfinite(values[usable]).any() else values, si)
    lacking = np.array([bool(item.lacks) for item in items.values()])
    for state, colour in ENDED.items():
        for lacks, filled, said in ((False, colour, state), (True, "white", f"{state}, model lacks something")):
            here = (states == state) & (lacking == lacks) & np.isfinite(values)
            if here.any():
                bars = 2.0 * np.nan_to_num(errors[here]) / worth
                style: dict[str, Any] = {"color": colour, "markerfacecolor": filled, "elinewidth": 0.6, "label": said}
                axes.errorbar(numbers[here], values[here] / worth, bars, fmt=ENDED_AS[state], markersize=2, **style)
    label(axes, y=axis_label(name.rpartition(".")[2], unit))
    _limit(axes, numbers, values / worth, errors / worth, usable)


def _limit(axes: Axes, numbers: np.ndarray, values: np.ndarray, errors: np.ndarray, usable: np.ndarray) -> None:
    """Show what can be used at a size to be read; what lies far outside, as a failed item may, by marks at the edge."""
    known = values[usable & np.isfinite(values)]
    if known.size < FEWEST_FOR_LIMITS:
        return
    low, high = np.quantile(known, NEARLY_ALL)
    bar = 2.0 * float(np.median(np.nan_to_num(errors[usable & np.isfinite(values)])))
    room = bar + 0.5 * (high - low)
    if not room > 0.0 or not np.any((values < low - 2.0 * room) | (values > high + 2.0 * room)):
        return
    ends = low - room, high + room
    axes.set_ylim(*ends)
    for beyond, edge, marker in ((values < ends[0], ends[0], "v"), (values > ends[1], ends[1], "^")):
        if beyond.any():
            axes.plot(numbers[beyond], np.full(beyond.sum(), edge), marker, color=GREY, markersize=3, clip_on=False)
    said = f"{np.count_nonzero((values < ends[0]) | (values > ends[1]))} beyond"
    axes.text(0.005, 0.96, said, transform=axes.transAxes, fontsize=SMALL, ha="left", va="top", color="0.25")


def _gaps(axes: Axes, numbers: np.ndarray, items: Mapping[str, BatchItem]) -> None:
    gaps = np.array([np.nan if item.gap is None else item.gap for item in items.values()])
    axes.axhline(1.0, color="0.5", linewidth=0.4)
    axes.plot(numbers, gaps, ".", color=BLACK, markersize=3)
    if is_wide(gaps):
        logarithmic(axes, "y")
    else:
        axes.set_ylim(0.0, 1.1 * max([1.2, *gaps[np.isfinite(gaps)]]))
    label(axes, y="residual RMS / noise")
