"""A posterior as the files of a result: the summary and the groups of ``result.h5``."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np

from fibrefit.report.posterior import posterior_advice
from fibrefit.report.sentences.posterior import likelihood_sentence, posterior_checks, prior_words, remark
from fibrefit.sampling.evidence import Mode
from fibrefit.sampling.nuts import CrossCheck
from fibrefit.sampling.posterior import INTERVAL_KIND, Marginal, Posterior
from fibrefit.sampling.predict import LEFT_OUT_SECONDS, CrossValidation, block_index, blockwise, usual_log_density
from fibrefit.study.summaries.part import Measure, Variable
from fibrefit.study.summaries.results import (
    CrossCheckSummary,
    CrossValidationSummary,
    ModeSummary,
    PosteriorParameter,
    PosteriorSummary,
    Provenance,
)
from fibrefit.workflow.fit_files import gap_summary
from fibrefit.workflow.sampling.found import Findings
from fibrefit.workflow.sampling.groups import chosen_draws, posterior_groups

SCORED = 800
"""Draws, of all ensembles together, whose likelihood is kept block by block, where ensembles are no more than these."""


def posterior_summary(found: Findings, origin: Provenance) -> PosteriorSummary:
    """Content of ``summary.json`` of a posterior."""
    posterior, course = found.posterior, found.posterior.course
    records = posterior.density.problem.layout.records
    evidence = posterior.log_evidence
    checks = posterior_checks(found.checks)
    return PosteriorSummary(
        status=found.status,
        study=found.study.name,
        rig=found.study.kind,
        effects=tuple(effect.name for effect in posterior.density.problem.model.effects),
        parameters={name: _parameter(found, marginal) for name, marginal in found.parameters.items()},
        records={record: _of_record(found, record) for record in records},
        between_records=dict(posterior.between),
        interval_kind=INTERVAL_KIND,
        interval_probability=posterior.settings.interval,
        likelihood=posterior.noise_model.kind + (", Student's t" if found.options.heavy else ""),
        likelihood_says=likelihood_sentence(posterior.noise_model),
        ensembles=course.points.shape[0],
        walkers=course.points.shape[2],
        draws=int(np.prod(course.kept.shape[:3])),
        steps=course.points.shape[1],
        warm_up=course.warm_up,
        ended="converged" if course.converged else "budget",
        acceptance=float(course.acceptance.mean()),
        modes=tuple(_mode(posterior, mode) for mode in posterior.modes),
        gap=gap_summary(posterior.gap),
        covered={channel: band.covered for channel, band in found.bands.items()},
        log_evidence=None if evidence is None else Measure(value=evidence.log_value, error=evidence.error),
        cross_validation=_cross_validation(found.cross_validation),
        compared=found.compared,
        second_opinion=None if found.cross_check is None else _cross_check(posterior, found.cross_check),
        fit_status=found.start.status,
        remarks=tuple(map(remark, posterior.remarks)),
        checks=checks,
        advice=posterior_advice(checks, course.converged, found.cross_check is not None),
        provenance=origin,
    )


def _parameter(found: Findings, marginal: Marginal) -> PosteriorParameter:
    fitted = dict(zip(found.start.names, found.start.values.tolist(), strict=True))
    return PosteriorParameter(
        mean=marginal.mean,
        sd=marginal.sd,
        median=marginal.median,
        interval=marginal.interval,
        unit=marginal.unit,
        r_hat=marginal.r_hat,
        ess_bulk=marginal.ess_bulk,
        ess_tail=marginal.ess_tail,
        prior="" if marginal.prior is None else _said(marginal),
        prior_share=marginal.prior_share,
        fitted=fitted.get(marginal.name),
    )


def _said(marginal: Marginal) -> str:
    prior = marginal.prior
    assert prior is not None
    return prior_words(prior, marginal.unit) + (" (default)" if prior.source == "default" else "")


def _of_record(found: Findings, record: str) -> dict[str, PosteriorParameter]:
    end = f"[{record}]"
    return {
        name.removesuffix(end): _parameter(found, marginal)
        for name, marginal in found.posterior.marginals.items()
        if name.endswith(end)
    }


def _mode(posterior: Posterior, mode: Mode) -> ModeSummary:
    centre = posterior.target.values(mode.approximation.centre[None])[0].tolist()
    values = dict(zip(posterior.target.names, centre, strict=True))
    return ModeSummary(weight=mode.weight, sampled=mode.course is not None, parameters=values)


def _cross_validation(found: CrossValidation) -> CrossValidationSummary | None:
    # Of a single block nothing tells how sure the sum is.
    if len(found.blocks) < 2 or not np.isfinite(found.total):
        return None
    return CrossValidationSummary(
        total=Measure(value=found.total, error=found.error),
        blocks=len(found.blocks),
        unsure=found.unreliable,
        effective_parameters=found.effective_parameters,
    )


def _cross_check(posterior: Posterior, found: CrossCheck) -> CrossCheckSummary:
    names = posterior.target.names
    return CrossCheckSummary(
        agrees=found.agrees,
        draws=found.draws,
        divergent=found.divergent,
        scores=dict(zip(names, found.scores.tolist(), strict=True)),
        spread=dict(zip(names, found.spread.tolist(), strict=True)),
        spread_scores=dict(zip(names, found.spread_scores.tolist(), strict=True)),
        r_hat=dict(zip(names, found.r_hat.tolist(), strict=True)),
    )


def groups_of(found: Findings) -> dict[str, dict[str, Variable]]:
    """Groups of ``result.h5``: those ArviZ knows, the blocks two models are compared by, and what else is drawn."""
    from fibrefit.workflow.sampling.drawn_groups import drawn_groups  # figures, which a run needs at its end only

    groups = posterior_groups(found.posterior, found.bands, found.posterior.settings.seed)
    ahead = found.cross_validation
    groups["log_likelihood"] = _log_likelihood(found.posterior)
    groups["cross_validation"] = {
        "elpd": Variable(ahead.blocks, ("block",), doc="Of each block of time, when it was left out."),
        "pareto_k": Variable(ahead.pareto_k, ("block",), doc="Reliability; good below 0.7."),
    }
    return groups | drawn_groups(found.posterior)


def scored_draws(draws: int, ensembles: int) -> np.ndarray:
    """Places of the draws whose likelihood is kept: evenly among those of an ensemble, one at the least."""
    number = min(draws, max(1, SCORED // ensembles))
    return np.linspace(0, draws - 1, number).round().astype(int)


def _log_likelihood(posterior: Posterior) -> dict[str, Variable]:
    """Log likelihood of each block of time at some of the draws, as ArviZ compares models by it.

    Noise is autocorrelated, so that a block is left out, not a sample; see `fibrefit.sampling.predict`.
    """
    course, density = posterior.course, posterior.density
    kept = course.kept.reshape(len(course.kept), -1, course.kept.shape[-1])
    chosen = chosen_draws(*course.kept_log_density.shape[1:])
    scored = scored_draws(len(chosen), len(kept))
    points = kept[:, chosen[scored]].reshape(-1, kept.shape[-1])
    blocks, number = block_index(density)
    each = blockwise(density, jnp.asarray(points), jnp.asarray(blocks), number, posterior.inputs)
    used = np.unique(blocks[blocks < number - 1])
    values = each[:, used].reshape(len(kept), len(scored), -1)
    records, each_record = density.problem.layout.records, (number - 1) // len(blocks)
    usual = usual_log_density(density, blocks, number)[used]
    return {
        "draw": Variable(scored, ("draw",), doc="Place in the draws of the posterior."),
        "readings": Variable(values, ("chain", "draw", "block"), doc="Of all channels together, SI units."),
        "usual": Variable(usual, ("block",), doc="Of noise that scatters as neighbouring readings do, SI units."),
        "block_record": Variable(np.array([records[b // each_record] for b in used], dtype=object), ("block",)),
        "block_begin": Variable(
            used % each_record * LEFT_OUT_SECONDS, ("block",), "s", "After the first sample of the record."
        ),
    }
