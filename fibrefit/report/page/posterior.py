"""The page of a posterior."""

from __future__ import annotations

from collections.abc import Sequence
from statistics import NormalDist

import numpy as np

from fibrefit.report.page.blocks import Block, PageContent, Records, Result, TableBlock, Words
from fibrefit.report.page.common import page_content
from fibrefit.report.page.records import Band, CourseModel, Sight, records_block
from fibrefit.report.posterior import VERDICTS, posterior_row
from fibrefit.study.summaries.part import Groups
from fibrefit.study.summaries.results import ChannelGap, Gap, PosteriorSummary


def posterior_page(result: Result) -> PageContent:
    """A posterior: its verdict, values, chains, records."""
    summary = result.summary
    assert isinstance(summary, PosteriorSummary)
    blocks: list[Block | None] = [
        Words("What to do next", summary.advice, listed=True),
        _parameters(summary),
        Words("How it was sampled", [summary.likelihood_says, *summary.remarks]) if summary.likelihood_says else None,
        view_of_posterior(result),
    ]
    said = f"{summary.draws} draws of {summary.ensembles} ensembles of {summary.walkers} walkers."
    return page_content(result, blocks, VERDICTS[summary.status], said, _facts(summary))


def _facts(summary: PosteriorSummary) -> list[tuple[str, str]]:
    every = [*summary.parameters.values(), *(one for own in summary.records.values() for one in own.values())]
    hats = [one.r_hat for one in every if one.r_hat is not None]
    sizes = [min(one.ess_bulk, one.ess_tail) for one in every if one.ess_bulk and one.ess_tail]
    facts = [("largest R-hat, 1 where chains agree", f"{max(hats):.4f}")] if hats else []
    facts += [("smallest effective sample size", f"{min(sizes):.0f}")] if sizes else []
    covered = ", ".join(f"{100 * share:.1f} % of {channel}" for channel, share in summary.covered.items())
    return [*facts, ("samples inside the 90 % band", covered)] if covered else facts


def _parameters(summary: PosteriorSummary) -> TableBlock:
    rows = []
    for name, known in summary.parameters.items():
        rows.append((*posterior_row(name, known), known.prior))
    kind = f"{100 * summary.interval_probability:g} % interval"
    head = ("parameter", "mean", "standard deviation", "unit", kind, "prior")
    return TableBlock("Parameters", head, rows, frozenset({1, 2}))


def view_of_posterior(result: Result) -> Records | None:
    """The records with the median of the model and the band of new measurements."""
    predicted, observed = (result.groups.get(name, {}) for name in ("posterior_predictive", "observed_data"))
    channels = [name for name in observed if f"{name}_model" in predicted]
    if not channels:
        return None
    middle = {channel: predicted[f"{channel}_model"].values[1] for channel in channels}
    bands = {}
    for channel in channels:
        low, _, high = predicted[f"{channel}_measured"].values
        bands[channel] = Band(low, high)
    model = CourseModel("final", "median of the model", "final", True, middle)
    gaps = _gaps(result.groups, channels)
    return records_block(Sight(result.groups, gaps, (model,), bands, "90 % posterior predictive band"))


def _gaps(groups: Groups, channels: Sequence[str]) -> dict[str, Gap]:
    """Residual of the median by record, with the noise of the draws: what new readings scatter beyond the model."""
    observed, predicted = groups["observed_data"], groups["posterior_predictive"]
    ends = NormalDist().inv_cdf(float(predicted["quantile"].values[-1]))
    found = {}
    for r, record in enumerate(observed["record"].values):
        own = {}
        for channel in channels:
            model, new = (predicted[f"{channel}_{of}"].values[:, r] for of in ("model", "measured"))
            beyond = np.nanmedian((new[2] - new[0]) ** 2 - (model[2] - model[0]) ** 2)
            noise = float(np.sqrt(max(beyond, 0.0))) / (2.0 * ends)
            rms = float(np.sqrt(np.nanmean((observed[channel].values[r] - model[1]) ** 2)))
            ratio = rms / noise if noise > 0.0 else None
            own[channel] = ChannelGap(rms=rms, unit=observed[channel].unit, noise=noise or None, ratio=ratio)
        found[str(record)] = Gap(**own)
    return found
