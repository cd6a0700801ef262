"""A posterior as named arrays, in the groups in which ArviZ looks for them."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from fibrefit.sampling.posterior import Posterior
from fibrefit.sampling.predict import LEVELS, Bands
from fibrefit.study.summaries.part import Variable
from fibrefit.workflow.groups_in_common import (
    BY_SAMPLE,
    conditions_by_name,
    names_of_records,
    observed_group,
    sample_times,
    within_records,
)

MOST_DRAWS = 2000
"""Draws kept of each ensemble."""
MOST_REPLICATES = 20
"""New measurements kept of each record; the bands are made from all."""


Group = dict[str, Variable]


def posterior_groups(posterior: Posterior, bands: Mapping[str, Bands], seed: int) -> dict[str, Group]:
    """Draws, their densities, prior, data, predictions and conditions, each in the group ArviZ has for it.

    A chain is an ensemble; the walkers of a step are neighbouring draws. Values that each record has of its own get a
    dimension ``record``.

    Parameters
    ----------
    bands : mapping of channel to Bands
        From `fibrefit.sampling.predict.predict`.
    seed : int
        Of the draws from the prior.
    """
    chosen = chosen_draws(*posterior.course.kept_log_density.shape[1:])
    draws = posterior.draws[:, chosen]
    density = posterior.course.kept_log_density.reshape(len(draws), -1)[:, chosen]
    problem = posterior.density.problem
    records = names_of_records(problem)
    stats = {"lp": Variable(density, ("chain", "draw"), doc="Log posterior density in the sampler's coordinates.")}
    stats["acceptance_rate"] = Variable(
        posterior.course.acceptance, ("chain", "walker"), doc="Share of moves accepted."
    )
    return {
        "posterior": {**records, **_named(posterior, draws)},
        "sample_stats": stats,
        "prior": {**records, **_named(posterior, _prior_draws(posterior, seed)[None])},
        "observed_data": observed_group(problem, posterior.channel_units),
        "posterior_predictive": {**sample_times(problem), **_predictive(posterior, bands)},
        "constant_data": {**records, **conditions_by_name(problem)},
    }


def chosen_draws(steps: int, walkers: int) -> np.ndarray:
    """Places of the draws that are kept: every walker of every so many steps."""
    every = -(-steps * walkers // MOST_DRAWS)
    return np.arange(steps * walkers).reshape(steps, walkers)[::every].ravel()


def _named(posterior: Posterior, draws: np.ndarray) -> Group:
    """Draws ``(n_chain, n_draw, n)`` by name, those of single records side by side."""
    layout, names, units = posterior.density.problem.layout, posterior.target.names, posterior.target.units
    entries: Group = {}
    for slot in layout.slots:
        own = [i for i, (other, record) in enumerate(layout.entries) if other is slot and record is not None]
        if len(own) == len(layout.records):
            entries[slot.name] = Variable(draws[..., own], ("chain", "draw", "record"), slot.unit)
    for i, name in enumerate(names):
        if name.split("[")[0] not in entries:
            entries[name] = Variable(draws[..., i], ("chain", "draw"), units[i])
    return entries


def _prior_draws(posterior: Posterior, seed: int) -> np.ndarray:
    random = np.random.default_rng(seed)
    return np.stack([prior.quantile(random.random(MOST_DRAWS)) for prior in posterior.target.priors], axis=1)


def _predictive(posterior: Posterior, bands: Mapping[str, Bands]) -> Group:
    """Bands of each channel, NaN beyond the record."""
    problem = posterior.density.problem
    found: Group = {"quantile": Variable(np.array(LEVELS), ("quantile",))}
    for channel, band in bands.items():
        unit = posterior.channel_units[channel]
        replicates, model, measured = (
            within_records(problem, of) for of in (band.replicates[None, :MOST_REPLICATES], band.model, band.measured)
        )
        found[channel] = Variable(replicates, ("chain", "draw", *BY_SAMPLE), unit, "New measurements.")
        of_model, of_new = "Quantiles of the model's readings.", "Quantiles of new measurements."
        found[f"{channel}_model"] = Variable(model, ("quantile", *BY_SAMPLE), unit, of_model)
        found[f"{channel}_measured"] = Variable(measured, ("quantile", *BY_SAMPLE), unit, of_new)
    return found
