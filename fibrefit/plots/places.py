"""Where model and measurement differ: in which phase of the motion, and when."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import PercentFormatter

from fibrefit.plots.fitted import Fitted
from fibrefit.plots.style import (
    BOTTOM,
    GREEN,
    LETTER_SMALL,
    ORANGE,
    PURPLE,
    RIGHT,
    SKY,
    SMALL,
    TOP,
    axes_at,
    cut_name,
    label,
    legend,
    new_figure,
    title,
)
from fibrefit.study.summaries.discovery import GapPlace
from fibrefit.study.summaries.part import Variable

ROW, LEAST_ROWS = 8.0, 4
"""Height of a record in mm, and rows there is room for at least: the phases beside them have as many."""
PHASES, SHARES, BETWEEN = 26.0, 52.0, 8.0
"""Room in mm for the names of phases, for their bars, and between those and the names of records."""
CHANNELS = (GREEN, PURPLE, ORANGE, SKY)
"""Colours of channels in their order: none of them means a model or what was measured."""
ROOM = 0.09
"""Room of a number, as a share of the axis; of places closer than that only the larger one has its number."""


def places_figure(first: Fitted, places: Sequence[GapPlace], group: Mapping[str, Variable]) -> Figure:
    """Shares of the gap by phase on the left, the stretches that hold most of it on the right.

    Parameters
    ----------
    first : Fitted
        The model the search began with.
    group : mapping of str to Variable
        ``phase_shares`` of ``result.h5``.
    """
    records = first.records
    height = ROW * max(len(records), LEAST_ROWS)
    figure = new_figure(TOP + BOTTOM + height)
    shares = {
        (str(channel), str(phase)): float(group["share"].values[c, p])
        for c, channel in enumerate(group["channel"].values)
        for p, phase in enumerate(group["phase"].values)
    }
    beside = "shares of the gap beyond noise: by phase, and in the stretches that hold most of it"
    title(figure, _heading(shares), beside)
    across = figure.get_size_inches()[0] * 25.4
    axes = axes_at(figure, PHASES, BOTTOM, SHARES, height)
    channels = first.channels
    _phases(axes, shares, channels)
    left = PHASES + SHARES + BETWEEN + LETTER_SMALL * max(len(cut_name(record)) for record in records)
    _times(axes_at(figure, left, BOTTOM, across - left - RIGHT, height), first, places)
    return figure


def _heading(shares: dict[tuple[str, str], float]) -> str:
    (channel, phase), share = max(shares.items(), key=lambda one: one[1])
    if share <= 0.0:
        return "The first model leaves no more than noise in any phase"
    return f"The first model goes wrong in the {channel} while {phase}: {100 * share:.0f} % of the gap"


def _phases(axes: Axes, shares: dict[tuple[str, str], float], channels: Sequence[str]) -> None:
    there = {phase for (_, phase), share in shares.items() if share > 0.0}
    phases = [phase for phase in dict.fromkeys(phase for _, phase in shares) if phase in there or not there]
    base = np.zeros(len(phases))
    for channel, colour in zip(channels, CHANNELS, strict=False):
        widths = np.array([shares[channel, phase] for phase in phases])
        axes.barh(range(len(phases)), widths, left=base, height=0.66, color=colour, label=channel)
        base += widths
    axes.set_yticks(range(len(phases)), phases)
    axes.set_ylim(len(phases) - 0.5, -0.5)
    axes.set_xlim(0.0, 1.08 * max(float(base.max()), 0.05))
    axes.xaxis.set_major_formatter(PercentFormatter(1.0, decimals=0))
    axes.tick_params(axis="y", length=0)
    label(axes, x="of the gap lies in this phase")
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0), handlelength=1.0)


def _times(axes: Axes, model: Fitted, places: Sequence[GapPlace]) -> None:
    records, channels = model.records, model.channels
    ends = [(float(times[0]), float(times[-1])) for times in map(model.times, range(len(records)))]
    for r, end in enumerate(ends):
        axes.plot(end, [r, r], color="0.8", linewidth=0.8, zorder=0)
    colours = dict(zip(channels, CHANNELS, strict=False))
    first, last = min(end[0] for end in ends), max(end[1] for end in ends)
    labelled: list[tuple[int, int, float]] = []
    for spot in places:
        r, c = records.index(spot.record), channels.index(spot.channel)
        height = 0.7 / len(channels)
        low = r - 0.35 + c * height
        axes.broken_barh([(spot.from_s, spot.to_s - spot.from_s)], (low, height), color=colours[spot.channel])
        if any((r, c) == other[:2] and abs(spot.to_s - other[2]) < ROOM * (last - first) for other in labelled):
            continue
        labelled.append((r, c, spot.to_s))
        beside: dict[str, Any] = {"xytext": (1.5, 0.0), "textcoords": "offset points"}
        text: dict[str, Any] = {"fontsize": SMALL, "color": "0.3", "ha": "left", "va": "center"}
        axes.annotate(f"{100 * spot.share:.0f} %", (spot.to_s, low + 0.5 * height), **beside, **text)
    axes.set_yticks(range(len(records)), [cut_name(record) for record in records])
    axes.set_ylim(len(records) - 0.5, -0.5)
    axes.set_xlim(first, last)
    axes.tick_params(axis="y", length=0)
    label(axes, x="time / s")
    if not places:
        axes.text(0.5, 0.5, "no stretch exceeds the noise", transform=axes.transAxes, ha="center", fontsize=SMALL)
