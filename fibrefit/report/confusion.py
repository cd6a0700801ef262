"""The terminal report of what records could show."""

from __future__ import annotations

import textwrap

from fibrefit.core.formatting import format_quantity
from fibrefit.report.checks import GLOSSARY
from fibrefit.report.layout import WIDTH
from fibrefit.report.sentences.thresholds import CONFOUNDED
from fibrefit.study.summaries.discovery import Detectable, DistinguishSummary

MOST_PAIRS = 12


def distinguish_report(summary: DistinguishSummary) -> str:
    """Report of what records can distinguish, in at most 80 columns.

    Parameters
    ----------
    summary : DistinguishSummary
        Content of ``summary.json``.
    """
    lines = [summary.study, "=" * WIDTH]
    for remark in summary.remarks:
        lines += ["", *textwrap.wrap(remark, WIDTH)]
    limits = "Detection limits: smallest strength that these records would show"
    lines += ["", limits, "-" * len(limits)]
    lines += [strength_line(one) for one in summary.effects]
    pairs = _pairs(summary)
    heading = "Confounded pairs: |cosine| of their sensitivities (1: not separable)"
    lines += ["", heading, "-" * len(heading)]
    lines += [f"{cosine:.3f}  {first} / {second}" for first, second, cosine in pairs[:MOST_PAIRS]]
    lines += [f"and {len(pairs) - MOST_PAIRS} more" for _ in pairs[MOST_PAIRS : MOST_PAIRS + 1]]
    if not pairs:
        lines.append(f"No two effects have sensitivities of |cosine| {CONFOUNDED:g} or more.")
    if summary.best_further_record is not None:
        lines += ["", *textwrap.wrap(summary.best_further_record.says, WIDTH)]
    return "\n".join([*lines, "", GLOSSARY])


def _pairs(summary: DistinguishSummary) -> list[tuple[str, str, float]]:
    names = [one.effect for one in summary.effects]
    found = [
        (names[i], names[j], row[j]) for i, row in enumerate(summary.cosine) for j in range(i) if row[j] > CONFOUNDED
    ]
    return sorted(found, key=lambda pair: -pair[2])


def strength_line(one: Detectable) -> str:
    """An effect, the parameter that tells its strength, and the smallest one that would be found."""
    return f"{one.effect:<34} {one.parameter:<24} {strength(one)}"


def strength(one: Detectable) -> str:
    """Smallest strength of an effect that would be found, with its unit."""
    if one.smallest_detectable is None:
        return "not visible"
    return format_quantity(one.smallest_detectable, one.unit, 2)
