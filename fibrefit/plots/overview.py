"""One page that tells all: the verdict, the records with their residuals, the gaps, the values, and what to doubt."""

from __future__ import annotations

import math
import textwrap
from collections.abc import Sequence
from functools import partial

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from fibrefit.core.formatting import in_words, or_others, shown_unit, typeset_unit
from fibrefit.plots.fitted import Fitted
from fibrefit.plots.lines import draw_line
from fibrefit.plots.quantities import axis_label, readable_unit
from fibrefit.plots.records import BAND, Compared
from fibrefit.plots.style import (
    FINAL,
    FIRST,
    GREY,
    LETTER_SMALL,
    MEASURED,
    PALE,
    SIMULATED,
    SMALL,
    USUAL,
    WIDTH,
    axes_at,
    cut_name,
    label,
    new_figure,
    set_caption,
    title,
)
from fibrefit.study.summaries.check import above_noise, failed_model_checks
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.results import FitResultSummary, ParameterSummary

LEFT, RIGHT, TOP, BOTTOM = 15.0, 4.0, 27.0, 6.0
"""Margins in mm: above there is room for the verdict, what explains it, and the legend."""
TALL, LOW, GAP, BETWEEN = 26.0, 18.0, 3.0, 9.0
"""Heights in mm of readings and residuals, and room between panels: all of it stands on one page."""
MOST_RECORDS, MOST_VALUES, MOST_GAPS, MOST_DOUBTS = 3, 12, 12, 4
"""Records, values, gaps and doubts there is room for on that page."""
MOST_MARKS = 4
"""Stretches between the marks of an axis: each mark takes as long to make as a line."""
LINE, BELOW = 4.2, 14.0
"""Height of a line of text, and room below the records for the label of their axis, in mm."""
ACROSS = 135
"""Letters in a line over the whole width."""

DOUBTED = "What is left is no larger than the noise; what is to be doubted all the same stands below"
LACKS = {
    True: "The error bars allow for what is left, which is more than noise: the model lacks something",
    False: "What is left is more than noise: the model lacks something",
}
"""By whether error bars allow for it."""
VERDICTS = {
    "ok": "The model explains these records down to their noise",
    "suspect": "The fit came to an end, but not all of its checks passed",
    "failed": "The fit cannot be relied on",
}


def overview_figure(summary: FitResultSummary, final: Fitted, first: Fitted | None = None) -> Figure:
    """The page.

    Parameters
    ----------
    summary : FitResultSummary
        Of a fit or of a discovery.
    first : Fitted, optional
        The model a search began with, where it differs.
    """
    chosen = (first or final).worst(MOST_RECORDS)
    channels, doubts = len(final.channels), _doubts(summary)
    values = [(name, one) for name, one in summary.parameters.items() if one.free or one.value][:MOST_VALUES]
    rows = max(len(values), min(len(final.records), MOST_GAPS)) + 4
    height = channels * (TALL + LOW + 2 * GAP)
    figure = new_figure(TOP + height + BELOW + LINE * (rows + len(doubts) + 1) + BOTTOM)
    up = figure.get_size_inches()[1] * 25.4
    title(figure, _verdict(summary), _beside(summary, len(chosen), len(final.records), first is not None))
    _records(figure, final, first, chosen)
    lower = up - TOP - height - BELOW
    _values(figure, values, lower)
    _gaps(figure, final, first, lower, LINE * (rows - 4))
    for number, text in enumerate(doubts):
        at = (lower - LINE * (rows + number)) / up
        figure.text(4.0 / WIDTH, at, text, fontsize=SMALL, color="0.2", va="top")
    set_caption(figure, f"{_verdict(summary)}. {_caption(summary)}")
    return figure


def _verdict(summary: FitResultSummary) -> str:
    if not isinstance(summary, DiscoverySummary):
        if summary.status != "ok" or not failed_model_checks(summary.checks):
            return VERDICTS[summary.status]
        return LACKS[summary.bars_allow] if above_noise(summary.checks) else DOUBTED
    if summary.verdict == "named":
        return f"The model lacked {in_words(or_others(name, summary.cannot_tell_apart) for name in summary.added)}"
    if summary.verdict == "nothing_missing":
        return "Nothing is missing: the model explains these records down to their noise"
    if summary.verdict == "not_trusted":
        return "The search cannot be trusted"
    looks = summary.unexplained.looks_like if summary.unexplained else None
    if looks:
        return f"Unexplained: what is missing looks like {looks.partition(';')[0]}"
    return "A gap is left that no effect accounts for"


