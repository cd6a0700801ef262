"""What may be wrong with single values: not determined, at a bound, outweighed, or another one in each record."""

from __future__ import annotations

import math
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal, NamedTuple

import numpy as np
from scipy.special import fdtrc

from fibrefit.core.matrices import equilibrated, least_squares, scale_of
from fibrefit.fitting.error_bars import METHOD, error_bars
from fibrefit.fitting.gls import GlsEstimate
from fibrefit.fitting.result import Estimate, Found
from fibrefit.fitting.thresholds import (
    CHANCE,
    LOOSE,
    NO_FACTOR,
    SEEN,
    SMALL_ERROR,
    TIED,
    VAGUE,
)
from fibrefit.fitting.uncertainty import MEMORY, ErrorBars, Scores, sandwich, stationary_parts
from fibrefit.problem import GAP_OF_NOISE, UNLIKELY, Layout, MarginalLikelihood, Problem
from fibrefit.study.summaries.part import Z_95


@dataclass(frozen=True)
class Weakness:
    """Something the records do not determine.

    Parameters
    ----------
    names : tuple of str
        The parameters it concerns; ``name[record]`` where each record has its own.
    kind : str
        ``"invisible"``, ``"vague"``: hardly visible, with a large relative error; ``"combined"``: only together, or not
        apart from values of each record; ``"tied"``: only together, with a correlation near one.
    share : float
        Relative standard error of a vague one; infinite where the value is zero.
    correlation, slope : float
        Of a tied pair, and how much of the second makes up for a unit of the first.
    """

    names: tuple[str, ...]
    kind: Literal["invisible", "vague", "combined", "tied"]
    share: float = math.nan
    correlation: float = math.nan
    slope: float = math.nan


def weaknesses(
    layout: Layout, values: np.ndarray, covariance: np.ndarray, normal: np.ndarray, unjudged: Collection[str] = ()
) -> tuple[Weakness, ...]:
    """What the records leave open about the parameters, those that each record has for itself among them.

    Parameters
    ----------
    values : (n_free,) in SI units
    covariance : (n_free, n_free)
        With infinite variances where the data see nothing.
    normal : (n_free, n_free)
        What the data see, in units of the noise.
    unjudged : collection of str
        Values that nobody asks for, and parameters of which that says nothing, such as the instant at which something
        happens: between two samples no reading moves with it.
    """
    judged = [i for i, (slot, _) in enumerate(layout.entries) if slot.name not in unjudged]
    variance = np.diag(covariance)
    found, mixed = [], []
    for i in judged:
        slot, name = layout.entries[i][0], layout.free_names[i]
        error = np.sqrt(variance[i])
        if not np.isfinite(error) and np.sqrt(normal[i, i]) * slot.range.scale > SEEN:
            mixed.append(name)
        elif not np.isfinite(error):
            found.append(Weakness((name,), "invisible"))
        elif error > VAGUE * abs(values[i]):
            # What is of either sign, such as a zero, may well be nil, and its error is no share of it.
            small = VAGUE if slot.range.lower < 0.0 < slot.range.upper else SMALL_ERROR
            if error > small * slot.range.scale:
                share = float(error / abs(values[i])) if values[i] else math.inf
                found.append(Weakness((name,), "vague", share=share))
    if mixed:
        found.append(Weakness(tuple(mixed), "combined"))
    given, record = _given_beliefs(layout, covariance), [record for _, record in layout.entries]
    for k, i in enumerate(judged):
        # Values of two records are tied, if at all, by one that both share.
        for j in (j for j in judged[k + 1 :] if record[i] is None or record[i] == record[j]):
            spread = np.sqrt(given[i, i] * given[j, j])
            correlation = given[i, j] / spread if np.isfinite(spread) and spread > 0.0 else 0.0
            loose = any(np.sqrt(given[p, p]) > LOOSE * abs(values[p]) for p in (i, j))
            if abs(correlation) > TIED and loose:
                names, slope = (layout.free_names[i], layout.free_names[j]), np.sqrt(given[j, j] / given[i, i])
                slope = float(slope * np.sign(correlation))
                found.append(Weakness(names, "tied", correlation=float(correlation), slope=slope))
    return tuple(found)


