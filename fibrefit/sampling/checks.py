"""Whether a posterior is to be believed: a table of checks, each with a sentence."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core.check import Check
from fibrefit.sampling.chains.ensembles import Course
from fibrefit.sampling.mode.modes import Mode
from fibrefit.sampling.posterior import Marginal
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.target import Target

HOPELESS_R_HAT = 1.1
HOPELESS_ESS = 50.0
STUCK = 0.02
"""Acceptance below which a walker counts as stuck."""
SECOND_MODE = 0.01
"""Weight from which a second mode must not be passed over."""
UNTAUGHT = 0.8
"""Share of the prior's width left, from which the data have taught nothing worth the name."""
RIDGE = 0.995
FAR = 4.0
"""Distance of the start from the posterior, beyond what its dimension explains, in standard deviations."""
LOUD = 1.1
"""Noise in the residuals over the noise at rest that still passes."""
PILED = 0.1
"""Distance of a lower or upper 2.5 % point from a limit, in standard deviations, at which draws pile up there."""


def ensembles_agree(names: Sequence[str], course: Course, settings: Settings) -> Check:
    """R-hat between ensembles."""
    found = course.mixing.r_hat
    worst, value = names[int(np.argmax(found))], float(found.max())
    passed = value < settings.r_hat
    says = (
        f"{len(course.points)} independent ensembles agree (largest R-hat {value:.4f}, {worst})."
        if passed
        else f"The ensembles do not agree on {worst} (R-hat {value:.4g}): the budget ended before they did. "
        "Resume with a larger one, or look for several modes."
    )
    return Check("the ensembles agree", passed, says, value, settings.r_hat, fatal=value > HOPELESS_R_HAT)


def draws_suffice(names: Sequence[str], course: Course, settings: Settings) -> Check:
    """Effective number of draws."""
    found = np.minimum(course.mixing.ess_bulk, course.mixing.ess_tail)
    worst, value = names[int(np.argmin(found))], float(found.min())
    passed = value > settings.ess
    says = f"The draws are worth {value:.4g} independent ones or more ({worst})." + (
        "" if passed else " The budget ended before there were enough: resume with a larger one."
    )
    return Check("there are enough draws", passed, says, value, settings.ess, fatal=value < HOPELESS_ESS)


def walkers_mix(names: Sequence[str], course: Course, settings: Settings) -> Check:
    """Whether each walker goes where the others go."""
    found = course.mixing.r_hat_walkers
    worst, value = names[int(np.argmax(found))], float(found.max())
    stuck = float(np.mean(course.acceptance < STUCK))
    passed = value < settings.r_hat_walkers and stuck == 0.0
    if stuck:
        says = f"{100 * stuck:.2g} % of the walkers hardly move: their draws are those of the start."
    elif passed:
        says = "Every walker goes where the others go."
    else:
        says = (
            f"Walkers keep to different values of {worst} (R-hat between walkers {value:.3g}): there are several "
            "modes, or a long ridge, and their shares depend on where the walkers began."
        )
    return Check("the walkers mix", passed, says, value, settings.r_hat_walkers, fatal=not passed)


def one_mode(modes: Sequence[Mode], target: Target) -> Check:
    """Whether a second mode has a weight worth naming."""
    others = [mode for mode in modes[1:] if not mode.left]
    weight = max((mode.weight for mode in others), default=0.0)
    passed = weight < SECOND_MODE
    if not others:
        says = "No other mode was found."
    elif passed:
        says = f"{len(others)} other mode{'s' * (len(others) > 1)} found, of a weight below {SECOND_MODE:.2g} together."
    else:
        listed = "; ".join(_described(mode, target) for mode in modes if mode.weight >= SECOND_MODE)
        says = (
            f"There are several modes: {listed}. Values and intervals are those of the first alone, "
            "never an average; another record must tell which is right."
        )
    return Check("there is one mode", passed, says, weight, SECOND_MODE)


def _described(mode: Mode, target: Target) -> str:
    centre = target.values(mode.approximation.centre[None])[0]
    told = [f"{n} = {v:.4g} {u}" for n, v, u in zip(target.names, centre, target.units, strict=True)]
    return f"weight {mode.weight:.2g} at {', '.join(told[:3])}{', ...' if len(told) > 3 else ''}"


