"""The first contact of each record under a magnifier: where the fibre goes taut, and where it goes slack again."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.declarations import FORCES
from fibrefit.plots.figures import MOST_RECORDS
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.records import Compared
from fibrefit.plots.style import (
    BOTTOM,
    LEFT,
    SIMULATED,
    SKY,
    SMALL,
    TOP,
    axes_at,
    cut_name,
    label,
    legend,
    new_figure,
    title,
)

ROWS = 6
"""Records in one figure."""
HEIGHT, ACROSS, ABOVE, BETWEEN = 30.0, 74.0, 8.0, 14.0
"""Height and width of a panel, room above the next row for its numbers and between columns for a label, in mm."""
SHARE = 0.35
"""Half of a window over the duration of the contact."""
FEWEST, MOST = 8, 200
"""Samples shown on either side of a snap, at least and at most: more would not be told apart."""
MOST_LETTERS = 46
"""Of what a panel is of, beside what it shows."""


def snap_figures(fitted: Fitted, taut: tuple[int, ...]) -> Iterator[Figure]:
    """Figures of at most `ROWS` records each; none where no force was measured.

    Parameters
    ----------
    taut : tuple of int
        Phases in which the fibre carries load.
    """
    gauge = next((c for c, channel in enumerate(fitted.channels) if channel in FORCES), None)
    if gauge is None:
        return
    contacts = [(r, contact) for r in fitted.worst(MOST_RECORDS) if (contact := first_contact(fitted, r, taut))]
    for first in range(0, len(contacts), ROWS):
        shown = contacts[first : first + ROWS]
        which = "each record" if len(shown) == len(fitted.records) else f"{len(shown)} of {len(fitted.records)} records"
        yield _figure(fitted, gauge, shown, which)


def first_contact(fitted: Fitted, record: int, taut: tuple[int, ...]) -> tuple[int, int | None] | None:
    """Samples at which the fibre goes taut for the first time and slack again; None where that does not happen."""
    loaded = np.isin(fitted.phase(record), taut)
    begins = np.flatnonzero(loaded & ~np.r_[True, loaded[:-1]])
    if not begins.size:
        return None
    start = int(begins[0])
    slack = np.flatnonzero(~loaded[start:])
    return start, start + int(slack[0]) if slack.size else None


def _figure(fitted: Fitted, gauge: int, contacts: list[tuple[int, tuple[int, int | None]]], which: str) -> Figure:
    figure = new_figure(TOP + BOTTOM + len(contacts) * (HEIGHT + ABOVE) - ABOVE)
    title(
        figure,
        f"How the model follows the first contact of {which}: take-up and release",
        "dots: measured samples; line: simulated; dashed: the instant at which the simulated fibre goes taut or slack",
    )
    up = figure.get_size_inches()[1] * 25.4
    for row, (record, (start, end)) in enumerate(contacts):
        bottom = up - TOP - HEIGHT - row * (HEIGHT + ABOVE)
        force = fitted.compared(record)[gauge]
        half = min(max(FEWEST, round(SHARE * ((end or start + 60) - start))), MOST)
        windows = [(start, "take-up")] if end is None else [(start, "take-up"), (end, "release")]
        for column, (instant, what) in enumerate(windows):
            axes = axes_at(figure, LEFT + column * (ACROSS + BETWEEN), bottom, ACROSS, HEIGHT)
            _zoom(axes, force, instant, half)
            if column == 0:
                _name(axes, fitted, record)
            axes.text(1.0, 1.02, what, transform=axes.transAxes, fontsize=SMALL, color="0.25", ha="right", va="bottom")
            if row == 0:
                legend(axes, loc="lower right" if column == 0 else "upper right", ncols=1)
            if row == len(contacts) - 1:
                label(axes, x="time after the contact begins / ms" if column == 0 else "time after it ends / ms")
    return figure


def _name(axes: Axes, fitted: Fitted, record: int) -> None:
    said = ", ".join(filter(None, (fitted.records[record], fitted.conditions(record))))
    axes.text(
        0.0, 1.02, cut_name(said, MOST_LETTERS), transform=axes.transAxes, fontsize=SMALL, color="0.25", va="bottom"
    )


def _zoom(axes: Axes, force: Compared, instant: int, half: int) -> None:
    window = slice(max(instant - half, 0), instant + half)
    times = 1e3 * (force.times[window] - force.times[instant])
    unit, worth = readable_unit(force.measured[window], force.unit)
    axes.axvline(0.0, color="0.7", linewidth=0.5, linestyle=(0, (3, 3)))
    dots: dict = {"linestyle": "none", "marker": "o", "markersize": 2.6, "markerfacecolor": SKY, "markeredgewidth": 0.0}
    axes.plot(times, force.measured[window] / worth, label="measured", **dots)
    axes.plot(times, force.simulated[window] / worth, label="simulated", **SIMULATED)
    axes.set_xlim(times[0], times[-1])
    axes.margins(y=0.1)
    label(axes, y=axis_label(force.name, unit))