def _beside(summary: FitResultSummary, shown: int, number: int, by_first: bool) -> str:
    which = (
        f"the {shown} of {number} records that the {'first ' * by_first}model explains worst"
        if shown < number
        else f"{number} record{'' if number == 1 else 's'}"
    )
    return f"{summary.study}: {which}; {_gap_in_words(summary)}"


def _gap_in_words(summary: FitResultSummary) -> str:
    before = summary.before.gap.total if isinstance(summary, DiscoverySummary) and summary.before else None
    after, expected = summary.gap.total, summary.expected_gap or 1.0
    if after is None:
        return "gap not known"
    falls = before is not None and isinstance(summary, DiscoverySummary) and summary.added
    said = f"gap {before:.2f} \N{RIGHTWARDS ARROW} {after:.2f}" if falls else f"gap {after:.2f}"
    return f"{said} (residual RMS over noise; {expected:.2f} expected)"


def _caption(summary: FitResultSummary) -> str:
    gap = f"{_gap_in_words(summary)[:1].upper()}{_gap_in_words(summary)[1:]}."
    values = ", ".join(_in_words(name, one) for name, one in list(summary.parameters.items())[:4] if one.free)
    lacks = len(failed_model_checks(summary.checks))
    failed = sum(not check.passed for check in summary.checks) - lacks
    said = [f"{failed} check{'s' * (failed != 1)} of the numbers failed"] * bool(failed)
    doubt = "say{} that the model lacks something" if above_noise(summary.checks) else "leave{} a doubt about the model"
    said += [f"{lacks} {doubt.format('s' * (lacks == 1))}"] * bool(lacks)
    return f"{gap} {values}. {'; '.join(said) or 'All checks passed'}."


def _in_words(name: str, one: ParameterSummary) -> str:
    value, error, unit = _rounded(one)
    return f"{name.replace('_', ' ')} {value}{f' ± {error}' if error else ''} {unit}".strip()


def _records(figure: Figure, final: Fitted, first: Fitted | None, chosen: Sequence[int]) -> None:
    width = (WIDTH - LEFT - RIGHT - BETWEEN * (len(chosen) - 1)) / len(chosen)
    up = figure.get_size_inches()[1] * 25.4
    for column, record in enumerate(chosen):
        left, upper = LEFT + column * (width + BETWEEN), up - TOP
        panels: list[Axes] = []
        models = [(final, FINAL), *([(first, FIRST)] if first else [])]
        for channel in range(len(final.channels)):
            readings = partial(_readings, in_unit=_unit_of(channel, [model for model, _ in models], chosen))
            for height, draw in ((TALL, readings), (LOW, _residuals)):
                axes = axes_at(figure, left, upper - height, width, height)
                draw(axes, [(model.compared(record)[channel], colour) for model, colour in models], column == 0)
                panels.append(axes)
                upper -= height + GAP
        _finish(panels, final, record, width)
    handles, labels = figure.axes[0].get_legend_handles_labels()
    figure.legend(
        handles, labels, loc="upper right", bbox_to_anchor=(1.0 - RIGHT / WIDTH, 1.0 - 14.0 / up), ncols=3,
        fontsize=SMALL, frameon=False, borderpad=0.0,
    )  # fmt: skip


def _finish(panels: list[Axes], final: Fitted, record: int, width: float) -> None:
    ends = final.motion_ends(record)
    for axes in panels:
        axes.set_xlim(*ends)
        axes.locator_params(nbins=MOST_MARKS)
        if axes is not panels[-1]:
            axes.set_xticks([])  # the times stand below the last of them
    label(panels[-1], x="time / s")
    said = ", ".join(filter(None, [final.records[record], final.conditions(record)]))
    lines = textwrap.wrap(said, int(width / LETTER_SMALL), max_lines=2, placeholder="\N{HORIZONTAL ELLIPSIS}")
    panels[0].text(
        0.0, 1.05, "\n".join(lines), transform=panels[0].transAxes, fontsize=SMALL, va="bottom", color="0.25"
    )


def _unit_of(channel: int, models: Sequence[Fitted], chosen: Sequence[int]) -> tuple[str, float]:
    """Unit of a channel in all records that are drawn, as one label is of all of them, and what it is worth."""
    every = [model.compared(record)[channel] for record in chosen for model in models]
    parts = [part for one in every for part in (one.measured, one.simulated)]
    return readable_unit(np.concatenate(parts), every[0].unit)


def _readings(axes: Axes, models: Sequence[tuple[Compared, str]], labelled: bool, in_unit: tuple[str, float]) -> None:
    one, (unit, worth) = models[0][0], in_unit
    draw_line(axes, one.times, one.measured / worth, label="measured", **MEASURED)
    for (model, colour), said in zip(reversed(models), _names(len(models)), strict=True):
        draw_line(axes, one.times, model.simulated / worth, label=said, **{**SIMULATED, "color": colour})
    axes.margins(y=0.06)
    if labelled:
        label(axes, y=axis_label(one.name, unit))


