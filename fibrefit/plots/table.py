"""What was understood of a measurement file: every column over time, with what is missing or masked."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import format_number, format_quantity, printable
from fibrefit.plots.lines import draw_line, mark_masked
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import BLUE, ORANGE, in_own_style, label, legend, stacked_figure, title
from fibrefit.records.table import Table

if TYPE_CHECKING:
    from fibrefit.records import Record, TimeGap

HEIGHT = 30.0
"""Of a column, in mm: six of them stand on a page."""
FEW = 200
"""Samples below which each is drawn as a dot too: a line needs two."""
MOST = 12
"""Columns that are drawn; the rest are counted in the title."""


class _Curve(NamedTuple):
    name: str
    unit: str | None
    times: np.ndarray
    values: np.ndarray
    valid: np.ndarray
    gaps: tuple[TimeGap, ...]


@in_own_style
def table_figure(what: Table | Record) -> Figure:
    """Every column of a file, or every channel of a record, over time.

    Parameters
    ----------
    what : Table or Record
        As read.

    Returns
    -------
    matplotlib.figure.Figure
        Masked samples are marked at the foot of each panel, missing ones shaded.
    """
    name = printable(what.path.name if isinstance(what, Table) else what.name)
    curves = _of_table(what) if isinstance(what, Table) else _of_record(what)
    shown = curves[:MOST]
    figure, panels = stacked_figure([HEIGHT] * max(len(shown), 1))
    beside = _remark(what) + (f"; {len(curves) - MOST} further columns not shown" if len(curves) > MOST else "")
    title(figure, f"{name}, as it was understood", beside)
    for axes, curve in zip(panels, shown, strict=False):
        _draw(axes, curve)
    label(panels[-1], x="time / s")
    figure.align_ylabels(panels)
    return figure


def _of_record(record: Record) -> list[_Curve]:
    return [
        _Curve(role, record.units[role], record.time, values, record.valid[role], record.gaps)
        for role, values in record.channels.items()
    ]


def _of_table(table: Table) -> list[_Curve]:
    roles = {place: role for role, place in table.roles.items()}
    found = []
    for place, column in enumerate(table.columns):
        base = table.times[column.group]
        name = column.name or column.header
        said = f"{name} ({roles[place]})" if place in roles and roles[place] != name else name
        found.append(_Curve(said, column.si, base.time, column.values, column.valid, base.gaps))
    return found


def _remark(what: Table | Record) -> str:
    times = [(base.time, base.rate) for base in (what.times if isinstance(what, Table) else (what,))]
    said = []
    for time, rate in times:
        usable = time[np.isfinite(time)]
        if usable.size > 1:
            said.append(f"{format_quantity(float(np.ptp(usable)), 's')} at {format_number(rate, 5)} Hz")
    return ", ".join(said)


def _draw(axes: Axes, curve: _Curve) -> None:
    usable = np.isfinite(curve.times)
    times, values, valid = curve.times[usable], curve.values[usable], curve.valid[usable]
    unit, worth = readable_unit(values[valid], curve.unit) if curve.unit else ("", 1.0)
    shown = np.where(valid, values, np.nan) / worth
    # A line across a gap would claim what nobody measured.
    after = np.searchsorted(times, [gap.after for gap in curve.gaps], side="right")
    x, y = np.insert(times, after, times[after - 1]), np.insert(shown, after, np.nan)
    draw_line(axes, x, y, color=BLUE, linewidth=0.5)
    if len(times) < FEW:
        axes.plot(x, y, linestyle="none", marker="o", markersize=1.5, color=BLUE)
    if len(times) > 1:
        mark_masked(axes, times, ~valid)
    for number, place in enumerate(after):
        axes.axvspan(
            times[place - 1],
            times[min(place, len(times) - 1)],
            facecolor=ORANGE,
            alpha=0.35,
            edgecolor="none",
            label="" if number else "missing",
        )
    label(axes, y=axis_label(curve.name, unit))
    axes.margins(x=0.0, y=0.08)
    if axes.get_legend_handles_labels()[1]:
        legend(axes, loc="upper right")
