"""Error bars of an estimate by several methods side by side, which of them is believed, and profile intervals.

An end of a profile-likelihood interval is where the best fit with one value held becomes significantly worse.

Source
------
Venzon and Moolgavkar, Appl. Stat. 37 (1988). The threshold is widened by the square of what correlated noise does to
the standard error, as a composite likelihood's is (Pace, Salvan and Sartori, Stat. Sinica 21 (2011)).
"""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from fibrefit.core.arrays import RAN_AWAY, gathered
from fibrefit.core.declarations import HELD
from fibrefit.fitting import uncertainty
from fibrefit.fitting.gls import GlsEstimate, kind_of_interval
from fibrefit.fitting.result import Estimate, PlainEstimate
from fibrefit.fitting.search.solve import descend
from fibrefit.fitting.thresholds import BLIND_PART, STATE_CELLS, UNNOTICED
from fibrefit.fitting.uncertainty import MEMORY, ErrorBars, Scores, inverse_root, sandwich
from fibrefit.problem import Motion, Problem, Range
from fibrefit.study.summaries.part import Z_95
from fibrefit.study.summaries.results import ParameterSummary


def error_bars(problem: Problem, scores: uncertainty.Scores, rate: float) -> ErrorBars:
    """Error bars by all methods; whatever one of them sees is there: the largest is the one to be believed.

    Parameters
    ----------
    scores : Scores
        At the estimate.
    rate : float
        Samples a second, in Hz.
    """
    normal, prior = scores.normal_matrix(), scores.prior_matrix()
    middles = {
        "white": uncertainty.white(scores),
        "spectrum": uncertainty.stationary(scores, rate) + prior,
        "newey_west": uncertainty.newey_west(scores) + prior,
        "block_bootstrap": uncertainty.block_bootstrap(scores) + prior,
    }
    if (window := problem.model.pieces) is not None:
        middles["windows"] = uncertainty.by_windows(scores, window) + prior
    found = {name: uncertainty.sandwich(normal, middle) for name, middle in middles.items()}
    largest = max(found, key=lambda name: size(problem, found[name]))
    return ErrorBars(found, largest, inverse=uncertainty.sandwich(normal, normal))


def size(problem: Problem, covariance: np.ndarray) -> float:
    """Sum of the logarithms of the variances of what methods are compared by."""
    variance = np.diag(covariance)[_compared_by(problem)]
    # What the data do not see is infinite by every method, and would make them all alike.
    variance = variance[np.isfinite(variance)]
    return float(np.sum(np.log(np.maximum(variance, 1e-300)))) if len(variance) else 0.0


def _compared_by(problem: Problem) -> list[int]:
    """Places of the values by which methods are compared: those that all records share, or all where none is shared."""
    return problem.layout.shared_places or list(range(problem.layout.size))


def error_inflation(problem: Problem, bars: ErrorBars) -> float:
    """Standard errors that are believed over those for noise without memory, median of the shared parameters."""
    return ratio(problem, bars.errors[bars.method], bars.errors["white"])


def convergence_unit(problem: Problem, bars: ErrorBars) -> float:
    """The same, at least one and finite: the unit in which it is judged whether a search has come to its end."""
    found = error_inflation(problem, bars)
    return max(found, 1.0) if math.isfinite(found) else 1.0


def ratio(problem: Problem, errors: np.ndarray, others: np.ndarray) -> float:
    """Median of the shared parameters' standard errors ``(n_free,)`` over others of theirs."""
    places = _compared_by(problem)
    above, below = errors[places], others[places]
    seen = np.isfinite(above) & (below > 0.0)
    return float(np.median(above[seen] / below[seen])) if seen.any() else float("nan")


