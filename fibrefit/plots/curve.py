"""What is missing, as a curve: the best one large with its errors and where it is supported, the others small."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BLUE,
    BOTTOM,
    GREY,
    LEFT,
    ORANGE,
    PALE,
    RIGHT,
    SKY,
    SMALL,
    TOP,
    axes_at,
    label,
    legend,
    logarithmic,
    new_figure,
    title,
)
from fibrefit.study.summaries.discovery import FreeCurve
from fibrefit.study.summaries.part import Z_95

LARGE, STAYS, SHARED_SPACE = 58.0, 12.0, 2.0
"""Heights in mm of the best curve and of where the motion stays, and what is between them: they share an axis."""
BETWEEN = 14.0
"""Room in mm between small pictures for the numbers and the label of the right one."""
SMALL_HEIGHT, ABOVE = 22.0, 20.0
"""Height of a small picture, and room between rows of them, in mm."""
COLUMNS, WIDEST = 3, 40
"""Small pictures in a row, and letters in a line above them."""
ROOM = 0.5
"""How far an axis reaches beyond the curve for the sake of its band, as a share of the curve's height."""


def curve_figure(curves: Sequence[FreeCurve]) -> Figure:
    """The best curve over where the motion spends its time, and the others with the gap each leaves.

    Parameters
    ----------
    curves : sequence of FreeCurve
        Best first, at least one; that of which a law is proposed comes before them.
    """
    best, *others = sorted(curves, key=lambda one: one.law is None)
    rows = -(-len(others) // COLUMNS)
    figure = new_figure(TOP + LARGE + SHARED_SPACE + STAYS + BOTTOM + rows * (SMALL_HEIGHT + ABOVE))
    beside = f"with it, the gap (residual RMS / noise) is {best.gap_after:.2f}"
    title(figure, f"What is missing looks like {best.says}", beside)
    across, up = figure.get_size_inches() * 25.4
    width = across - LEFT - RIGHT
    axes = axes_at(figure, LEFT, up - TOP - LARGE, width, LARGE)
    _curve(axes, best)
    axes.tick_params(labelbottom=False)
    legend(axes, loc="lower right", bbox_to_anchor=(1.0, 1.0))
    _stays(axes_at(figure, LEFT, up - TOP - LARGE - SHARED_SPACE - STAYS, width, STAYS), axes, best)
    small = (width - (COLUMNS - 1) * BETWEEN) / COLUMNS
    for i, curve in enumerate(others):
        row, column = divmod(i, COLUMNS)
        bottom = BOTTOM + (rows - 1 - row) * (SMALL_HEIGHT + ABOVE)
        panel = axes_at(figure, LEFT + column * (small + BETWEEN), bottom, small, SMALL_HEIGHT)
        _curve(panel, curve)
        label(panel, x=axis_label(curve.variable, readable_unit(np.array(curve.knots), curve.unit)[0]))
        heading = "\n".join(textwrap.wrap(f"{curve.says}: gap {curve.gap_after:.2f}", WIDEST))
        panel.text(0.0, 1.04, heading, transform=panel.transAxes, fontsize=SMALL, color="0.25", ha="left", va="bottom")
    return figure


def _curve(axes: Axes, curve: FreeCurve) -> None:
    across = readable_unit(np.array(curve.knots), curve.unit)[1]
    up = readable_unit(np.array(curve.heights), curve.height_unit)
    knots, heights = np.divide(curve.knots, across), np.divide(curve.heights, up[1])
    half = Z_95 * np.array([np.inf if error is None else error for error in curve.std_errors]) / up[1]
    reach = ROOM * float(np.ptp(heights)) or 1.0
    lowest, highest = float(heights.min()) - reach, float(heights.max()) + reach
    low, high = np.maximum(heights - half, lowest), np.minimum(heights + half, highest)
    if curve.acts is not None:
        axes.axvspan(*np.divide(curve.acts, across), facecolor=PALE, edgecolor="none", zorder=0, label="where it acts")
    axes.axhline(0.0, color=GREY, linewidth=0.6, zorder=1)
    axes.fill_between(knots, low, high, facecolor=SKY, alpha=0.45, edgecolor="none", zorder=2, label="95 % band")
    axes.plot(knots, heights, color=BLUE, linewidth=1.0, marker="o", markersize=2.2, zorder=3, label="height at a knot")
    if curve.law is not None:
        axes.plot(
            knots,
            np.array(curve.law) / up[1],
            color=ORANGE,
            linewidth=1.6,
            linestyle="--",
            zorder=4,
            label="proposed law",
        )
    axes.set_xlim(float(knots[0]), float(knots[-1]))
    # Where no record has been, the band is as wide as anything: it does not set the scale.
    seen = (np.array(curve.seconds) > 0.0) | (half == half.min())
    least, most = min(0.0, float(low[seen].min())), max(0.0, float(high[seen].max()))
    axes.set_ylim(least - 0.05 * (most - least), most + 0.05 * (most - least))
    label(axes, y=axis_label("height", up[0]))


def _stays(axes: Axes, above: Axes, curve: FreeCurve) -> None:
    """How long the motion stays near each knot; at rest it does so longer than anywhere else by far."""
    unit, across = readable_unit(np.array(curve.knots), curve.unit)
    knots = np.divide(curve.knots, across)
    axes.bar(knots, curve.seconds, width=float(knots[1] - knots[0]), color="0.72", edgecolor="white", linewidth=0.3)
    axes.sharex(above)
    axes.tick_params(labelbottom=True)
    if any(curve.seconds):
        logarithmic(axes, "y")
        axes.minorticks_off()
    label(axes, x=axis_label(curve.variable, unit), y="time / s")
