"""Whether single records ask for the same values, within their own error bars.

Where residuals are more than noise, a value may stand for different things in different records: a stiffness that
hardens is a larger one in a higher drop. Error bars from residuals alone do not know it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import fdtrc

from fibrefit.fitting.estimates import ErrorBars
from fibrefit.fitting.thresholds import RARE_SCATTER
from fibrefit.fitting.uncertainty import MEMORY, Scores, sandwich, stationary_parts
from fibrefit.problem.statement.matrices import least_squares
from fibrefit.problem.statement.problem import Problem
from fibrefit.study.summaries.check import Check


def records_agree(problem: Problem, values: np.ndarray, scores: Scores, bars: ErrorBars, rate: float) -> Check | None:
    """Whether values of single records differ by more than their error bars; None where fewer than two tell a value.

    Parameters
    ----------
    values : (n_free,) in SI units
    scores : Scores
        At these values.
    bars : ErrorBars
        Of the values of all.
    rate : float
        Samples a second, in Hz.

    Law
    ---
    One step of each record from the values of all: ``d_r = H_r^-1 g_r``. Its error is that of noise with the spectrum
    of all residuals, as many times larger as the believed error of the value of all is than that of the spectrum, and
    as the record is louder than all are. The weighted scatter over its degrees of freedom follows F; the errors
    themselves are known from 1 / `MEMORY` independent parts of each record.
    """
    shared = problem.layout.shared_places
    if len(scores.columns) < 2 or not shared:
        return None
    steps, errors = _steps(scores, rate)
    errors = errors * _above_spectrum(bars)
    chance, facts, told = 1.0, dict[str, Any](), False
    for i in shared:
        seen = np.isfinite(errors[:, i]) & (errors[:, i] > 0.0)
        if (number := int(seen.sum())) < 2:
            continue
        told = True
        weight = 1.0 / errors[seen, i] ** 2
        mean = np.sum(weight * steps[seen, i]) / np.sum(weight)
        ratio = float(np.sum(weight * (steps[seen, i] - mean) ** 2) / (number - 1))
        by_chance = float(fdtrc(number - 1, number / MEMORY, ratio)) * len(shared)
        if by_chance < chance:
            chance, own, slot = by_chance, values[i] + steps[seen, i], problem.layout.entries[i][0]
            facts = {"parameter": slot.name, "unit": slot.unit, "ratio": float(np.sqrt(ratio))}
            facts |= {"low": float(own.min()), "high": float(own.max())}
    if not told:
        return None
    return Check(
        name="single records agree",
        passed=chance >= RARE_SCATTER,
        statistic=chance,
        threshold=RARE_SCATTER,
        identifier="records_agree",
        quantity="agreement of the records",
        facts=facts,
    )


def _above_spectrum(bars: ErrorBars) -> np.ndarray:
    """Believed errors ``(n_free,)`` over those of noise with the residuals' spectrum, at least one."""
    believed, known = bars.errors[bars.method], bars.errors["spectrum"]
    seen = np.isfinite(believed) & np.isfinite(known) & (known > 0.0)
    return np.maximum(np.divide(believed, known, out=np.ones(len(known)), where=seen), 1.0)


def _steps(scores: Scores, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """One step of each record and its standard errors, ``(n_record, n_free)``; infinite where it tells nothing."""
    steps = np.zeros((len(scores.columns), scores.size))
    errors = np.full_like(steps, np.inf)
    middle, loud = stationary_parts(scores, rate), _loudness(scores)
    for r, columns in enumerate(scores.columns):
        slopes = scores.slopes[r]
        normal = np.einsum("cti,ctj->ij", slopes, slopes)
        covariance = sandwich(normal, loud[r] * middle(r))
        there = columns < scores.size
        step = -least_squares(normal, scores.of_record(r).sum(axis=0))
        steps[r, columns[there]] = step[there]
        errors[r, columns[there]] = np.sqrt(np.diag(covariance))[there]
    return steps, errors


def _loudness(scores: Scores) -> np.ndarray:
    """Mean square of the residuals of each record ``(n_record,)`` over that of all."""
    power = np.sum(scores.residuals**2, axis=(1, 2))
    number = np.count_nonzero(scores.residuals, axis=(1, 2))
    return (power / np.maximum(number, 1)) / max(power.sum() / max(number.sum(), 1), 1e-300)