def estimates(
    problem: Problem,
    values: np.ndarray,
    bars: ErrorBars,
    plain: PlainEstimate | None = None,
    gls: GlsEstimate | None = None,
) -> tuple[Estimate, ...]:
    """Estimates of all values in the order of the layout, then those that are held.

    Parameters
    ----------
    values : (n_free,) in SI units
    plain : PlainEstimate, optional
        What is reported beside the estimates.
    gls : GlsEstimate, optional
        Where the intervals are from.
    """
    found, layout, errors = [], problem.layout, bars.errors
    common = _due_to_priors(problem, values, bars.covariance if bars.inverse is None else bars.inverse)
    for i, (slot, record) in enumerate(layout.entries):
        value, error, limits = float(values[i]), float(errors[bars.method][i]), slot.range
        low, high = (value - Z_95 * error, value + Z_95 * error) if gls is None else gls.intervals[i]
        low, high = max(float(low), limits.lower), min(float(high), limits.upper)
        between = {} if gls is None else gls.between
        of_one = record is not None or len(layout.records) == 1
        kind = "record" if of_one else kind_of_interval(slot.name, between)
        believed = {}
        if record is None and slot.belief is not None:
            believed = {"prior_centre": slot.belief.centre, "prior_error": 1.0 / abs(slot.belief.slope(value))}
        summary = ParameterSummary(
            unit=slot.unit,
            value=value,
            std_error=error,
            interval_95=(low, high),
            # What the model lacks makes a value less sure; it does not bring it to a limit.
            at_bound=at_bound(value, float(errors[bars.of_noise or bars.method][i]), limits),
            interval_kind=kind,
            std_errors={name: float(column[i]) for name, column in errors.items()},
            plain_value=None if plain is None else float(plain.values[i]),
            plain_error=None if plain is None else float(plain.errors[i]),
            common_error=None if common is None else float(common[i]),
            **believed,
        )
        found.append(Estimate(slot.name, None if record is None else layout.records[record], summary))
    return tuple(found + _held(problem))


def at_bound(value: float, error: float, limits: Range) -> bool:
    """Whether an estimate is stopped by a limit: nearer to it than a tenth of its error."""
    tolerance = UNNOTICED * error if np.isfinite(error) else 0.0
    return limits.at_bound(value, max(tolerance, 1e-9 * limits.scale))


def _due_to_priors(problem: Problem, values: np.ndarray, inverse: np.ndarray) -> np.ndarray | None:
    """Standard errors ``(n_free,)`` that an error of the priors' centres makes; None without priors.

    Parameters
    ----------
    inverse : (n_free, n_free)
        Of the normal matrix that the values are of, whatever noise their error bars are for.

    Law
    ---
    With H of the records and P of the priors, and ``C = (H + P)^-1``, the part of the centres is ``C P C``, and that of
    noise ``C S C`` with S the variance of its score. Noise is another in every record, and the centres are the same.
    """
    if not problem.layout.beliefs:
        return None
    places = [i for i, _ in problem.layout.beliefs]
    slopes = np.array([belief.slope(float(values[i])) for i, belief in problem.layout.beliefs])
    return np.sqrt(np.sum((inverse[:, places] * slopes) ** 2, axis=1))


def _held(problem: Problem) -> list[Estimate]:
    found = []
    for slot in problem.layout.slots:
        # What each record states for itself is its own, where there is one record too.
        own = not slot.shared and len(slot.fixed) == len(problem.layout.records)
        names = problem.layout.records if own else (None,)
        for name, value in zip(names, slot.fixed, strict=False):
            if value is not None:
                summary = ParameterSummary(value=value, interval_95=(value, value), unit=slot.unit, free=False)
                found.append(Estimate(slot.name, name, summary))
    return found


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
    # States that a residual may depend on, acceleration among them.
    for state in (*motion.states.values(), np.gradient(motion.states["speed"], axis=1)):
        covariance = sandwich(normal, _clustered(scores, _cells(state, motion, scores.counts)) + prior)
        errors.append(np.sqrt(np.diag(covariance)))
    largest = np.max(errors, axis=0)
    known = np.isfinite(largest) & (bars.errors[bars.method] > 0.0) & np.isfinite(bars.errors[bars.method])
    factor = np.where(known, largest / np.where(known, bars.errors[bars.method], 1.0), 1.0)
    wider = bars.covariance * np.outer(factor, factor)
    return ErrorBars({**bars.covariances, METHOD: wider}, METHOD, bars.method, bars.inverse)


def _without_parts(scores: Scores) -> np.ndarray:
    """Covariance ``(n_free, n_free)`` by the jackknife over parts of the records as long as noise may be correlated."""
    root = inverse_root(scores.normal_matrix())
    steps = []
    for r, columns in enumerate(scores.columns):
        seen = columns < scores.size
        score, count = scores.of_record(r)[:, seen], int(scores.counts[r])
        for part in np.array_split(np.arange(count), round(1.0 / MEMORY)):
            slopes = scores.slopes[r][:, part][..., seen] @ root[columns[seen]]
            share, axes = np.linalg.eigh(np.einsum("cti,ctj->ij", slopes, slopes))
            share = np.clip(share, 0.0, 1.0 - BLIND_PART)
            own = root[columns[seen]].T @ score[part].sum(axis=0)
            steps.append(root @ (axes @ ((axes.T @ own) / (1.0 - share))))
    return (len(steps) - 1) / len(steps) * np.einsum("ri,rj->ij", steps, steps)


