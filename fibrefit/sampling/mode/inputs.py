"""Errors in variables: what the errors of measured inputs do to a posterior.

A likelihood takes the inputs for exact. Where a drive's position is measured and multiplied by a stiff fibre it is not:
its error is one more unknown of each record. Values and errors are brought to the place where both together explain the
records best, under the noise spectrum. The ensembles walk around there with the inputs as corrected, which leaves
out how the errors could vary with the values; by what that takes away, the posterior is widened.

It is not `fitting.search.with_input_errors`, which lets records differ: steps here are full ones from the estimate of
a fit, and what is wanted beside the place are the covariances with the errors known and unknown.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.estimate.gls import inverse
from fibrefit.problem.estimate.hausman import HausmanTest, hausman_test, scattered
from fibrefit.problem.inputs.errors_in_variables import (
    InputCoefficients,
    InputErrors,
    corrected,
    expanded,
    no_errors,
)
from fibrefit.problem.inputs.sensitivities import (
    InputSensitivities,
    weighted_sensitivities,
    whitened_sensitivities,
    without_input_errors,
)
from fibrefit.problem.noise.whitening import Levelled, Whitening, innovations
from fibrefit.problem.statement.layout import Layout, assembled, gathered
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task

STEPS = 6
SETTLED = 0.05
"""Change of coefficients, whose prior has a spread of one, or of values in standard errors, that ends the search."""


@dataclass(frozen=True)
class GlsWithInputs:
    """Values and input errors that explain the records best under the noise spectrum.

    Parameters
    ----------
    task : Task
        With the errors taken off its inputs.
    values : (n_free,) in SI units
    widening : (n_free, n_free)
        Covariance in free coordinates that the errors add to that of values sampled with the inputs as corrected.
    hausman : HausmanTest
        Of the plain estimate, with input errors of its own, and of this one.
    """

    task: Task
    values: np.ndarray
    widening: np.ndarray
    hausman: HausmanTest


def inputs_corrected(
    task: Task, known: Mapping[str, InputErrors], values: np.ndarray, coefficients: InputCoefficients | None = None
) -> tuple[Task, InputCoefficients]:
    """The task with the input errors that suit given values best, under white noise, and these errors.

    Parameters
    ----------
    known : mapping of input to InputErrors
    values : (n_free,) in SI units
    coefficients : mapping of input to (n_record, n_wave), optional
        Errors to begin with: a motion that bounces is not led back to its best from just anywhere.
    """
    coefficients = no_errors(known) if coefficients is None else coefficients
    for _ in range(STEPS):
        residuals, _, seen = _linearised(task.problem, known, values, coefficients)
        moved = _named(known, -without_input_errors(seen, residuals + np.asarray(seen.offset)[:, None])[1][:, 0])
        change = max(float(np.abs(moved[name] - coefficients[name]).max()) for name in known)
        coefficients = moved
        if change < SETTLED:
            break
    return replace(task, problem=corrected(task.problem, known, coefficients)), coefficients


def gls_with_inputs(
    task: Task,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    whitening: Whitening,
    level: np.ndarray,
) -> GlsWithInputs:
    """Go from the plain (OLS) estimate to that under coloured noise (GLS).

    Parameters
    ----------
    task : Task
        With its inputs as measured.
    known : mapping of input to InputErrors
    values : (n_free,) in SI units
        The plain estimate.
    coefficients : mapping of input to (n_record, n_wave)
        Its input errors.
    level : (n_channel,)
        Noise over what the whitening assumes.
    """
    problem, layout = task.problem, task.problem.layout
    at = _evaluate(problem, known, values, coefficients, whitening, level)
    hausman = hausman_test(at.step, at.of_plain, at.covariance)
    for _ in range(STEPS):
        error = np.sqrt(np.clip(np.diag(at.covariance), 0.0, None))
        change = float(np.max(np.abs(at.step) / np.where(error > 0.0, error, np.inf)))
        values, coefficients = _inside(layout, values, at.step), at.best
        if change < SETTLED:
            break
        at = _evaluate(problem, known, values, coefficients, whitening, level)
    slope = _slope(layout, values)
    widening = (at.covariance - at.of_corrected) / np.outer(slope, slope)
    found = replace(task, problem=corrected(problem, known, coefficients))
    return GlsWithInputs(found, values, widening, hausman)


class _Evaluation(NamedTuple):
    """Step of the values, best coefficients after it, and covariances ``(n_free, n_free)``, all in SI units.

    What a fit believes of the values beforehand counts in all of them.

    Parameters
    ----------
    step : (n_free,)
    best : mapping of input to (n_record, n_wave)
    covariance, of_corrected, of_plain
        Of the whitened estimate with the coefficients unknown and with the coefficients known, and of the plain one.
    """

    step: np.ndarray
    best: InputCoefficients
    covariance: np.ndarray
    of_corrected: np.ndarray
    of_plain: np.ndarray


def _evaluate(
    problem: Problem,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    whitening: Whitening,
    level: np.ndarray,
) -> _Evaluation:
    layout, belief = problem.layout, problem.layout.prior_gram(values)
    residuals, slopes, seen = _linearised(problem, known, values, coefficients)
    levelled, channels = Levelled(whitening, jnp.asarray(level)), seen.downweight.shape[1]
    rows = np.concatenate([slopes, residuals + np.asarray(seen.offset)[:, None]], axis=1)
    white = np.asarray(_whitened(levelled, rows.reshape(*rows.shape[:2], channels, -1))).reshape(rows.shape)
    kept, imitated = without_input_errors(whitened_sensitivities(seen, levelled), white)
    first = white[:, :-1]
    covariance = inverse(_sum(layout, first, kept[:, :-1]) + belief[:-1, :-1])
    pull = np.einsum("rin,rn->ri", first, kept[:, -1])
    step = -covariance @ (gathered(pull, layout.local_columns, layout.size) + belief[:-1, -1])
    local = np.concatenate([step, [0.0, 0.0]])[layout.local_columns]
    best = -np.einsum("riw,ri->rw", imitated, np.concatenate([local, np.ones((len(local), 1))], axis=1))
    # What no error of the input can imitate, in the eyes of the plain estimate.
    plain = without_input_errors(seen, slopes)[0]
    waved = seen.products(plain)
    columns = np.moveaxis(plain.reshape(*plain.shape[:2], channels, -1), 1, -1)
    coloured = assembled(scattered(columns, whitening, level), layout.local_columns, layout.size)
    middle = coloured + _gathered(layout, [own @ own.T for own in waved]) + belief[:-1, :-1]
    bread = inverse(_sum(layout, slopes, plain) + belief[:-1, :-1])
    alone = inverse(_sum(layout, first, first) + belief[:-1, :-1])
    return _Evaluation(step, _named(known, best), covariance, alone, bread @ middle @ bread)


def _linearised(
    problem: Problem, known: Mapping[str, InputErrors], values: np.ndarray, coefficients: InputCoefficients
) -> tuple[np.ndarray, np.ndarray, InputSensitivities]:
    """Residuals ``(n_record, 1, n)``, slopes ``(n_record, n_local_free, n)`` and sensitivities to errors of inputs."""
    rows = expanded(problem, known, values, coefficients)
    residuals = np.stack([found for found, _, _ in rows])
    seen = weighted_sensitivities(coefficients, [part for _, _, part in rows], np.ones(residuals.shape))
    return residuals.reshape(len(rows), 1, -1), np.stack([own for _, own, _ in rows]), seen


def _whitened(levelled: Levelled, rows: np.ndarray) -> jax.Array:
    """Innovations of rows ``(n_record, n_row, n_channel, n_time)``."""
    return jnp.moveaxis(innovations(levelled, jnp.moveaxis(jnp.asarray(rows), 1, -1)), -1, 1)


def _sum(layout: Layout, left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Products of rows ``(n_record, n_local, n)`` in the places of the free values."""
    return _gathered(layout, np.einsum("rin,rjn->rij", left, right))


def _gathered(layout: Layout, grams: np.ndarray | list[np.ndarray]) -> np.ndarray:
    """Products ``(n_record, n_local, n_local)`` in the places of the free values."""
    return assembled(np.asarray(grams), layout.local_columns, layout.size)


def _named(known: Mapping[str, InputErrors], rows: np.ndarray) -> InputCoefficients:
    ends = np.cumsum([of.size.shape[1] for of in known.values()])[:-1]
    return dict(zip(known, np.split(rows, ends, axis=1), strict=True))


def _inside(layout: Layout, values: np.ndarray, step: np.ndarray) -> np.ndarray:
    """Values after a step, kept off their limits: a step is one in free coordinates, which have none."""
    free = np.asarray(layout.free(jnp.asarray(values)))
    return np.asarray(layout.values(jnp.asarray(free + step / _slope(layout, values))))


def _slope(layout: Layout, values: np.ndarray) -> np.ndarray:
    free = layout.free(jnp.asarray(values))
    return np.asarray(jax.jvp(layout.values, (free,), (jnp.ones_like(free),))[1])
