"""Population and trends in words: of a series that was fitted jointly, or of a batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fibrefit.core.formatting import format_number, shown_unit
from fibrefit.report.layout import decimals_of, items, table
from fibrefit.report.text import quantity_text
from fibrefit.series.meta_analysis import BY_ORDER
from fibrefit.series.thresholds import SIGNIFICANT
from fibrefit.study.summaries.series import PopulationSummary, TrendSummary

MOST_TRENDS = 6


POPULATION = ("", "mean", "95 %", "sd", "a new record, 95 %", "")


def population_lines(population: Mapping[str, PopulationSummary]) -> list[str]:
    """A row for each parameter: its mean, how much records differ, where a new one lies."""
    return table(POPULATION, population_rows(population), {1, 3})


def population_rows(population: Mapping[str, PopulationSummary]) -> list[tuple[str, ...]]:
    """Cells of the same, below the head `POPULATION`."""
    rows: list[tuple[str, ...]] = []
    for name, one in population.items():
        unit, worth = shown_unit(one.mean, one.unit)
        scale = 100.0 if one.relative else 1.0 / worth
        sd = f"{scale * one.between_records:.2g}{' %' if one.relative else ''}"
        mean, *ends = _to_their_width((one.mean, *one.mean_interval_95), one.mean_interval_95, worth)
        new = _to_their_width(one.new_record_interval_95, one.new_record_interval_95, worth)
        rows.append((name, mean, " to ".join(ends), sd, " to ".join(new), "" if unit == "-" else unit))
    return rows


def _to_their_width(values: Sequence[float], interval: tuple[float, float], worth: float) -> list[str]:
    """Values in a unit worth so much in SI, to two digits of half of an interval: its ends are not told as one."""
    half = 0.5 * (interval[1] - interval[0]) / worth
    if not half > 0.0:
        return [format_number(value / worth) for value in values]
    return [f"{value / worth:.{decimals_of(half)}f}" for value in values]


def trend_lines(trends: Sequence[TrendSummary]) -> list[str]:
    """Trends that are more than chance, records that do not follow, and how many looks there were."""
    return items(trend_sentences(trends))


def trend_sentences(trends: Sequence[TrendSummary]) -> list[str]:
    """The same, each in a sentence."""
    significant = [one for one in trends if one.chance_corrected < SIGNIFICANT]
    said = [_trend(one) for one in significant[:MOST_TRENDS]]
    if further := significant[MOST_TRENDS:]:
        said.append(f"Further trends that are more than chance: {len(further)}.")
    outliers = dict.fromkeys(outlier.record for one in trends for outlier in one.outliers)
    said += [
        f"{record} does not follow the others: {_outlying(record, trends)}." for record in list(outliers)[:MOST_TRENDS]
    ]
    if others := list(outliers)[MOST_TRENDS:]:
        said.append(f"Further records that do not follow the others: {len(others)}.")
    if not significant and trends:
        said.append(f"None of {len(trends)} looks shows more than chance, corrected for all of them.")
    return said


def _outlying(record: str, trends: Sequence[TrendSummary]) -> str:
    """Of each parameter the line from which a record is furthest, and over what else it is far from one."""
    far = [(one, outlier.score) for one in trends for outlier in one.outliers if outlier.record == record]
    said = []
    for parameter in dict.fromkeys(one.parameter for one, _ in far):
        (one, score), *others = sorted(
            (pair for pair in far if pair[0].parameter == parameter), key=lambda p: -abs(p[1])
        )
        also = f", and is far from those over {_listed([other for other, _ in others])}" if others else ""
        said.append(
            f"its {parameter} is {abs(score):.2g} standard deviations {'above' if score > 0 else 'below'} their line "
            f"over {_listed([one])}{also}"
        )
    return "; ".join(said)


def _listed(trends: Sequence[TrendSummary]) -> str:
    return ", ".join(one.condition.replace("_", " ") for one in trends)


def _trend(one: TrendSummary) -> str:
    counted = "record" if one.condition == BY_ORDER else one.condition_unit
    per = "" if counted == "-" else f" per {counted}"
    slope = quantity_text(one.slope, one.slope_error, one.unit)
    return (
        f"{one.parameter} over {one.condition.replace('_', ' ')}: {slope}{per} "
        f"({one.records} records, probability by chance {one.chance_corrected:.2g})."
    )
