"""The best values of a problem, errors of measured inputs taken off, and what the records say around them.

Readings are linearised in the errors of inputs and these are eliminated, by the Gauss-Newton of all estimates; where
the best ones are found to lie elsewhere, readings are linearised again there. At first little is known of the errors,
and samples that depend on them so strongly, or bend so soon, that a linear step says nothing of them count for less;
with what is learnt from the others they can be predicted.

Source
------
Bell and Cathey, IEEE Trans. Autom. Control 38 (1993): an iterated Kalman smoother is a Gauss-Newton search.
"""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import numpy as np
from scipy.ndimage import uniform_filter1d

from fibrefit.core.declarations import ROLES
from fibrefit.core.limits import beyond_limits, time_for
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.thresholds import (
    FALLS,
    LOSES,
    MISSED_LINEARISED,
    MORE_COUNT,
    MOST_LINEARISATIONS,
    REACTS_ALIKE,
    ROUGHLY,
)
from fibrefit.fitting.uncertainty import Scores
from fibrefit.problem import (
    InputCoefficients,
    InputErrors,
    InputSensitivities,
    Linearised,
    Place,
    PosteriorMode,
    Problem,
    Task,
    Unknowns,
    View,
    corrected,
    downweighted,
    downweights,
    error_rms,
    expanded,
    input_errors,
    instant_weights,
    mode,
    no_errors,
    samples_about,
)
from fibrefit.study.summaries.results import InputErrorSummary

SHORTENED = 3
"""How often records that are not followed to their end are shortened, by half at the most, before they are given up: an
eighth of what counts then tells whether the drive's error is what the model lacks."""

COARSE = 1e-3
"""Promised fall at which a descent ends, as a share of what the residuals have beyond the noise: a model that lacks
something has no exact best."""

IN_VAIN = 2
"""Looks in a row, each at another place than was predicted, that gain nothing, after which there is no further one."""

NEARBY = 0.02
"""Time in s about an instant from which is taken whether a record is followed there."""

DRAWS = 2
"""Of noise, to see how much of it errors of inputs take up."""


@dataclass(frozen=True)
class WithInputErrors:
    """Values and errors of inputs that explain the records together.

    Parameters
    ----------
    problem : Problem
        With the errors taken off its inputs.
    values : (n_free,) in SI units
    coefficients : mapping of input to (n_record, n_wave)
        The errors, before they are given their colour.
    view : View
        Readings linearised in the errors, near these.
    predicted_reduction : float or None
        Of the cost, of one more step, in units of the residual variance; None where inputs stay as measured.
    """

    problem: Problem
    values: np.ndarray
    coefficients: InputCoefficients
    view: View
    predicted_reduction: float | None

    @property
    def sensitivities(self) -> InputSensitivities:
        """Of the view."""
        assert self.view.raw is not None
        return self.view.raw


def with_input_errors(
    task: Task,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients | None = None,
    near: InputSensitivities | None = None,
) -> WithInputErrors:
    """Best values and input errors, from the values that suit the inputs as they were measured.

    Parameters
    ----------
    task : Task
    known : mapping of input to InputErrors
    values : (n_free,) in SI units
    coefficients : mapping of input to (n_record, n_wave), optional
        Where to begin; inputs as they were measured by default.
    near : InputSensitivities, optional
        Readings linearised near there by somebody else, with what is known of the errors beforehand.
    """
    problem, layout = task.problem, task.problem.layout
    unknowns = Unknowns.of_fit(layout, values, np.full(layout.size, np.inf))
    place = unknowns.place_of(np.asarray(layout.local(values)))
    waves, roots = no_errors(known) if coefficients is None else coefficients, None
    linearisations: list[_Linearisation] = []
    beforehand: View | None = None
    known_rows: Sequence[np.ndarray | None] = [None] * len(problem.layout.records)
    while len(linearisations) < MOST_LINEARISATIONS:
        began = time.monotonic()
        if near is not None and roots is None:
            view = _view(problem, known, near)
        else:
            at = _values(unknowns, problem, place)
            with beyond_limits():  # there is no alternative to the first, and time is left for each of the next
                known_rows = rows = _reactions(problem, known, at, waves, known_rows)
            view = _seen_with(problem, known, at, waves, rows, roots)
        beforehand, view = beforehand or view, replace(view, beforehand=beforehand)
        end = _descended(problem, unknowns, place, view)
        if not linearisations and coefficients is not None and not accounted_for(_variance(problem, view, end)):
            return with_input_errors(task, known, values)  # where it began was a bad place
        look = _linearisation_at(problem, known, unknowns, place, view, end)
        if not accounted_for(look.variance):
            break
        linearisations.append(look)
        # Another look takes as long as this one.
        if (
            len(linearisations) == MOST_LINEARISATIONS
            or not _tells_more(linearisations)
            or not time_for(time.monotonic() - began)
        ):
            break
        place, waves, roots = look.end.place, look.coefficients, _weighted(look.view).roots()
        known_rows = [row if alike else None for row, alike in zip(known_rows, look.reacts_alike, strict=True)]
    if not (followed := [look for look in linearisations if look.is_followed]):
        return WithInputErrors(problem, values, no_errors(known), beforehand or view, None)
    best = min(followed, key=lambda look: float(look.left.sum()))
    there, values = corrected(problem, known, best.coefficients), _values(unknowns, problem, best.end.place)
    reduction = best.end.predicted_reduction / best.variance
    return WithInputErrors(there, values, best.coefficients, best.view, reduction)


