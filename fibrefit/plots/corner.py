"""Joint distribution of every two values of a posterior."""

from __future__ import annotations

import math
import textwrap
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator, ScalarFormatter

from fibrefit.core.formatting import in_words
from fibrefit.plots.quantities import axis_label, last_part, readable_unit
from fibrefit.plots.style import FINAL, POSTERIOR, SMALL, USUAL, new_figure, title

CELL, WIDEST = 33.0, 178.0
"""Side of a panel where there is room, and width of the whole at most, in mm: a page."""
LEFT, RIGHT, BOTTOM, TOP = 22.0, 4.0, 19.0, 21.0
"""Margins in mm: numbers stand aslant here, and the label beside them."""
LETTER, BESIDE = 1.55, 9.0
"""Width of a letter of a label, and room of the numbers between a panel and its label, in mm."""
BINS = 36
"""Bins of a histogram each way: finer ones would show chance."""
SMOOTH = 1.1
"""Width of the smoothing of the contours, in bins: they are then those of the density and not of chance."""
MOST_DRAWS = 20000
"""Draws that are binned at most: some fifteen for each cell."""
LEVELS = (0.5, 0.9)
"""Shares of the draws inside the contours."""
EDGE = 0.08
"""Share of an axis at each end that goes without a number."""
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

    @property
    def short(self) -> str:
        """The last part of its name."""
        return last_part(self.name)


def corner_figure(drawn: Sequence[Drawn], probability: float) -> Figure:
    """Histograms on the diagonal, contours of equal density below it, by the library corner.

    Parameters
    ----------
    probability : float
        Of the equal-tailed interval that is marked and stated above each histogram.

    Source
    ------
    Foreman-Mackey, J. Open Source Software 1(2), 24 (2016).
    """
    side = min(CELL * len(drawn), WIDEST - LEFT - RIGHT)
    width = max(LEFT + side + RIGHT, 110.0)
    figure = new_figure(BOTTOM + side + TOP, width=width)
    shown = [one.shown for one in drawn]
    tails = (0.5 - 0.5 * probability, 0.5, 0.5 + 0.5 * probability)
    fitted = [
        None if one.fitted is None else one.fitted / worth for one, (_, _, worth) in zip(drawn, shown, strict=True)
    ]
    _draw_corner(
        np.column_stack([values for values, *_ in shown]),
        bins=BINS,
        range=[_reach(values) for values, *_ in shown],
        labels=[_label(one.short, unit, side / len(drawn)) for one, (_, unit, _) in zip(drawn, shown, strict=True)],
        label_kwargs={"fontsize": USUAL},
        labelpad=max(0.0, BESIDE * len(drawn) / side - 0.3),
        smooth=SMOOTH,
        quantiles=tails,
        levels=LEVELS,
        color=POSTERIOR,
        # Of a single value it cannot draw the fit.
        truths=fitted if len(drawn) > 1 else None,
        truth_color=FINAL,
        plot_datapoints=False,
        fill_contours=True,
        hist_kwargs={"linewidth": 0.8},
        contour_kwargs={"linewidths": 0.6},
        fig=figure,
    )
    across, up = figure.get_size_inches() * 25.4
    figure.subplots_adjust(LEFT / across, BOTTOM / up, (LEFT + side) / across, (BOTTOM + side) / up, 0.06, 0.06)
    if len(drawn) == 1 and fitted[0] is not None:
        figure.axes[0].axvline(fitted[0], color=FINAL)
    _tidy(figure, drawn, shown, tails)
    levels = in_words(f"{100 * level:.0f} %" for level in LEVELS)
    beside = f"contours hold {levels} of the draws; dashed: median and {100 * probability:g} % interval; black: the fit"
    title(figure, _heading(drawn), beside)
    return figure


def _label(name: str, unit: str, width: float) -> str:
    """Label of an axis in lines that fit a panel of a width in mm; a unit is not broken."""
    words, firm = name.replace("_", " "), "\N{NO-BREAK SPACE}"
    unit_part = axis_label(name, unit).removeprefix(words).strip().replace(" ", firm)
    lines = textwrap.wrap(f"{words} {unit_part}", int(width / LETTER), break_long_words=False)
    return "\n".join(lines).replace(firm, " ")


