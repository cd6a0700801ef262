"""The terminal report of a series: the answer, the three models, the laws tried, the population, the trends."""

from __future__ import annotations

from fibrefit.core.formatting import format_quantity
from fibrefit.report.checks import GLOSSARY, failures, passes
from fibrefit.report.layout import items, paragraph, section, shortened_names, table, titled
from fibrefit.report.pooled import population_lines, trend_lines
from fibrefit.report.text import MOST_RECORDS, quantity_text, with_error
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.study.summaries.series import SeriesSummary

MODELS = {
    "constant": "constant parameters",
    "speed_law": "a law of speed",
    "per_record": "values of each record",
}
LAWS_LISTED = 5
LONGEST = 18


def series_report(summary: SeriesSummary) -> str:
    """Report of a series in at most 80 columns; no line break at its end."""
    sections = [
        titled(summary.study, summary.status),
        paragraph(summary.sentence),
        section("Three models of the same records", _models(summary)),
        section("Values of the model that serves", _values(summary)),
        section("Laws of speed, each by itself", _laws(summary)),
        section("Records", _records(summary)),
        section("Population", population_lines(summary.population)),
        section("Trends", trend_lines(summary.trends)),
        section("What to doubt", failures(summary.checks)),
        section("Checks", passes(summary.checks)),
        section("What to do next", items(summary.advice)),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


def _models(summary: SeriesSummary) -> list[str]:
    head = ("", "ln Bayes factor", "gap", "gap left out", "ln p left out")
    rows = [
        (
            f"{'* ' if name == summary.answer else '  '}{MODELS[name]}",
            f"{one.log_bayes_factor:.4g}",
            f"{one.gap:.3g}",
            f"{one.gap_left_out:.3g}",
            f"{one.elpd:.4g}",
        )
        for name, one in summary.models.items()
    ]
    said = "p: predictive density of records left out in turn. Logarithms are over those of constant parameters."
    return [*table(head, rows, {1, 2, 3, 4}), paragraph(said)]


def _values(summary: SeriesSummary) -> list[str]:
    found = summary.models[summary.answer].parameters
    rows = [_value(name, one) for name, one in found.items()]
    return table(("", "value", "std error", ""), rows, {1, 2})


def _value(name: str, one: ParameterSummary) -> tuple[str, ...]:
    value, error, unit = with_error(one.value, one.std_error, one.unit)
    return name, value, error, "" if unit == "-" else unit


def _number(one: ParameterSummary) -> str:
    return "not determined" if one.std_error is None else quantity_text(one.value, one.std_error, one.unit)


def _laws(summary: SeriesSummary) -> list[str]:
    rows = []
    for law in summary.laws[:LAWS_LISTED]:
        said = [f"{name.rpartition('.')[2]} {_number(one)}" for name, one in law.parameters.items()]
        said = said or ["predicted by linearisation, not fitted"] * law.linearised
        rows.append((law.parameter, law.form, f"{law.log_bayes_factor:.4g}", said[0] if said else ""))
        rows += [("", "", "", one) for one in said[1:]]
    return table(("", "form", "ln Bayes", ""), rows, {2})


def _records(summary: SeriesSummary) -> list[str]:
    names = list(next(iter(summary.records.values())).parameters)
    rows, records = [], dict(list(summary.records.items())[:MOST_RECORDS])
    short = shortened_names(records, LONGEST)
    for record, one in records.items():
        cells = [short[record]]
        speed = max(one.speeds.values(), key=lambda ends: ends[1], default=None)
        cells.append("" if speed is None else f"{speed[0]:.2g} to {speed[1]:.2g}")
        for name in names:
            own = one.parameters[name]
            cells.append(format_quantity(own.value, own.unit, 4))
        rows.append((*cells, f"{one.gap_left_out[summary.answer]:.3g}"))
    head = ("", "m/s", *names, "left out")
    more = len(summary.records) - MOST_RECORDS
    return [*table(head, rows, set(range(1, len(head)))), *([f"and {more} more: see table.csv."] if more > 0 else [])]
