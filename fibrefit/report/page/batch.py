"""The page of a batch: all items in one table, and how their values go with conditions."""

from __future__ import annotations

import math
import statistics
from collections.abc import Mapping
from typing import NamedTuple

from fibrefit.core.formatting import shown_unit
from fibrefit.report.batch import batch_verdict, scatter_sentences
from fibrefit.report.page.blocks import Block, Items, PageContent, Result, TableBlock, Words
from fibrefit.report.page.common import failed_checks, gap_line, page_content
from fibrefit.report.pooled import POPULATION, population_rows, trend_sentences
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import FitResultSummary, ParameterSummary
from fibrefit.study.summaries.series import SPEED_OF, BatchItem, BatchSummary


def batch_page(result: Result) -> PageContent:
    """A batch: how many ended how, every item with its values."""
    summary = result.summary
    assert isinstance(summary, BatchSummary)
    found = [item.status or "not possible" for item in summary.items.values()]
    counts = {kind: found.count(kind) for kind in ("ok", "suspect", "failed", "not possible") if kind in found}
    blocks: list[Block | None] = [
        Words("What was found", [*scatter_sentences(summary), *trend_sentences(summary.trends)], listed=True),
        _items(result, summary),
        _population(summary),
    ]
    number = f"{len(found)} identification{'s' * (len(found) != 1)}"
    said = f"{number}: {', '.join(f'{n} {kind}' for kind, n in counts.items())}."
    return page_content(result, blocks, batch_verdict(summary), said, [(kind, str(n)) for kind, n in counts.items()])


def _population(summary: BatchSummary) -> TableBlock | None:
    """Means, differences between items, and where one more would lie."""
    if not summary.population:
        return None
    head = ("parameter", *POPULATION[1:-1], "unit")
    note = "sd: standard deviation between records, their own errors taken off."
    return TableBlock("Population", head, population_rows(summary.population), frozenset({1, 3}), note)


NO_BREAK = "\N{NO-BREAK SPACE}"
MOST_PRINTED = 120
"""Items that are printed, three sheets of A4 or so: of more only those that ask to be looked at."""

RATIO = ".2f"
"""How a gap is written."""


class _Column(NamedTuple):
    """Numbers of a column in the unit in which they are shown, by item."""

    label: str
    unit: str
    worth: float
    numbers: Mapping[str, tuple[float, float | None]]
    written: str = ".4g"

    def cell(self, item: str) -> tuple[str, float | None, float | None]:
        """Text, number and error of an item."""
        if item not in self.numbers:
            return "", None, None
        # Sixty degrees are 60 of them, not 59.999999999999993: whoever filters asks for the former.
        value, error = (None if one is None else float(f"{one / self.worth:.12g}") for one in self.numbers[item])
        assert value is not None
        if not error:
            return f"{value:{self.written}}", value, None
        decimals = min(max(0, 1 - math.floor(math.log10(error))), 12)
        return f"{value:.{decimals}f} ± {error:.{decimals}f}", value, error


def _items(result: Result, summary: BatchSummary) -> Items:
    """A row for each item; columns are its status, gap, conditions, free values and the gap of each channel."""
    numbers = [*_conditions(summary.items), *_values(summary), *_channels(result.items)]
    gaps = _Column("gap", "-", 1.0, {k: (v.gap, None) for k, v in summary.items.items() if v.gap is not None}, RATIO)
    lacking = any(item.lacks for item in summary.items.values())
    head = [{"label": "item", "kind": "text"}, {"label": "status", "kind": "status"}]
    head += [{"label": "model", "kind": "text"}] * lacking
    head += [{"label": _labelled(column.label, column.unit), "kind": "number"} for column in (gaps, *numbers)]
    rows, printed = [], _printed(summary.items)
    for name, item in summary.items.items():
        cells: list[tuple[str, float | None, float | None]] = [(name, None, None)]
        cells.append((item.status or "not possible", None, None))
        cells += [("lacks" if item.lacks else "", None, None)] * lacking
        cells += [column.cell(name) for column in (gaps, *numbers)]
        rows.append(
            {
                "cells": cells,
                "lacks": bool(item.lacks),
                "detail": _detail(item, result.items.get(name)),
                "link": _link(result, item),
                "printed": name in printed,
            }
        )
    return Items("Every item", head, rows)


def _printed(items: Mapping[str, BatchItem]) -> set[str]:
    """Items that are printed: all, or those that are doubtful or not explained, the largest gaps before others."""
    if len(items) <= MOST_PRINTED:
        return set(items)
    asking = [name for name, item in items.items() if item.lacks or item.status != "ok"]
    return set(sorted(asking, key=lambda name: -(items[name].gap or math.inf))[:MOST_PRINTED])


def _labelled(name: str, unit: str) -> str:
    words = name.replace("_", " ")
    # A unit is not broken over two lines.
    return words if unit in ("-", "") else f"{words} [{unit.replace(' ', NO_BREAK)}]"


def _column(label: str, si: str, numbers: Mapping[str, tuple[float, float | None]]) -> _Column:
    """A column in the unit that suits the middle of its numbers."""
    middle = statistics.median(abs(value) for value, _ in numbers.values())
    unit, worth = shown_unit(middle or 1.0, si)
    return _Column(label, unit, worth, numbers)


def _conditions(items: Mapping[str, BatchItem]) -> list[_Column]:
    """Conditions that differ of items, as a study states them: the speeds were found."""
    columns = []
    for heading in dict.fromkeys(heading for item in items.values() for heading in item.conditions):
        name, _, unit = heading.partition(" [")
        numbers: dict[str, tuple[float, float | None]] = {
            key: (item.conditions[heading], None) for key, item in items.items() if heading in item.conditions
        }
        if not name.startswith(SPEED_OF) and len({value for value, _ in numbers.values()}) > 1:
            columns.append(_column(name, unit.rstrip("]") or "-", numbers))
    return columns


def _values(summary: BatchSummary) -> list[_Column]:
    found: dict[str, dict[str, ParameterSummary]] = {}
    for item, one in summary.items.items():
        for name, value in one.parameters.items():
            if value.free:
                found.setdefault(name, {})[item] = value
    return [
        _column(name, next(iter(of.values())).unit, {item: (one.value, one.std_error) for item, one in of.items()})
        for name, of in found.items()
    ]


def _channels(items: Mapping[str, Part]) -> list[_Column]:
    """Gap of each channel, where the items' own summaries tell."""
    found: dict[str, dict[str, tuple[float, float | None]]] = {}
    for name, summary in items.items():
        if isinstance(summary, FitResultSummary):
            for channel, gap in summary.gap.channels.items():
                if gap.ratio is not None:
                    found.setdefault(channel, {})[name] = (gap.ratio, None)
    return [_Column(f"gap of {channel}", "-", 1.0, of, RATIO) for channel, of in found.items()]


def _detail(item: BatchItem, summary: Part | None) -> list[str]:
    """What opens below a row: why an item failed, its checks, its records."""
    if item.error is not None:
        return [item.error]
    if not isinstance(summary, FitResultSummary):
        return []
    records = [f"{name}: gap {gap_line(one.gap)}." for name, one in summary.records.items()]
    return [*failed_checks(summary.checks), *records, *summary.advice]


def _link(result: Result, item: BatchItem) -> str:
    return f"{result.link}/{item.result}/summary.json" if item.result and result.link else ""