def _names(count: int) -> list[str]:
    return ["model"] if count == 1 else ["first model", "final model"]


def _residuals(axes: Axes, models: Sequence[tuple[Compared, str]], labelled: bool) -> None:
    axes.axhspan(-BAND, BAND, facecolor=PALE, edgecolor="none", zorder=0)
    largest = 1.5 * BAND
    for model, colour in reversed(models):
        residual = (model.measured - model.simulated) / (model.noise or math.nan)
        draw_line(axes, model.times, residual, color=colour, linewidth=0.35)
        if np.isfinite(residual).any():
            largest = max(largest, float(np.nanquantile(np.abs(residual), 0.999)))
    axes.set_ylim(-1.1 * largest, 1.1 * largest)
    if labelled:
        label(axes, y="residual / noise")


def _rounded(one: ParameterSummary) -> tuple[str, str, str]:
    """Value and standard error to the digits that mean something, and their unit."""
    unit, worth = shown_unit(one.value if one.value else one.std_error or 0.0, one.unit)
    unit = "" if unit == "-" else typeset_unit(unit)
    if not one.std_error:
        return f"{one.value / worth:.5g}", "", unit
    decimals = min(max(0, 1 - math.floor(math.log10(one.std_error / worth))), 12)
    return f"{one.value / worth:.{decimals}f}", f"{one.std_error / worth:.{decimals}f}", unit


def _values(figure: Figure, values: Sequence[tuple[str, ParameterSummary]], top: float) -> None:
    """Values with their standard errors as a table."""
    up = figure.get_size_inches()[1] * 25.4
    figure.text(4.0 / WIDTH, top / up, "Values and standard errors", fontsize=USUAL, fontweight="bold", va="top")
    for row, (name, one) in enumerate(values, 1):
        value, error, unit = _rounded(one)
        y = (top - LINE * row - 1.0) / up
        said = textwrap.shorten(name.replace("_", " "), 44, placeholder="\N{HORIZONTAL ELLIPSIS}")
        figure.text(4.0 / WIDTH, y, said, fontsize=SMALL, va="top")
        shown = f"{value} ± {error} {unit}" if error else f"{value} {unit}{'' if one.free else ' (held)'}"
        figure.text(92.0 / WIDTH, y, shown, fontsize=SMALL, va="top", ha="right")


def _gaps(figure: Figure, final: Fitted, first: Fitted | None, top: float, height: float) -> None:
    """Gap of each record before and after, those that are explained worst on top."""
    up = figure.get_size_inches()[1] * 25.4
    totals = {name: np.nan if gap.total is None else gap.total for name, gap in final.record_gaps.items()}
    before = (
        {name: np.nan if g.total is None else g.total for name, g in first.record_gaps.items()} if first else totals
    )
    names = sorted(totals, key=lambda name: -np.nan_to_num(before[name], nan=np.inf))[:MOST_GAPS]
    figure.text(100.0 / WIDTH, top / up, "Gap by record", fontsize=USUAL, fontweight="bold", va="top")
    axes = axes_at(figure, 140.0, top - height - LINE, WIDTH - 140.0 - RIGHT, height)
    rows = np.arange(len(names))
    axes.axvline(1.0, color=GREY, linewidth=0.6)
    if first:
        axes.hlines(rows, [totals[n] for n in names], [before[n] for n in names], color=GREY, linewidth=0.6)
        axes.plot([before[name] for name in names], rows, "s", color=FIRST, markersize=3)
    axes.plot([totals[name] for name in names], rows, "o", color=FINAL, markersize=3)
    axes.set_yticks(rows, [cut_name(name) for name in names])
    axes.set_ylim(len(names) - 0.4, -0.6)
    axes.set_xlim(
        0.0, 1.1 * float(np.nanmax([1.2, *(size for name in names for size in (before[name], totals[name]))]))
    )
    axes.tick_params(axis="y", length=0)
    label(axes, x="residual RMS / noise")


def _doubts(summary: FitResultSummary) -> list[str]:
    """Checks that failed, in lines; or that none did."""
    failed = [check for check in summary.checks if not check.passed]
    if not failed:
        return [f"All {len(summary.checks)} checks passed."] if summary.checks else []
    lines: list[str] = []
    for check in failed[:MOST_DOUBTS]:
        word = "FAILED" if check.about == "numbers" else "MODEL"  # as in the report
        lines += textwrap.wrap(f"{word} {check.quantity or check.name}: {check.says}", ACROSS)
    more = len(failed) - MOST_DOUBTS
    return lines + ([f"and {more} more."] if more > 0 else [])
