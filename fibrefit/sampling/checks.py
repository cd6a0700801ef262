"""Whether a posterior can be believed: convergence, modes, priors and residuals, a sentence each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.check import Check
from fibrefit.problem.thresholds import GAP
from fibrefit.sampling.chains.ensembles import ChainHistory
from fibrefit.sampling.mode.modes import Mode
from fibrefit.sampling.posterior import Marginal
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.target import Target
from fibrefit.sampling.thresholds import (
    FAR,
    HOPELESS_ESS,
    HOPELESS_R_HAT,
    PRIOR_MATTERS,
    SECOND_MODE,
    STRONG,
    STUCK,
    TRUNCATED,
    UNCONTRACTED,
)


def ensembles_agree(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Convergence: R-hat between ensembles."""
    found = course.mixing.r_hat
    worst, value = names[int(np.argmax(found))], float(found.max())
    passed = value < settings.r_hat
    says = (
        f"R-hat between {len(course.points)} ensembles is at most {value:.4f} ({worst}), threshold {settings.r_hat:g}."
        if passed
        else f"R-hat between ensembles is {value:.4g} for {worst}, threshold {settings.r_hat:g}: the chains have not "
        "converged within the budget. Resume with a larger one, or look for several modes."
    )
    fatal = value > HOPELESS_R_HAT
    return Check(
        "the ensembles agree",
        passed,
        says,
        value,
        settings.r_hat,
        fatal=fatal,
        identifier="convergence",
        quantity="convergence (R-hat)",
    )


