"""Records side by side: drawn to what they have in common, and over their conditions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BLACK,
    BLUE,
    GAP,
    GREY,
    MOST_NAMES,
    PALE,
    RIGHT,
    SKY,
    SMALL,
    TOP,
    VERMILLION,
    WIDTH,
    axes_at,
    label,
    legend,
    name_records,
    new_figure,
    title,
)
from fibrefit.series.meta_analysis import BY_ORDER
from fibrefit.series.thresholds import SIGNIFICANT
from fibrefit.study.summaries.series import speed_name

if TYPE_CHECKING:
    from fibrefit.study.summaries.series import BatchItem, PopulationSummary, SeriesRecord, TrendSummary

LEFT, BOTTOM, ACROSS, UP = 17.0, 13.0, 17.0, 15.0
"""Margins for names of records in two lines, and room between panels for the label of the next, in mm."""
LEGEND = 3.5
"""Room for a legend below a title of two lines and its remark, in mm."""
HEIGHT, COLUMNS = 32.0, 3
"""Height of a panel in mm, and panels in a row."""
MOST = 12
"""Trends that are drawn: a page of them."""
TRENDS = (
    "line: weighted regression; bars: 2 standard errors; diamond: outlier; chance: probability of as strong a trend "
    "where there is none, all looks together"
)


class RecordValue(NamedTuple):
    """What a record says of a parameter, and what is believed of it beside the others."""

    value: float
    error: float
    shrunk: float | None = None
    around: float | None = None


Values = Mapping[str, Mapping[str, RecordValue]]


def population_figure(population: Mapping[str, PopulationSummary], values: Values) -> Figure:
    """Values of each record with the intervals of the mean and of a new record.

    Parameters
    ----------
    population : mapping of parameter to PopulationSummary
    values : mapping of record to mapping of parameter to RecordValue
    """
    top = TOP + LEGEND
    high = top + len(population) * (HEIGHT + GAP) - GAP + BOTTOM
    figure = new_figure(high)
    title(
        figure,
        _differing(population),
        "open: record by itself; filled: partially pooled; bars: twice the standard error",
    )
    for i, (name, found) in enumerate(population.items()):
        axes = axes_at(figure, LEFT, high - top - (i + 1) * HEIGHT - i * GAP, WIDTH - LEFT - RIGHT, HEIGHT)
        _pooled(axes, name, found, values)
        last = i == len(population) - 1
        named = len(values) <= MOST_NAMES
        if named:
            name_records(axes, range(1, len(values) + 1), list(values), WIDTH - LEFT - RIGHT)
        else:
            axes.set_xticks([])
        axes.tick_params(axis="x", labelbottom=last)
        label(axes, x="record" if last and not named else "")
    legend(figure.axes[0], loc="lower left", bbox_to_anchor=(0.0, 1.0))
    return figure


def _differing(population: Mapping[str, PopulationSummary]) -> str:
    """Which parameter differs most surely from record to record, and by how much; or that none does beyond chance."""
    name, one = min(population.items(), key=lambda item: item[1].chance)
    unit, worth = readable_unit(np.array([one.mean]), one.unit)
    by = f"{100.0 * one.between_records:.2g} %" if one.relative else f"{one.between_records / worth:.2g} {unit}"
    if one.chance * len(population) >= SIGNIFICANT:
        return f"Records differ by no more than chance: {_words(name)} by {by} (probability {one.chance:.2g})"
    said = f"{_words(name)} differs from record to record by {by} ({_chance(one.chance)})"
    return said[0].upper() + said[1:]


def _chance(chance: float) -> str:
    """A probability; of the smallest ones a computer knows nothing but that."""
    return f"probability by chance {f'{chance:.2g}' if chance else 'below 1e-300'}"


def _words(name: str) -> str:
    return name.rpartition(".")[2].replace("_", " ")


def _pooled(axes: Axes, name: str, found: PopulationSummary, values: Values) -> None:
    rows = [one.get(name, RecordValue(np.nan, np.nan)) for one in values.values()]
    places = np.arange(1, len(rows) + 1)
    unit, worth = readable_unit(np.array([found.mean]), found.unit)
    new, mean = ([end / worth for end in ends] for ends in (found.new_record_interval_95, found.mean_interval_95))
    axes.axhspan(*new, color=PALE, linewidth=0, label="a new record, 95 %")
    axes.axhspan(*mean, color=SKY, alpha=0.6, linewidth=0, label="mean, 95 %")
    columns = [np.array([np.nan if x is None else x for x in column]) / worth for column in zip(*rows, strict=True)]
    style = {"fmt": "o", "markersize": 3, "elinewidth": 0.6}
    axes.errorbar(places - 0.1, columns[0], 2.0 * columns[1], color=GREY, markerfacecolor="white", **style)  # type: ignore[arg-type]
    axes.errorbar(places + 0.1, columns[2], 2.0 * columns[3], color=BLUE, **style)  # type: ignore[arg-type]
    label(axes, y=axis_label(name.rpartition(".")[2], unit))


def trends_figure(
    trends: Sequence[TrendSummary], values: Values, records: Mapping[str, BatchItem | SeriesRecord]
) -> Figure:
    """The surest trends, each parameter over its condition with its line.

    Parameters
    ----------
    trends : sequence of TrendSummary
        The surest first, one at least.
    values : mapping of record to mapping of parameter to RecordValue
    records : mapping of record to BatchItem or SeriesRecord
        All of them in their order, with their conditions by bare names or with their units; ``speed of <parameter>``
        for the speed.
    """
    drawn = trends[:MOST]
    high = TOP + -(-len(drawn) // COLUMNS) * (HEIGHT + UP) + 2.0
    figure = new_figure(high)
    title(figure, _strongest(trends), TRENDS)
    wide = (WIDTH - LEFT - RIGHT - (COLUMNS - 1) * ACROSS) / COLUMNS
    for i, one in enumerate(drawn):
        row, column = divmod(i, COLUMNS)
        bottom = high - TOP - (row + 1) * HEIGHT - row * UP
        _trend(
            axes_at(figure, LEFT + column * (wide + ACROSS), bottom, wide, HEIGHT),
            one,
            _points(one, values, records),
        )
    return figure


def _strongest(trends: Sequence[TrendSummary]) -> str:
    """How many trends are more than chance, and which is the surest."""
    sure = sum(one.chance_corrected < SIGNIFICANT for one in trends)
    if not sure:
        return f"None of {len(trends)} trends is stronger than chance"
    first = f"{_words(trends[0].parameter)} over {_words(trends[0].condition)}"
    return f"{sure} of {len(trends)} possible trends {'is' if sure == 1 else 'are'} stronger than chance: {first} first"


def _points(
    one: TrendSummary, values: Values, records: Mapping[str, BatchItem | SeriesRecord]
) -> tuple[np.ndarray, np.ndarray]:
    """Condition, its error, value and error of each record that shows both, ``(4, n)``; and which are outliers."""
    bare = speed_name(one.parameter) if one.condition == "speed" else one.condition
    headed = f"{bare} [{one.condition_unit}]"
    outliers, rows, flags = {o.record for o in one.outliers}, [], []
    # Those of which nothing can be used count too.
    places = {name: float(number) for number, name in enumerate(records, 1)}
    for name, said in values.items():
        record = records.get(name)
        known, errors = ({}, {}) if record is None else (record.conditions, record.condition_errors)
        x = known.get(bare, known.get(headed, places.get(name) if bare == BY_ORDER else None))
        if x is not None and one.parameter in said:
            spread = errors.get(bare, errors.get(headed, 0.0))
            rows.append((x, spread, said[one.parameter].value, said[one.parameter].error))
            flags.append(name in outliers)
    return np.array(rows).reshape(-1, 4).T, np.array(flags, dtype=bool)


def _trend(axes: Axes, one: TrendSummary, points: tuple[np.ndarray, np.ndarray]) -> None:
    (x, spread, value, error), outlying = points
    unit, worth = readable_unit(value, one.unit)
    across, scale = readable_unit(x, one.condition_unit)
    for here, colour, mark, size in ((~outlying, BLUE, "o", 2.5), (outlying, VERMILLION, "D", 3.5)):
        bars, across_it = 2.0 * np.nan_to_num(error[here]) / worth, 2.0 * spread[here] / scale
        style: dict[str, Any] = {"fmt": mark, "color": colour, "markersize": size, "elinewidth": 0.6}
        axes.errorbar(x[here] / scale, value[here] / worth, bars, across_it if across_it.any() else None, **style)
    ends = np.array([x.min(), x.max()])
    axes.plot(ends / scale, (one.intercept + one.slope * ends) / worth, color=BLACK, linewidth=0.8)
    if one.condition_unit == "-" and set(x) <= {0.0, 1.0}:
        axes.set_xticks([0.0, 1.0], ["no", "yes"])
        axes.set_xlim(-0.5, 1.5)
    axes.set_title(f"chance {one.chance_corrected:.2g}", fontsize=SMALL, loc="right", pad=2)
    label(axes, x=axis_label(one.condition, across), y=axis_label(one.parameter.rpartition(".")[2], unit))
