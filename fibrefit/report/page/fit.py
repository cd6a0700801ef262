"""The page of a fit."""

from __future__ import annotations

from fibrefit.report.page.blocks import Block, PageContent, Records, Result, Words
from fibrefit.report.page.common import (
    gap_line,
    gaps_table,
    page_content,
    records_table,
    values_tables,
)
from fibrefit.report.page.records import CourseModel, Sight, fit_bands, records_block, simulated
from fibrefit.report.text import VERDICTS
from fibrefit.study.summaries.results import FitSummary


def fit_page(result: Result) -> PageContent:
    """A fit: its verdict, values, records, pictures."""
    summary = result.summary
    assert isinstance(summary, FitSummary)
    view = view_of_fit(result)
    blocks: list[Block | None] = [
        Words("What to do next", summary.advice, listed=True),
        *values_tables(summary),
        view,
        gaps_table({name: one.gap for name, one in summary.records.items()}, summary.gap, None, None),
        records_table(summary.records),
    ]
    said = " ".join(filter(None, [opening(summary), summary.estimator_says]))
    return page_content(result, blocks, VERDICTS[summary.status], said, facts(summary))


def opening(summary: FitSummary) -> str:
    """What was fitted, in a sentence."""
    number = len(summary.records)
    model = f"the base model with {', '.join(summary.effects)}" if summary.effects else "the base model"
    return f"{number} record{'s' * (number != 1)} fitted by {model}."


def facts(summary: FitSummary) -> list[tuple[str, str]]:
    """Key numbers."""
    total = summary.gap.total
    expected = 1.0 if summary.expected_gap is None else summary.expected_gap
    facts = [] if total is None else [(f"gap: residual RMS over noise, {expected:.2f} expected", f"{total:.2f}")]
    facts.append(("gap by channel", gap_line(summary.gap)))
    if summary.starts is not None:
        facts.append(("starts that agree", f"{summary.starts.agreeing} of {summary.starts.tried}"))
    return facts


def view_of_fit(result: Result) -> Records | None:
    """The records with the fitted model and the interval of new measurements."""
    summary, groups = result.summary, result.groups
    assert isinstance(summary, FitSummary)
    readings = simulated(groups, "predictions")
    if not readings:
        return None
    gaps = {name: one.gap for name, one in summary.records.items()}
    model = CourseModel("final", "model", "final", True, readings)
    bands = fit_bands(groups, readings, gaps)
    said = "95 % interval of a new measurement: noise and errors of the values"
    return records_block(Sight(groups, gaps, (model,), bands, said))
