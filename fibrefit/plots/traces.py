"""Traces of the ensembles, and rank plots of their draws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.quantities import axis_label, last_part, readable_unit
from fibrefit.plots.style import BOTTOM, GAP, KINDS, PALE, SMALL, TOP, USUAL, axes_at, label, new_figure, title

ROW, LEFT = 20.0, 18.0
"""Height of a value, and room for its label and numbers of many digits, in mm."""
LONG, RANKS = 100.0, 50.0
"""Widths in mm of traces and of ranks: those are read over time, these only against a level."""
BINS = 20
"""Bins of the ranks: with a thousand draws each is good to a seventh."""
SPREAD = (0.05, 0.95)
"""Quantiles of an ensemble's walkers between which its band runs."""


@dataclass(frozen=True)
class Way:
    """One value along the chains.

    Parameters
    ----------
    name, unit : str
        The unit in SI.
    steps : (n_step,) int, from 1
    low, median, high : (n_ensemble, n_step)
        Of the walkers, at the quantiles `SPREAD`.
    draws : (n_ensemble, n_draw)
        That were kept.
    warm_up : int
        Steps discarded.
    r_hat, ess : float
        Of its draws; NaN where it is not known.
    """

    name: str
    unit: str
    steps: np.ndarray
    low: np.ndarray
    median: np.ndarray
    high: np.ndarray
    draws: np.ndarray
    warm_up: int
    r_hat: float
    ess: float = np.nan


def traces_figure(ways: list[Way], limit: float | None = None, worst: float | None = None) -> Figure:
    """One row a value: the walkers of each ensemble over the steps, and the ranks of its draws among all.

    Parameters
    ----------
    ways : list of Way
        At least one.
    limit : float or None
        R-hat up to which ensembles count as agreeing; None where it is not known.
    worst : float or None
        The largest R-hat of all values, those that are not drawn too; that of the drawn ones unless said.
    """
    figure = new_figure(TOP + BOTTOM + len(ways) * (ROW + GAP) - GAP)
    heading = _agreement(ways, limit, float(np.max([way.r_hat for way in ways])) if worst is None else worst)
    title(figure, heading, "median and 90 % of the walkers of each ensemble, and ranks of its draws among all")
    for number, way in enumerate(ways):
        bottom = BOTTOM + (len(ways) - 1 - number) * (ROW + GAP)
        last = number == len(ways) - 1
        _trace(axes_at(figure, LEFT, bottom, LONG, ROW), way, last)
        _ranks(axes_at(figure, LEFT + LONG + 10.0, bottom, RANKS, ROW), way, last)
    return figure


def _agreement(ways: list[Way], limit: float | None, worst: float) -> str:
    """Whether the ensembles agree, by the value for which they do so least."""
    count = f"{len(ways[0].draws)} ensembles of walkers"
    if not np.isfinite(worst) or any(np.isnan(way.r_hat) for way in ways):
        return f"Whether {count} agree is not known"
    if limit is not None and worst >= limit:
        return f"{count} do not agree: R-hat is up to {worst:.3f}, above {limit:g}"
    return f"{count} agree to an R-hat of {worst:.3f} or better"


def _trace(axes: Axes, way: Way, last: bool) -> None:
    unit, worth = readable_unit(way.draws, way.unit)
    axes.axvspan(0.5, way.warm_up + 0.5, facecolor=PALE, edgecolor="none")
    for low, middle, high, (colour, _) in zip(way.low, way.median, way.high, _colours(len(way.draws)), strict=True):
        axes.fill_between(way.steps, low / worth, high / worth, facecolor=colour, alpha=0.12, linewidth=0.0)
        axes.plot(way.steps, middle / worth, color=colour, linewidth=0.6)
    least, most = np.quantile(way.draws / worth, [0.001, 0.999])
    if most > least:
        axes.set_ylim(least - 0.2 * (most - least), most + 0.2 * (most - least))
    axes.set_xlim(0.5, way.steps[-1] + 0.5)
    axes.yaxis.set_major_locator(MaxNLocator(4))
    axes.tick_params(labelbottom=last)
    label(axes, x="step (shaded: warm-up)" if last else "", y=axis_label(last_part(way.name), unit))
    axes.text(1.0, 1.02, way.name, transform=axes.transAxes, fontsize=SMALL, ha="right", va="bottom", color="0.25")


def _ranks(axes: Axes, way: Way, last: bool) -> None:
    ranks = np.argsort(np.argsort(way.draws.ravel())).reshape(way.draws.shape) / way.draws.size
    shares = [np.histogram(one, BINS, (0.0, 1.0))[0] * BINS / way.draws.shape[1] for one in ranks]
    for found, (colour, _) in zip(shares, _colours(len(ranks)), strict=True):
        axes.stairs(found, np.linspace(0.0, 1.0, BINS + 1), color=colour, linewidth=0.7)
    if way.ess > 0.0:
        # Two standard deviations of a share, of an ensemble with its part of the effective draws.
        chance = 2.0 * np.sqrt(BINS * len(ranks) / way.ess)
        axes.axhspan(1.0 - chance, 1.0 + chance, facecolor=PALE, edgecolor="none", zorder=0)
    axes.axhline(1.0, color="0.5", linewidth=0.4)
    axes.set_ylim(0.0, max(2.0, 1.05 * float(np.max(shares))))
    axes.set_xlim(0.0, 1.0)
    axes.tick_params(labelbottom=last)
    if last:
        label(axes, x="rank among all draws (grey: chance)")
    label(axes, y="share / expected")
    said = f"R-hat {way.r_hat:.3f}" + (f", ESS {way.ess:.0f}" if way.ess > 0.0 else "")
    axes.text(1.0, 1.02, said, transform=axes.transAxes, fontsize=USUAL, ha="right", va="bottom", color="0.25")


def _colours(count: int) -> list[tuple[str, str]]:
    return [KINDS[i % len(KINDS)] for i in range(count)]