def _draw_corner(draws: np.ndarray, **options: Any) -> None:
    """The library's own drawing of draws ``(n_draw, n_value)``.

    Its front door hands arrays to ArviZ where that is installed, which warns of its own future and draws the same.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        # It asks for pyplot, which nothing else needs.
        from corner.core import corner_impl
    corner_impl(draws, **options)


def _heading(drawn: Sequence[Drawn]) -> str:
    """Which two values trade places most."""
    if len(drawn) < 2:
        return f"Posterior of the {drawn[0].short.replace('_', ' ')}"
    # Draws that are all alike are correlated with nothing.
    with np.errstate(invalid="ignore"):
        correlation = np.corrcoef([one.values for one in drawn])
    below = np.where(np.tri(len(drawn), k=-1, dtype=bool), np.abs(np.nan_to_num(correlation)), -1.0)
    i, j = np.unravel_index(int(below.argmax()), below.shape)
    names = [drawn[int(k)].short.replace("_", " ") for k in (i, j)]
    value = f"{correlation[i, j]:.2f}".replace("-", "\N{MINUS SIGN}")
    return f"Posterior: {names[0]} and {names[1]} are correlated most, {value}"


def _tidy(
    figure: Figure, drawn: Sequence[Drawn], shown: Sequence[tuple[np.ndarray, str, float]], tails: tuple[float, ...]
) -> None:
    """Small ticks, no empty panels, and above each histogram its median and interval."""
    panels = np.array(figure.axes).reshape(len(drawn), len(drawn))
    for (row, column), axes in np.ndenumerate(panels):
        if column > row:
            figure.delaxes(axes)
            continue
        _ticks(axes, x=row == len(drawn) - 1, y=column == 0 and row > 0)
        if column < row:
            axes.set_yticks(_inner(axes.get_ylim()))
        for line in axes.lines:
            line.set(linewidth=0.7, markersize=2.5)
        if row == column:
            low, middle, high = np.quantile(shown[row][0], tails)
            axes.set_title(_interval_text(low, middle, high), fontsize=SMALL - 0.5, pad=3)


def _interval_text(low: float, middle: float, high: float) -> str:
    """Median with its interval, to two digits of the interval."""
    spread = max(high - low, 1e-12 * abs(middle), 1e-300)
    decimals = min(max(0, 1 - math.floor(math.log10(0.5 * spread))), 12)
    return f"{middle:.{decimals}f}\n{low:.{decimals}f} to {high:.{decimals}f}".replace("-", "\N{MINUS SIGN}")


def _reach(values: np.ndarray) -> tuple[float, float]:
    """Ends of an axis; of some width even where all draws are one."""
    low, high = np.quantile(values, REACH)
    if not high > low:
        low, high = low - 1e-6 * max(abs(low), 1e-6), high + 1e-6 * max(abs(high), 1e-6)
    slack = 0.05 * (high - low)
    return float(low - slack), float(high + slack)


def _inner(ends: tuple[float, float]) -> list[float]:
    """Round numbers away from the ends of an axis, where their labels would lie on those of the next panel."""
    low, high = min(ends), max(ends)
    edge = EDGE * (high - low)
    found = MaxNLocator(4).tick_values(low, high)
    return [float(tick) for tick in found if low + edge < tick < high - edge]


def _ticks(axes: Axes, x: bool, y: bool) -> None:
    axes.set_xticks(_inner(axes.get_xlim()))
    for formatter in (axes.xaxis.get_major_formatter(), axes.yaxis.get_major_formatter()):
        # Those without labels have no formatter that could be set.
        if isinstance(formatter, ScalarFormatter):
            formatter.set_useOffset(False)
    axes.tick_params(labelsize=SMALL - 1.0, width=0.5, length=2.0, labelbottom=x, labelleft=y)
    axes.tick_params(axis="x", labelrotation=30.0)
    for spine in axes.spines.values():
        spine.set_linewidth(0.5)
