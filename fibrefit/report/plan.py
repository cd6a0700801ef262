"""The terminal report of a plan: which record to take next, and what it would add."""

from __future__ import annotations

import math

from fibrefit.report.checks import GLOSSARY
from fibrefit.report.layout import WIDTH, items, numbered, paragraph, section, shortened, table, titled
from fibrefit.report.sentences.discovery import shown_condition, shown_probability
from fibrefit.rigs.thresholds import FARTHER
from fibrefit.study.summaries.discovery import FurtherRecord, PlanSummary

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
    if summary.rivals and summary.ahead is not None:
        ahead, behind = summary.rivals if summary.ahead >= 0.0 else summary.rivals[::-1]
        first += (
            f" {_at_hand(summary, 'make')} {ahead} more probable than {behind} by {abs(summary.ahead):.2g} nats; "
            "beyond 5 they are told apart."
        )
    elif summary.rivals and summary.probability_distinguished_now is not None:
        first += (
            f" {_at_hand(summary, 'tell')} {summary.rivals[0]} from {summary.rivals[1]} with a probability of "
            f"{shown_probability(summary.probability_distinguished_now)} %."
        )
    parts = [
        titled(summary.study),
        paragraph(first),
        paragraph(_within(summary)),
        section("The next record", numbered(one.says for one in best)),
        section("What each would add", _rows(best)),
        section("What to doubt", items(summary.remarks)),
        GLOSSARY,
    ]
    return "\n\n".join(part for part in parts if part)


def _within(summary: PlanSummary) -> str:
    """What a further record may have, and why; empty where that is not told."""
    kinds = {True: "as the study states under [limits]", False: f"those at hand, {FARTHER:g} times wider at either end"}
    said = []
    for stated, why in kinds.items():
        ends = {name: ends for name, ends in summary.reach.items() if (name in summary.limits_stated) == stated}
        ranges = [f"{name} {' to '.join(shown_condition(name, at) for at in pair)}" for name, pair in ends.items()]
        said += [f"{', '.join(ranges)} ({why})"] if ranges else []
    if not said:
        return ""
    rest = "" if set(summary.limits_stated) == set(summary.reach) else " State under [limits] what your rig can do."
    return f"None goes beyond {'; '.join(said)}.{rest}"


def _rows(best: tuple[FurtherRecord, ...]) -> list[str]:
    """One row a quantity, one column a record: names are long, and records few."""
    rows = [
        ("cost / min", *(f"{one.minutes:.3g}" for one in best)),
        ("resolved / %", *(_resolved(one) for one in best)),
        *((f"error of {name}", *(f"x {one.errors[name]:.2f}" for one in best)) for name in best[0].errors),
        ("detection limits", *(f"x {_mean(one.limits):.2f}" if one.limits else "" for one in best)),
    ]
    head = ("", *(f"{number}." for number in range(1, len(best) + 1)))
    room = WIDTH - sum(2 + max(len(row[column]) for row in rows) for column in range(1, len(head)))
    kept = [(shortened(row[0], room), *row[1:]) for row in rows if any(row[1:])]
    return table(head, kept, right=set(range(1, len(head))))


def _resolved(one: FurtherRecord) -> str:
    """Probability that it tells the rivals apart, in brackets where slopes alone say so."""
    if one.probability_distinguished is None:
        return ""
    said = shown_probability(one.probability_distinguished)
    return said if one.looked_into is not False else f"({said})"


def _mean(factors: dict[str, float]) -> float:
    return math.exp(sum(math.log(factor) for factor in factors.values()) / len(factors))


def _at_hand(summary: PlanSummary, verb: str) -> str:
    number = len(summary.records)
    return f"The one at hand {verb}s" if number == 1 else f"The {number} at hand {verb}"
