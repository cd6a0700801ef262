"""Prior and posterior of each value."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.corner import Drawn
from fibrefit.plots.quantities import axis_label
from fibrefit.plots.style import POSTERIOR, PRIOR, SMALL, TOP, axes_at, label, new_figure, title
from fibrefit.sampling.thresholds import PRIOR_MATTERS

CELL, ACROSS, BETWEEN, MARGIN = 36.0, 4, 8.0, 6.0
"""Width of a panel in mm and panels in a row; room between them and left of the first: heights have no numbers."""
BELOW = 12.0
"""Room in mm below a panel for numbers and label."""
BINS, POINTS = 60, 400
"""Bins of the posterior, and points of the prior: more than can be seen in a panel."""


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
    figure = new_figure(TOP + rows * (CELL + BELOW))
    title(figure, _heading([prior.share for prior in priors if np.isfinite(prior.share)]), COLOURS)
    for number, (one, prior) in enumerate(zip(drawn, priors, strict=True)):
        row, column = divmod(number, ACROSS)
        bottom = BELOW + (rows - 1 - row) * (CELL + BELOW)
        axes = axes_at(figure, MARGIN + column * (CELL + BETWEEN), bottom, CELL, 0.85 * CELL)
        _overlay(axes, one, prior)
    return figure


def _heading(shares: list[float]) -> str:
    """What the widths of posterior and prior say of the values that are shown."""
    if not shares:
        return "No prior has a width that could be compared with the posterior's"
    said = "The prior matters"
    if max(shares) < PRIOR_MATTERS:
        said = "The records, not the prior, determine every value shown"
    return f"{said}: posterior / prior width is {100 * max(shares):.2g} % at most"


COLOURS = "orange: prior;  blue: posterior"


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
