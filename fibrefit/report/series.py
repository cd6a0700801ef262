"""The terminal report of a series: the answer, the three models, the laws tried, the population, the trends."""

from __future__ import annotations

import textwrap

from fibrefit.core.units import format_number, format_quantity, shown_unit
from fibrefit.report.checks import GLOSSARY, failures, passes
from fibrefit.report.layout import WIDTH, items, paragraph, section, shortened, table
from fibrefit.report.text import with_error
from fibrefit.study.summaries.series import SeriesSummary, TrendSummary
from fibrefit.study.summaries.summaries import ParameterSummary

MODELS = {
    "constant": "constant parameters",
    "speed_law": "a law of speed",
    "per_record": "values of each record",
}
MOST_TRENDS, MOST_LAWS, MOST_RECORDS = 6, 5, 12
SIGNIFICANT = 0.05
LONGEST = 18


def series_report(summary: SeriesSummary) -> str:
    """Report of a series in at most 80 columns.

    Parameters
    ----------
    summary : SeriesSummary
        Content of ``summary.json``.

    Returns
    -------
    str
        Lines without a final line break.
    """
    sections = [
        _title(summary),
        paragraph(summary.sentence),
        section("Three models of the same records", _models(summary)),
        section("Values of the model that serves", _values(summary)),
        section("Laws of speed, each by itself", _laws(summary)),
        section("Records", _records(summary)),
        section("Population", _population(summary)),
        section("Trends", _trends(summary)),
        section("What to doubt", failures(summary.checks)),
        section("Checks", passes(summary.checks)),
        section("What to do next", items(summary.advice)),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


def _title(summary: SeriesSummary) -> str:
    status = summary.status.upper()
    name = textwrap.shorten(summary.study, WIDTH - len(status) - 2, placeholder="...")
    return f"{name}{status:>{WIDTH - len(name)}}\n{'=' * WIDTH}"


def _models(summary: SeriesSummary) -> list[str]:
    head = ("", "ln Bayes factor", "gap", "gap left out", "ln foresight")
    rows = [
        (
            f"{'* ' if name == summary.answer else '  '}{MODELS[name]}",
            f"{one.log_bayes_factor:.4g}",
            f"{one.gap:.3g}",
            f"{one.gap_left_out:.3g}",
            f"{one.foresight:.4g}",
        )
        for name, one in summary.models.items()
    ]
    said = "Bayes factor and foresight of records left out are over constant parameters."
    return [*table(head, rows, {1, 2, 3, 4}), paragraph(said)]


def _values(summary: SeriesSummary) -> list[str]:
    found = summary.models[summary.answer].parameters
    rows = [_value(name, one) for name, one in found.items()]
    return table(("", "value", "std error", ""), rows, {1, 2})


def _value(name: str, one: ParameterSummary) -> tuple[str, ...]:
    value, error, unit = with_error(one.value, one.std_error, one.unit)
    return name, value, error, "" if unit == "-" else unit


def _laws(summary: SeriesSummary) -> list[str]:
    rows = []
    for law in summary.laws[:MOST_LAWS]:
        said = ", ".join(
            f"{name.rpartition('.')[2]} {one.value:.3g} +/- {one.std_error or 0.0:.1g}"
            for name, one in law.parameters.items()
        )
        rows.append((law.parameter, law.form, f"{law.log_bayes_factor:.4g}", shortened(said, 42)))
    return table(("", "form", "ln Bayes", ""), rows, {2})


def _records(summary: SeriesSummary) -> list[str]:
    names = list(next(iter(summary.records.values())).parameters)
    rows = []
    for record, one in list(summary.records.items())[:MOST_RECORDS]:
        cells = [shortened(record, LONGEST)]
        speed = max(one.speeds.values(), key=lambda ends: ends[1], default=None)
        cells.append("" if speed is None else f"{speed[0]:.2g} to {speed[1]:.2g}")
        for name in names:
            own = one.parameters[name]
            cells.append(format_quantity(own.value, own.unit, 4))
        rows.append((*cells, f"{one.gap_left_out[summary.answer]:.3g}"))
    head = ("", "m/s", *names, "left out")
    more = len(summary.records) - MOST_RECORDS
    return [*table(head, rows, set(range(1, len(head)))), *([f"and {more} more: see table.csv."] if more > 0 else [])]


def _population(summary: SeriesSummary) -> list[str]:
    rows = []
    for name, one in summary.population.items():
        unit, worth = shown_unit(one.mean, one.unit)
        scale = 100.0 if one.relative else 1.0 / worth
        sd = f"{scale * one.between_records:.2g}{' %' if one.relative else ''}"
        ends = [_ends(*pair, worth) for pair in (one.mean_interval_95, one.new_record_interval_95)]
        rows.append((name, format_number(one.mean / worth), ends[0], sd, ends[1], "" if unit == "-" else unit))
    return table(("", "mean", "95 %", "sd", "a new record, 95 %", ""), rows, {1, 3})


def _ends(low: float, high: float, worth: float) -> str:
    return f"{format_number(low / worth)} to {format_number(high / worth)}"


def _trends(summary: SeriesSummary) -> list[str]:
    told = [one for one in summary.trends if one.chance_corrected < SIGNIFICANT][:MOST_TRENDS]
    lines = items(_trend(one) for one in told)
    strays = {o.record: (one, o.score) for one in summary.trends for o in one.outliers}
    lines += items(
        f"{record} does not follow the others: its {one.parameter} is {abs(score):.2g} standard deviations "
        f"{'above' if score > 0 else 'below'} their line over {one.condition}."
        for record, (one, score) in list(strays.items())[:MOST_TRENDS]
    )
    if not told and summary.trends:
        lines.append(
            paragraph(f"None of {len(summary.trends)} looks shows more than chance, corrected for all of them.")
        )
    return lines


def _trend(one: TrendSummary) -> str:
    per = "" if one.condition_unit == "-" else f" per {one.condition_unit}"
    value, error, unit = with_error(one.slope, one.slope_error, one.unit)
    return (
        f"{one.parameter} over {one.condition}: {value} +/- {error} {unit}{per} "
        f"({one.records} records, probability by chance {one.chance_corrected:.2g})"
    )
