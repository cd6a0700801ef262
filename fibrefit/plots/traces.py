"""Traces of the ensembles, and rank plots of their draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import KINDS, PALE, SMALL, USUAL, axes_at, label, new_figure, title

ROW, GAP, LEFT, BOTTOM, TOP = 20.0, 5.0, 18.0, 11.0, 17.0
LONG, RANKS = 100.0, 50.0
BINS = 20
SPREAD = (0.05, 0.95)
"""Quantiles of an ensemble's walkers between which its band runs."""


@dataclass(frozen=True)
class Way:
    """One value along the chains.

    Parameters
    ----------
    name, unit : str
        The unit in SI.
    values : (n_ensemble, n_step, n_walker)
    warm_up : int
        Steps discarded.
    r_hat : float
    """

    name: str
    unit: str
    values: np.ndarray
    warm_up: int
    r_hat: float


def traces_figure(ways: list[Way]) -> Figure:
    """One row a value: the walkers of each ensemble over the steps, and the ranks of its draws among all.

    Parameters
    ----------
    ways : list of Way
    """
    figure = new_figure(TOP + BOTTOM + len(ways) * (ROW + GAP) - GAP)
    worst = max(ways, key=lambda way: way.r_hat)
    heading = f"{len(ways[0].values)} ensembles of walkers agree to an R-hat of {worst.r_hat:.3f} or better"
    title(figure, heading, "median and 90 % of the walkers of each ensemble, and ranks of its draws among all")
    for number, way in enumerate(ways):
        bottom = BOTTOM + (len(ways) - 1 - number) * (ROW + GAP)
        last = number == len(ways) - 1
        _trace(axes_at(figure, LEFT, bottom, LONG, ROW), way, last)
        _ranks(axes_at(figure, LEFT + LONG + 10.0, bottom, RANKS, ROW), way, last)
    return figure


def _trace(axes: Axes, way: Way, last: bool) -> None:
    unit, worth = readable_unit(way.values, way.unit)
    values, steps = way.values / worth, np.arange(1, way.values.shape[1] + 1)
    axes.axvspan(0.5, way.warm_up + 0.5, facecolor=PALE, edgecolor="none")
    for ensemble, (colour, _) in zip(values, _colours(len(values)), strict=True):
        low, high = np.quantile(ensemble, SPREAD, axis=1)
        axes.fill_between(steps, low, high, facecolor=colour, alpha=0.12, linewidth=0.0)
        axes.plot(steps, np.median(ensemble, axis=1), color=colour, linewidth=0.6)
    kept = values[:, way.warm_up :]
    low, high = np.quantile(kept, [0.001, 0.999])
    if high > low:
        axes.set_ylim(low - 0.2 * (high - low), high + 0.2 * (high - low))
    axes.set_xlim(0.5, len(steps) + 0.5)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelbottom=last)
    label(axes, x="step (shaded: warm-up)" if last else "", y=axis_label(way.name.rpartition(".")[2], unit))
    axes.text(1.0, 1.02, way.name, transform=axes.transAxes, fontsize=SMALL, ha="right", va="bottom", color="0.25")


def _ranks(axes: Axes, way: Way, last: bool) -> None:
    kept = way.values[:, way.warm_up :].reshape(len(way.values), -1)
    ranks = np.argsort(np.argsort(kept.ravel())).reshape(kept.shape) / kept.size
    for ensemble, (colour, _) in zip(ranks, _colours(len(ranks)), strict=True):
        shares = np.histogram(ensemble, BINS, (0.0, 1.0))[0] * BINS / kept.shape[1]
        axes.stairs(shares, np.linspace(0.0, 1.0, BINS + 1), color=colour, linewidth=0.7)
    axes.axhline(1.0, color="0.5", linewidth=0.4)
    axes.set_ylim(0.0, 2.0)
    axes.set_xlim(0.0, 1.0)
    axes.tick_params(labelbottom=last)
    if last:
        label(axes, x="rank among all draws")
    said = f"R-hat {way.r_hat:.3f}"
    axes.text(1.0, 1.02, said, transform=axes.transAxes, fontsize=USUAL, ha="right", va="bottom", color="0.25")


def _colours(count: int) -> list[tuple[str, str]]:
    return [KINDS[i % len(KINDS)] for i in range(count)]