@dataclass(frozen=True)
class _Linearisation:
    """Where readings linearised once lead.

    Parameters
    ----------
    view : View
        Each record up to where it is followed.
    end : PosteriorMode
    coefficients : mapping of input to (n_record, n_wave)
    variance : float
        Of what the best errors leave of the samples that count, 1 at the least.
    share : (n_record,)
        Of the samples, that which counts.
    left : (n_record,)
        Mean square of what is left of all samples, in units of the noise.
    bends : bool
        Whether readings are others than those that were predicted, where they count.
    reacts_alike : (n_record,) bool
        Whether all of a record counts, and errors of its inputs do there what they did at the place.
    is_followed : bool
        Whether all records are followed, and little is left where samples count.
    """

    view: View
    end: PosteriorMode
    coefficients: InputCoefficients
    variance: float
    share: np.ndarray
    left: np.ndarray
    bends: bool
    reacts_alike: np.ndarray
    is_followed: bool


def _linearisation_at(
    problem: Problem,
    known: Mapping[str, InputErrors],
    unknowns: Unknowns,
    place: Place,
    whole: View,
    end: PosteriorMode,
) -> _Linearisation:
    """Where readings linearised at a place lead, given where they lead if all of them are followed.

    A record taken for another motion than it is, by a bounce that is not its own, tells nothing of what comes after it.
    Up to there it does, and with what that tells the next look is from a place from which more of it is followed.
    """
    view = whole
    for _ in range(SHORTENED):
        if accounted_for(_variance(problem, view, end)):
            break
        view = _view(problem, known, _weighted(view).until(_followed(problem, view, end)))
        end = _descended(problem, unknowns, place, view)
    predicted, coefficients = view.residuals(end.local)
    left = np.asarray(corrected(problem, known, coefficients).linearised_at(end.local).residuals)
    here, samples = left * _weighted(view).downweight, instant_weights(problem).sum(axis=-1)
    number, variance = instant_weights(problem, _weighted(view).downweight).sum(axis=-1), _variance(problem, view, end)
    # What readings linearised elsewhere predicted of it may be none: a motion that bounces is another one then.
    return _Linearisation(
        replace(view, beforehand=whole.beforehand),
        end,
        coefficients,
        variance,
        number / samples,
        np.sum(left**2, axis=(1, 2)) / samples,
        not as_predicted(here, predicted[0], variance),
        (number > (1.0 - MORE_COUNT) * samples) & reacts_alike(here, predicted[0], variance),
        view is whole and accounted_for(float(np.sum(here**2)), float(number.sum())),
    )


def _followed(problem: Problem, view: View, end: PosteriorMode) -> list[int]:
    """Number of samples of each record up to where more is left than errors of inputs leave, half of them at least."""
    number, about = instant_weights(problem, _weighted(view).downweight), samples_about(problem, NEARBY)
    left = np.sum(view.residuals(end.local)[0][0] ** 2, axis=1)
    power, count = (np.stack(list(map(uniform_filter1d, rows, about))) for rows in (left, number))
    lost = power > LOSES**2 * np.maximum(count, 1.0)
    middle = np.argmax(np.cumsum(number, axis=-1) > 0.5 * number.sum(axis=-1, keepdims=True), axis=-1)
    first = np.where(lost.any(axis=-1), np.argmax(lost, axis=-1), 0)
    is_far = left.sum(axis=-1) > LOSES**2 * number.sum(axis=-1)
    return np.where(is_far, np.maximum(first, middle), number.shape[-1]).tolist()