def _given_beliefs(layout: Layout, covariance: np.ndarray) -> np.ndarray:
    """Covariance if the values with a prior were held: what that prior leaves open is in the error bars.

    A value with a prior is not tied to another one by the records alone; its own rows become zero.
    """
    held = [i for i, _ in layout.beliefs if np.isfinite(covariance[i, i])]
    if not held:
        return covariance
    inside = covariance[np.ix_(held, held)]
    size = scale_of(inside)
    share = equilibrated(np.linalg.pinv(equilibrated(inside, size)), size)
    given = covariance - covariance[:, held] @ share @ covariance[held]
    given[held], given[:, held] = 0.0, 0.0
    return given


class AtBound(NamedTuple):
    """A value at a bound.

    Parameters
    ----------
    name : str
        With its record, as in `Layout.free_names`.
    unit : str
    limit : float
        The bound, in SI units.
    end : float
        The other end of its 95 % interval, in SI units.
    above : bool
        Whether values lie above the bound.
    pull : float
        How far beyond the bound it would lie without it, in the standard errors that it would have there.
    """

    name: str
    unit: str
    limit: float
    end: float
    above: bool
    pull: float


def at_bounds(layout: Layout, found: Sequence[Estimate], pulls: Callable[[], np.ndarray]) -> tuple[AtBound, ...]:
    """The values that lie at a bound, and how far they would go beyond it.

    Parameters
    ----------
    found : sequence of Estimate
        Those of the free values, in the order of the layout; others may follow.
    pulls : callable
        Steps ``(n_free,)`` to where the values would lie without bounds, upwards, in the standard errors they would
        have there; asked only where a value lies at a bound.
    """
    stopped = [i for i in range(layout.size) if found[i].found.at_bound]
    steps = pulls() if stopped else np.zeros(0)
    places = []
    for i in stopped:
        slot, one = layout.entries[i][0], found[i].found
        limits = slot.range
        above = one.value - limits.lower <= limits.upper - one.value
        low, high = one.interval_95 or (limits.lower, limits.upper)
        limit, end = (limits.lower, high) if above else (limits.upper, low)
        pull = float(-steps[i] if above else steps[i])
        if one.std_error:
            # Nothing stops what a record has for itself in a likelihood: it lies as far beyond as it would.
            pull = max(pull, (limit - one.value if above else one.value - limit) / one.std_error)
        end = float(np.clip(end, limits.lower, limits.upper))
        places.append(AtBound(layout.free_names[i], slot.unit, limit, end, above, pull))
    return tuple(places)


def pulls_of_plain(problem: Problem, scores: Scores, rate: float) -> np.ndarray:
    """Steps ``(n_free,)`` to the minimum of plain least squares without bounds, over the standard errors there.

    What a bound keeps from being explained makes errors at the bound larger: they are those of the residuals that
    slopes predict beyond it.

    Parameters
    ----------
    rate : float
        Samples a second, in Hz.
    """
    normal, gradient = scores.normal_matrix(), scores.gradient()
    if not (np.isfinite(normal).all() and np.isfinite(gradient).all()):
        return np.zeros(scores.size)
    step = -least_squares(normal, gradient)
    # What is held in a record has a place beyond all free values.
    local = np.concatenate([step, np.zeros(2)])[scores.columns]
    there = scores.residuals + np.einsum("rcti,ri->rct", scores.slopes, local)
    bars = error_bars(problem, replace(scores, residuals=np.where(scores.residuals != 0.0, there, 0.0)), rate)
    return _over(step, bars.errors[bars.method])


