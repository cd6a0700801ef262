"""The terminal report of a plan: which record to take next, and what it would add."""

from __future__ import annotations

from fibrefit.report.checks import GLOSSARY
from fibrefit.report.layout import items, numbered, paragraph, section, table, titled
from fibrefit.study.summaries.design import FurtherRecord, PlanSummary

MOST = 6
"""Records that are described; all are in the summary."""
WORDS = {
    "errors": "by how much the standard errors of the parameters fall",
    "rivals": "by how surely they tell the rivals apart",
    "power": "by how much the detection limits of missing effects fall",
}


def plan_report(summary: PlanSummary) -> str:
    """Report of a plan in at most 80 columns; no line break at its end."""
    best = summary.further[: min(MOST, len(summary.further))]
    first = f"{len(summary.further)} records that could be taken next, ranked {WORDS[summary.purpose]}."
    if summary.rivals and summary.probability_distinguished_now is not None:
        first += (
            f" The {len(summary.records)} at hand tell {summary.rivals[0]} from {summary.rivals[1]} with a probability "
            f"of {100.0 * summary.probability_distinguished_now:.0f} %."
        )
    parts = [
        titled(summary.study),
        paragraph(first),
        section("The next record", numbered(one.says for one in best)),
        section("What each would add", _rows(best)),
        section("What to doubt", items(summary.remarks)),
        GLOSSARY,
    ]
    return "\n\n".join(part for part in parts if part)


def _rows(best: tuple[FurtherRecord, ...]) -> list[str]:
    names = list(best[0].errors)
    head = ("", "cost", "resolved", *(f"error of {name}" for name in names))
    rows = [
        (
            f"{i}.",
            f"{one.minutes:g} min",
            "" if one.probability_distinguished is None else f"{100.0 * one.probability_distinguished:.0f} %",
            *(f"x {one.errors[name]:.2f}" if name in one.errors else "" for name in names),
        )
        for i, one in enumerate(best, 1)
    ]
    return table(head, rows, right=set(range(1, len(head))))
