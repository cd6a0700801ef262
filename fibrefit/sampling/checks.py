"""Whether a posterior can be believed: convergence, modes, priors and residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.problem import GAP_OF_NOISE
from fibrefit.sampling.chains import ChainHistory, Target
from fibrefit.sampling.evidence import Mode
from fibrefit.sampling.posterior import Marginal
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.thresholds import (
    FAR_FROM_START,
    HOPELESS_ESS,
    HOPELESS_R_HAT,
    OVERLOOKED,
    PRIOR_MATTERS,
    SAME_WIDTH,
    STRONG_CORRELATION,
    STUCK,
    TRUNCATED,
)
from fibrefit.study.summaries.check import Check

#: What each check asserts, and the quantity it tests, by its identifier.
CHECKS = {
    "convergence": ("the ensembles agree", "convergence (R-hat)"),
    "effective_sample_size": ("there are enough draws", "effective sample size"),
    "walker_mixing": ("the walkers mix", "mixing of the walkers"),
    "second_mode": ("there is one mode", "weight of other modes"),
    "contraction": ("every posterior is narrower than its prior", "posterior width against prior width"),
    "posterior_correlation": ("no strong posterior correlation", "strongest posterior correlation"),
    "distance_from_fit": ("the posterior lies at the fit", "distance of the posterior from the fit"),
    "proper_priors": ("every prior is proper", "propriety of the priors"),
    "truncation": ("no posterior is truncated by a bound", "posteriors truncated by a bound"),
    "residual_size": ("the residuals are noise", "residual size"),
}


def _check(
    identifier: str, passed: bool, statistic: float, threshold: float, fatal: bool = False, **facts: Any
) -> Check:
    name, quantity = CHECKS[identifier]
    return Check(
        name=name,
        passed=passed,
        statistic=statistic,
        threshold=threshold,
        fatal=fatal,
        identifier=identifier,
        quantity=quantity,
        facts=facts,
    )


def ensembles_agree(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Convergence: R-hat between ensembles."""
    found = course.mixing.r_hat
    worst, value, limit = names[int(np.argmax(found))], float(found.max()), settings.r_hat
    return _check(
        "convergence", value < limit, value, limit, value > HOPELESS_R_HAT, worst=worst, ensembles=len(course.points)
    )


def draws_suffice(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Effective sample size."""
    found = np.minimum(course.mixing.ess_bulk, course.mixing.ess_tail)
    worst, value, least = names[int(np.argmin(found))], float(found.min()), settings.ess
    return _check("effective_sample_size", value > least, value, least, value < HOPELESS_ESS, worst=worst)


def walkers_mix(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Whether every walker explores the whole mode: R-hat between walkers, and acceptance."""
    found, limit = course.mixing.r_hat_walkers, settings.r_hat_walkers
    worst, value = names[int(np.argmax(found))], float(found.max())
    stuck = float(np.mean(course.acceptance < STUCK))
    passed = value < limit and stuck == 0.0
    return _check("walker_mixing", passed, value, limit, not passed, worst=worst, stuck=stuck, least=STUCK)


def one_mode(modes: Sequence[Mode], target: Target) -> Check:
    """Whether all other modes together have a weight worth naming."""
    others = [mode for mode in modes[1:] if not mode.absorbed]
    weight = float(sum(mode.weight for mode in others))
    # Of many that have it together, those are named that have as much as they have in the mean.
    described = []
    for mode in (modes[0], *(mode for mode in others if mode.weight * len(others) >= OVERLOOKED)):
        centre = target.values(mode.approximation.centre[None])[0]
        described.append((mode.weight, tuple(zip(target.names, centre.tolist(), target.units, strict=True))))
    return _check("second_mode", weight < OVERLOOKED, weight, OVERLOOKED, others=len(others), modes=tuple(described))


def contraction(found: Mapping[str, Marginal]) -> Check:
    """Whether the posterior is narrower than the prior."""
    shares = {name: marginal.prior_share for name, marginal in found.items() if np.isfinite(marginal.prior_share)}
    nothing = tuple(name for name, share in shares.items() if share > SAME_WIDTH)
    worst = max(shares.values(), default=0.0)
    matters = tuple(name for name, share in shares.items() if share >= PRIOR_MATTERS)
    return _check("contraction", not nothing, worst, SAME_WIDTH, nothing=nothing, matters=matters)


def correlation(names: Sequence[str], course: ChainHistory) -> Check:
    """Whether no two coordinates are strongly correlated in the posterior."""
    points = course.kept.reshape(-1, course.points.shape[-1])
    spread = points.std(axis=0)
    moving = np.flatnonzero(spread > 0.0)
    every = np.abs(np.corrcoef(points[:, moving].T)) - np.eye(len(moving)) if len(moving) > 1 else np.zeros((1, 1))
    a, b = np.unravel_index(int(np.argmax(every)), every.shape)
    value, limit = float(every[a, b]), STRONG_CORRELATION
    pair = tuple(names[moving[k]] for k in (a, b)) if len(moving) else ()
    return _check("posterior_correlation", value < limit, value, limit, pair=pair)


def start_is_near(target: Target, course: ChainHistory, start: np.ndarray) -> Check:
    """Whether the posterior lies at what the fit reports, ``(n_start,)``; of the coordinates beyond it knew nothing."""
    points = course.kept.reshape(-1, target.size)[:, : len(start)]
    centre, covariance = points.mean(axis=0), np.cov(points.T).reshape(len(start), len(start))
    scale = scale_of(covariance)
    difference = (start - centre) / scale
    inverse = np.linalg.pinv(equilibrated(covariance, scale), rcond=1e-10, hermitian=True)
    distance = float(np.sqrt(max(difference @ inverse @ difference, 0.0)))
    limit = float(np.sqrt(len(start)) + FAR_FROM_START)
    worst = target.names[int(np.argmax(np.abs(difference)))]
    return _check("distance_from_fit", distance < limit, distance, limit, worst=worst)


def priors_proper(target: Target) -> Check:
    """Whether every prior is a proper distribution."""
    improper = [n for n, prior in zip(target.names, target.priors, strict=False) if not prior.proper]
    return _check("proper_priors", not improper, float(len(improper)), 0.0, parameters=tuple(improper))


def truncation(found: Mapping[str, Marginal]) -> Check:
    """Whether no posterior is truncated by a bound."""
    truncated = []
    for name, marginal in found.items():
        if marginal.prior is None or marginal.sd == 0.0:
            continue
        gaps = (marginal.ends[0] - marginal.prior.lower, marginal.prior.upper - marginal.ends[1])
        if min(gaps) < TRUNCATED * marginal.sd and marginal.prior_share < SAME_WIDTH:
            truncated.append(name)
    return _check("truncation", not truncated, float(len(truncated)), 0.0, parameters=tuple(truncated))


def residual_size(channels: tuple[str, ...], ratio: np.ndarray) -> Check:
    """Whether the residuals are no larger than the noise at rest.

    Parameters
    ----------
    ratio : (n_channel,)
        Residual RMS over that expected from the noise at rest, or stated by the study, and from that of inputs.
    """
    worst = int(np.argmax(ratio))
    value, limit = float(ratio[worst]), GAP_OF_NOISE
    return _check("residual_size", bool(ratio[worst] <= limit), value, limit, channel=channels[worst])


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
