"""Every parameter against every condition: weighted regression, the scatter between records a variance of its own.

Law
---
``y_r = a + b x_r + b_r + e_r`` with ``var = tau^2 + s_r^2 + b^2 u_r^2``, u the error of the condition; the line is the
most probable one by the errors of both (York), whose slope is not drawn to nil by those of the condition. tau is where
the weighted sum of squares equals its degrees of freedom (Paule and Mandel), and tests are Student's (Hartung, Knapp).
A record further from the line than chance allows among so many records and lines, by the studentised residual it has
when it is left out, is named and left out (Bonferroni); significance is corrected for all looks (Holm).

Source
------
York et al., Am. J. Phys. 72 (2004); Fuller, Measurement Error Models (1987), section 1.2; Paule and Mandel, J. Res. NBS
87 (1982); Knapp and Hartung, Stat. Med. 22 (2003); Holm, Scand. J. Stat. 6 (1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from fibrefit.series.thresholds import FEWEST_RECORDS, MOST_OUTLIERS, OUTLIER, SIGNIFICANT

BY_ORDER = "order of the records"
"""Condition that counts the records, one after the other."""

ROUNDS, HALVINGS, MOST_STEPS = 20, 60, 200
CLOSE = 1e-9
"""Relative change of a slope at which it is found."""


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


@dataclass(frozen=True)
class Outlier:
    """A record that does not follow a line.

    Parameters
    ----------
    record : str
    score : float
        Distance from the line of the others, in standard deviations.
    chance : float
        Probability of one as far in any line of a series of this length.
    """

    record: str
    score: float
    chance: float


@dataclass(frozen=True)
class Trend:
    """A parameter against a condition.

    Parameters
    ----------
    parameter, condition : str
    unit, condition_unit : str
    slope, slope_error : float
        In `unit` per `condition_unit`.
    slope_interval_95 : (float, float)
    intercept : float
    middle : float
        Weighted mean of the condition, about which errors of slope and level are independent.
    level : float
        Parameter there.
    between_records : float
        Standard deviation between records about the line, in `unit`.
    chance, chance_corrected : float
        Probability of a slope as steep without a trend; the same among all looks.
    records : int
    outliers : tuple of Outlier
    """

    parameter: str
    condition: str
    unit: str
    condition_unit: str
    slope: float
    slope_error: float
    slope_interval_95: tuple[float, float]
    intercept: float
    middle: float
    level: float
    between_records: float
    chance: float
    chance_corrected: float
    records: int
    outliers: tuple[Outlier, ...] = ()

    @property
    def found(self) -> bool:
        """Whether it is more than chance among all looks."""
        return self.chance_corrected < SIGNIFICANT


def trends(names: Sequence[str], pairs: Sequence[tuple[Quantity, Quantity]]) -> tuple[Trend, ...]:
    """Trends of parameters with conditions.

    Parameters
    ----------
    names : sequence of str
        Of the records.
    pairs : sequence of (Quantity, Quantity)
        Parameter and condition, with the records in that order.

    Returns
    -------
    tuple of Trend
        The surest first.
    """
    from statsmodels.stats.multitest import multipletests

    found = [line for y, x in pairs if (line := trend_of(names, y, x, len(pairs))) is not None]
    if not found:
        return ()
    corrected = multipletests([line.chance for line in found], method="holm")[1]
    listed = [replace(line, chance_corrected=float(chance)) for line, chance in zip(found, corrected, strict=True)]
    return tuple(sorted(listed, key=lambda line: line.chance))


def trend_of(names: Sequence[str], y: Quantity, x: Quantity, looks: int = 1) -> Trend | None:
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
    seen = np.isfinite(y.values) & np.isfinite(y.errors) & np.isfinite(x.values)
    kept = np.flatnonzero(seen)
    if len(kept) < FEWEST_RECORDS or len(np.unique(x.values[kept])) < 2:
        return None
    outliers: list[Outlier] = []
    while True:
        line = _line(x.values[kept], y.values[kept], x.errors[kept], y.errors[kept])
        outlier = None if line is None else _outlier(line, looks * seen.sum())
        if outlier is None or len(outliers) >= max(1, int(MOST_OUTLIERS * seen.sum())) or len(kept) <= FEWEST_RECORDS:
            break
        place, score, chance = outlier
        outliers.append(Outlier(names[kept[place]], score, chance))
        kept = np.delete(kept, place)
    return None if line is None or not np.isfinite(line.wider) else _fitted(line, y, x, len(kept), tuple(outliers))


@dataclass(frozen=True)
class _Line:
    """A fitted line: of statsmodels, about the weighted mean of the condition, and the scatter about it.

    `known` ``(n_record,)``: what errors that are known make of a distance, in units of its whole standard deviation.
    """

    fit: object
    middle: float
    tau: float
    wider: float
    known: np.ndarray


def _line(x: np.ndarray, y: np.ndarray, u: np.ndarray, s: np.ndarray) -> _Line | None:
    if np.ptp(x) == 0.0:
        return None
    near = nearest_line(x, y, u, s**2)
    for _ in range(ROUNDS):
        tau = _between(x, y, s**2 + (near.slope * u) ** 2, near.slope if u.any() else None)
        before, near = near, nearest_line(x, y, u, s**2 + tau**2, near.slope)
        if abs(near.slope - before.slope) <= CLOSE * abs(near.slope) or not u.any():
            break
    middle = float(np.average(x, weights=near.weights))
    centred = near.x - np.average(near.x, weights=near.weights)
    # What is left has no part along the places nearest to the records: a regression on these has this slope and error.
    left = y - np.average(y, weights=near.weights) - near.slope * (x - middle)
    fitted = np.average(y, weights=near.weights) + near.slope * centred + left
    known = np.sqrt(near.weights * (s**2 + (near.slope * u) ** 2))
    return _Line(_regression(centred, fitted, near.weights), middle, tau, _wider(near, u), known)


def _wider(near: Nearest, u: np.ndarray) -> float:
    """Variance of the slope over that of a regression on where records most probably are.

    They are not exactly there, and how much records scatter is found from the same distances as the slope: for equal
    errors this is Fuller's variance. Infinite where errors of the condition alone explain how it differs: nothing is
    known of the slope then.
    """
    blurred = near.weights * u**2
    seen = float(near.weights @ near.x**2)
    corrected = seen - float(blurred @ (1.0 - blurred * near.slope**2))
    if corrected <= 0.0:
        return np.inf
    by_scatter = near.slope * float(near.weights @ blurred) / float(near.weights.sum())
    return seen * (seen + 2.0 * len(u) * by_scatter**2) / corrected**2


def _regression(x: np.ndarray, y: np.ndarray, weights: np.ndarray) -> object:
    from statsmodels.regression.linear_model import WLS

    return WLS(y, np.column_stack([np.ones(len(x)), x]), weights=weights).fit()


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
    for _ in range(MOST_STEPS):
        weights = 1.0 / (variance + (slope * u) ** 2)
        along, across = (one - np.average(one, weights=weights) for one in (x, y))
        place = weights * (along * variance + slope * across * u**2)
        before, slope = slope, float((weights * place) @ across / ((weights * place) @ along))
        if abs(slope - before) <= CLOSE * abs(slope) or not u.any():
            break
    return Nearest(slope, weights, place)


def _between(x: np.ndarray, y: np.ndarray, known: np.ndarray, slope: float | None) -> float:
    """Scatter about the line at which the weighted sum of squares is what so many records leave.

    The line of a given slope, or the best one there is.
    """
    freedom = len(x) - 2

    def excess(tau: float) -> float:
        weights = 1.0 / np.maximum(known + tau**2, 1e-300)
        away = x - np.average(x, weights=weights), y - np.average(y, weights=weights)
        sxx, sxy, syy = (float(weights @ (one * other)) for one, other in ((away[0],) * 2, away, (away[1],) * 2))
        best = sxy / sxx if slope is None else slope
        return syy - 2.0 * best * sxy + best**2 * sxx - freedom

    if freedom < 1 or excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, float(np.ptp(y))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _outlier(line: _Line, number: int) -> tuple[int, float, float] | None:
    """The record that is furthest from the line of the others, where that is more than chance.

    Parameters
    ----------
    line : _Line
    number : int
        Distances that may be large by chance: those of all records from all lines.
    """
    from scipy.stats import t
    from statsmodels.regression.linear_model import OLS
    from statsmodels.stats.outliers_influence import OLSInfluence

    freedom = int(line.fit.df_resid) - 1  # type: ignore[attr-defined]
    if freedom < 1:
        return None
    with np.errstate(all="ignore"):
        # Influence is that of ordinary least squares: it is computed of what weights make of the records.
        weighted = line.fit.model  # type: ignore[attr-defined]
        inside = np.asarray(OLSInfluence(OLS(weighted.wendog, weighted.wexog).fit()).resid_studentized_internal)
        scale = float(line.fit.scale)  # type: ignore[attr-defined]
        of_others = np.sqrt(scale * np.maximum(freedom + 1.0 - inside**2, 1e-12) / freedom)
        # Others that by luck scatter less than their known errors make no record stray.
        scores = np.nan_to_num(inside * np.sqrt(scale) / np.maximum(of_others, line.known))
    place = int(np.argmax(np.abs(scores)))
    chance = min(1.0, number * 2.0 * float(t.sf(abs(scores[place]), freedom)))
    return (place, float(scores[place]), chance) if chance < OUTLIER else None


def _fitted(line: _Line, y: Quantity, x: Quantity, number: int, outliers: tuple[Outlier, ...]) -> Trend:
    from scipy.stats import t

    fit, freedom = line.fit, number - 2
    # No narrower than the errors that are known make it.
    wide = max(1.0, float(fit.scale)) / max(float(fit.scale), 1e-300)  # type: ignore[attr-defined]
    level, slope = (float(v) for v in fit.params)  # type: ignore[attr-defined]
    slope_error = float(fit.bse[1]) * float(np.sqrt(wide * line.wider))  # type: ignore[attr-defined]
    chance = 2.0 * float(t.sf(abs(slope) / max(slope_error, 1e-300), freedom))
    half = float(t.ppf(0.975, freedom)) * slope_error
    return Trend(
        parameter=y.name,
        condition=x.name,
        unit=y.unit,
        condition_unit=x.unit,
        slope=slope,
        slope_error=slope_error,
        slope_interval_95=(slope - half, slope + half),
        intercept=level - slope * line.middle,
        middle=line.middle,
        level=level,
        between_records=line.tau,
        chance=chance,
        chance_corrected=chance,
        records=number,
        outliers=outliers,
    )
