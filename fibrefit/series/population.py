"""Partial pooling: what records of one kind have in common, how much they differ, and what a new one would show.

Law
---
``y_r = mu + b_r + e_r`` with ``b_r ~ N(0, tau^2)`` between records and ``e_r ~ N(0, s_r^2)`` the error of each. Nothing
is known beforehand of mu; of tau the prior is Jeffreys', ``p(tau)^2 ~ sum tau^2 / (tau^2 + s_r^2)^2``, which makes
intervals hold as often as they say. All that is reported is an average over tau on a grid: the posterior of mu and of a
new record is a mixture of normal distributions, with tails as heavy as those of Student's. Values that are positive,
with small errors, are given by their logarithms, so that tau is a relative difference.

Source
------
Gelman, Bayesian Data Analysis (2013), ch. 5; Bodnar, Link and Elster, Bayesian Anal. 11 (2016) on this prior;
Viechtbauer, Stat. Med. 26 (2007) on the Q profile.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fibrefit.problem.estimate.evidence import INSIDE_95, mixture_quantile
from fibrefit.series.thresholds import LOGARITHMIC

POINTS = 200
LOWEST, HIGHEST = 1e-3, 30.0
"""Ends of the grid of tau, in units of the smallest error and of the spread of the values."""
FARTHEST, HALVINGS = 100.0, 60


@dataclass(frozen=True)
class Population:
    """One parameter of a series of records, in SI units.

    Parameters
    ----------
    mean : float
    mean_interval : (float, float)
        Of 95 %.
    sd : float
        Between records, median of what is believed of it: relative where `logarithmic`.
    sd_interval : (float, float)
        Of 95 %, by the Q profile; where `sd`, which has a law of its own, lies beyond an end, it is that end.
    new_record : (float, float)
        Interval of 95 % of the true value of one more record.
    shrunk, shrunk_error : (n_record,)
        Value of each record, drawn to the mean by as much as it is uncertain; and its standard deviation.
    chance : float
        Probability of values as different as these if records did not differ (Cochran's Q).
    logarithmic : bool
    """

    mean: float
    mean_interval: tuple[float, float]
    sd: float
    sd_interval: tuple[float, float]
    new_record: tuple[float, float]
    shrunk: np.ndarray
    shrunk_error: np.ndarray
    chance: float
    logarithmic: bool


def population(values: np.ndarray, errors: np.ndarray, common: float = 0.0) -> Population | None:
    """Pool one parameter over records; None where fewer than two records tell of it.

    Parameters
    ----------
    values, errors : (n_record,) in SI units
        Of each record by itself; those that are not finite say nothing.
    common : float in SI units
        Standard error that all values share: of what is taken from elsewhere, such as a scale. More records leave it.
    """
    said = np.isfinite(values) & np.isfinite(errors) & (errors > 0.0)
    if said.sum() < 2:
        return None
    positive = bool(np.all(values[said] > 0.0))
    logarithmic = positive and float(np.median(errors[said] / np.abs(values[said]))) < LOGARITHMIC
    y, s = (np.log(values[said]), errors[said] / values[said]) if logarithmic else (values[said], errors[said])
    found = _pooled(y, s, common / float(np.median(np.abs(values[said]))) if logarithmic else common)
    sd, ends = found.level(0.5), _profile(y, s)
    tell = np.exp if logarithmic else np.asarray
    shrunk, around = np.full(len(values), np.nan), np.full(len(values), np.nan)
    shrunk[said] = tell(found.shrunk)
    around[said] = found.around * (shrunk[said] if logarithmic else 1.0)
    return Population(
        mean=float(tell(found.of_mean(0.5))),
        mean_interval=_pair(tell, found.of_mean),
        sd=sd,
        sd_interval=(min(ends[0], sd), max(ends[1], sd)),
        new_record=_pair(tell, found.of_new),
        shrunk=shrunk,
        shrunk_error=around,
        chance=_chance(y, s),
        logarithmic=logarithmic,
    )


@dataclass(frozen=True)
class _Pooled:
    """Posterior on the grid: tau, weights, mean of mu and its error, each ``(n_grid,)``; and the error all share."""

    tau: np.ndarray
    weight: np.ndarray
    mu: np.ndarray
    error: np.ndarray
    shrunk: np.ndarray
    around: np.ndarray
    common: float

    def of_mean(self, share: float) -> float:
        return mixture_quantile(self.weight, self.mu, np.hypot(self.error, self.common), share)

    def of_new(self, share: float) -> float:
        around = np.hypot(np.hypot(self.error, self.tau), self.common)
        return mixture_quantile(self.weight, self.mu, around, share)

    def level(self, share: float) -> float:
        cumulated = np.cumsum(self.weight) - 0.5 * self.weight
        return float(np.exp(np.interp(share, cumulated, np.log(self.tau))))


def _pooled(y: np.ndarray, s: np.ndarray, common: float) -> _Pooled:
    spread = max(float(np.ptp(y)), float(s.min()))
    tau = np.geomspace(LOWEST * s.min(), HIGHEST * spread, POINTS)
    variance = tau[:, None] ** 2 + s**2
    weights = 1.0 / variance
    total = weights.sum(axis=1)
    mu = (weights @ y) / total
    log = -0.5 * (np.log(variance).sum(axis=1) + np.log(total) + np.sum(weights * (y - mu[:, None]) ** 2, axis=1))
    # Points lie evenly in the logarithm of tau.
    log += 0.5 * np.log(np.sum(weights**2, axis=1)) + 2.0 * np.log(tau)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    share = s**2 * weights
    own = share * mu[:, None] + (1.0 - share) * y
    scatter = (1.0 - share) * s**2 + share**2 / total[:, None]
    shrunk = weight @ own
    around = np.sqrt(weight @ (scatter + (own - shrunk) ** 2) + common**2)
    return _Pooled(tau, weight, mu, 1.0 / np.sqrt(total), shrunk, around, common)


def _pair(tell: object, quantile: object) -> tuple[float, float]:
    low, high = (float(tell(quantile(share))) for share in INSIDE_95)  # type: ignore[operator]
    return low, high


def _profile(y: np.ndarray, s: np.ndarray) -> tuple[float, float]:
    """Standard deviations between records with which the values are neither too different nor too alike."""
    from scipy.stats import chi2

    ends = [_where_q_is(y, s, float(chi2.ppf(share, len(y) - 1))) for share in INSIDE_95[::-1]]
    return ends[0], ends[1]


def _where_q_is(y: np.ndarray, s: np.ndarray, goal: float) -> float:
    """Standard deviation between records with which Cochran's Q is `goal`; zero where it is less anyway."""
    low, high = 0.0, FARTHEST * max(float(np.ptp(y)), float(s.max()))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if _q(y, s, middle) > goal else (low, middle)
    return 0.0 if _q(y, s, 0.0) <= goal else 0.5 * (low + high)


def _q(y: np.ndarray, s: np.ndarray, tau: float) -> float:
    weights = 1.0 / (s**2 + tau**2)
    return float(np.sum(weights * (y - np.average(y, weights=weights)) ** 2))


def _chance(y: np.ndarray, s: np.ndarray) -> float:
    from scipy.stats import chi2

    return float(chi2.sf(_q(y, s, 0.0), len(y) - 1))