def pulls_of_gls(gls: GlsEstimate) -> np.ndarray:
    """The same of the likelihood; nothing bounds what each record has for itself.

    Records that a bound keeps from their common value seem to differ: how much they do is weighed anew without it.
    """
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    endless = np.full(len(found.unknowns.shared), np.inf)
    unbounded = replace(found, unknowns=replace(found.unknowns, lower=-endless, upper=endless))
    with np.errstate(all="ignore"):
        free = MarginalLikelihood.of(unbounded, gls.evidence.axes)
        shared = _over(free.mean - gls.evidence.mean, np.sqrt(np.diag(free.spread)))
    # Of a strength whose typical value lies below its null the coordinate falls as it rises.
    shared = shared * np.sign(found.unknowns.slope(found.place.z))
    places, pulls = found.unknowns.places_in(layout)[0], np.zeros(layout.size)
    pulls[layout.shared_places] = shared[places[layout.shared_places]]
    return pulls


def _over(step: np.ndarray, errors: np.ndarray) -> np.ndarray:
    """Steps in standard errors; what has no error is not visible, and no record asks for anything."""
    known = np.isfinite(step) & np.isfinite(errors) & (errors > 0.0)
    return np.where(known, step, 0.0) / np.where(known, errors, 1.0)


def beyond_bounds(places: Sequence[AtBound]) -> Found:
    """Whether the records ask for no value beyond a bound, chance allowed for."""
    beyond = tuple(one.name for one in places if one.pull > CHANCE)
    facts = {"parameters": beyond, "by_chance": tuple(one for one in places if one.pull <= CHANCE)}
    return Found(max((one.pull for one in places), default=0.0), facts, not beyond)


def with_ends(places: Sequence[AtBound], layout: Layout, found: Sequence[Estimate]) -> tuple[AtBound, ...]:
    """Values at a bound with the ends of the intervals that are reported."""
    ends = {name: one.found.interval_95 for name, one in zip(layout.free_names, found, strict=False)}
    return tuple(
        one if (interval := ends.get(one.name)) is None else one._replace(end=interval[1 if one.above else 0])
        for one in places
    )


class Outweighed(NamedTuple):
    """A value whose trace is outweighed.

    Parameters
    ----------
    value : float in SI units
    ratio, most : float
        What is left over what the value does in the readings, and the most that passes.
    """

    name: str
    value: float
    unit: str
    ratio: float
    most: float = 1.0


def outweighed(layout: Layout, values: np.ndarray, scores: Scores) -> Outweighed | None:
    """The value whose trace is outweighed most; None where none is.

    Parameters
    ----------
    values : (n_free,) in SI units
    scores : Scores
        At these values.

    Law
    ---
    ``sqrt(e (H^-1)_jj) / |θ_j| > 1`` with e the sum of squares beyond the noise: both sums of squares have the same
    unit, so that neither noise nor number of samples matter. Stated faults that put a value off by a factor of 1.5 or
    more leave 0.5 to 2.2 of this, most of them more than 1; masses and forces 5 to 10 % wrong 0.1 to 0.8.

    Values that may have either sign are small by accident, and those the records do not see at all are reported
    elsewhere.
    """
    variance = np.diag(sandwich(*(scores.normal_matrix(),) * 2))
    # Squares less those of noise, which is known to a few percent.
    noise = GAP_OF_NOISE**2 * np.count_nonzero(scores.residuals, axis=(0, 2))
    beyond = float(np.sum(np.maximum(np.sum(scores.residuals**2, axis=(0, 2)) - noise, 0.0)))
    worst: Outweighed | None = None
    for i, (slot, record) in enumerate(layout.entries):
        if record is None and slot.range.lower >= 0.0 and np.isfinite(variance[i]):
            moved = float(np.sqrt(beyond * variance[i]))
            ratio = moved / max(abs(float(values[i])), NO_FACTOR * slot.range.scale)
            if ratio > (1.0 if worst is None else worst.ratio):
                worst = Outweighed(slot.name, float(values[i]), slot.unit, ratio)
    return worst


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


def records_agree(problem: Problem, values: np.ndarray, scores: Scores, bars: ErrorBars, rate: float) -> Found | None:
    """Whether values of single records differ by more than their error bars; None where fewer than two tell a value.

    Where residuals are more than noise, a value may stand for different things in different records: a stiffness that
    hardens is a larger one in a higher drop. Error bars from residuals alone do not know it.

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
    return Found(chance, facts, chance >= UNLIKELY) if told else None


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
