"""Multistart: where each start began, where it ended, and the residual there."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BOTTOM,
    GREY,
    KINDS,
    RIGHT,
    SMALL,
    TOP,
    WIDE,
    axes_at,
    is_wide,
    label,
    logarithmic,
    new_figure,
    title,
)
from fibrefit.study.summaries.part import Variable

LEFT, BETWEEN = 14.0, 6.0
"""Room for the numbers of the starts, and between panels for the end of a number, in mm."""
ROW = 2.2
"""Height of a start in mm: its number is a line of small text."""
MOST_PANELS = 5
"""Parameters that are drawn: more would be narrower than their numbers."""
MOST_KEYS = 8
"""Entries of the key: a line of it holds no more."""
LOST = "given up"


class _Starts(NamedTuple):
    """The group ``starts`` of a result as arrays; see `fibrefit.fitting.result.Starts`."""

    names: tuple[str, ...]
    began: np.ndarray
    ended: np.ndarray
    cost: np.ndarray
    basin: np.ndarray

    @property
    def tried(self) -> int:
        """Number of starts."""
        return len(self.cost)


def starts_figure(group: Mapping[str, Variable], units: Mapping[str, str]) -> Figure:
    """Starts in the order of their cost, a column for each parameter, colour and marker by basin.

    Parameters
    ----------
    group : mapping of str to Variable
        ``starts`` of ``result.h5``.
    units : mapping of str to str
        SI unit of each parameter.
    """
    known, began, ended, cost, basin = (group[n].values for n in ("parameter", "began", "ended", "cost", "basin"))
    starts = _Starts(tuple(map(str, known)), began, ended, cost, basin.astype(int))
    order = np.argsort(np.where(np.isfinite(starts.cost), starts.cost, np.inf), kind="stable")
    names = starts.names[:MOST_PANELS]
    figure = new_figure(TOP + BOTTOM + max(30.0, ROW * starts.tried))
    agreeing = int(np.sum(starts.basin == 0))
    title(figure, f"{agreeing} of {starts.tried} starts reached the best minimum")
    across, up = figure.get_size_inches() * 25.4
    width = (across - LEFT - RIGHT - BETWEEN * len(names)) / (len(names) + 1)
    panels = [
        axes_at(figure, LEFT + i * (width + BETWEEN), BOTTOM, width, up - TOP - BOTTOM) for i in range(len(names) + 1)
    ]
    for axes, name in zip(panels, names, strict=False):
        _ways(axes, starts, order, name, units.get(name, "-"))
    _costs(panels[-1], starts, order)
    for axes in panels:
        axes.set_ylim(starts.tried + 0.5, 0.5)
        axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    for axes in panels[1:]:
        axes.tick_params(labelleft=False)
    label(panels[0], y="start, by its cost at the end")
    _key(figure, panels[0], starts)
    return figure


def _kind(basin: int) -> tuple[str, str]:
    return ("0.6", "x") if basin < 0 else KINDS[min(basin, len(KINDS) - 1)]


def _ways(axes: Axes, starts: _Starts, order: np.ndarray, name: str, si: str) -> None:
    column = starts.names.index(name)
    began, ended = starts.began[order, column], starts.ended[order, column]
    unit, worth = readable_unit(np.concatenate([began, ended]), si)
    by_decades = is_wide(np.concatenate([began, ended]))
    if by_decades:
        # What went to zero would take all the room: it stands at the edge.
        edge = float(np.nanmin(began)) / WIDE
        if np.any(ended < edge):
            ended = np.maximum(ended, edge)
            axes.text(0.0, 1.01, "at the left: nearly 0", transform=axes.transAxes, fontsize=SMALL, va="bottom")
    rank = np.arange(1, len(order) + 1)
    for basin in np.unique(starts.basin):
        colour, marker = _kind(int(basin))
        mine = starts.basin[order] == basin
        x, y = np.stack([began[mine], ended[mine]]) / worth, np.stack([rank[mine], rank[mine]])
        axes.plot(x, y, color=colour, linewidth=0.5, alpha=0.6)
        axes.plot(x[0], y[0], linestyle="none", marker="|", markersize=4.0, markeredgewidth=0.6, color=colour)
        axes.plot(x[1], y[1], linestyle="none", marker=marker, markersize=3.2, markeredgewidth=0.6, color=colour)
    if by_decades:
        logarithmic(axes, "x")
    label(axes, x=axis_label(name.rpartition(".")[2], unit))


def _costs(axes: Axes, starts: _Starts, order: np.ndarray) -> None:
    cost, best = starts.cost[order], float(np.min(starts.cost))
    rank = np.arange(1, len(order) + 1)
    ratio = np.sqrt(cost / best) if 0.0 < best < np.inf else np.full(len(cost), np.nan)
    for basin in np.unique(starts.basin[starts.basin >= 0]):
        colour, marker = _kind(int(basin))
        mine = starts.basin[order] == basin
        axes.plot(ratio[mine], rank[mine], linestyle="none", marker=marker, markersize=3.2, color=colour)
    finite = ratio[np.isfinite(ratio)]
    if finite.size and finite.max() > WIDE:
        logarithmic(axes, "x")
    elif finite.size:
        axes.set_xlim(0.97, max(1.1, 1.05 * finite.max()))
    axes.axvline(1.0, color=GREY, linewidth=0.5, linestyle=(0, (3, 3)), zorder=0)
    label(axes, x="residual rms / that of the best")


def _key(figure: Figure, axes: Axes, starts: _Starts) -> None:
    entries = []
    basins, numbers = np.unique(starts.basin, return_counts=True)
    for basin, number in sorted(zip(basins.tolist(), numbers.tolist(), strict=True), key=lambda b: (b[0] < 0, b[0])):
        colour, marker = _kind(basin)
        said = LOST if basin < 0 else "best minimum" if basin == 0 else f"minimum {basin + 1}"
        entries += axes.plot(
            [], [], color=colour, marker=marker, markersize=3.2, linewidth=0.5, label=f"{said}: {number}"
        )
    entries += axes.plot([], [], color="0.3", linestyle="none", marker="|", markersize=4.0, label="where it began")
    # The minima in the middle are left out first, neither the best one nor what the other signs mean.
    figure.legend(
        handles=entries if len(entries) <= MOST_KEYS else entries[: MOST_KEYS - 2] + entries[-2:],
        loc="upper left", ncols=MOST_KEYS, fontsize=SMALL, frameon=False,
        bbox_to_anchor=(0.015, 1.0 - 8.0 / (figure.get_size_inches()[1] * 25.4)), handlelength=1.8, columnspacing=1.4,
    )  # fmt: skip
