"""How each kind of result is told: one file a kind, and one line here."""

from __future__ import annotations

from collections.abc import Callable

from fibrefit.report.page.batch import told_batch
from fibrefit.report.page.blocks import Result, Telling
from fibrefit.report.page.discovery import told_discovery
from fibrefit.report.page.fit import told_fit
from fibrefit.report.page.posterior import told_posterior
from fibrefit.report.page.prediction import told_prediction
from fibrefit.report.page.sweep import told_plainly
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.prediction import PredictionSummary
from fibrefit.study.summaries.summaries import BatchSummary, FitSummary, PosteriorSummary

KINDS: dict[type[Part], Callable[[Result], Telling]] = {
    FitSummary: told_fit,
    DiscoverySummary: told_discovery,
    PosteriorSummary: told_posterior,
    BatchSummary: told_batch,
    PredictionSummary: told_prediction,
}


def told_of(result: Result) -> Telling:
    """A result as it is told; by its pictures and the report of the terminal where its kind has no page of its own."""
    return KINDS.get(type(result.summary), told_plainly)(result)