def data_taught(found: Mapping[str, Marginal]) -> Check:
    """Whether the posterior is more than the prior."""
    shares = {name: marginal.prior_share for name, marginal in found.items() if np.isfinite(marginal.prior_share)}
    nothing = [name for name, share in shares.items() if share > UNTAUGHT]
    worst = max(shares.values(), default=0.0)
    says = (
        f"The data taught us nothing about {', '.join(nothing)}: what is reported is the prior."
        if nothing
        else "Every parameter is known far better than its prior says."
        if worst < 0.3
        else "The data taught something about every parameter, but the prior of "
        + ", ".join(name for name, share in shares.items() if share >= 0.3)
        + " matters."
    )
    return Check("the data taught every parameter", not nothing, says, worst, UNTAUGHT)


def no_ridge(names: Sequence[str], course: Course) -> Check:
    """Whether two coordinates are known one by one."""
    points = course.kept.reshape(-1, course.points.shape[-1])
    spread = points.std(axis=0)
    moving = np.flatnonzero(spread > 0.0)
    correlation = (
        np.abs(np.corrcoef(points[:, moving].T)) - np.eye(len(moving)) if len(moving) > 1 else np.zeros((1, 1))
    )
    a, b = np.unravel_index(int(np.argmax(correlation)), correlation.shape)
    value = float(correlation[a, b])
    passed = value < RIDGE
    says = (
        "No two parameters stand for one another."
        if passed
        else f"Only a combination of {names[moving[a]]} and {names[moving[b]]} is determined "
        f"(correlation {value:.4f}); the interval of either alone says little."
    )
    return Check("parameters are told apart", passed, says, value, RIDGE)


def start_is_near(target: Target, course: Course, start: np.ndarray) -> Check:
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
        "The posterior lies where the fit did."
        if passed
        else f"The posterior lies {distance:.3g} standard deviations from the start (most of it in {worst}): the start "
        "was not the best fit, or plain and whitened residuals want different values."
    )
    return Check("the posterior lies at the fit", passed, says, distance, limit)


def priors_proper(target: Target) -> Check:
    """Whether every prior is a distribution."""
    improper = [n for n, prior in zip(target.names, target.priors, strict=False) if not prior.proper]
    says = (
        f"The prior of {', '.join(improper)} is not a distribution: it has no end. The posterior is one only because "
        "the data limit it, and there is no marginal likelihood to compare models by."
        if improper
        else "Every prior is a distribution."
    )
    return Check("every prior is proper", not improper, says, float(len(improper)), 0.0)


def inside_limits(found: Mapping[str, Marginal]) -> Check:
    """Whether draws pile up at a limit."""
    piled = []
    for name, marginal in found.items():
        if marginal.prior is None or marginal.sd == 0.0:
            continue
        gaps = (marginal.interval[0] - marginal.prior.lower, marginal.prior.upper - marginal.interval[1])
        if min(gaps) < PILED * marginal.sd and marginal.prior_share < UNTAUGHT:
            piled.append(name)
    says = (
        f"The posterior of {', '.join(piled)} leans against a limit: read it as one-sided."
        if piled
        else "No posterior leans against a limit."
    )
    return Check("no posterior leans against a limit", not piled, says, float(len(piled)), 0.0)


def loudness(channels: tuple[str, ...], ratio: np.ndarray) -> Check:
    """Whether the residuals are as quiet as the records at rest.

    Parameters
    ----------
    channels : tuple of str
    ratio : (n_channel,)
        Rms of the residuals over what the noise at rest, or stated by the study, and that of inputs account for.
    """
    worst = int(np.argmax(ratio))
    passed = bool(ratio[worst] <= LOUD)
    says = (
        "The residuals are as quiet as the records at rest."
        if passed
        else f"The residuals of {channels[worst]} are {ratio[worst]:.3g} times as loud as the record at rest: what the "
        "model lacks is counted as noise, and the intervals are those of a model that is wrong. Run discover."
    )
    return Check("the residuals are noise", passed, says, float(ratio[worst]), LOUD)


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
        data_taught(found),
        no_ridge(target.names, course),
        inside_limits(found),
        priors_proper(target),
    )