def _weighted(view: View) -> InputSensitivities:
    """Of the records of a view, which has noisy inputs."""
    assert view.raw is not None
    return view.raw


def _variance(problem: Problem, view: View, end: PosteriorMode) -> float:
    """Mean square of what the best errors of inputs leave of the samples that count; that of noise at the least."""
    return max(1.0, end.normal.cost / float(instant_weights(problem, _weighted(view).downweight).sum()))


def _tells_more(linearisations: Sequence[_Linearisation]) -> bool:
    """Whether one look more may tell more of any record."""
    last = linearisations[-1]
    if len(linearisations) == 1:
        return last.bends or lets_more_count(last.share, -1.0) or bool(np.isfinite(last.left).any())
    return still_gains([look.share for look in linearisations], [look.left for look in linearisations], last.bends)


def still_gains(shares: Sequence[np.ndarray | float], lefts: Sequence[np.ndarray | float], bends: bool) -> bool:
    """Whether a look at readings linearised anew let more of any record count, or left less of it, than all before it.

    Where readings are others than was predicted, the next look may gain what this one did not; but places may also lead
    to each other and back for ever.

    Parameters
    ----------
    shares, lefts : sequence of float or (n_record,)
        Of each look: share of the samples that count, and mean square of what is left of all.
    bends : bool
        Whether readings are others than was predicted at the last one.
    """

    def gains(number: int) -> bool:
        most, least = np.max(np.array(shares[:number]), axis=0), np.min(np.array(lefts[:number]), axis=0)
        return lets_more_count(shares[number], most) or bool(np.any(np.asarray(lefts[number]) < FALLS * least))

    return any(gains(number) for number in range(len(shares))[1:][-(IN_VAIN if bends else 1) :])


@beyond_limits()  # there is no alternative to it
def as_it_ended(
    problem: Problem,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    local: np.ndarray,
    coefficients: InputCoefficients,
    near: InputSensitivities | None,
) -> WithInputErrors:
    """Values and errors of inputs with which a search ended whose records differ: they are its best ones.

    Parameters
    ----------
    problem : Problem
        With its inputs as measured.
    known : mapping of input to InputErrors
    values : (n_free,) in SI units
        Means over the records.
    local : (n_record, n_local) in SI units
        Values of each record.
    coefficients : mapping of input to (n_record, n_wave)
    near : InputSensitivities, optional
        Readings linearised near there, where they have been.
    """
    view = linearised_in_errors(problem, known, local, coefficients) if near is None else _view(problem, known, near)
    return WithInputErrors(corrected(problem, known, coefficients), values, coefficients, view, 0.0)


def accounted_for(cost: float, number: float = 1.0) -> bool:
    """Whether a sum of squares, of so many samples, is small enough for errors of inputs to be what the model lacks."""
    return cost < LOSES**2 * number


def as_predicted(left: np.ndarray, linearised: np.ndarray, variance: float = 1.0) -> bool:
    """Whether residuals are those that linearised readings predict, where they count."""
    return float(np.mean((left - linearised)[linearised != 0.0] ** 2)) < MISSED_LINEARISED * variance


def reacts_alike(left: np.ndarray, linearised: np.ndarray, variance: float = 1.0) -> np.ndarray:
    """Whether residuals of each record are so nearly those of linearised readings that errors do there the same."""
    missed = np.where(linearised != 0.0, left - linearised, 0.0).reshape(len(left), -1)
    number = np.count_nonzero(linearised.reshape(len(left), -1), axis=1)
    return np.asarray(np.sum(missed**2, axis=1) < REACTS_ALIKE * variance * np.maximum(number, 1))


def lets_more_count(share: np.ndarray | float, before: np.ndarray | float) -> bool:
    """Whether another look may let more of the samples count, of which such shares, of any record, do and did.

    What is learnt from more samples lets still more of them count, until it does not.
    """
    return bool(
        np.any((np.asarray(share) <= 1.0 - MORE_COUNT) & (np.asarray(share) >= np.asarray(before) + MORE_COUNT))
    )


