"""Best values together with the errors of measured inputs, by the Gauss-Newton of all estimates.

Readings are linearised in the errors and these are eliminated; where the best ones are found to lie elsewhere,
readings are linearised again there. At first little is known of the errors, and samples that depend on them so
strongly, or bend so soon, that a linear step says nothing of them count for less; with what is learnt from the others
they can be predicted.

Source
------
Bell and Cathey, IEEE Trans. Autom. Control 38 (1993): an iterated Kalman smoother is a Gauss-Newton search.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.core.time_limit import beyond_limits, time_left
from fibrefit.fitting.thresholds import ALL_COUNT, HOPELESS, MISSED_LINEARISED, MORE_COUNT
from fibrefit.problem.estimate.gauss_newton import mode
from fibrefit.problem.estimate.normal_equations import Place, PosteriorMode, Unknowns, arrowhead, place_of
from fibrefit.problem.estimate.unknowns import fit_unknowns, free_values
from fibrefit.problem.estimate.view import View
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, InputErrors, corrected, expanded, no_errors
from fibrefit.problem.inputs.linearity_weights import counted, downweighted, downweights
from fibrefit.problem.inputs.sensitivities import InputSensitivities, weighted_sensitivities
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task

LINEARISATIONS = 4
"""How often readings are linearised at the most."""
REDUCTION_TOLERANCE = 0.05
"""Predicted reduction of the cost by a further step below which a descent ends, in units where 1 is one standard error.

At this scale the cost of a motion that sticks and bounces is rough; a fit is judged at it, too.
"""
COARSE = 1e-3
"""Promised fall at which a descent ends, as a share of what the residuals have beyond the noise: a model that lacks
something has no exact best."""
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
    predicted_reduction : float
        Reduction of the cost predicted of one more step, in units of the residual variance.
    """

    problem: Problem
    values: np.ndarray
    coefficients: InputCoefficients
    view: View
    predicted_reduction: float

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
    unknowns = fit_unknowns(layout, values, np.full(layout.size, np.inf))
    place = place_of(unknowns, np.asarray(layout.local(values)))
    waves, roots = no_errors(known) if coefficients is None else coefficients, None
    found: WithInputErrors | None = None
    beforehand: View | None = None
    samples, share = float(counted(problem).sum()), -1.0
    for _ in range(LINEARISATIONS):
        began = time.monotonic()
        if near is not None and roots is None:
            view = _view(problem, known, near)
        else:
            view = linearised_in_errors(problem, known, _values(unknowns, problem, place), waves, roots)
        beforehand, view = beforehand or view, replace(view, beforehand=beforehand)
        sensitivities = view.raw
        assert sensitivities is not None
        number = float(counted(problem, sensitivities.downweight).sum())
        end = _descended(unknowns, place, view, number)
        variance = max(1.0, end.normal.cost / number)
        if not accounted_for(variance) and found is None and coefficients is not None:
            return with_input_errors(task, known, values)  # where it began was a bad place
        if not accounted_for(variance):
            return found or WithInputErrors(problem, values, no_errors(known), view, 0.0)
        remaining, waves = view.residuals(end.local)
        place, there = end.place, corrected(problem, known, waves)
        left = np.asarray(there.linearised_at(end.local).residuals) * sensitivities.downweight
        # What readings linearised elsewhere predicted of it may be none: a motion that bounces is another one then.
        if accounted_for(float(np.sum(left**2)), number):
            found = WithInputErrors(
                there, _values(unknowns, problem, place), waves, view, end.predicted_reduction / variance
            )
        share, before = number / samples, share
        if as_predicted(left, remaining[0], variance) and not lets_more_count(share, before):
            break
        # Another look takes as long as this one.
        if time_left() <= time.monotonic() - began:
            break
        roots = sensitivities.roots()
    return found or WithInputErrors(problem, values, no_errors(known), view, 0.0)


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
    return cost < HOPELESS * number


def as_predicted(left: np.ndarray, linearised: np.ndarray, variance: float = 1.0) -> bool:
    """Whether residuals are those that linearised readings predict, where they count."""
    return float(np.mean((left - linearised)[linearised != 0.0] ** 2)) < MISSED_LINEARISED * variance


def lets_more_count(share: float, before: float) -> bool:
    """Whether another look may let more of the samples count, of which such shares do and did.

    What is learnt from more samples lets still more of them count, until it does not.
    """
    return not (share > ALL_COUNT or share < before + MORE_COUNT)


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
    rows = [rows for _, _, rows in expanded(problem, known, values, coefficients)]
    downweight = downweights(problem, known, values, coefficients, rows, roots)
    return _view(problem, known, weighted_sensitivities(coefficients, rows, downweight))


def _view(problem: Problem, known: Mapping[str, InputErrors], seen: InputSensitivities) -> View:
    return View(downweighted(corrected(problem, known, seen.coefficients), seen.downweight), None, seen, seen)


def _descended(unknowns: Unknowns, place: Place, view: View, number: float) -> PosteriorMode:
    gram, nothing = view.gram(unknowns), np.zeros(0)
    with beyond_limits():  # the first of these is without an alternative, and all are short
        normal = arrowhead(unknowns, place, gram)
        enough = max(REDUCTION_TOLERANCE, COARSE * (normal.cost - number))
        return mode(unknowns, PosteriorMode(unknowns, place, normal, nothing, np.inf, 1), gram, nothing, enough)


def _values(unknowns: Unknowns, problem: Problem, place: Place) -> np.ndarray:
    return free_values(problem.layout, unknowns, unknowns.value(place.z), place.own)


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
    left = found.sensitivities.left(rows).reshape(len(weights), DRAWS, *weights.shape[1:])
    counts = np.sum(np.where(seen, weights, 0.0) ** 2, axis=-1)
    return np.sqrt(np.sum(left**2, axis=-1).mean(axis=1) / np.maximum(counts, 1e-300))
