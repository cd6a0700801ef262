"""Joint distribution of every two values of a posterior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import BLACK, BLUE, SMALL, VERMILLION, label, new_figure, place, title

LEFT, BOTTOM, TOP, GAP = 20.0, 14.0, 14.0, 2.0
CELL, WIDEST = 30.0, 178.0
BINS = 36
MOST_DRAWS = 20000
LEVELS = (0.5, 0.9)
"""Shares of the draws inside the contours."""
REACH = (0.0005, 0.9995)
"""Quantiles of the draws between which the axes run."""


@dataclass(frozen=True)
class Drawn:
    """Draws of one value.

    Parameters
    ----------
    name, unit : str
        The unit in SI.
    values : (n_draw,)
    fitted : float or None
        Value of the fit.
    """

    name: str
    unit: str
    values: np.ndarray
    fitted: float | None = None

    @property
    def shown(self) -> tuple[np.ndarray, str, float]:
        """Draws in a readable unit, that unit, and what it is worth in SI."""
        unit, worth = readable_unit(self.values, self.unit)
        step = -(-len(self.values) // MOST_DRAWS)
        return self.values[::step] / worth, unit, worth


def corner_figure(drawn: list[Drawn], probability: float) -> Figure:
    """Histograms on the diagonal, contours of equal density below it.

    Parameters
    ----------
    drawn : list of Drawn
    probability : float
        Of the equal-tailed interval that is shaded.
    """
    count = len(drawn)
    cell = min(CELL, (WIDEST - LEFT - GAP * count) / count)
    side = count * (cell + GAP)
    figure = new_figure(BOTTOM + side + TOP, width=max(LEFT + side + 5.0, 90.0))
    levels = " and ".join(f"{100 * level:.0f} %" for level in LEVELS)
    title(figure, "Posterior", f"contours: {levels};  shaded: {100 * probability:g} %;  cross: fit")
    shown = [one.shown for one in drawn]
    for row in range(count):
        for column in range(row + 1):
            axes = place(figure, LEFT + column * (cell + GAP), BOTTOM + (count - 1 - row) * (cell + GAP), cell, cell)
            axes.set_xlim(*_reach(shown[column][0]))
            if row == column:
                _histogram(axes, shown[row][0], probability)
            else:
                _cloud(axes, shown[column][0], shown[row][0])
                _mark_fit(axes, drawn[column], drawn[row], shown[column][2], shown[row][2])
            _ticks(axes, row == count - 1, column == 0 and row > 0)
            if row == count - 1:
                label(axes, x=axis_label(_short(drawn[column].name), shown[column][1]))
            if column == 0 and row > 0:
                label(axes, y=axis_label(_short(drawn[row].name), shown[row][1]))
    return figure


def _reach(values: np.ndarray) -> tuple[float, float]:
    """Ends of an axis; of some width even where all draws are one."""
    low, high = np.quantile(values, REACH)
    if not high > low:
        low, high = low - 1e-6 * max(abs(low), 1e-6), high + 1e-6 * max(abs(high), 1e-6)
    slack = 0.05 * (high - low)
    return float(low - slack), float(high + slack)


def _histogram(axes: Axes, values: np.ndarray, probability: float) -> None:
    heights, edges = np.histogram(values, BINS, axes.get_xlim())
    axes.stairs(heights, edges, color=BLACK, linewidth=0.8)
    low, high = np.quantile(values, [0.5 - 0.5 * probability, 0.5 + 0.5 * probability])
    axes.axvspan(low, high, facecolor=BLUE, alpha=0.18, edgecolor="none")
    axes.axvline(float(np.median(values)), color=BLUE, linewidth=0.8)
    axes.set_ylim(0.0, 1.1 * max(heights.max(), 1))
    axes.spines["left"].set_visible(False)


def _cloud(axes: Axes, x: np.ndarray, y: np.ndarray) -> None:
    axes.set_ylim(*_reach(y))
    heights, across, up = np.histogram2d(x, y, BINS, (axes.get_xlim(), axes.get_ylim()))
    smooth = _blurred(heights)
    levels = _levels(smooth)
    centres = (0.5 * (across[1:] + across[:-1]), 0.5 * (up[1:] + up[:-1]))
    if len(levels) < len(LEVELS):
        axes.plot(x, y, ",", color=BLUE, alpha=0.3)
        return
    axes.contourf(*centres, smooth.T, levels=[*levels, smooth.max() * 1.001], colors=[BLUE, BLUE], alpha=0.25)
    axes.contour(*centres, smooth.T, levels=levels, colors=BLACK, linewidths=0.5)


def _blurred(heights: np.ndarray) -> np.ndarray:
    """A histogram evened out a little, so that its contours are those of the density and not of chance."""
    kernel = np.exp(-0.5 * (np.arange(-3, 4) / 1.1) ** 2)
    kernel /= kernel.sum()
    for axis in (0, 1):
        heights = np.apply_along_axis(np.convolve, axis, heights, kernel, mode="same")
    return heights


def _levels(heights: np.ndarray) -> list[float]:
    """Heights of the contours that hold the shares of `LEVELS`, ascending; fewer where the draws are too few."""
    ordered = np.sort(heights.ravel())[::-1]
    held = np.cumsum(ordered) / max(ordered.sum(), 1e-300)
    found = {float(ordered[min(int(np.searchsorted(held, share)), ordered.size - 1)]) for share in LEVELS}
    return sorted(level for level in found if level > 0.0)


def _mark_fit(axes: Axes, across: Drawn, up: Drawn, x_worth: float, y_worth: float) -> None:
    if across.fitted is not None and up.fitted is not None:
        axes.plot(across.fitted / x_worth, up.fitted / y_worth, "x", color=VERMILLION, markersize=4, clip_on=True)


def _ticks(axes: Axes, x: bool, y: bool) -> None:
    axes.xaxis.set_major_locator(MaxNLocator(3, prune="both"))
    axes.yaxis.set_major_locator(MaxNLocator(3, prune="both"))
    axes.tick_params(labelbottom=x, labelleft=y, left=y, labelsize=SMALL - 1.0)
    axes.tick_params(axis="x", labelrotation=30.0)


def _short(name: str) -> str:
    """The last part of a dotted name, without its record."""
    return name if name.startswith("noise.") else name.partition("[")[0].rpartition(".")[2]
