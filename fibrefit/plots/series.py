"""What a series says together: parameters over speed, three models, the population, trends over the conditions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.plots.figures import Figures
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    SKY,
    SMALL,
    VERMILLION,
    label,
    legend,
    new_figure,
    place,
    title,
)

if TYPE_CHECKING:
    from fibrefit.study.summaries.series import OwnSummary, SeriesRecord, SeriesSummary, SpeedCurveSummary, TrendSummary

LEFT, RIGHT, TOP, BOTTOM, ACROSS, UP = 17.0, 6.0, 17.0, 13.0, 17.0, 15.0
HEIGHT = 44.0
WIDTH = 183.0
ANSWERS = {"constant": "one set of parameters", "speed_law": "a law of speed", "per_record": "values of each record"}
COLOURS = {"constant": ORANGE, "speed_law": BLUE, "per_record": GREEN}
COLUMNS, MOST = 3, 12


def series_figures(summary: SeriesSummary) -> Figures:
    """``answer``, ``population`` and ``trends``."""
    found = {"answer": _answer(summary)}
    if summary.population:
        found["population"] = _population(summary)
    if summary.trends:
        found["trends"] = _trends(summary)
    return Figures(found)


def _answer(summary: SeriesSummary) -> Figure:
    """Each parameter over speed, with the law where there is one; below, how records left out are predicted."""
    names = list(next(iter(summary.records.values())).parameters)
    figure = new_figure(TOP + HEIGHT + UP + 0.8 * HEIGHT + BOTTOM)
    best = summary.models[summary.answer]
    title(
        figure, f"{summary.study}: {ANSWERS[summary.answer]}", f"gap {best.gap:.2f}, left out {best.gap_left_out:.2f}"
    )
    wide = (WIDTH - LEFT - RIGHT - (len(names) - 1) * ACROSS) / len(names)
    for i, name in enumerate(names):
        bottom = BOTTOM + 0.8 * HEIGHT + UP
        _over_speed(place(figure, LEFT + i * (wide + ACROSS), bottom, wide, HEIGHT), summary, name)
    _left_out(place(figure, LEFT, BOTTOM, WIDTH - LEFT - RIGHT, 0.8 * HEIGHT - 4.0), summary)
    return figure


def _over_speed(axes: Axes, summary: SeriesSummary, name: str) -> None:
    rows = [one for one in summary.records.values() if name in one.speeds]
    first = next(iter(summary.records.values())).parameters[name]
    unit, worth = readable_unit(np.array([one.parameters[name].value for one in rows]), first.unit)
    curve = next((one for one in summary.curves if one.parameter == name), None)
    lawful = curve is not None and summary.answer == "speed_law"
    if lawful:
        for one in rows:
            axes.axvspan(*one.speeds[name], ymax=0.03, color=GREY, alpha=0.25, linewidth=0)
    else:
        _by_itself(axes, rows, name, worth)
    if curve is not None:
        _law(axes, curve, worth, lawful)
    shared = summary.models["constant"].parameters.get(name)
    if shared is not None:
        axes.axhline(shared.value / worth, color=ORANGE, linewidth=0.9, linestyle="--", label="constant")
    axes.set_xscale("log")
    label(axes, x=axis_label("speed", "m/s"), y=axis_label(name, unit))
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0), ncols=3, columnspacing=0.8, handlelength=1.4)


def _by_itself(axes: Axes, rows: list[SeriesRecord], name: str, worth: float) -> None:
    """Value of each record over the speeds that tell of it."""
    for number, one in enumerate(rows):
        (slow, fast), own = one.speeds[name], one.parameters[name]
        axes.plot([slow, fast], [own.value / worth] * 2, color=GREY, linewidth=0.8)
        said = "" if number else "record by itself"
        bar = [2.0 * own.std_error / worth]
        middle = [float(np.sqrt(slow * fast))]
        axes.errorbar(middle, [own.value / worth], bar, fmt="o", color=BLACK, markersize=3, elinewidth=0.8, label=said)


def _law(axes: Axes, curve: SpeedCurveSummary, worth: float, lawful: bool) -> None:
    speeds, low, high = (np.array(part) for part in (curve.speeds, curve.low, curve.high))
    line, band, words = (BLUE, SKY, curve.form) if lawful else (GREY, PALE, f"{curve.form}, not preferred")
    axes.fill_between(speeds, low / worth, high / worth, color=band, alpha=0.5, linewidth=0)
    axes.plot(speeds, np.array(curve.values) / worth, color=line, linewidth=1.2, label=words)


def _left_out(axes: Axes, summary: SeriesSummary) -> None:
    """Gap of each record as the others predict it, by each model."""
    places = np.arange(len(summary.records))
    for i, (name, words) in enumerate(ANSWERS.items()):
        gaps = [one.gap_left_out[name] for one in summary.records.values()]  # type: ignore[index]
        axes.bar(places + 0.25 * (i - 1), gaps, 0.22, color=COLOURS[name], label=words)
    axes.axhline(1.0, color=BLACK, linewidth=0.6)
    axes.set_yscale("log")
    axes.set_xticks(places, [name[-28:] for name in summary.records] if len(places) <= MOST else [""] * len(places))
    axes.tick_params(axis="x", labelsize=SMALL)
    label(axes, y="gap when left out")
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def _population(summary: SeriesSummary) -> Figure:
    """Values of each record, drawn to the mean, with the intervals of the mean and of a new record."""
    names = list(summary.population)
    figure = new_figure(TOP + len(names) * (HEIGHT * 0.7 + 6.0) + BOTTOM + 8.0)
    title(figure, "Population", "open: record by itself; filled: partially pooled; bars: twice the standard error")
    high = TOP + len(names) * (HEIGHT * 0.7 + 6.0) + BOTTOM + 8.0
    for i, name in enumerate(names):
        bottom = high - TOP - (i + 1) * (HEIGHT * 0.7) - i * 6.0
        axes = place(figure, LEFT, bottom, WIDTH - LEFT - RIGHT, HEIGHT * 0.7)
        _pooled(axes, summary, name)
        if i < len(names) - 1:
            axes.tick_params(labelbottom=False)
    return figure


def _pooled(axes: Axes, summary: SeriesSummary, name: str) -> None:
    found = summary.population[name]
    rows = [one.parameters[name] for one in summary.records.values()]
    places = np.arange(1, len(rows) + 1)
    unit, worth = readable_unit(np.array([found.mean]), found.unit)
    axes.axhspan(
        *(end / worth for end in found.new_record_interval_95), color=PALE, linewidth=0, label="a new record, 95 %"
    )
    axes.axhspan(
        *(end / worth for end in found.mean_interval_95), color=SKY, alpha=0.6, linewidth=0, label="mean, 95 %"
    )
    values, errors = (np.array([getattr(row, key) for row in rows]) / worth for key in ("value", "std_error"))
    axes.errorbar(places - 0.1, values, 2.0 * errors, fmt="o", color=GREY, markerfacecolor="white", markersize=3,
                  elinewidth=0.6)  # fmt: skip
    shrunk, around = (
        np.array([np.nan if getattr(row, key) is None else getattr(row, key) for row in rows]) / worth
        for key in ("shrunk", "shrunk_error")
    )
    axes.errorbar(places + 0.1, shrunk, 2.0 * around, fmt="o", color=BLUE, markersize=3, elinewidth=0.6)
    named = len(rows) <= MOST
    axes.set_xticks(places if named else [], [key[-28:] for key in summary.records] if named else [])
    axes.tick_params(axis="x", labelsize=SMALL)
    label(axes, y=axis_label(name, unit), x="" if named else "record")
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0))


def _trends(summary: SeriesSummary) -> Figure:
    """The surest trends, each parameter over its condition with its line."""
    told = summary.trends[:MOST]
    rows = -(-len(told) // COLUMNS)
    high = TOP + rows * (HEIGHT * 0.75 + UP) + 2.0
    figure = new_figure(high)
    title(figure, "Trends, the surest first", "line: weighted regression; bars: twice the standard error")
    wide = (WIDTH - LEFT - RIGHT - (COLUMNS - 1) * ACROSS) / COLUMNS
    for i, one in enumerate(told):
        row, column = divmod(i, COLUMNS)
        bottom = high - TOP - (row + 1) * HEIGHT * 0.75 - row * UP
        _trend(place(figure, LEFT + column * (wide + ACROSS), bottom, wide, HEIGHT * 0.75), summary, one)
    return figure


def _trend(axes: Axes, summary: SeriesSummary, one: TrendSummary) -> None:
    strays = {o.record for o in one.outliers}
    rows = _points(summary, one)
    unit, worth = readable_unit(np.array([own.value for *_, own in rows]), one.unit)
    across, scale = readable_unit(np.array([x for _, x, _ in rows]), one.condition_unit)
    for record, x, own in rows:
        colour = VERMILLION if record in strays else BLUE
        bar = [2.0 * own.std_error / worth]
        axes.errorbar([x / scale], [own.value / worth], bar, fmt="o", color=colour, markersize=3, elinewidth=0.6)
    ends = np.array([min(x for _, x, _ in rows), max(x for _, x, _ in rows)])
    axes.plot(ends / scale, (one.intercept + one.slope * ends) / worth, color=BLACK, linewidth=0.8)
    axes.set_title(f"chance {one.chance_corrected:.2g}", fontsize=SMALL, loc="right", pad=2)
    label(axes, x=axis_label(one.condition, across), y=axis_label(one.parameter, unit))


def _points(summary: SeriesSummary, one: TrendSummary) -> list[tuple[str, float, OwnSummary]]:
    """Name, condition and value of each record that shows both."""
    key = f"speed of {one.parameter}" if one.condition == "speed" else one.condition
    return [
        (name, record.conditions[key], record.parameters[one.parameter])
        for name, record in summary.records.items()
        if key in record.conditions
    ]
