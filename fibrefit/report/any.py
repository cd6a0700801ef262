"""The report of any result."""

from __future__ import annotations

import importlib
from collections import Counter
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

from fibrefit.study.summaries.part import Part

if TYPE_CHECKING:
    from fibrefit.study.summaries.discovery import DistinguishSummary
    from fibrefit.study.summaries.series import BatchSummary

REPORTS = {
    "FitSummary": "text.fit_report",
    "DiscoverySummary": "discovery.discovery_report",
    "PosteriorSummary": "posterior.posterior_report",
    "PredictionSummary": "prediction.prediction_report",
    "BatchSummary": "batch.batch_report",
    "SweepSummary": "sweep.sweep_report",
    "DistinguishSummary": "confusion.distinguish_report",
    "PlanSummary": "plan.plan_report",
    "SeriesSummary": "series.series_report",
}
"""Module and function of each kind's report, loaded when it is first needed: a fit needs one of them."""


def report_of(summary: Part) -> str:
    """Report in at most 80 columns.

    Parameters
    ----------
    summary : Part
        Content of a ``summary.json``.
    """
    module, name = REPORTS[type(summary).__name__].split(".")
    said: str = getattr(importlib.import_module(f"fibrefit.report.{module}"), name)(summary)
    return said


def sentence_of(summary: Part) -> str:
    """What a result says whose records share no parameters, in a line; ``no parameters`` where it is of another kind.

    Parameters
    ----------
    summary : Part
        Content of a ``summary.json``.
    """
    line = LINES.get(type(summary).__name__)
    return line(summary) if line else "no parameters"


def _compared(summary: DistinguishSummary) -> str:
    seen = sum(one.smallest_detectable is not None for one in summary.effects)
    pairs = len(summary.cannot_tell_apart)
    confounded = f"{pairs} {'pair is' if pairs == 1 else 'pairs are'} confounded"
    return f"{seen} of {len(summary.effects)} effects would show; {confounded}"


def _counted(summary: BatchSummary) -> str:
    found = Counter(item.status or "not possible" for item in summary.items.values())
    return ", ".join(f"{number} {status}" for status, number in found.items())


LINES: dict[str, Callable[[Any], str]] = {
    "PlanSummary": lambda summary: f"next: {summary.further[0].says}",
    "DistinguishSummary": _compared,
    "BatchSummary": _counted,
    "SeriesSummary": lambda summary: summary.sentence,
}
