"""The report of any result."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from typing import Any

from fibrefit.report.batch import batch_report
from fibrefit.report.confusion import distinguish_report
from fibrefit.report.discovery import discovery_report
from fibrefit.report.plan import plan_report
from fibrefit.report.posterior import posterior_report
from fibrefit.report.prediction import prediction_report
from fibrefit.report.series import series_report
from fibrefit.report.sweep import sweep_report
from fibrefit.report.text import fit_report
from fibrefit.study.summaries.design import DistinguishSummary, PlanSummary
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.prediction import PredictionSummary
from fibrefit.study.summaries.series import SeriesSummary
from fibrefit.study.summaries.summaries import BatchSummary, FitSummary, PosteriorSummary
from fibrefit.study.summaries.sweep import SweepSummary

REPORTS: dict[type[Part], Callable[[Any], str]] = {
    FitSummary: fit_report,
    DiscoverySummary: discovery_report,
    PosteriorSummary: posterior_report,
    PredictionSummary: prediction_report,
    BatchSummary: batch_report,
    SweepSummary: sweep_report,
    DistinguishSummary: distinguish_report,
    PlanSummary: plan_report,
    SeriesSummary: series_report,
}


def report_of(summary: Part) -> str:
    """Report in at most 80 columns.

    Parameters
    ----------
    summary : Part
        Content of a ``summary.json``.
    """
    return REPORTS[type(summary)](summary)


def sentence_of(summary: Part) -> str:
    """What a result says whose records share no parameters, in a line; ``no parameters`` where it is of another kind.

    Parameters
    ----------
    summary : Part
        Content of a ``summary.json``.
    """
    return LINES[type(summary)](summary) if type(summary) in LINES else "no parameters"


def _compared(summary: DistinguishSummary) -> str:
    seen = sum(one.smallest_detectable is not None for one in summary.effects)
    return f"{seen} of {len(summary.effects)} effects would show; {len(summary.cannot_tell_apart)} pairs look alike"


def _counted(summary: BatchSummary) -> str:
    found = Counter(item.status or "not possible" for item in summary.items.values())
    return ", ".join(f"{number} {status}" for status, number in found.items())


LINES: dict[type[Part], Callable[[Any], str]] = {
    PlanSummary: lambda summary: f"next: {summary.further[0].says}",
    DistinguishSummary: _compared,
    BatchSummary: _counted,
    SeriesSummary: lambda summary: summary.sentence,
}
