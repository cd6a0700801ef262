"""Whether a posterior can be believed: convergence, modes, priors and residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.problem.statement.matrices import equilibrated, scale_of
from fibrefit.problem.thresholds import GAP_OF_NOISE
from fibrefit.sampling.chains.ensembles import ChainHistory
from fibrefit.sampling.mode.modes import Mode
from fibrefit.sampling.posterior import Marginal
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.target import Target
from fibrefit.sampling.thresholds import (
    FAR_FROM_START,
    HOPELESS_ESS,
    HOPELESS_R_HAT,
    PRIOR_MATTERS,
    SECOND_MODE,
    STRONG_CORRELATION,
    STUCK,
    TRUNCATED,
    UNCONTRACTED,
)
from fibrefit.study.summaries.check import Check


def ensembles_agree(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Convergence: R-hat between ensembles."""
    found = course.mixing.r_hat
    worst, value = names[int(np.argmax(found))], float(found.max())
    return Check(
        name="the ensembles agree",
        passed=value < settings.r_hat,
        statistic=value,
        threshold=settings.r_hat,
        fatal=value > HOPELESS_R_HAT,
        identifier="convergence",
        quantity="convergence (R-hat)",
        facts={"worst": worst, "ensembles": len(course.points)},
    )


def draws_suffice(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Effective sample size."""
    found = np.minimum(course.mixing.ess_bulk, course.mixing.ess_tail)
    worst, value = names[int(np.argmin(found))], float(found.min())
    return Check(
        name="there are enough draws",
        passed=value > settings.ess,
        statistic=value,
        threshold=settings.ess,
        fatal=value < HOPELESS_ESS,
        identifier="effective_sample_size",
        quantity="effective sample size",
        facts={"worst": worst},
    )


def walkers_mix(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Whether every walker explores the whole mode: R-hat between walkers, and acceptance."""
    found = course.mixing.r_hat_walkers
    worst, value = names[int(np.argmax(found))], float(found.max())
    stuck = float(np.mean(course.acceptance < STUCK))
    passed = value < settings.r_hat_walkers and stuck == 0.0
    return Check(
        name="the walkers mix",
        passed=passed,
        statistic=value,
        threshold=settings.r_hat_walkers,
        fatal=not passed,
        identifier="walker_mixing",
        quantity="mixing of the walkers",
        facts={"worst": worst, "stuck": stuck, "least": STUCK},
    )


def one_mode(modes: Sequence[Mode], target: Target) -> Check:
    """Whether all other modes together have a weight worth naming."""
    others = [mode for mode in modes[1:] if not mode.absorbed]
    weight = float(sum(mode.weight for mode in others))
    # Of many that have it together, those are named that have as much as they have in the mean.
    named = [modes[0], *(mode for mode in others if mode.weight * len(others) >= SECOND_MODE)]
    return Check(
        name="there is one mode",
        passed=weight < SECOND_MODE,
        statistic=weight,
        threshold=SECOND_MODE,
        identifier="second_mode",
        quantity="weight of other modes",
        facts={"others": len(others), "modes": tuple(_described(mode, target) for mode in named)},
    )


def _described(mode: Mode, target: Target) -> tuple[float, tuple[tuple[str, float, str], ...]]:
    """Weight of a mode, and its values by name with their units."""
    centre = target.values(mode.approximation.centre[None])[0]
    return mode.weight, tuple(zip(target.names, centre.tolist(), target.units, strict=True))


def contraction(found: Mapping[str, Marginal]) -> Check:
    """Whether the posterior is narrower than the prior."""
    shares = {name: marginal.prior_share for name, marginal in found.items() if np.isfinite(marginal.prior_share)}
    nothing = [name for name, share in shares.items() if share > UNCONTRACTED]
    worst = max(shares.values(), default=0.0)
    matters = tuple(name for name, share in shares.items() if share >= PRIOR_MATTERS)
    return Check(
        name="every posterior is narrower than its prior",
        passed=not nothing,
        statistic=worst,
        threshold=UNCONTRACTED,
        identifier="contraction",
        quantity="posterior width against prior width",
        facts={"nothing": tuple(nothing), "matters": matters},
    )


def correlation(names: Sequence[str], course: ChainHistory) -> Check:
    """Whether no two coordinates are strongly correlated in the posterior."""
    points = course.kept.reshape(-1, course.points.shape[-1])
    spread = points.std(axis=0)
    moving = np.flatnonzero(spread > 0.0)
    every = np.abs(np.corrcoef(points[:, moving].T)) - np.eye(len(moving)) if len(moving) > 1 else np.zeros((1, 1))
    a, b = np.unravel_index(int(np.argmax(every)), every.shape)
    value = float(every[a, b])
    return Check(
        name="no strong posterior correlation",
        passed=value < STRONG_CORRELATION,
        statistic=value,
        threshold=STRONG_CORRELATION,
        identifier="posterior_correlation",
        quantity="strongest posterior correlation",
        facts={"pair": tuple(names[moving[k]] for k in (a, b)) if len(moving) else ()},
    )


def start_is_near(target: Target, course: ChainHistory, start: np.ndarray) -> Check:
    """Whether the posterior lies at what the fit reports, ``(n_start,)``; of the coordinates beyond it knew nothing."""
    points = course.kept.reshape(-1, target.size)[:, : len(start)]
    centre, covariance = points.mean(axis=0), np.cov(points.T).reshape(len(start), len(start))
    scale = scale_of(covariance)
    difference = (start - centre) / scale
    inverse = np.linalg.pinv(equilibrated(covariance, scale), rcond=1e-10, hermitian=True)
    distance = float(np.sqrt(max(difference @ inverse @ difference, 0.0)))
    limit = float(np.sqrt(len(start)) + FAR_FROM_START)
    return Check(
        name="the posterior lies at the fit",
        passed=distance < limit,
        statistic=distance,
        threshold=limit,
        identifier="distance_from_fit",
        quantity="distance of the posterior from the fit",
        facts={"worst": target.names[int(np.argmax(np.abs(difference)))]},
    )


def priors_proper(target: Target) -> Check:
    """Whether every prior is a proper distribution."""
    improper = [n for n, prior in zip(target.names, target.priors, strict=False) if not prior.proper]
    return Check.none_of(
        improper,
        name="every prior is proper",
        identifier="proper_priors",
        quantity="propriety of the priors",
        facts={"parameters": tuple(improper)},
    )


def truncation(found: Mapping[str, Marginal]) -> Check:
    """Whether no posterior is truncated by a bound."""
    truncated = []
    for name, marginal in found.items():
        if marginal.prior is None or marginal.sd == 0.0:
            continue
        gaps = (marginal.ends[0] - marginal.prior.lower, marginal.prior.upper - marginal.ends[1])
        if min(gaps) < TRUNCATED * marginal.sd and marginal.prior_share < UNCONTRACTED:
            truncated.append(name)
    return Check.none_of(
        truncated,
        name="no posterior is truncated by a bound",
        identifier="truncation",
        quantity="posteriors truncated by a bound",
        facts={"parameters": tuple(truncated)},
    )


def residual_size(channels: tuple[str, ...], ratio: np.ndarray) -> Check:
    """Whether the residuals are no larger than the noise at rest.

    Parameters
    ----------
    ratio : (n_channel,)
        Residual RMS over that expected from the noise at rest, or stated by the study, and from that of inputs.
    """
    worst = int(np.argmax(ratio))
    return Check(
        name="the residuals are noise",
        passed=bool(ratio[worst] <= GAP_OF_NOISE),
        statistic=float(ratio[worst]),
        threshold=GAP_OF_NOISE,
        identifier="residual_size",
        quantity="residual size",
        facts={"channel": channels[worst]},
    )


def assess(
    target: Target, modes: Sequence[Mode], found: Mapping[str, Marginal], start: np.ndarray, settings: Settings
) -> tuple[Check, ...]:
    """All checks that need nothing but the draws.

    Parameters
    ----------
    modes : sequence of Mode
        The heaviest first, and sampled.
    found : mapping of str to Marginal
        Of the heaviest mode.
    start : (n_free,)
        What the fit reports, in coordinates.
    """
    course = modes[0].course
    assert course is not None
    return (
        ensembles_agree(target.names, course, settings),
        draws_suffice(target.names, course, settings),
        walkers_mix(target.names, course, settings),
        one_mode(modes, target),
        start_is_near(target, course, start),
        contraction(found),
        correlation(target.names, course),
        truncation(found),
        priors_proper(target),
    )