def linearised_in_errors(
    problem: Problem,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    roots: list[np.ndarray] | None = None,
) -> View:
    """Records with the errors of their inputs eliminated, linearised at given ones.

    Parameters
    ----------
    problem : Problem
        With its inputs as measured.
    known : mapping of input to InputErrors
    values : (n_free,) or, where records differ, (n_record, n_local) in SI units
    coefficients : mapping of input to (n_record, n_wave)
    roots : list of (n_wave, n_wave), optional
        See `downweights`.
    """
    rows = _reactions(problem, known, values, coefficients, [None] * len(problem.layout.records))
    return _seen_with(problem, known, values, coefficients, rows, roots)


def _reactions(
    problem: Problem, known: Mapping[str, InputErrors], values: np.ndarray, coefficients: InputCoefficients,
    before: Sequence[np.ndarray | None],
) -> list[np.ndarray]:  # fmt: skip
    """What each wave of the errors of inputs does to readings, see `expanded`; of some records as it was `before`."""
    asked = [r for r, rows in enumerate(before) if rows is None]
    anew = iter(expanded(problem, known, values, coefficients, asked))
    return [next(anew)[2] if rows is None else rows for rows in before]


def _seen_with(
    problem: Problem, known: Mapping[str, InputErrors], values: np.ndarray, coefficients: InputCoefficients,
    rows: Sequence[np.ndarray], roots: list[np.ndarray] | None,
) -> View:  # fmt: skip
    """Records with the errors of their inputs eliminated, given what these do."""
    downweight = downweights(problem, known, values, coefficients, rows, roots)
    return _view(problem, known, InputSensitivities.of(coefficients, rows, downweight))


def _view(problem: Problem, known: Mapping[str, InputErrors], seen: InputSensitivities) -> View:
    return View(downweighted(corrected(problem, known, seen.coefficients), seen.downweight), None, seen, seen)


def _descended(problem: Problem, unknowns: Unknowns, place: Place, view: View) -> PosteriorMode:
    gram, nothing = view.gram(unknowns), np.zeros(0)
    number = float(instant_weights(problem, _weighted(view).downweight).sum())
    with beyond_limits():  # the first of these is without an alternative, and all are short
        begun = PosteriorMode.at(unknowns, place, gram, nothing)
        enough = max(ROUGHLY, COARSE * (begun.normal.cost - number))
        return mode(unknowns, begun, gram, nothing, enough)


def _values(unknowns: Unknowns, problem: Problem, place: Place) -> np.ndarray:
    return unknowns.free_values(problem.layout, unknowns.value(place.z), place.own)


def noise_left(task: Task, found: WithInputErrors) -> np.ndarray:
    """Share of the noise's rms that errors of inputs leave when they are fitted, ``(n_record, n_channel)``."""
    random, weights = np.random.default_rng(0), found.sensitivities.downweight
    data, channels = task.problem.observations, task.problem.model.rig.channels
    seen = np.stack([np.asarray(data.weight[channel]) > 0.0 for channel in channels], axis=1)
    noise = np.zeros((DRAWS, *seen.shape))
    for r, trace in enumerate(task.traces):
        size, rate = len(trace.times), trace.rate
        for c, channel in enumerate(channels):
            for draw in noise:
                wave = task.noise[channel].draw(2 * size, rate, random)[:size]
                draw[r, c, :size] = wave / max(wave.std(), 1e-300)
    rows = np.moveaxis(np.where(seen, noise, 0.0) * weights, 0, 1).reshape(len(weights), DRAWS, -1)
    for own, record in zip(rows, found.sensitivities.records, strict=True):
        own += record.imitated(random.standard_normal((DRAWS, len(record.inverse))), own.shape[1])
    left = found.sensitivities.without_errors(rows).reshape(len(weights), DRAWS, *weights.shape[1:])
    counts = np.sum(np.where(seen, weights, 0.0) ** 2, axis=-1)
    return np.sqrt(np.sum(left**2, axis=-1).mean(axis=1) / np.maximum(counts, 1e-300))


class Ended(NamedTuple):
    """Where a search ended: a fit goes on from there, and does not search anew.

    Parameters
    ----------
    local : (n_record, n_local) in SI units
        Values of each record.
    differ : bool
        Whether records differ in more than their own values.
    coefficients : mapping of input to (n_record, n_wave), optional
        Errors of measured inputs.
    near : InputSensitivities, optional
        Readings linearised in these errors, near there.
    """

    local: np.ndarray
    differ: bool = False
    coefficients: InputCoefficients | None = None
    near: InputSensitivities | None = None


