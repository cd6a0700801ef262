"""Whether single records ask for the same values, within their own error bars.

Where residuals are more than noise, a value may stand for different things in different records: a stiffness that
hardens is a larger one in a higher drop. Error bars from residuals alone do not know it.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.special import fdtrc

from fibrefit.fitting.thresholds import RARE_SCATTER
from fibrefit.fitting.uncertainty import MEMORY, Scores, newey_west_of, sandwich
from fibrefit.problem.statement.layout import least_squares
from fibrefit.problem.statement.problem import Problem
from fibrefit.study.summaries.check import Check


def records_agree(problem: Problem, values: np.ndarray, scores: Scores) -> Check | None:
    """Whether the values of single records differ by more than their error bars; None where there is only one record.

    Parameters
    ----------
    values : (n_free,) in SI units
    scores : Scores
        At these values.

    Law
    ---
    One step of each record from the values of all: ``d_r = H_r^-1 g_r``, with errors by Newey and West. Their weighted
    scatter over its degrees of freedom follows F; the errors themselves are known from 1 / `MEMORY` independent parts.
    """
    shared = problem.layout.shared_places
    if len(scores.columns) < 2 or not shared:
        return None
    steps, errors = _steps(scores)
    chance, facts = 1.0, dict[str, Any]()
    for i in shared:
        seen = np.isfinite(errors[:, i]) & (errors[:, i] > 0.0)
        if (number := int(seen.sum())) < 2:
            continue
        weight = 1.0 / errors[seen, i] ** 2
        mean = np.sum(weight * steps[seen, i]) / np.sum(weight)
        ratio = float(np.sum(weight * (steps[seen, i] - mean) ** 2) / (number - 1))
        by_chance = float(fdtrc(number - 1, number / MEMORY, ratio)) * len(shared)
        if by_chance < chance:
            chance, own, slot = by_chance, values[i] + steps[seen, i], problem.layout.entries[i][0]
            facts = {"parameter": slot.name, "unit": slot.unit, "ratio": float(np.sqrt(ratio))}
            facts |= {"low": float(own.min()), "high": float(own.max())}
    return Check(
        name="single records agree",
        passed=chance >= RARE_SCATTER,
        statistic=chance,
        threshold=RARE_SCATTER,
        identifier="records_agree",
        quantity="agreement of the records",
        facts=facts,
    )


def _steps(scores: Scores) -> tuple[np.ndarray, np.ndarray]:
    """One step of each record and its standard errors, ``(n_record, n_free)``; infinite where it tells nothing."""
    steps = np.zeros((len(scores.columns), scores.size))
    errors = np.full_like(steps, np.inf)
    for r, columns in enumerate(scores.columns):
        score = scores.of_record(r)
        slopes = scores.slopes[r]
        normal = np.einsum("cti,ctj->ij", slopes, slopes)
        covariance = sandwich(normal, newey_west_of(score))
        there = columns < scores.size
        step = -least_squares(normal, score.sum(axis=0))
        steps[r, columns[there]] = step[there]
        errors[r, columns[there]] = np.sqrt(np.diag(covariance))[there]
    return steps, errors
