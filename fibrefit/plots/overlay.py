"""Prior and posterior of each value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.corner import Drawn
from fibrefit.plots.quantities import axis_label
from fibrefit.plots.style import POSTERIOR, PRIOR, SMALL, axes_at, label, new_figure, title
from fibrefit.sampling.thresholds import PRIOR_MATTERS

CELL, GAP, LEFT, BOTTOM, TOP = 36.0, 8.0, 6.0, 12.0, 16.0
ACROSS = 4
BINS, POINTS = 60, 400


class PriorCurve(NamedTuple):
    """Density of the prior of a value.

    Parameters
    ----------
    at : (n,) in SI units, over what is worth seeing of the value
    density : (n,) per SI unit; NaN for an improper prior
    share : float
        Posterior over prior width.
    """

    at: np.ndarray
    density: np.ndarray
    share: float


def overlay_figure(drawn: list[Drawn], priors: list[PriorCurve]) -> Figure:
    """Density of prior and posterior of each value, on one axis."""
    rows = -(-len(drawn) // ACROSS) or 1
    figure = new_figure(TOP + rows * (CELL + BOTTOM))
    widest = max((prior.share for prior in priors if np.isfinite(prior.share)), default=0.0)
    said = "The prior matters" if widest >= PRIOR_MATTERS else "The records, not the prior, determine every value"
    title(figure, f"{said}: posterior / prior width is {100 * widest:.2g} % at most", "orange: prior;  blue: posterior")
    for number, (one, prior) in enumerate(zip(drawn, priors, strict=True)):
        row, column = divmod(number, ACROSS)
        bottom = BOTTOM + (rows - 1 - row) * (CELL + BOTTOM)
        axes = axes_at(figure, LEFT + column * (CELL + GAP), bottom, CELL, 0.85 * CELL)
        _overlay(axes, one, prior)
    return figure


def _overlay(axes: Axes, one: Drawn, prior: PriorCurve) -> None:
    values, unit, worth = one.shown
    ends = float(prior.at[0]) / worth, float(prior.at[-1]) / worth
    heights, edges = np.histogram(values, BINS, ends, density=True)
    axes.stairs(heights, edges, color=POSTERIOR, fill=True, alpha=0.35)
    if np.isfinite(prior.density).all():
        axes.plot(prior.at / worth, prior.density * worth, color=PRIOR, linewidth=1.2)
        said = f"posterior / prior width {100 * prior.share:.2g} %" if np.isfinite(prior.share) else ""
    else:
        said = "improper prior"
    axes.text(1.0, 1.03, said, transform=axes.transAxes, fontsize=SMALL, ha="right", va="bottom", color="0.25")
    axes.set_xlim(*ends)
    axes.set_ylim(bottom=0.0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    label(axes, x=axis_label(one.name.rpartition(".")[2] if "noise." not in one.name else one.name, unit))
