"""Error bars where residuals are more than noise: what a model lacks comes back whenever the rig is where it was.

A residual that depends on the state is not drawn anew with each sample, nor with each swing: all samples of one state
say the same of it, and a record says as much of it as it visits different states.

Law
---
``H^-1 (Σ_c g_c g_c') H^-1`` with g_c the sum of the scores over all samples, of all records, in one cell of a state.
Each state is cut into `CELLS` cells visited equally often, as where residuals are checked against states; which of
them matters is not known, and for each value the largest standard error counts. So does the jackknife over the parts of
each record, ``(K - 1)/K Σ_r d_r d_r'`` with ``d_r = (H - H_r)^-1 g_r`` what the values change by where part r is left
out: a swing that dies out does not come back to its first states, and what it asks for there is another value than what
it asks for at last.

Source
------
Miller, Biometrika 61 (1974): the jackknife; Liang and Zeger, Biometrika 73 (1986): clusters that are alike inside;
Kennedy and O'Hagan, J. R. Statist. Soc. B 63 (2001): discrepancy between model and reality.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.fitting.estimates import ErrorBars
from fibrefit.fitting.misfit.structure import CELLS
from fibrefit.fitting.thresholds import NO_FACTOR, VAGUE
from fibrefit.fitting.uncertainty import MEMORY, MOST_LEVERAGE, Scores, inverse_root, sandwich
from fibrefit.problem.diagnose.motion import HELD, Motion
from fibrefit.problem.statement.layout import RAN_AWAY, Layout, gathered
from fibrefit.study.summaries.part import Z_95

PARTS = round(1.0 / MEMORY)
"""Parts of a record: each as long as the longest correlation allowed for in noise."""
METHOD = "discrepancy"


def with_discrepancy(bars: ErrorBars, scores: Scores, motion: Motion) -> ErrorBars:
    """Error bars that allow for what the model lacks.

    Parameters
    ----------
    bars : ErrorBars
        For noise alone.

    Returns
    -------
    ErrorBars
        With a further method, which is believed: correlations of the one believed before, and of each value the
        largest standard error of all methods.
    """
    normal, prior = scores.normal_matrix(), scores.prior_matrix()
    errors = [bars.errors[bars.method]]
    errors.append(np.sqrt(np.diag(_without_parts(scores))))
    for state in _states(motion):
        covariance = sandwich(normal, _clustered(scores, _cells(state, motion, scores.counts)) + prior)
        errors.append(np.sqrt(np.diag(covariance)))
    largest = np.max(errors, axis=0)
    known = np.isfinite(largest) & (bars.errors[bars.method] > 0.0) & np.isfinite(bars.errors[bars.method])
    factor = np.where(known, largest / np.where(known, bars.errors[bars.method], 1.0), 1.0)
    wider = bars.covariance * np.outer(factor, factor)
    return ErrorBars({**bars.covariances, METHOD: wider}, METHOD, bars.method, bars.inverse)


class Doubtful(NamedTuple):
    """A value that what the model lacks may put off by a factor.

    Parameters
    ----------
    value, error : float in SI units
        Its standard error allows for what the model lacks.
    share : float
        Of itself that its 95 % interval reaches to either side.
    """

    name: str
    unit: str
    value: float
    error: float
    share: float


def most_doubtful(layout: Layout, values: np.ndarray, bars: ErrorBars) -> Doubtful | None:
    """The shared value that is known worst against its size, of those that noise alone would leave known.

    None where error bars are those of noise, and where there is no such value.

    Parameters
    ----------
    values : (n_free,) in SI units
    """
    if bars.method != METHOD:
        return None
    found = []
    for i, (slot, record) in enumerate(layout.entries):
        error, by_noise = (float(bars.errors[method][i]) for method in (METHOD, bars.of_noise or METHOD))
        # Values that may have either sign are small by accident; what records do not determine is reported elsewhere.
        if record is None and slot.range.lower >= 0.0 and np.isfinite(error):
            size = max(abs(float(values[i])), NO_FACTOR * slot.range.scale)
            if by_noise <= VAGUE * size:
                found.append(Doubtful(slot.name, slot.unit, float(values[i]), error, Z_95 * error / size))
    return max(found, key=lambda one: one.share, default=None)


def _without_parts(scores: Scores) -> np.ndarray:
    """Covariance ``(n_free, n_free)`` by the jackknife over parts of the records."""
    root = inverse_root(scores.normal_matrix())
    steps = []
    for r, columns in enumerate(scores.columns):
        seen = columns < scores.size
        score, count = scores.of_record(r)[:, seen], int(scores.counts[r])
        for part in np.array_split(np.arange(count), PARTS):
            slopes = scores.slopes[r][:, part][..., seen] @ root[columns[seen]]
            share, axes = np.linalg.eigh(np.einsum("cti,ctj->ij", slopes, slopes))
            share = np.clip(share, 0.0, MOST_LEVERAGE)
            own = root[columns[seen]].T @ score[part].sum(axis=0)
            steps.append(root @ (axes @ ((axes.T @ own) / (1.0 - share))))
    return (len(steps) - 1) / len(steps) * np.einsum("ri,rj->ij", steps, steps)


def _states(motion: Motion) -> list[np.ndarray]:
    """States that a residual may depend on, ``(n_record, n_time)`` each; acceleration among them."""
    return [*motion.states.values(), np.gradient(motion.states["speed"], axis=1)]


def _cells(state: np.ndarray, motion: Motion, counts: np.ndarray) -> np.ndarray:
    """Cell of each sample, ``(n_record, n_time)``; -1 where nothing moves yet, or beyond the record."""
    there = (np.arange(state.shape[1]) < np.asarray(counts)[:, None]) & (motion.phase != HELD) & np.isfinite(state)
    if not there.any():
        return np.full(state.shape, -1)
    edges = np.unique(np.quantile(state[there], np.linspace(0.0, 1.0, CELLS + 1)[1:-1]))
    return np.where(there, np.searchsorted(edges, state), -1)


@RAN_AWAY
def _clustered(scores: Scores, cells: np.ndarray) -> np.ndarray:
    """Variance of the score, ``(n_free, n_free)``, of residuals that are alike within a cell."""
    sums = np.zeros((CELLS, scores.size))
    for r, columns in enumerate(scores.columns):
        score, here = scores.of_record(r), cells[r, : scores.counts[r]]
        for cell in range(CELLS):
            sums[cell] += gathered(score[here == cell].sum(axis=0)[None], columns[None], scores.size)
    return sums.T @ sums