def draws_suffice(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Effective sample size."""
    found = np.minimum(course.mixing.ess_bulk, course.mixing.ess_tail)
    worst, value = names[int(np.argmin(found))], float(found.min())
    passed = value > settings.ess
    says = f"The bulk/tail effective sample size is {value:.4g} at least ({worst}), threshold {settings.ess:g}" + (
        "." if passed else ": the budget ended before there were enough draws. Resume with a larger one."
    )
    fatal = value < HOPELESS_ESS
    return Check(
        "there are enough draws",
        passed,
        says,
        value,
        settings.ess,
        fatal=fatal,
        identifier="effective_sample_size",
        quantity="effective sample size",
    )


def walkers_mix(names: Sequence[str], course: ChainHistory, settings: Settings) -> Check:
    """Whether every walker explores the whole mode: R-hat between walkers, and acceptance."""
    found = course.mixing.r_hat_walkers
    worst, value = names[int(np.argmax(found))], float(found.max())
    stuck = float(np.mean(course.acceptance < STUCK))
    passed = value < settings.r_hat_walkers and stuck == 0.0
    if stuck:
        says = (
            f"The acceptance of {100 * stuck:.2g} % of the walkers is below {100 * STUCK:g} %: their draws are those "
            "of the start."
        )
    elif passed:
        says = f"R-hat between walkers is {value:.3g} at most, threshold {settings.r_hat_walkers:g}; acceptance OK."
    else:
        says = (
            f"R-hat between walkers is {value:.3g} for {worst}, threshold {settings.r_hat_walkers:g}: there are "
            "several modes, or a strong correlation, and their weights depend on where the walkers started."
        )
    return Check(
        "the walkers mix",
        passed,
        says,
        value,
        settings.r_hat_walkers,
        fatal=not passed,
        identifier="walker_mixing",
        quantity="mixing of the walkers",
    )


def one_mode(modes: Sequence[Mode], target: Target) -> Check:
    """Whether a second mode has a weight worth naming."""
    others = [mode for mode in modes[1:] if not mode.absorbed]
    weight = max((mode.weight for mode in others), default=0.0)
    passed = weight < SECOND_MODE
    if not others:
        says = "No other mode was found."
    elif passed:
        says = f"{len(others)} other mode{'s' * (len(others) > 1)} found, of a weight below {SECOND_MODE:.2g} together."
    else:
        listed = "; ".join(_described(mode, target) for mode in modes if mode.weight >= SECOND_MODE)
        says = (
            f"The posterior is multimodal: {listed}. Values and intervals are those of the first mode alone, "
            "never an average; another record must tell which is right."
        )
    return Check(
        "there is one mode",
        passed,
        says,
        weight,
        SECOND_MODE,
        identifier="second_mode",
        quantity="weight of a second mode",
    )


def _described(mode: Mode, target: Target) -> str:
    centre = target.values(mode.approximation.centre[None])[0]
    named = [f"{n} = {v:.4g} {u}" for n, v, u in zip(target.names, centre, target.units, strict=True)]
    return f"weight {mode.weight:.2g} at {', '.join(named[:3])}{', ...' if len(named) > 3 else ''}"


def contraction(found: Mapping[str, Marginal]) -> Check:
    """Whether the posterior is narrower than the prior."""
    shares = {name: marginal.prior_share for name, marginal in found.items() if np.isfinite(marginal.prior_share)}
    nothing = [name for name, share in shares.items() if share > UNCONTRACTED]
    worst = max(shares.values(), default=0.0)
    says = (
        f"Posterior / prior width of {', '.join(nothing)} exceeds {UNCONTRACTED:g} (largest {worst:.2f}): the data "
        "tell nothing of it, and what is reported is the prior."
        if nothing
        else f"Posterior / prior width is {worst:.2g} at most: prior influence is negligible."
        if worst < PRIOR_MATTERS
        else f"Posterior / prior width is {worst:.2f} at most: the prior of "
        + ", ".join(name for name, share in shares.items() if share >= PRIOR_MATTERS)
        + " matters."
    )
    return Check(
        "every posterior is narrower than its prior",
        not nothing,
        says,
        worst,
        UNCONTRACTED,
        identifier="contraction",
        quantity="posterior width against prior width",
    )


def correlation(names: Sequence[str], course: ChainHistory) -> Check:
    """Whether no two coordinates are strongly correlated in the posterior."""
    points = course.kept.reshape(-1, course.points.shape[-1])
    spread = points.std(axis=0)
    moving = np.flatnonzero(spread > 0.0)
    every = np.abs(np.corrcoef(points[:, moving].T)) - np.eye(len(moving)) if len(moving) > 1 else np.zeros((1, 1))
    a, b = np.unravel_index(int(np.argmax(every)), every.shape)
    value = float(every[a, b])
    passed = value < STRONG
    says = (
        f"The strongest posterior |correlation| is {value:.2f}, threshold {STRONG:g}."
        if passed
        else f"The posterior |correlation| of {names[moving[a]]} and {names[moving[b]]} is {value:.4f}, threshold "
        f"{STRONG:g}: only a combination of them is determined, and the interval of either alone says little."
    )
    return Check(
        "no strong posterior correlation",
        passed,
        says,
        value,
        STRONG,
        identifier="posterior_correlation",
        quantity="strongest posterior correlation",
    )


def start_is_near(target: Target, course: ChainHistory, start: np.ndarray) -> Check:
    """Whether the posterior lies where the fit was."""
    points = course.kept.reshape(-1, target.size)
    centre, covariance = points.mean(axis=0), np.cov(points.T).reshape(target.size, target.size)
    scale = np.sqrt(np.diag(covariance))
    safe = np.where(scale > 0.0, scale, 1.0)
    difference = (start - centre) / safe
    inverse = np.linalg.pinv(covariance / np.outer(safe, safe), rcond=1e-10, hermitian=True)
    distance = float(np.sqrt(max(difference @ inverse @ difference, 0.0)))
    limit = float(np.sqrt(target.size) + FAR)
    passed = distance < limit
    worst = target.names[int(np.argmax(np.abs(difference)))]
    says = (
        f"The posterior mean is {distance:.3g} standard deviations from the fit, threshold {limit:.3g}."
        if passed
        else f"The posterior mean is {distance:.3g} standard deviations from the start, threshold {limit:.3g} (most of "
        f"it in {worst}): the start was not the best fit, or OLS and GLS estimates differ."
    )
    return Check(
        "the posterior lies at the fit",
        passed,
        says,
        distance,
        limit,
        identifier="distance_from_fit",
        quantity="distance of the posterior from the fit",
    )


def priors_proper(target: Target) -> Check:
    """Whether every prior is a proper distribution."""
    improper = [n for n, prior in zip(target.names, target.priors, strict=False) if not prior.proper]
    says = (
        f"The prior of {', '.join(improper)} is improper (unbounded). The posterior is proper only because the data "
        "bound it, and there is no marginal likelihood to compare models by."
        if improper
        else "Every prior is proper."
    )
    return Check(
        "every prior is proper",
        not improper,
        says,
        float(len(improper)),
        0.0,
        identifier="proper_priors",
        quantity="propriety of the priors",
    )


def truncation(found: Mapping[str, Marginal]) -> Check:
    """Whether no posterior is truncated by a bound."""
    truncated = []
    for name, marginal in found.items():
        if marginal.prior is None or marginal.sd == 0.0:
            continue
        gaps = (marginal.interval[0] - marginal.prior.lower, marginal.prior.upper - marginal.interval[1])
        if min(gaps) < TRUNCATED * marginal.sd and marginal.prior_share < UNCONTRACTED:
            truncated.append(name)
    says = (
        f"The posterior of {', '.join(truncated)} is truncated by a bound: read its interval as one-sided."
        if truncated
        else "No posterior is truncated by a bound."
    )
    return Check(
        "no posterior is truncated by a bound",
        not truncated,
        says,
        float(len(truncated)),
        0.0,
        identifier="truncation",
        quantity="posteriors truncated by a bound",
    )


def residual_size(channels: tuple[str, ...], ratio: np.ndarray) -> Check:
    """Whether the residuals are no larger than the noise at rest.

    Parameters
    ----------
    channels : tuple of str
    ratio : (n_channel,)
        Residual RMS over that expected from the noise at rest, or stated by the study, and from that of inputs.
    """
    worst = int(np.argmax(ratio))
    passed = bool(ratio[worst] <= GAP)
    says = (
        f"No channel exceeds its noise level: largest normalised residual RMS {ratio[worst]:.3g}, threshold {GAP:g}."
        if passed
        else f"The normalised residual RMS of {channels[worst]} is {ratio[worst]:.3g}, expected 1: what the model "
        "lacks is counted as noise, and the intervals are those of a wrong model. Run discover."
    )
    return Check(
        "the residuals are noise",
        passed,
        says,
        float(ratio[worst]),
        GAP,
        identifier="residual_size",
        quantity="residual size",
    )


def assess(
    target: Target, modes: Sequence[Mode], found: Mapping[str, Marginal], start: np.ndarray, settings: Settings
) -> tuple[Check, ...]:
    """All checks that need nothing but the draws.

    Parameters
    ----------
    target : Target
    modes : sequence of Mode
        The heaviest first, and sampled.
    found : mapping of str to Marginal
        Of the heaviest mode.
    start : (n,)
        Where the fit was, in coordinates.
    settings : Settings
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
