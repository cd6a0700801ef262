"""What a series says together: parameters over speed, three models, the population, trends over the conditions."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import in_words
from fibrefit.plots.figures import Figures
from fibrefit.plots.pooled import ACROSS, BOTTOM, LEFT, UP, RecordValue, population_figure, trends_figure
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.style import (
    BLACK,
    BLUE,
    GREEN,
    GREY,
    ORANGE,
    PALE,
    RIGHT,
    SKY,
    SMALL,
    TOP,
    WIDE_GAP,
    WIDTH,
    axes_at,
    in_own_style,
    label,
    legend,
    logarithmic,
    name_records,
    new_figure,
    title,
)

if TYPE_CHECKING:
    from fibrefit.study.summaries.series import SeriesRecord, SeriesSummary, SpeedCurveSummary

HEIGHT = 44.0
"""Of the parameters over speed, in mm."""
ANSWERS = {"constant": "one set of parameters", "speed_law": "a law of speed", "per_record": "values of each record"}
COLOURS = {"constant": ORANGE, "speed_law": BLUE, "per_record": GREEN}
MOST = 12
"""Records whose names fit below an axis."""


@in_own_style
def series_figures(summary: SeriesSummary) -> Figures:
    """``answer``, ``population`` and ``trends``."""
    found = {"answer": _answer(summary)}
    values = {
        name: {
            key: RecordValue(own.value, own.std_error, own.shrunk, own.shrunk_error)
            for key, own in one.parameters.items()
        }
        for name, one in summary.records.items()
    }
    if summary.population:
        found["population"] = population_figure(summary.population, values)
    if summary.trends:
        found["trends"] = trends_figure(summary.trends, values, summary.records)
    return Figures(found)


def _answer(summary: SeriesSummary) -> Figure:
    """Each parameter over speed, with the law where there is one; below, how records left out are predicted."""
    names = list(next(iter(summary.records.values())).parameters)
    figure = new_figure(TOP + HEIGHT + UP + 0.8 * HEIGHT + BOTTOM)
    title(figure, f"{summary.study}: {_headline(summary)}", _gaps(summary))
    wide = (WIDTH - LEFT - RIGHT - (len(names) - 1) * ACROSS) / len(names)
    for i, name in enumerate(names):
        bottom = BOTTOM + 0.8 * HEIGHT + UP
        _over_speed(axes_at(figure, LEFT + i * (wide + ACROSS), bottom, wide, HEIGHT), summary, name)
    _key(figure)
    _left_out(axes_at(figure, LEFT, BOTTOM, WIDTH - LEFT - RIGHT, 0.8 * HEIGHT - 4.0), summary)
    return figure


def _headline(summary: SeriesSummary) -> str:
    """The answer, in the words of a title."""
    if summary.answer != "speed_law":
        serves = "serves" if summary.answer == "constant" else "serve"
        return f"{ANSWERS[summary.answer]} {serves} all {len(summary.records)} records"
    lawful = list(dict.fromkeys(one.parameter for one in summary.curves))
    return f"{in_words(lawful)} {'depends' if len(lawful) == 1 else 'depend'} on speed"


def _gaps(summary: SeriesSummary) -> str:
    """Gap of each model, and where records are left out."""
    said = [f"{ANSWERS[name]} {one.gap:.2f} ({one.gap_left_out:.2f})" for name, one in summary.models.items()]
    return f"gap (of records left out): {', '.join(said)}"


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
        axes.axhline(shared.value / worth, color=ORANGE, linewidth=0.9, linestyle="--", label="one set of parameters")
    logarithmic(axes, "x")
    label(axes, x=axis_label("speed", "m/s"), y=axis_label(name, unit))


def _key(figure: Figure) -> None:
    """One legend for all panels over speed: what is drawn in any of them."""
    drawn = {
        words: handle for axes in figure.axes for handle, words in zip(*axes.get_legend_handles_labels(), strict=True)
    }
    options = {"fontsize": SMALL, "frameon": False, "borderpad": 0.0, "ncols": len(drawn)}
    figure.axes[0].legend(drawn.values(), drawn.keys(), loc="lower left", bbox_to_anchor=(0.0, 1.0), **options)


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
    line, band = (BLUE, SKY) if lawful else (GREY, PALE)
    words = f"law of speed ({curve.form})" if lawful else f"{curve.form}, not preferred"
    axes.fill_between(speeds, low / worth, high / worth, color=band, alpha=0.5, linewidth=0)
    axes.plot(speeds, np.array(curve.values) / worth, color=line, linewidth=1.2, label=words)


def _left_out(axes: Axes, summary: SeriesSummary) -> None:
    """Gap of each record as the others predict it, by each model."""
    places, largest = np.arange(len(summary.records)), 1.0
    for i, ((name, words), mark) in enumerate(zip(ANSWERS.items(), "osD", strict=True)):
        gaps = [one.gap_left_out[name] for one in summary.records.values()]  # type: ignore[index]
        axes.plot(places + 0.15 * (i - 1), gaps, mark, color=COLOURS[name], markersize=4, label=words)
        largest = max(largest, *gaps)
    axes.axhline(1.0, color=BLACK, linewidth=0.6)
    if largest > WIDE_GAP:
        logarithmic(axes, "y")
    else:
        axes.set_ylim(0.0, 1.15 * largest)
    if len(places) <= MOST:
        name_records(axes, places, list(summary.records), WIDTH - LEFT - RIGHT)
    label(axes, y="gap when left out")
    legend(axes, loc="lower left", bbox_to_anchor=(0.0, 1.0))
