"""Every parameter against every condition: weighted regression, the scatter between records a variance of its own.

Law
---
``y_r = a + b x_r + b_r + e_r`` with ``var = tau^2 + s_r^2 + b^2 u_r^2``, u the error of the condition. tau is where the
weighted sum of squares equals its degrees of freedom (Paule and Mandel), and tests are Student's (Hartung and Knapp).
A record further from the line than chance allows among so many, by the studentised residual it has when it is left
out, is named and left out; significance is corrected for all looks (Holm).

Source
------
Paule and Mandel, J. Res. NBS 87 (1982); Knapp and Hartung, Stat. Med. 22 (2003); Holm, Scand. J. Stat. 6 (1979).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.series.thresholds import FEWEST_RECORDS, MOST_OUTLIERS, SIGNIFICANT, STRAY

BY_ORDER = "order of the records"
"""Condition that counts the records, one after the other."""

ROUNDS, HALVINGS = 20, 60


@dataclass(frozen=True)
class Quantity:
    """A parameter or a condition over the records.

    Parameters
    ----------
    name, unit : str
    values : (n_record,) in `unit`
        NaN where nothing is known.
    errors : (n_record,) in `unit`
        Standard errors; zero where it is known exactly.
    """

    name: str
    unit: str
    values: np.ndarray
    errors: np.ndarray


@dataclass(frozen=True)
class Outlier:
    """A record that does not follow a line.

    Parameters
    ----------
    record : str
    score : float
        Distance from the line of the others, in standard deviations.
    chance : float
        Probability of one as far in a series of this length.
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

    found = [line for y, x in pairs if (line := trend_of(names, y, x)) is not None]
    if not found:
        return ()
    corrected = multipletests([line.chance for line in found], method="holm")[1]
    listed = [replace(line, chance_corrected=float(chance)) for line, chance in zip(found, corrected, strict=True)]
    return tuple(sorted(listed, key=lambda line: line.chance))


def trend_of(names: Sequence[str], y: Quantity, x: Quantity) -> Trend | None:
    """One parameter against one condition; None where there is too little to tell."""
    seen = np.isfinite(y.values) & np.isfinite(y.errors) & np.isfinite(x.values)
    kept = np.flatnonzero(seen)
    if len(kept) < FEWEST_RECORDS or len(np.unique(x.values[kept])) < 2:
        return None
    outliers: list[Outlier] = []
    while True:
        line = _line(x.values[kept], y.values[kept], x.errors[kept], y.errors[kept])
        stray = None if line is None else _stray(line, seen.sum())
        if stray is None or len(outliers) >= max(1, MOST_OUTLIERS * seen.sum()) or len(kept) <= FEWEST_RECORDS:
            break
        place, score, chance = stray
        outliers.append(Outlier(names[kept[place]], score, chance))
        kept = np.delete(kept, place)
    return None if line is None else _fitted(line, y, x, len(kept), tuple(outliers))


@dataclass(frozen=True)
class _Line:
    """A fitted line: of statsmodels, about the weighted mean of the condition, and the scatter about it."""

    fit: object
    middle: float
    tau: float


def _line(x: np.ndarray, y: np.ndarray, u: np.ndarray, s: np.ndarray) -> _Line | None:
    if np.ptp(x) == 0.0:
        return None
    slope = 0.0
    for _ in range(ROUNDS):
        known = s**2 + (slope * u) ** 2
        tau = _between(x, y, known)
        line = _weighted(x, y, known + tau**2)
        before, slope = slope, float(line.fit.params[1])  # type: ignore[attr-defined]
        if abs(slope - before) <= 1e-6 * abs(slope) or not u.any():
            break
    return replace(line, tau=tau)


def _weighted(x: np.ndarray, y: np.ndarray, variance: np.ndarray) -> _Line:
    from statsmodels.regression.linear_model import WLS

    weights = 1.0 / np.maximum(variance, 1e-300)
    middle = float(np.average(x, weights=weights))
    fit = WLS(y, np.column_stack([np.ones(len(x)), x - middle]), weights=weights).fit()
    return _Line(fit, middle, 0.0)


def _between(x: np.ndarray, y: np.ndarray, known: np.ndarray) -> float:
    """Scatter about the line at which the weighted sum of squares is what so many records leave."""
    freedom = len(x) - 2

    def excess(tau: float) -> float:
        weights = 1.0 / np.maximum(known + tau**2, 1e-300)
        away = x - np.average(x, weights=weights), y - np.average(y, weights=weights)
        sxx, sxy, syy = (float(weights @ (one * other)) for one, other in ((away[0],) * 2, away, (away[1],) * 2))
        return syy - sxy**2 / sxx - freedom

    if freedom < 1 or excess(0.0) <= 0.0:
        return 0.0
    low, high = 0.0, float(np.ptp(y))
    for _ in range(HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if excess(middle) > 0.0 else (low, middle)
    return 0.5 * (low + high)


def _stray(line: _Line, number: int) -> tuple[int, float, float] | None:
    """The record that is furthest from the line of the others, where that is more than chance."""
    from scipy.stats import t
    from statsmodels.regression.linear_model import OLS
    from statsmodels.stats.outliers_influence import OLSInfluence

    freedom = int(line.fit.df_resid) - 1  # type: ignore[attr-defined]
    if freedom < 1:
        return None
    with np.errstate(all="ignore"):
        # Influence is that of ordinary least squares: it is asked of what weights make of the records.
        weighted = line.fit.model  # type: ignore[attr-defined]
        inside = np.asarray(OLSInfluence(OLS(weighted.wendog, weighted.wexog).fit()).resid_studentized_internal)
        scores = np.nan_to_num(inside * np.sqrt(freedom / np.maximum(freedom + 1.0 - inside**2, 1e-12)))
    place = int(np.argmax(np.abs(scores)))
    chance = min(1.0, number * 2.0 * float(t.sf(abs(scores[place]), freedom)))
    return (place, float(scores[place]), chance) if chance < STRAY else None


def _fitted(line: _Line, y: Quantity, x: Quantity, number: int, outliers: tuple[Outlier, ...]) -> Trend:
    from scipy.stats import t

    fit, freedom = line.fit, number - 2
    # No narrower than the errors that are known make it.
    wide = max(1.0, float(fit.scale)) / max(float(fit.scale), 1e-300)  # type: ignore[attr-defined]
    level, slope = (float(v) for v in fit.params)  # type: ignore[attr-defined]
    slope_error = float(fit.bse[1]) * np.sqrt(wide)  # type: ignore[attr-defined]
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
