"""How each kind of result is shown: one file a kind, and one line here."""

from __future__ import annotations

from collections.abc import Callable

from fibrefit.report.page.batch import batch_page
from fibrefit.report.page.blocks import PageContent, Result
from fibrefit.report.page.discovery import discovery_page
from fibrefit.report.page.fit import fit_page
from fibrefit.report.page.posterior import posterior_page
from fibrefit.report.page.prediction import prediction_page
from fibrefit.report.page.sweep import plain_page
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import FitSummary, PosteriorSummary, PredictionSummary
from fibrefit.study.summaries.series import BatchSummary

KINDS: dict[type[Part], Callable[[Result], PageContent]] = {
    FitSummary: fit_page,
    DiscoverySummary: discovery_page,
    PosteriorSummary: posterior_page,
    BatchSummary: batch_page,
    PredictionSummary: prediction_page,
}


def page_of(result: Result) -> PageContent:
    """A result as it is shown; by its pictures and the report of the terminal where its kind has no page of its own."""
    return KINDS.get(type(result.summary), plain_page)(result)