def _cells(state: np.ndarray, motion: Motion, counts: np.ndarray) -> np.ndarray:
    """Cell of each sample, ``(n_record, n_time)``; -1 where nothing moves yet, or beyond the record."""
    there = (np.arange(state.shape[1]) < np.asarray(counts)[:, None]) & (motion.phase != HELD) & np.isfinite(state)
    if not there.any():
        return np.full(state.shape, -1)
    edges = np.unique(np.quantile(state[there], np.linspace(0.0, 1.0, STATE_CELLS + 1)[1:-1]))
    return np.where(there, np.searchsorted(edges, state), -1)


@RAN_AWAY
def _clustered(scores: Scores, cells: np.ndarray) -> np.ndarray:
    """Variance of the score, ``(n_free, n_free)``, of residuals that are alike within a cell."""
    sums = np.zeros((STATE_CELLS, scores.size))
    for r, columns in enumerate(scores.columns):
        score, here = scores.of_record(r), cells[r, : scores.counts[r]]
        for cell in range(STATE_CELLS):
            sums[cell] += gathered(score[here == cell].sum(axis=0)[None], columns[None], scores.size)
    return sums.T @ sums


CHI2_95 = 3.841459
"""Rise of the deviance at either end of a 95 % interval: the square of `Z_95`."""

NEAR = 1.96
"""Standard errors from the best value at which an end is looked for first: on a parabola it is there."""

FARTHEST = 8.0
"""Distance in standard errors beyond which an end of the interval is not searched."""

Cost = Callable[[np.ndarray], float]
"""Smallest deviance, twice a negative log likelihood, with one value held, from values ``(n_free,)`` in SI units to
begin at."""


def plain_cost(
    problem: Problem, values: np.ndarray, index: int, width: np.ndarray, whole: np.ndarray
) -> tuple[Cost, float]:
    """Cost of plain least squares with the value at `index` held, and the standard error that it has by this cost.

    Squares, priors among them, are counted over the variance that the best fit leaves: by this cost residuals that are
    larger than the noise make a prior as much wider, which error bars that are reported do not.

    Parameters
    ----------
    values : (n_free,) in SI units
        Of the best fit.
    width : (n_free,)
        Unit of the solver's steps, see `solve.widths`.
    whole : (1, n_record) int
        Samples of each record.
    """
    held = np.where(np.arange(len(width)) == index, 0.0, width)

    def squares(at: np.ndarray) -> float:
        return float(descend(problem, problem.layout.free(at), held, whole).cost)

    variance = squares(values) / problem.n_measured
    linear = problem.evaluate(np.asarray(problem.layout.local(values)))[0]
    normal = Scores.of(problem, linear, values).normal_matrix()
    own = float(np.sqrt(variance * sandwich(normal, normal)[index, index]))
    return lambda at: squares(at) / variance, own


def profile_interval(
    problem: Problem, values: np.ndarray, index: int, cost: Cost, own: float, reported: float
) -> tuple[float, float]:
    """95 % interval of one free value.

    Parameters
    ----------
    values : (n_free,) in SI units
        Of the best fit.
    index : int
        The value's place.
    cost : callable
        Deviance of the best fit with the value held.
    own, reported : float
        Its standard error if the noise were what this cost takes it for, and for the noise as it is, in SI units.

    Returns
    -------
    tuple of float
        In SI units; the limit of the parameter where the cost never rises enough within reach.
    """
    lowest = cost(values)
    rise = CHI2_95 * (reported / own) ** 2

    def excess(value: float) -> float:
        return cost(np.where(np.arange(len(values)) == index, value, values)) - lowest - rise

    limits = problem.layout.entries[index][0].range
    low = _crossing(excess, values[index], -NEAR * reported, max(limits.lower, values[index] - FARTHEST * reported))
    high = _crossing(excess, values[index], NEAR * reported, min(limits.upper, values[index] + FARTHEST * reported))
    return low if low is not None else limits.lower, high if high is not None else limits.upper


def _crossing(excess: Callable[[float], float], centre: float, step: float, last: float) -> float | None:
    """Where the excess turns positive on the way from `centre` past ``centre + step`` to `last`; None if nowhere."""
    from scipy.optimize import brentq

    inner, outer = centre, centre + step
    while True:
        outer = max(outer, last) if step < 0.0 else min(outer, last)
        if excess(outer) > 0.0:
            return float(brentq(excess, inner, outer, xtol=1e-3 * abs(step), rtol=1e-12))
        if outer == last:
            return None
        inner, outer = outer, outer + step
