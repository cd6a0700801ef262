"""Figures of a posterior, from its summary and its arrays: of one just sampled, or of one that was saved."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.plots.bands import Banded, bands_figure
from fibrefit.plots.corner import Drawn, corner_figure
from fibrefit.plots.figures import MOST_RECORDS, Figures
from fibrefit.plots.overlay import PriorCurve, overlay_figure
from fibrefit.plots.style import in_own_style
from fibrefit.plots.traces import Way, traces_figure
from fibrefit.study.summaries.part import Groups, Variable
from fibrefit.study.summaries.results import PosteriorParameter, PosteriorSummary

MOST_VALUES = 10
"""Values in a corner plot, unless they are named: more cannot be read."""


@in_own_style
def posterior_figures(summary: PosteriorSummary, groups: Groups) -> Figures:
    """All figures of a posterior.

    Parameters
    ----------
    summary : PosteriorSummary
        Content of ``summary.json``.
    groups : Groups
        Content of ``result.h5``.

    Returns
    -------
    Figures
        A dict. ``corner``: every two values together. ``traces``: traces and ranks of each ensemble. ``prior``:
        prior and posterior. ``record <name>``: posterior predictive bands against what was measured.
    """
    figures = corner_figures(summary, groups) | trace_figures(summary, groups) | prior_figures(summary, groups)
    return Figures(figures | band_figures(groups, _records(groups)[:MOST_RECORDS]))


@in_own_style
def corner_figures(summary: PosteriorSummary, groups: Groups, names: Sequence[str] = ()) -> Figures:
    """``corner``: joint distribution of every two values."""
    chosen = _chosen(summary, names)
    drawn = [_drawn(groups, name, one) for name, one in list(chosen.items())[: None if names else MOST_VALUES]]
    return Figures({"corner": corner_figure(drawn, summary.interval_probability)})


@in_own_style
def trace_figures(summary: PosteriorSummary, groups: Groups, names: Sequence[str] = ()) -> Figures:
    """``traces``: traces and rank plots of each ensemble."""
    kept, ways = groups["traces"], []
    places = {str(name): i for i, name in enumerate(kept["value"].values)}
    for name, one in _chosen(summary, names).items():
        low, middle, high = (kept[part].values[places[name]] for part in ("low", "median", "high"))
        steps, warm_up = kept["step"].values, summary.warm_up or 0
        r_hat = np.nan if one.r_hat is None else one.r_hat
        ess = np.nan if one.ess_bulk is None else one.ess_bulk
        ways.append(Way(name, one.unit, steps, low, middle, high, _draws(groups, name), warm_up, r_hat, ess))
    limit = next((check.threshold for check in summary.checks if check.identifier == "convergence"), None)
    every = [*summary.parameters.values(), *(one for own in summary.records.values() for one in own.values())]
    worst = float(np.max([np.nan if one.r_hat is None else one.r_hat for one in every]))
    return Figures({"traces": traces_figure(ways, limit, worst)})


@in_own_style
def prior_figures(summary: PosteriorSummary, groups: Groups, names: Sequence[str] = ()) -> Figures:
    """``prior``: prior and posterior of each value."""
    chosen, kept = _chosen(summary, names), groups["prior_density"]
    places = {str(name): i for i, name in enumerate(kept["value"].values)}
    known = {name: one for name, one in chosen.items() if name in places}
    curves = [
        PriorCurve(
            kept["at"].values[places[name]],
            kept["density"].values[places[name]],
            np.nan if one.prior_share is None else one.prior_share,
        )
        for name, one in known.items()
    ]
    return Figures({"prior": overlay_figure([_drawn(groups, name, one) for name, one in known.items()], curves)})


@in_own_style
def band_figures(groups: Groups, records: Sequence[str] = ()) -> Figures:
    """``record <name>``: bands of the model and of new measurements, on what was measured.

    Raises
    ------
    UsageError
        If there is no record of such a name.
    """
    observed, predicted = groups["observed_data"], groups["posterior_predictive"]
    channels = [name for name in observed if f"{name}_model" in predicted]
    known, figures = _records(groups), Figures()
    for name in records or known:
        if name not in known:
            raise UsageError(
                f'record "{name}"', "not in this study", f"one of {', '.join(known)}", did_you_mean(name, known)
            )
        r = known.index(name)
        there = np.any([np.isfinite(observed[channel].values[r]) for channel in channels], axis=0)
        span = slice(0, int(np.flatnonzero(there)[-1]) + 1)
        banded = [_banded(observed, predicted, channel, (r, span)) for channel in channels]
        figures[f"record {name}"] = bands_figure(name, banded)
    return figures


def _banded(
    observed: Mapping[str, Variable], predicted: Mapping[str, Variable], channel: str, at: tuple[int, slice]
) -> Banded:
    return Banded(
        channel,
        observed[channel].unit,
        observed["time"].values[at],
        observed[channel].values[at],
        predicted[f"{channel}_model"].values[:, *at],
        predicted[f"{channel}_measured"].values[:, *at],
    )


def _records(groups: Groups) -> list[str]:
    return list(map(str, groups["observed_data"]["record"].values))


def _drawn(groups: Groups, name: str, one: PosteriorParameter) -> Drawn:
    return Drawn(name, one.unit, _draws(groups, name).ravel(), one.fitted)


def _draws(groups: Groups, name: str) -> np.ndarray:
    """Draws ``(n_chain, n_draw)`` of a value; those of single records lie side by side under one name."""
    group = groups["posterior"]
    if name in group:
        return group[name].values
    bare, _, record = name.removesuffix("]").partition("[")
    return group[bare].values[..., list(map(str, group["record"].values)).index(record)]


def _chosen(summary: PosteriorSummary, names: Sequence[str]) -> dict[str, PosteriorParameter]:
    """Values by name; all that records share where none is named."""
    own = {f"{name}[{record}]": one for record, values in summary.records.items() for name, one in values.items()}
    known = {**summary.parameters, **own}
    for name in names:
        if name not in known:
            raise UsageError(
                f'parameter "{name}"', "not sampled", f"one of {', '.join(known)}", did_you_mean(name, list(known))
            )
    return {name: known[name] for name in names} if names else dict(summary.parameters) or own
