"""The gap (normalised residual RMS): by record and channel before and after, and with each of the candidates."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import from_to
from fibrefit.plots.style import (
    BOTTOM,
    FINAL,
    FIRST,
    GREY,
    LONGEST_BESIDE_AXES,
    PALE,
    RIGHT,
    SMALL,
    TOP,
    USUAL,
    WIDE_GAP,
    axes_at,
    cut_name,
    label,
    legend,
    logarithmic,
    new_figure,
    title,
)
from fibrefit.study.summaries.discovery import Candidate, DiscoverySummary, listed_candidates
from fibrefit.study.summaries.results import Gap

ROW, BETWEEN = 5.0, 6.0
"""Height of a record, two lines of small text, and room between channels for the end of a number, in mm."""
NUMBERS = 26.0
"""Room for numbers beside the bars, in mm."""
LETTER = 1.25
"""Width of a small letter, in mm, not less."""
ONLY_NOISE = 1.1
"""Gap, over that of noise alone, up to which only noise is left."""
MOST_CANDIDATES = 16
"""Candidates that are drawn: those of the lists in reports, twice over."""
BEYOND = 1.25
"""Ratio to the gap before at which the axis of the candidates ends; a longer bar carries its number."""

Pair = tuple[float, float]


def gap_figure(summary: DiscoverySummary) -> Figure:
    """A row for each record and one for all; a column for each channel, and one for records that were left out."""
    after = {name: one.gap for name, one in summary.records.items()} | {"all records": summary.gap}
    changed = bool(summary.added) and summary.before is not None
    before = {**summary.before.records, "all records": summary.before.gap} if changed and summary.before else after
    names = list(after)
    channels = [channel for channel in summary.gap.channels if summary.gap.ratio_of(channel) is not None]
    columns: dict[str, dict[str, Pair]] = {
        channel: {name: (_known(before[name], channel), _known(after[name], channel)) for name in names}
        for channel in channels
    }
    if summary.held_out:
        columns["left out"] = {held.record: (held.gap_before, held.gap_after) for held in summary.held_out}
    left = 5.0 + LETTER * min(max(map(len, names)), LONGEST_BESIDE_AXES)
    figure = new_figure(TOP + BOTTOM + ROW * len(names))
    noise = summary.expected_gap or 1.0
    then, now = before["all records"].total, summary.gap.total
    said = "is not known" if now is None else f"is {now:.2f}"
    said = from_to(then, now, ".2f") if changed and then is not None and now is not None else said
    title(
        figure,
        f"The gap of all records {said}; {noise:.2f} is expected of noise alone",
        "gap: RMS of measured minus simulated over that of the noise; left out: predicted from the other records",
    )
    across, up = figure.get_size_inches() * 25.4
    width = (across - left - RIGHT - BETWEEN * (len(columns) - 1)) / len(columns)
    for i, (column, pairs) in enumerate(columns.items()):
        axes = axes_at(figure, left + i * (width + BETWEEN), BOTTOM, width, up - TOP - BOTTOM)
        _pairs(axes, [pairs.get(name) for name in names], changed, noise)
        axes.set_yticks(range(len(names)), [cut_name(name) for name in names] if i == 0 else [""] * len(names))
        label(axes, x=f"{column} / noise" if column in channels else "left out / noise")
        if i == 0:
            legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def _known(gap: Gap, channel: str) -> float:
    """Gap of a channel; what is not known is not drawn."""
    found = gap.ratio_of(channel)
    return np.nan if found is None else found


def _pairs(axes: Axes, pairs: Sequence[Pair | None], changed: bool, noise: float) -> None:
    there = [(row, *pair) for row, pair in enumerate(pairs) if pair is not None]
    rows, before, after = (np.array(column) for column in zip(*there, strict=True))
    axes.axvspan(0.0, ONLY_NOISE * noise, facecolor=PALE, edgecolor="none", zorder=0)
    axes.axvline(noise, color=GREY, linewidth=0.6)
    if changed:
        axes.hlines(rows, np.minimum(before, after), np.maximum(before, after), color=GREY, linewidth=0.8, zorder=1)
        axes.plot(before, rows, linestyle="none", marker="s", markersize=4.0, color=FIRST, label="before")
    axes.plot(
        after, rows, linestyle="none", marker="o", markersize=4.0, color=FINAL, label="after" if changed else "gap"
    )
    largest = float(np.nanmax([noise, *before, *after]))
    if largest > WIDE_GAP:
        logarithmic(axes, "x")
        least = np.nan_to_num(np.concatenate([before, after, [noise]]))
        axes.set_xlim(0.8 * min(1.0, float(least[least > 0.0].min())), 1.25 * largest)
    else:
        axes.set_xlim(0.0, max(1.08 * largest, 1.5))
    axes.set_ylim(len(pairs) - 0.5, -0.5)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
    axes.grid(axis="y", color="0.92", linewidth=0.5, zorder=-1)


def candidates_figure(ranking: Sequence[Candidate], gap_before: float, added: str, noise: float) -> Figure:
    """What gap each candidate would leave, best first.

    Parameters
    ----------
    gap_before : float
        Without any of them.
    added : str
        The one that was added; empty if none was.
    noise : float
        Gap that noise alone leaves.
    """
    ranked = listed_candidates(ranking, MOST_CANDIDATES, added)
    shown = ranked.shown
    names = [cut_name(candidate.effect, 2 * LONGEST_BESIDE_AXES) for candidate in shown]
    left = 5.0 + LETTER * max(map(len, names))
    figure = new_figure(TOP + BOTTOM + ROW * len(shown))
    best = min(ranking, key=lambda one: one.gap_after)
    said = f"{best.effect} leaves the smallest gap of all effects tried: {best.gap_after:.2f}"
    gain = "gains" if ranked.others == 1 else "gain"
    rest = "with less evidence" if ranked.gain else f"that {gain} nothing"
    more = f"; and {ranked.others} more {rest}" if ranked.others else ""
    title(figure, said, f"gaps of the search, where all models are fitted in one noise{more}")
    across, up = figure.get_size_inches() * 25.4
    axes = axes_at(figure, left, BOTTOM, across - left - NUMBERS, up - TOP - BOTTOM)
    beside = 1.0 + (NUMBERS - RIGHT) / (across - left - NUMBERS)
    gaps = np.array([candidate.gap_after for candidate in shown])
    colours = [FINAL if candidate.effect == added else "0.72" for candidate in shown]
    axes.barh(range(len(shown)), gaps, height=0.68, color=colours)
    axes.axvline(noise, color=GREY, linewidth=0.6)
    axes.axvline(gap_before, color=FIRST, linewidth=0.9)
    reach = BEYOND * max(gap_before, noise)
    axes.set_xlim(0.0, reach)
    axes.set_ylim(len(shown) - 0.5, -0.5)
    axes.set_yticks(range(len(shown)), names)
    axes.tick_params(axis="y", length=0)
    over = axes.get_xaxis_transform()
    axes.text(noise, 1.01, "noise ", transform=over, fontsize=SMALL, color="0.35", ha="right", va="bottom")
    axes.text(gap_before, 1.01, " without", transform=over, fontsize=SMALL, color=FIRST, ha="left", va="bottom")
    axes.text(beside, 1.01, "evidence", transform=axes.transAxes, fontsize=SMALL, color="0.35", ha="right", va="bottom")
    for row in np.flatnonzero(gaps > reach).tolist():
        axes.text(reach, row, f"{gaps[row]:.3g} ", fontsize=SMALL, color="0.25", ha="right", va="center")
    for row, candidate in enumerate(shown):
        said = f"{round(candidate.evidence) or 0:,d}".replace("-", "\N{MINUS SIGN}").replace(",", "\N{THIN SPACE}")
        axes.text(
            beside,
            row,
            said,
            transform=axes.get_yaxis_transform(),
            fontsize=SMALL,
            color="0.25",
            ha="right",
            va="center",
        )
    label(axes, x="gap after (residual RMS / noise)")
    axes.xaxis.label.set_fontsize(USUAL)
    return figure
