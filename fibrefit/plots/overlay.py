"""Prior and posterior of each value."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from fibrefit.plots.corner import Drawn
from fibrefit.plots.quantities import axis_label
from fibrefit.plots.style import POSTERIOR, PRIOR, SMALL, axes_at, label, new_figure, title

if TYPE_CHECKING:
    from fibrefit.sampling.posterior import Prior

CELL, GAP, LEFT, BOTTOM, TOP = 36.0, 8.0, 6.0, 12.0, 16.0
ACROSS = 4
WIDER = 3.0
"""Half-width of the axis in half-widths of the posterior: enough to see the prior go on beside it."""
PRIOR_MATTERS = 0.3
"""Posterior over prior width above which the whole prior is shown."""
BINS = 60


def overlay_figure(drawn: list[Drawn], priors: list[Prior], shares: list[float]) -> Figure:
    """Density of prior and posterior of each value, on one axis.

    Parameters
    ----------
    drawn : list of Drawn
    priors : list of Prior
    shares : list of float
        Posterior over prior width of each.
    """
    rows = -(-len(drawn) // ACROSS) or 1
    figure = new_figure(TOP + rows * (CELL + BOTTOM))
    widest = max((share for share in shares if np.isfinite(share)), default=0.0)
    said = "The prior matters" if widest >= PRIOR_MATTERS else "The records, not the prior, determine every value"
    title(figure, f"{said}: posterior / prior width is {100 * widest:.2g} % at most", "orange: prior;  blue: posterior")
    for number, (one, prior, share) in enumerate(zip(drawn, priors, shares, strict=True)):
        row, column = divmod(number, ACROSS)
        bottom = BOTTOM + (rows - 1 - row) * (CELL + BOTTOM)
        axes = axes_at(figure, LEFT + column * (CELL + GAP), bottom, CELL, 0.85 * CELL)
        _overlay(axes, one, prior, share)
    return figure


def _overlay(axes: Axes, one: Drawn, prior: Prior, share: float) -> None:
    values, unit, worth = one.shown
    ends = _ends(values, prior, share, worth)
    heights, edges = np.histogram(values, BINS, ends, density=True)
    axes.stairs(heights, edges, color=POSTERIOR, fill=True, alpha=0.35)
    grid = np.linspace(*ends, 400)
    if prior.proper:
        # The slope of the distribution function is the density, in whatever unit.
        density = np.diff(prior.cdf(grid * worth)) / np.diff(grid)
        axes.plot(0.5 * (grid[1:] + grid[:-1]), density, color=PRIOR, linewidth=1.2)
        said = f"posterior / prior width {100 * share:.2g} %" if np.isfinite(share) else ""
    else:
        said = "improper prior"
    axes.text(1.0, 1.03, said, transform=axes.transAxes, fontsize=SMALL, ha="right", va="bottom", color="0.25")
    axes.set_xlim(*ends)
    axes.set_ylim(bottom=0.0)
    axes.set_yticks([])
    axes.spines["left"].set_visible(False)
    axes.xaxis.set_major_locator(MaxNLocator(4))
    label(axes, x=axis_label(one.name.rpartition(".")[2] if "noise." not in one.name else one.name, unit))


def _ends(values: np.ndarray, prior: Prior, share: float, worth: float) -> tuple[float, float]:
    """Ends of the axis: around the posterior, or the whole prior where the data tell little."""
    low, middle, high = np.quantile(values, [0.001, 0.5, 0.999])
    if prior.proper and share >= PRIOR_MATTERS:
        first, last = prior.quantile(np.array([0.005, 0.995])) / worth
        return min(float(first), float(low)), max(float(last), float(high))
    half = max(WIDER * 0.5 * float(high - low), 1e-9 * abs(float(middle)), 1e-300)
    return (
        max(float(middle) - half, prior.lower / worth),
        min(float(middle) + half, prior.upper / worth),
    )
