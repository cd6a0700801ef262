"""A posterior: draws, marginals of each parameter, and checks."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from fibrefit.core.declarations import Statement
from fibrefit.problem import HausmanTest
from fibrefit.sampling.chains import ChainHistory, Target
from fibrefit.sampling.density.likelihood import NoiseModel
from fibrefit.sampling.density.log_posterior import LogPosterior
from fibrefit.sampling.density.prior import Prior, Priors
from fibrefit.sampling.evidence import Evidence, Mode
from fibrefit.sampling.latent import Deviations, DrawnInputs
from fibrefit.sampling.settings import Settings
from fibrefit.sampling.thresholds import SAME_WIDTH
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
