"""A posterior: draws, marginals of each parameter, and whether it can be believed: modes, priors, residuals."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fibrefit.core.declarations import Statement
from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.problem import GAP_OF_NOISE, HausmanTest
from fibrefit.sampling.chains import ChainHistory, Target
from fibrefit.sampling.density.likelihood import NoiseModel
from fibrefit.sampling.density.log_posterior import LogPosterior
from fibrefit.sampling.density.prior import Prior, Priors
from fibrefit.sampling.evidence import Evidence, Mode
from fibrefit.sampling.latent import Deviations, DrawnInputs
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
from fibrefit.study.summaries.results import BetweenRecordsSummary, ChannelGap

INTERVAL_KIND = "equal_tailed"


@dataclass(frozen=True)
class Marginal:
    """The posterior of one value; SI units.

    Parameters
    ----------
    interval : tuple of float
        Equal-tailed, of the probability asked for.
    ends : tuple of float
        2.5 and 97.5 % points, whatever interval was asked for.
    prior_share : float
        Posterior over prior width, 0 to 1: one where the data tell nothing; NaN without a proper prior.
    """

    name: str
    unit: str
    mean: float
    sd: float
    median: float
    interval: tuple[float, float]
    ends: tuple[float, float]
    r_hat: float
    ess_bulk: float
    ess_tail: float
    prior: Prior | None
    prior_share: float


def marginals(target: Target, course: ChainHistory, probability: float) -> dict[str, Marginal]:
    """Marginals of all values, by name.

    Parameters
    ----------
    probability : float
        Of the intervals.
    """
    draws = target.values(course.kept.reshape(-1, target.size))
    tail = 0.5 * (1.0 - probability)
    low, first, median, last, high = np.quantile(draws, [tail, 0.025, 0.5, 0.975, 1.0 - tail], axis=0)
    found = {}
    for i, name in enumerate(target.names):
        prior = target.priors[i] if target.priors else None
        found[name] = Marginal(
            name=name,
            unit=target.units[i],
            mean=float(draws[:, i].mean()),
            sd=float(draws[:, i].std(ddof=1)),
            median=float(median[i]),
            interval=(float(low[i]), float(high[i])),
            ends=(float(first[i]), float(last[i])),
            r_hat=float(course.mixing.r_hat[i]),
            ess_bulk=float(course.mixing.ess_bulk[i]),
            ess_tail=float(course.mixing.ess_tail[i]),
            prior=prior,
            # On the scale on which the prior is uniform, of a width of one over the root of 12.
            prior_share=np.nan if prior is None else float(min(np.sqrt(12.0) * np.std(prior.cdf(draws[:, i])), 1.0)),
        )
    return found


@dataclass(frozen=True, kw_only=True)
class PosteriorSetup:
    """All that is known before the first draw: noise, mode, how records differ, errors of inputs.

    Parameters
    ----------
    ratio : (n_channel,)
        RMS residual at the mode, errors of inputs taken off, over that of noise.
    values : (n_free,) in SI units
        Where the walkers begin.
    deviations : Deviations or None
        None where no mode is reached.
    inputs : DrawnInputs or None
        Errors of measured inputs, which belong to each record; None where inputs are exact.
    alike : bool
        Whether records are taken for alike that might differ.
    moving : float
        Standard deviations by which errors of inputs still moved when readings were last linearised in them; 0 where
        they had come to rest.
    """

    ratio: np.ndarray
    noise_model: NoiseModel
    priors: Priors
    density: LogPosterior
    target: Target
    values: np.ndarray
    hausman: HausmanTest
    deviations: Deviations | None = None
    inputs: DrawnInputs | None = None
    alike: bool = False
    moving: float = 0.0


@dataclass(frozen=True, kw_only=True)
class Posterior(PosteriorSetup):
    """The joint posterior of a problem's free values and its noise: the setup, and the draws.

    Parameters
    ----------
    modes : tuple of Mode
        The heaviest first: its draws are the posterior's. The others are reported with their weights.
    marginals : dict of str to Marginal
        Of the heaviest mode; noise included.
    start : (n_free,) in SI units
        The fit it began with.
    channel_units : mapping of channel to str
    between : mapping of name to BetweenRecordsSummary
        How much records differ; empty where that was not sought.
    gap : mapping of channel to ChannelGap
        RMS residual of each channel at the mode, and its noise.
    """

    modes: tuple[Mode, ...]
    marginals: Mapping[str, Marginal]
    checks: tuple[Check, ...]
    start: np.ndarray
    settings: Settings
    channel_units: Mapping[str, str]
    seconds: float
    between: Mapping[str, BetweenRecordsSummary] = field(default_factory=dict)
    gap: Mapping[str, ChannelGap] = field(default_factory=dict)

    @property
    def course(self) -> ChainHistory:
        """The draws' course."""
        course = self.modes[0].course
        assert course is not None
        return course

    @property
    def points(self) -> np.ndarray:
        """Draws in coordinates without limits, ``(n_ensemble, n_draw, n)``; the walkers of each step side by side."""
        kept = self.course.kept
        return kept.reshape(len(kept), -1, kept.shape[-1])

    @property
    def draws(self) -> np.ndarray:
        """Draws in SI units, ``(n_ensemble, n_draw, n)``."""
        points = self.points
        return self.target.values(points.reshape(-1, self.target.size)).reshape(points.shape)

    @property
    def remarks(self) -> tuple[Statement, ...]:
        """What a reader should know besides the checks."""
        found = [Statement("records_alike")] if self.alike else []
        if self.moving:
            found.append(Statement("inputs_moving", {"moving": self.moving}))
        # Where the noise spectrum makes much of a difference: GLS against OLS standard errors.
        shared = [i for i, (_, record) in enumerate(self.density.problem.layout.entries) if record is None]
        gains = [(float(self.hausman.efficiency[i]), self.target.names[i]) for i in shared]
        gains = sorted(gain for gain in gains if 0.0 < gain[0] < SAME_WIDTH)
        return (*found, *([Statement("gls_gains", {"factors": tuple(gains)})] if gains else []))

    @property
    def log_evidence(self) -> Evidence | None:
        """Logarithm of the marginal likelihood, None where a prior is not proper or draws are too few."""
        if not all(prior.proper for prior in self.target.priors):
            return None
        found = [mode for mode in self.modes if mode.course is not None and not mode.absorbed]
        logs = np.array([mode.evidence.log_value for mode in found])
        weights = np.array([mode.weight for mode in found])
        total = float(logs.max() + np.log(np.sum(np.exp(logs - logs.max()))))
        error = float(np.sqrt(np.sum((weights * [mode.evidence.error for mode in found]) ** 2)))
        return Evidence(total, error) if np.isfinite(error) else None

    @property
    def status(self) -> str:
        """``ok``, ``suspect`` or ``failed``."""
        return status(self.checks)

    def thinned(self, count: int, seed: int = 0) -> np.ndarray:
        """Points ``(count, n)`` of the ensembles, chosen at random."""
        points = self.course.kept.reshape(-1, self.target.size)
        return points[np.random.default_rng(seed).choice(len(points), count, replace=len(points) < count)]


def status(checks: tuple[Check, ...]) -> str:
    """``failed`` where a fatal check did, ``suspect`` where any did, else ``ok``."""
    failed = [check for check in checks if not check.passed]
    if any(check.fatal for check in failed):
        return "failed"
    return "suspect" if failed else "ok"


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
