"""The terminal report of a prediction."""

from __future__ import annotations

from fibrefit.core.formatting import format_share, in_words
from fibrefit.report.checks import GLOSSARY, failures, notes_on_records, passes
from fibrefit.report.layout import LONGEST_RECORD_NAME, items, paragraph, section, shortened_names, table, titled
from fibrefit.report.text import (
    ABOUT_RECORDS,
    MOST_RECORDS,
    about_records,
    known_quantity,
    parameter_row,
    population_sentence,
)
from fibrefit.study.summaries.results import ParameterSummary, PredictedChannel, PredictionSummary

EXPECTED = (
    "Expected: what noise, what the model lacked in the fit, and the error bars of the values come to together. "
    "In band: share of the samples inside the 95 % predictive band."
)


def prediction_report(summary: PredictionSummary) -> str:
    """Report of a prediction in at most 80 columns; no line break at its end."""
    sections = [
        titled(f"{summary.study}, predicted", summary.verdict.replace("_", " ")),
        paragraph(f"{_of_which(summary)}{summary.says}"),
        section("How well it is predicted", _predicted(summary)),
        section("With what values", _values(summary)),
        section(ABOUT_RECORDS, about_records(summary.records)),
        section("What to doubt", _doubts(summary)),
        section("What to do next", items(summary.advice)),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


def _doubts(summary: PredictionSummary) -> list[str]:
    return failures(summary.checks) + items(notes_on_records(summary.records)) + passes(summary.checks)


def _of_which(summary: PredictionSummary) -> str:
    """The record that was predicted, where it is one; several stand in a table."""
    return f"Of {next(iter(summary.records))}: " if len(summary.records) == 1 else ""


def _predicted(summary: PredictionSummary) -> list[str]:
    head = ("residuals", "explained", "rms", "expected", "in the fit", "in band")
    rows = [_row(name, channel) for name, channel in summary.channels.items()]
    return [*table(head, rows, right={1, 2, 3, 4, 5})[:-1], paragraph(EXPECTED), "", *_records(summary)]


def _row(name: str, channel: PredictedChannel) -> tuple[str, ...]:
    def shown(value: float | None) -> str:
        return "" if value is None else known_quantity(value, channel.unit)

    return (
        name,
        share_told(channel.explained),
        shown(channel.rms),
        shown(channel.expected),
        shown(channel.fit_rms),
        share_told(channel.inside),
    )


def share_told(share: float | None) -> str:
    """A share as a cell; empty where it is not known."""
    return "" if share is None else format_share(share)


def _records(summary: PredictionSummary) -> list[str]:
    """Share explained of each record, worst first; nothing where there is only one."""
    if len(summary.records) < 2:
        return []
    channels = list(summary.channels)

    def worst(name: str) -> float:
        gaps = summary.records[name].gap.channels.values()
        return min((gap.explained for gap in gaps if gap.explained is not None), default=0.0)

    shown = sorted(summary.records, key=worst)[:MOST_RECORDS]
    rows, short = [], shortened_names(shown, LONGEST_RECORD_NAME)
    for name in shown:
        gaps = summary.records[name].gap.channels
        shares = [share_told(gaps[channel].explained) if channel in gaps else "" for channel in channels]
        rows.append((short[name], *shares))
    lines = table(("explained by record, worst first", *channels), rows, right=set(range(1, len(channels) + 1)))
    others = len(summary.records) - len(rows)
    return lines + ([paragraph(f"and {others} more, explained better.")] if others else [])


def _values(summary: PredictionSummary) -> list[str]:
    rows = [_parameter(name, parameter) for name, parameter in summary.parameters.items()]
    lines = table(("", "value", "+/-", "unit", "95 % interval"), rows, right={1, 2})
    text = f"From {summary.result}; none of them was fitted here"
    own = list(dict.fromkeys(name for record in summary.records.values() for name in record.parameters))
    text += f", only {in_words([name.replace('_', ' ') for name in own])} of each record." if own else "."
    if summary.effects:
        text += f" The model: the base model and {', '.join(summary.effects)}."
    return [*lines, *map(paragraph, filter(None, [population_sentence(summary.parameters)])), paragraph(text)]


def _parameter(name: str, parameter: ParameterSummary) -> tuple[str, ...]:
    return parameter_row(name, parameter)
