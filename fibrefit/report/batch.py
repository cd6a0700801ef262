"""The terminal report of a batch: how many ended how, what they found, how much it differs between them."""

from __future__ import annotations

import statistics
from collections.abc import Sequence

from fibrefit.core.formatting import shown_unit
from fibrefit.report.checks import GLOSSARY, failures
from fibrefit.report.layout import decimals_of, items, paragraph, section, table, titled
from fibrefit.report.pooled import population_lines, trend_lines
from fibrefit.report.sentences.thresholds import SCATTERS_MORE
from fibrefit.report.text import LONGEST_NAME, with_error
from fibrefit.study.summaries.results import ParameterSummary
from fibrefit.study.summaries.series import BatchSummary

MOST_NAMED = 5
"""Items named in a sentence; the others are counted."""
MOST_ERRORS = 12
"""Items that could not be carried out and are listed with the reason."""
SPREAD = 1.4826
"""Standard deviation of a normal distribution over its median absolute deviation."""


def items_in_words(wrong: Sequence[str], total: int, what: str) -> str:
    """How many of all items something is said of, the first ones by name."""
    if not wrong:
        return f"All {total}: yes." if total else "There is none."
    more = f" and {len(wrong) - MOST_NAMED} more" if len(wrong) > MOST_NAMED else ""
    return f"{len(wrong)} of {total} items {what}: {', '.join(wrong[:MOST_NAMED])}{more}."


def batch_report(summary: BatchSummary) -> str:
    """Report of a batch in at most 80 columns; no line break at its end."""
    sections = [
        titled(summary.name, summary.status),
        paragraph(batch_verdict(summary)),
        section("How many", _counts(summary)),
        section("What was found", _found(summary)),
        section("Population", population_lines(summary.population)),
        section("Trends", trend_lines(summary.trends)),
        section("What to doubt", _doubts(summary)),
        section("What to do next", items(_next(summary))),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


def batch_verdict(summary: BatchSummary) -> str:
    """What the status means, with how many items can be used where not all are ok."""
    if summary.status == "ok":
        return "Every identification came to an end, and each passed all checks of its numbers."
    if summary.status == "failed":
        return "None of these identifications can be used."
    usable = sum(item.status in ("ok", "suspect") for item in summary.items.values())
    whole = len(summary.items)
    return f"{f'All {whole}' if usable == whole else f'{usable} of {whole}'} can be used: see what to doubt."


def _counts(summary: BatchSummary) -> list[str]:
    found = [item.status or "not possible" for item in summary.items.values()]
    kinds = ("ok", "suspect", "failed", "not possible")
    said = ", ".join(f"{found.count(kind)} {kind}" for kind in kinds if kind in found)
    return [paragraph(f"{len(found)} identification{'' if len(found) == 1 else 's'}: {said}.")]


def _usable(summary: BatchSummary) -> dict[str, list[ParameterSummary]]:
    """Free values of the items that can be used, by name."""
    values: dict[str, list[ParameterSummary]] = {}
    for item in summary.items.values():
        if item.status in ("ok", "suspect"):
            for name, found in item.parameters.items():
                if found.free:
                    values.setdefault(name, []).append(found)
    return values


def _found(summary: BatchSummary) -> list[str]:
    rows = []
    for name, found in _usable(summary).items():
        middle = statistics.median(one.value for one in found)
        scatter, error = _scatter(found)
        # All in one unit; of a median of nothing that of what is larger.
        unit, worth = shown_unit(middle or max(scatter, error or 0.0), found[0].unit)
        value = with_error(middle, scatter, found[0].unit)[0] if middle else "0"
        spread, own = _told(scatter, worth), _told(error, worth)
        shown = name if len(name) <= LONGEST_NAME else f"...{name[-LONGEST_NAME + 3 :]}"
        rows.append((shown, value, spread, own, "" if unit == "-" else unit, str(len(found))))
    lines = table(("", "median", "sd", "std. error", "unit", "items"), rows, right={1, 2, 3, 5})
    lines += [paragraph(said) for said in scatter_sentences(summary)]
    if rows:
        lines.append(paragraph("sd: robust standard deviation between items; std. error: median of their own."))
    return lines


def _told(error: float | None, worth: float) -> str:
    """An error bar in a unit that is worth so much in SI, to the digits that mean something."""
    return f"{error / worth:.{decimals_of(error / worth)}f}" if error else ""


def _scatter(found: Sequence[ParameterSummary]) -> tuple[float, float | None]:
    """Robust standard deviation between items, and the median of their own standard errors."""
    middle = statistics.median(one.value for one in found)
    errors = [one.std_error for one in found if one.std_error]
    return (
        SPREAD * statistics.median(abs(one.value - middle) for one in found),
        statistics.median(errors) if errors else None,
    )


def scatter_sentences(summary: BatchSummary) -> list[str]:
    """Which parameters differ from item to item by more than their errors; nothing where none does."""
    differ = []
    for name, found in _usable(summary).items():
        scatter, error = _scatter(found)
        if error and scatter > SCATTERS_MORE * error and len(found) > 2:
            differ.append(f"{name} (ratio {scatter / error:.1f})")
    return [f"Between-item scatter exceeds the standard error: {', '.join(differ)}."] if differ else []


def _doubts(summary: BatchSummary) -> list[str]:
    lines = failures(summary.checks)
    stopped = [(name, item.error) for name, item in summary.items.items() if item.error]
    lines += items(f"{name}: {error}" for name, error in stopped[:MOST_ERRORS])
    if len(stopped) > MOST_ERRORS:
        lines.append(paragraph(f"and {len(stopped) - MOST_ERRORS} more: see results.csv."))
    return lines


def _next(summary: BatchSummary) -> list[str]:
    said = []
    found = [item.status for item in summary.items.values()]
    if "suspect" in found or any(item.lacks for item in summary.items.values()):
        said.append(
            "fibrefit show ITEM, with the folder of one item under items/, tells what is wrong with it; fibrefit "
            "discover on its study looks for what the model lacks."
        )
    if None in found:
        said.append("Put right what could not be carried out, and run the same again with --resume: the rest is kept.")
    return said
