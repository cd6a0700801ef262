"""Meta-analysis of the records of a series: the population of each parameter, and its trends over conditions.

Law
---
Population, by partial pooling: ``y_r = mu + b_r + e_r`` with ``b_r ~ N(0, tau^2)`` between records and ``e_r ~ N(0,
s_r^2)`` the error of each. Nothing is known beforehand of mu; of tau the prior is Jeffreys', ``p(tau)^2 ~ sum tau^2 /
(tau^2 + s_r^2)^2``, which makes intervals hold as often as they say. All that is reported is an average over tau on a
grid: the posterior of mu and of a new record is a mixture of normal distributions, with tails as heavy as those of
Student's. Values that are positive, with small errors, are given by their logarithms, so that tau is a relative
difference.

Trends, by weighted regression of every parameter on every condition: ``y_r = a + b x_r + b_r + e_r`` with ``var = tau^2
+ s_r^2 + b^2 u_r^2``, u the error of the condition; the line is the most probable one by the errors of both (York),
whose slope is not drawn to zero by those of the condition. tau is where the weighted sum of squares equals its degrees
of freedom (Paule and Mandel), and tests are Student's (Hartung, Knapp). A record further from the line than chance
allows among so many records and lines, by the studentised residual it has when it is left out, is named and left out
(Bonferroni); significance is corrected for all looks (Holm).

Source
------
Gelman, Bayesian Data Analysis (2013), ch. 5; Bodnar, Link and Elster, Bayesian Anal. 11 (2016) on the prior;
Viechtbauer, Stat. Med. 26 (2007) on the Q profile. York et al., Am. J. Phys. 72 (2004); Fuller, Measurement Error
Models (1987), section 1.2; Paule and Mandel, J. Res. NBS 87 (1982); Knapp and Hartung, Stat. Med. 22 (2003); Holm,
Scand. J. Stat. 6 (1979).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple

import numpy as np

from fibrefit.series.thresholds import FEWEST_RECORDS, LOGARITHMIC, MOST_OUTLIERS, OUTLIER
from fibrefit.study.summaries.series import OutlierSummary, TrendSummary

BY_ORDER = "order of the records"
"""Condition that counts the records, one after the other."""
CLOSE = 1e-9
"""Relative change of a slope at which it is found."""


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
    from scipy.stats import chi2

    from fibrefit.problem import INSIDE_95, mixture_quantile

    known = np.isfinite(values) & np.isfinite(errors) & (errors > 0.0)
    if known.sum() < 2:
        return None
    size = np.abs(values[known])
    logarithmic = bool(np.all(values[known] > 0.0)) and float(np.median(errors[known] / size)) < LOGARITHMIC
    y, s = (np.log(values[known]), errors[known] / values[known]) if logarithmic else (values[known], errors[known])
    common = common / float(np.median(size)) if logarithmic else common
    back = np.exp if logarithmic else np.asarray

    # The posterior on a grid of tau, even in its logarithm, far beyond the smallest error and the spread of the values.
    tau = np.geomspace(1e-3 * s.min(), 30.0 * max(float(np.ptp(y)), float(s.min())), 200)
    variance = tau[:, None] ** 2 + s**2
    weights = 1.0 / variance
    total = weights.sum(axis=1)
    mu = (weights @ y) / total
    log = -0.5 * (np.log(variance).sum(axis=1) + np.log(total) + np.sum(weights * (y - mu[:, None]) ** 2, axis=1))
    log += 0.5 * np.log(np.sum(weights**2, axis=1)) + 2.0 * np.log(tau)
    weight = np.exp(log - log.max())
    weight /= weight.sum()
    error = 1.0 / np.sqrt(total)
    of_mean = partial(mixture_quantile, weight, mu, np.hypot(error, common))
    of_new = partial(mixture_quantile, weight, mu, np.hypot(np.hypot(error, tau), common))
    sd = float(np.exp(np.interp(0.5, np.cumsum(weight) - 0.5 * weight, np.log(tau))))

    # Each record, drawn to the mean by its share of the variance.
    share = s**2 * weights
    own = share * mu[:, None] + (1.0 - share) * y
    scatter = (1.0 - share) * s**2 + share**2 / total[:, None]
    middle = weight @ own
    around = np.sqrt(weight @ (scatter + (own - middle) ** 2) + common**2)
    shrunk, shrunk_error = np.full(len(values), np.nan), np.full(len(values), np.nan)
    shrunk[known] = back(middle)
    shrunk_error[known] = around * (shrunk[known] if logarithmic else 1.0)

    def cochran(tau: float) -> float:
        weights = 1.0 / (s**2 + tau**2)
        return float(np.sum(weights * (y - np.average(y, weights=weights)) ** 2))

    # The Q profile: with which the values are neither too different nor too alike.
    goals = [float(chi2.ppf(share, len(y) - 1)) for share in INSIDE_95[::-1]]
    highest = 100.0 * max(float(np.ptp(y)), float(s.max()))
    low, high = (_falls_to_zero(lambda tau: cochran(tau) - goal, highest) for goal in goals)  # noqa: B023
    return Population(
        mean=float(back(of_mean(0.5))),
        mean_interval=(float(back(of_mean(INSIDE_95[0]))), float(back(of_mean(INSIDE_95[1])))),
        sd=sd,
        sd_interval=(min(low, sd), max(high, sd)),
        new_record=(float(back(of_new(INSIDE_95[0]))), float(back(of_new(INSIDE_95[1])))),
        shrunk=shrunk,
        shrunk_error=shrunk_error,
        chance=float(chi2.sf(cochran(0.0), len(y) - 1)),
        logarithmic=logarithmic,
    )


def _falls_to_zero(excess: Callable[[float], float], highest: float) -> float:
    """Where a falling function is zero, between 0 and `highest`, by bisection; 0 where it is nowhere above."""
    if excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, highest
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


@dataclass(frozen=True)
class Quantity:
    """A parameter or a condition over the records.

    Parameters
    ----------
    name, unit : str
    values : (n_record,) in `unit`
        NaN where nothing is known.
    errors : (n_record,) in `unit`
        Standard errors, each by itself; zero where it is known exactly.
    common : float in `unit`
        Standard error that all values share.
    """

    name: str
    unit: str
    values: np.ndarray
    errors: np.ndarray
    common: float = 0.0


def trends(names: Sequence[str], pairs: Sequence[tuple[Quantity, Quantity]]) -> tuple[TrendSummary, ...]:
    """Trends of parameters with conditions.

    Parameters
    ----------
    names : sequence of str
        Of the records.
    pairs : sequence of (Quantity, Quantity)
        Parameter and condition, with the records in that order.

    Returns
    -------
    tuple of TrendSummary
        The surest first.
    """
    from statsmodels.stats.multitest import multipletests

    found = [line for y, x in pairs if (line := trend_of(names, y, x, len(pairs))) is not None]
    if not found:
        return ()
    corrected = multipletests([line.chance for line in found], method="holm")[1]
    listed = [
        line.model_copy(update={"chance_corrected": float(chance)})
        for line, chance in zip(found, corrected, strict=True)
    ]
    return tuple(sorted(listed, key=lambda line: line.chance))


def trend_of(names: Sequence[str], y: Quantity, x: Quantity, looks: int = 1) -> TrendSummary | None:
    """One parameter against one condition; None where there is too little to tell, or errors explain the condition.

    Parameters
    ----------
    names : sequence of str
        Of the records.
    y, x : Quantity
        Parameter and condition.
    looks : int
        Lines of the series, in any of which a record may stray by chance.
    """
    from scipy.stats import t
    from statsmodels.regression.linear_model import OLS
    from statsmodels.stats.outliers_influence import OLSInfluence

    seen = np.isfinite(y.values) & np.isfinite(y.errors) & np.isfinite(x.values)
    kept = np.flatnonzero(seen)
    if len(kept) < FEWEST_RECORDS or len(np.unique(x.values[kept])) < 2:
        return None
    outliers: list[OutlierSummary] = []
    while line := _line(x.values[kept], y.values[kept], x.errors[kept], y.errors[kept]):
        fit, freedom = line.fit, int(line.fit.df_resid) - 1
        with np.errstate(all="ignore"):
            # Influence is that of ordinary least squares: it is computed of what weights make of the records.
            inside = np.asarray(OLSInfluence(OLS(fit.model.wendog, fit.model.wexog).fit()).resid_studentized_internal)
            scale = float(fit.scale)
            of_others = np.sqrt(scale * np.maximum(freedom + 1.0 - inside**2, 1e-12) / freedom)
            # Others that by luck scatter less than their known errors make no record stray.
            scores = np.nan_to_num(inside * np.sqrt(scale) / np.maximum(of_others, line.known))
        place = int(np.argmax(np.abs(scores)))
        # Of the distances of all records from all lines so many may be large by chance (Bonferroni).
        chance = min(1.0, looks * seen.sum() * 2.0 * float(t.sf(abs(scores[place]), freedom)))
        enough = len(outliers) >= max(1, int(MOST_OUTLIERS * seen.sum())) or len(kept) <= FEWEST_RECORDS
        if chance >= OUTLIER or enough:
            break
        outliers.append(OutlierSummary(record=names[kept[place]], score=float(scores[place]), chance=chance))
        kept = np.delete(kept, place)
    if line is None or not np.isfinite(line.wider):
        return None

    fit, freedom = line.fit, len(kept) - 2
    # No narrower than the errors that are known make it.
    wide = max(1.0, float(fit.scale)) / max(float(fit.scale), 1e-300)
    level, slope = (float(v) for v in fit.params)
    slope_error = float(fit.bse[1]) * float(np.sqrt(wide * line.wider))
    chance = 2.0 * float(t.sf(abs(slope) / max(slope_error, 1e-300), freedom))
    half = float(t.ppf(0.975, freedom)) * slope_error
    return TrendSummary(
        parameter=y.name,
        condition=x.name,
        unit=y.unit,
        condition_unit=x.unit,
        slope=slope,
        slope_error=slope_error,
        slope_interval_95=(slope - half, slope + half),
        intercept=level - slope * line.middle,
        between_records=line.tau,
        chance=chance,
        chance_corrected=chance,
        records=len(kept),
        outliers=tuple(outliers),
    )


@dataclass(frozen=True)
class _Line:
    """A fitted line: of statsmodels, about the weighted mean of the condition, and the scatter about it.

    `wider` is the variance of the slope over that of the fit; `known` ``(n_record,)`` what errors that are known make
    of a distance, in units of its whole standard deviation.
    """

    fit: Any
    middle: float
    tau: float
    wider: float
    known: np.ndarray


def _line(x: np.ndarray, y: np.ndarray, u: np.ndarray, s: np.ndarray) -> _Line | None:
    from statsmodels.regression.linear_model import WLS

    if np.ptp(x) == 0.0:
        return None

    def excess(tau: float, known: np.ndarray, slope: float | None) -> float:
        """Weighted sum of squares beyond what so many records leave, about the line of a slope or the best one."""
        weights = 1.0 / np.maximum(known + tau**2, 1e-300)
        away = x - np.average(x, weights=weights), y - np.average(y, weights=weights)
        sxx, sxy, syy = (float(weights @ (one * other)) for one, other in ((away[0],) * 2, away, (away[1],) * 2))
        best = sxy / sxx if slope is None else slope
        return syy - 2.0 * best * sxy + best**2 * sxx - (len(x) - 2)

    near, tau = nearest_line(x, y, u, s**2), 0.0
    for _ in range(20):
        if len(x) > 2:
            known, slope = s**2 + (near.slope * u) ** 2, near.slope if u.any() else None
            tau = _falls_to_zero(partial(excess, known=known, slope=slope), float(np.ptp(y)))
        before, near = near, nearest_line(x, y, u, s**2 + tau**2, near.slope)
        if abs(near.slope - before.slope) <= CLOSE * abs(near.slope) or not u.any():
            break
    middle = float(np.average(x, weights=near.weights))
    centred = near.x - np.average(near.x, weights=near.weights)
    # What is left has no part along the places nearest to the records: a regression on these has this slope and error.
    residuals = y - np.average(y, weights=near.weights) - near.slope * (x - middle)
    fitted = np.average(y, weights=near.weights) + near.slope * centred + residuals
    fit = WLS(fitted, np.column_stack([np.ones(len(x)), centred]), weights=near.weights).fit()

    # Records are not exactly at their most probable places, and how much they scatter is found from the same distances
    # as the slope: for equal errors this is Fuller's variance. Where errors of the condition alone explain how it
    # differs, nothing is known of the slope.
    blurred = near.weights * u**2
    seen = float(near.weights @ near.x**2)
    corrected = seen - float(blurred @ (1.0 - blurred * near.slope**2))
    by_scatter = near.slope * float(near.weights @ blurred) / float(near.weights.sum())
    wider = np.inf if corrected <= 0.0 else seen * (seen + 2.0 * len(u) * by_scatter**2) / corrected**2
    known = np.sqrt(near.weights * (s**2 + (near.slope * u) ** 2))
    return _Line(fit, middle, tau, wider, known)


class Nearest(NamedTuple):
    """A line by the errors of both coordinates.

    Parameters
    ----------
    slope : float
    weights : (n_record,)
        Of the distances from the line along y.
    x : (n_record,)
        Where each record most probably is on the line, less the weighted mean of x.
    """

    slope: float
    weights: np.ndarray
    x: np.ndarray


def nearest_line(x: np.ndarray, y: np.ndarray, u: np.ndarray, variance: np.ndarray, slope: float = 0.0) -> Nearest:
    """The most probable line through records that are uncertain in both coordinates.

    Parameters
    ----------
    x, y, u, variance : (n_record,)
        Coordinates, standard errors of `x`, variances of `y`.
    slope : float
        To begin with.

    Source
    ------
    York, Evensen, Lopez Martinez and De Basabe Delgado, Am. J. Phys. 72 (2004) 367, eq. 13.
    """
    variance = np.maximum(variance, 1e-300)
    for _ in range(200):
        weights = 1.0 / (variance + (slope * u) ** 2)
        along, across = (one - np.average(one, weights=weights) for one in (x, y))
        place = weights * (along * variance + slope * across * u**2)
        before, slope = slope, float((weights * place) @ across / ((weights * place) @ along))
        if abs(slope - before) <= CLOSE * abs(slope) or not u.any():
            break
    return Nearest(slope, weights, place)
