"""The page of a prediction: values found before, on records they were not found from."""

from __future__ import annotations

import numpy as np

from fibrefit.report.page.blocks import Block, PageContent, Records, Result, TableBlock, Words
from fibrefit.report.page.common import gaps_table, page_content, parameters_table, records_table
from fibrefit.report.page.records import Band, CourseModel, Sight, records_block, simulated
from fibrefit.report.prediction import EXPECTED, share_told
from fibrefit.report.text import known_quantity
from fibrefit.study.summaries.part import Z_95
from fibrefit.study.summaries.results import PredictedChannel, PredictionSummary

VERDICTS = {
    "holds": "The values hold for these records.",
    "does_not_hold": "The values do not hold for these records.",
    "not_trusted": "This prediction cannot be trusted.",
}


def prediction_page(result: Result) -> PageContent:
    """A prediction: its verdict, how well each channel is predicted, the records."""
    summary = result.summary
    assert isinstance(summary, PredictionSummary)
    gaps = {name: one.gap for name, one in summary.records.items()}
    blocks: list[Block | None] = [
        _predicted(summary),
        Words("What to do next", summary.advice, listed=True),
        view_of_prediction(result),
        gaps_table(gaps, summary.gap, None, None),
        records_table(summary.records),
        parameters_table(summary.parameters),
    ]
    facts = [(f"{name} explained", share_told(one.explained)) for name, one in summary.channels.items()]
    said = f"{summary.says} Values of {summary.result}."
    return page_content(result, blocks, VERDICTS[summary.verdict], said, facts)


def _predicted(summary: PredictionSummary) -> TableBlock:
    rows = [_row(name, one) for name, one in summary.channels.items()]
    head = ("channel", "explained", "rms", "expected", "rms in the fit", "inside the 95 % band")
    return TableBlock("How well it is predicted", head, rows, frozenset(range(1, len(head))), EXPECTED)


def _row(name: str, one: PredictedChannel) -> tuple[str, ...]:
    sizes = ("" if v is None else known_quantity(v, one.unit) for v in (one.rms, one.expected, one.fit_rms))
    return name, share_told(one.explained), *sizes, share_told(one.inside)


def view_of_prediction(result: Result) -> Records | None:
    """The records with the prediction and the interval in which new readings were expected."""
    summary, groups = result.summary, result.groups
    assert isinstance(summary, PredictionSummary)
    readings = simulated(groups, "predictions")
    if not readings:
        return None
    bands = {}
    for channel, values in readings.items():
        sd = groups["predictions"].get(f"{channel}_sd")
        half = Z_95 * (np.zeros_like(values) if sd is None else np.nan_to_num(sd.values))
        bands[channel] = Band(values - half, values + half)
    gaps = {name: one.gap for name, one in summary.records.items()}
    model = CourseModel("final", "prediction", "final", True, readings)
    said = "95 % interval of a new reading: noise, what the fit lacked, errors of the values"
    return records_block(Sight(groups, gaps, (model,), bands, said))