@dataclass(frozen=True)
class Optimum:
    """The problem at its best values, and what the uncertainty is taken from.

    Where an input is measured with noise, the problem is the one with its error taken off, and slopes are what no error
    of the input can imitate.

    Parameters
    ----------
    problem : Problem
    values : (n_free,) in SI units
    local : (n_record, n_local) in SI units
        The same for each record; where a search ended with records that differ, those of each.
    linear : Linearised
    scores : Scores
    expected_gap : float
        Of a perfect model.
    input_errors : dict of input to InputErrorSummary
    coefficients : mapping of input to (n_record, n_wave)
        Errors of the inputs, see `errors_in_variables`.
    view : View, optional
        Readings linearised in those errors.
    predicted_with_inputs : float, optional
        Reduction of the cost predicted of one more step of values and input errors together.
    """

    problem: Problem
    values: np.ndarray
    local: np.ndarray
    linear: Linearised
    scores: Scores
    expected_gap: float = 1.0
    input_errors: Mapping[str, InputErrorSummary] = field(default_factory=dict)
    coefficients: InputCoefficients = field(default_factory=dict)
    view: View | None = None
    predicted_with_inputs: float | None = None

    @property
    def differ(self) -> bool:
        """Whether records have values of their own in place of those they share."""
        return not np.array_equal(self.local, np.asarray(self.problem.layout.local(self.values)))

    def predicted_reduction(self, moving: Sequence[bool]) -> float:
        """Reduction of the cost predicted of one more Gauss-Newton step of the values that are not stopped by a bound.

        In units of the residual variance.
        """
        if self.predicted_with_inputs is not None:
            return self.predicted_with_inputs
        return self.scores.predicted_reduction(np.array(moving[: self.scores.size]))


def optimum(task: Task, values: np.ndarray, ended: Ended | None = None) -> Optimum:
    """What is known at the best values of a task; noisy inputs are corrected first, which moves the values a little.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
        Best for the inputs as they were measured.
    ended : Ended, optional
        Where a search ended at these values.
    """
    problem, known = task.problem, input_errors(task)
    if not known:
        local = np.asarray(problem.layout.local(values))
        linear = linearised(problem, local)
        return Optimum(problem, values, local, linear, Scores.of(problem, linear, values))
    if ended is not None and ended.differ and ended.coefficients is not None:
        # Values that all records share would lose bounces of those that differ.
        local = ended.local
        found = as_it_ended(problem, known, values, local, ended.coefficients, ended.near)
    else:
        coefficients, near = (None, None) if ended is None else (ended.coefficients, ended.near)
        found = with_input_errors(task, known, values, coefficients, near)
        local = np.asarray(problem.layout.local(found.values))
    shares = noise_left(task, found)
    # Residuals and slopes without what errors of the inputs can imitate.
    layout, weights = found.problem.layout, found.sensitivities.downweight
    linear, counts = found.problem.linearised_at(local), np.asarray(found.problem.observations.experiment.count)
    residuals = np.asarray(linear.residuals) * weights
    slopes = np.moveaxis(np.asarray(linear.slopes) * weights[..., None], -1, 1)
    left, waves = found.sensitivities.split(slopes.reshape(*slopes.shape[:2], -1))
    slopes = np.moveaxis(left.reshape(slopes.shape), 1, -1)
    # Errors of inputs that are fitted take some of the readings' noise with them: it is put back.
    whole = residuals / np.where(shares > 0.0, shares, 1.0)[:, :, None]
    prior, belief = np.einsum("riw,rjw->rij", waves, waves), layout.prior_gram(found.values)
    scores = Scores(whole, slopes, counts, layout.local_columns, layout.size, prior, belief)
    errors = {}
    for name, size in error_rms(problem, known, found.coefficients).items():
        squares = [task.input_noise[name].rms(trace.duration, trace.rate) ** 2 for trace in task.traces]
        usual = float(np.sqrt(np.mean(squares)))
        errors[name] = InputErrorSummary(rms=size, noise=usual, unit=ROLES[name], looked_for=known[name].rms)
    expected = float(np.sqrt(np.mean(shares**2)))
    return Optimum(
        found.problem,
        found.values,
        local,
        Linearised(residuals, slopes),
        scores,
        expected,
        errors,
        found.coefficients,
        found.view,
        found.predicted_reduction,
    )


def optimum_of_each(shared: Optimum, local: np.ndarray) -> Optimum:
    """An optimum of exact inputs with values of each record, ``(n_record, n_local)`` in SI units, about shared ones."""
    linear = linearised(shared.problem, local)
    return replace(shared, local=local, linear=linear, scores=Scores.of(shared.problem, linear, shared.values))
