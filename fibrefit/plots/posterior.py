"""Figures of a posterior."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.plots.bands import Banded, bands_figure
from fibrefit.plots.corner import Drawn, corner_figure
from fibrefit.plots.figures import Figures
from fibrefit.plots.overlay import overlay_figure
from fibrefit.plots.traces import Way, traces_figure
from fibrefit.study.summaries.arrays import Array, Groups
from fibrefit.study.summaries.summaries import PosteriorSummary

if TYPE_CHECKING:
    from fibrefit.sampling.posterior import Posterior
    from fibrefit.sampling.predict import Bands

MOST_RECORDS = 24
"""Records that get a figure of their own."""
MOST_VALUES = 10
"""Values in a corner plot, unless they are named: more cannot be read."""


def posterior_figures(posterior: Posterior, bands: Mapping[str, Bands]) -> Figures:
    """All figures of a posterior.

    Parameters
    ----------
    posterior : Posterior
    bands : mapping of channel to Bands
        From `fibrefit.sampling.predict.predict`.

    Returns
    -------
    Figures
        A dict. ``corner``: every two values together. ``traces``: traces and ranks of each ensemble. ``prior``:
        prior and posterior. ``record <name>``: posterior predictive bands against what was measured.
    """
    records = posterior.density.problem.layout.records
    figures = corner_figures(posterior)
    figures |= trace_figures(posterior)
    figures |= prior_figures(posterior)
    figures |= band_figures(posterior, bands, records[:MOST_RECORDS])
    return figures


def saved_posterior_figures(summary: PosteriorSummary, groups: Groups) -> Figures:
    """Figures of a saved posterior: ``corner`` and ``record <name>``.

    Parameters
    ----------
    summary : PosteriorSummary
        Content of ``summary.json``.
    groups : Groups
        Content of ``result.h5``.
    """
    names = [name for name in summary.parameters if name in groups["posterior"]][:MOST_VALUES]
    known = {name: summary.parameters[name] for name in names}
    drawn = [Drawn(n, one.unit, groups["posterior"][n].values.ravel(), one.fitted) for n, one in known.items()]
    figures = Figures({"corner": corner_figure(drawn, summary.interval_probability)})
    observed, predicted = groups["observed_data"], groups["posterior_predictive"]
    channels = [name for name in observed if f"{name}_model" in predicted]
    for r, record in enumerate(map(str, observed["record"].values[:MOST_RECORDS])):
        there = np.any([np.isfinite(observed[channel].values[r]) for channel in channels], axis=0)
        span = slice(0, int(np.flatnonzero(there)[-1]) + 1)
        figures[f"record {record}"] = bands_figure(
            record, [_saved_band(observed, predicted, channel, (r, span)) for channel in channels]
        )
    return figures


def _saved_band(
    observed: Mapping[str, Array], predicted: Mapping[str, Array], channel: str, at: tuple[int, slice]
) -> Banded:
    return Banded(
        channel,
        observed[channel].unit,
        observed["time"].values[at],
        observed[channel].values[at],
        predicted[f"{channel}_model"].values[:, *at],
        predicted[f"{channel}_measured"].values[:, *at],
    )


def corner_figures(posterior: Posterior, names: Sequence[str] = ()) -> Figures:
    """``corner``: joint distribution of every two values."""
    chosen = _chosen(posterior, names)[: None if names else MOST_VALUES]
    flat = posterior.draws.reshape(-1, posterior.target.size)
    fitted = dict(zip(posterior.density.problem.layout.free_names, posterior.start.tolist(), strict=True))
    drawn = [
        Drawn(posterior.target.names[i], posterior.target.units[i], flat[:, i], fitted.get(posterior.target.names[i]))
        for i in chosen
    ]
    return Figures({"corner": corner_figure(drawn, posterior.settings.interval)})


def trace_figures(posterior: Posterior, names: Sequence[str] = ()) -> Figures:
    """``traces``: traces and rank plots of each ensemble."""
    course, target = posterior.course, posterior.target
    every = target.values(course.points.reshape(-1, target.size)).reshape(course.points.shape)
    ways = [
        Way(target.names[i], target.units[i], every[..., i], course.warm_up, float(course.mixing.r_hat[i]))
        for i in _chosen(posterior, names)
    ]
    return Figures({"traces": traces_figure(ways)})


def prior_figures(posterior: Posterior, names: Sequence[str] = ()) -> Figures:
    """``prior``: prior and posterior of each value."""
    target, flat = posterior.target, posterior.draws.reshape(-1, posterior.target.size)
    chosen = [i for i in _chosen(posterior, names) if target.priors]
    drawn = [Drawn(target.names[i], target.units[i], flat[:, i]) for i in chosen]
    shares = [posterior.marginals[target.names[i]].prior_share for i in chosen]
    return Figures({"prior": overlay_figure(drawn, [target.priors[i] for i in chosen], shares)})


def band_figures(posterior: Posterior, bands: Mapping[str, Bands], records: Sequence[str] = ()) -> Figures:
    """``record <name>``: bands of the model and of new measurements, on what was measured."""
    data, known = posterior.density.problem.observations, posterior.density.problem.layout.records
    times, counts = np.asarray(data.experiment.times), np.asarray(data.experiment.count)
    figures = Figures()
    for name in records or known:
        if name not in known:
            raise UsageError(
                f'record "{name}"', "not in this study", f"one of {', '.join(known)}", did_you_mean(name, known)
            )
        record = known.index(name)
        inside = slice(0, int(counts[record]))
        banded = []
        for channel, band in bands.items():
            counted = np.asarray(data.weight[channel])[record, inside] > 0.0
            measured = np.where(counted, np.asarray(data.measured[channel])[record, inside], np.nan)
            banded.append(
                Banded(
                    channel,
                    posterior.channel_units[channel],
                    times[record, inside],
                    measured,
                    band.model[:, record, inside],
                    band.measured[:, record, inside],
                )
            )
        figures[f"record {name}"] = bands_figure(name, banded)
    return figures


def _chosen(posterior: Posterior, names: Sequence[str]) -> list[int]:
    """Places of values by name; of all that records share where none is named."""
    known = posterior.target.names
    if not names:
        own = tuple(f"[{record}]" for record in posterior.density.problem.layout.records)
        shared = [i for i, name in enumerate(known) if not name.endswith(own)]
        return shared or list(range(len(known)))
    for name in names:
        if name not in known:
            raise UsageError(
                f'parameter "{name}"', "not sampled", f"one of {', '.join(known)}", did_you_mean(name, known)
            )
    return [known.index(name) for name in names]
