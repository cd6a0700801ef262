"""Errors in variables: what the errors of measured inputs do to a posterior.

A likelihood takes the inputs for exact. Where a drive's position is measured and multiplied by a stiff fibre it is not:
its error is one more unknown of each record. Values and errors are brought to the place where both together explain the
records best, under the noise spectrum. The ensembles walk around there with the inputs as corrected, which leaves
out how the errors could vary with the values; by what that takes away, the posterior is widened.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.estimate.gls import inverse
from fibrefit.problem.estimate.hausman import HausmanTest, correlated, hausman_test
from fibrefit.problem.inputs.errors_in_variables import (
    InputCoefficients,
    InputErrors,
    corrected,
    expanded,
    no_errors,
    without,
)
from fibrefit.problem.noise.whitening import Whitening, innovations
from fibrefit.problem.statement.layout import Layout, assembled, gathered
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task

STEPS = 6
SETTLED = 0.05
"""Change of coefficients, whose prior has a spread of one, or of values in standard errors, that ends the search."""
CHUNK = 32
"""Rows whitened at once."""


@dataclass(frozen=True)
class Settled:
    """Values and input errors that explain the records best under the noise spectrum.

    Parameters
    ----------
    task : Task
        With the errors taken off its inputs.
    values : (n_free,) in SI units
    widening : (n_free, n_free)
        Covariance in free coordinates that the errors add to that of values sampled with the inputs as corrected.
    parting : HausmanTest
        Of the plain estimate, with input errors of its own, and of this one.
    """

    task: Task
    values: np.ndarray
    widening: np.ndarray
    parting: HausmanTest


def cleaned(
    task: Task, known: Mapping[str, InputErrors], values: np.ndarray, coefficients: InputCoefficients | None = None
) -> tuple[Task, InputCoefficients]:
    """The task with the input errors that suit given values best, under white noise, and these errors.

    Parameters
    ----------
    task : Task
    known : mapping of input to InputErrors
    values : (n_free,) in SI units
    coefficients : mapping of input to (n_record, n_wave), optional
        Errors to begin with: a motion that bounces is not led back to its best from just anywhere.
    """
    coefficients = no_errors(known) if coefficients is None else coefficients
    for _ in range(STEPS):
        best = []
        for r, (residuals, _, sensitivities) in enumerate(expanded(task.problem, known, values, coefficients)):
            missed = residuals.ravel() - _flat(coefficients, r) @ sensitivities
            best.append(-without(sensitivities, missed[None])[0][:, 0])
        moved = _named(known, np.stack(best))
        change = max(float(np.abs(moved[name] - coefficients[name]).max()) for name in known)
        coefficients = moved
        if change < SETTLED:
            break
    return replace(task, problem=corrected(task.problem, known, coefficients)), coefficients


def settled(
    task: Task,
    known: Mapping[str, InputErrors],
    values: np.ndarray,
    coefficients: InputCoefficients,
    whitening: Whitening,
    level: np.ndarray,
) -> Settled:
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
    whitening : Whitening
    level : (n_channel,)
        Noise over what the whitening assumes.
    """
    problem, layout = task.problem, task.problem.layout
    at = _evaluate(problem, known, values, coefficients, whitening, level)
    parting = hausman_test(at.step, at.of_plain, at.covariance)
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
    return Settled(found, values, widening, parting)


class _Evaluation(NamedTuple):
    """Step of the values, best coefficients after it, and covariances ``(n_free, n_free)``, all in SI units.

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
    layout, rows = problem.layout, expanded(problem, known, values, coefficients)
    shape = rows[0][0].shape
    missed = [
        residuals.ravel() - _flat(coefficients, r) @ sensitivities
        for r, (residuals, _, sensitivities) in enumerate(rows)
    ]
    slopes = [own for _, own, _ in rows]
    # What no error of the input can imitate, in the eyes of the plain estimate.
    plain = [without(sensitivities, own)[1] for _, own, sensitivities in rows]
    white = _whitened(
        [np.concatenate([own, miss[None], of_inputs]) for (_, own, of_inputs), miss in zip(rows, missed, strict=True)],
        shape, whitening, level,
    )  # fmt: skip
    size = len(slopes[0])
    kept = [without(part[size + 1 :], part[: size + 1]) for part in white]
    first = [part[:size] for part in white]
    orthogonal = [rest for _, rest in kept]
    normal = _sum(layout, first, [rest[:size] for rest in orthogonal])
    covariance = inverse(normal)
    pull = np.stack([own @ rest[-1] for own, rest in zip(first, orthogonal, strict=True)])
    step = -covariance @ gathered(pull, layout.local_columns, layout.size)
    waved = [sensitivities @ own.T for (_, _, sensitivities), own in zip(rows, plain, strict=True)]
    middle = _sum(layout, plain, _coloured(plain, shape, whitening, level)) + _sum(
        layout, [w.T for w in waved], [w.T for w in waved]
    )
    bread = inverse(_sum(layout, slopes, plain))
    local = np.concatenate([step, [0.0, 0.0]])[layout.local_columns]
    best = np.stack([-(imitated @ np.append(own, 1.0)) for (imitated, _), own in zip(kept, local, strict=True)])
    return _Evaluation(
        step, _named(known, best), covariance, inverse(_sum(layout, first, first)), bread @ middle @ bread
    )


def _sum(layout: Layout, left: list[np.ndarray], right: list[np.ndarray]) -> np.ndarray:
    """Products of rows ``(n_local, n)`` of all records in the places of the free values."""
    products = np.stack([a @ b.T for a, b in zip(left, right, strict=True)])
    return assembled(products, layout.local_columns, layout.size)


def _whitened(rows: list[np.ndarray], shape: tuple[int, ...], whitening: Whitening, level: np.ndarray) -> list:
    """Innovations of rows ``(n_row, n_channel * n_time)`` of every record, over the level of the noise."""
    stacked = np.stack([part.reshape(-1, *shape) for part in rows])
    rest = -stacked.shape[1] % CHUNK
    stacked = np.concatenate([stacked, np.zeros((len(rows), rest, *shape))], axis=1)
    for first in range(0, stacked.shape[1], CHUNK):
        part = np.moveaxis(stacked[:, first : first + CHUNK], 1, -1)
        white = np.asarray(innovations(whitening, jnp.asarray(part))) / level[:, None, None]
        stacked[:, first : first + CHUNK] = np.moveaxis(white, -1, 1)
    count = len(rows[0])
    return [part[:count].reshape(count, -1) for part in stacked]


def _coloured(rows: list[np.ndarray], shape: tuple[int, ...], whitening: Whitening, level: np.ndarray) -> list:
    """Covariance of the noise times rows ``(n_row, n_channel * n_time)`` of every record."""
    stacked = np.stack([np.moveaxis(part.reshape(-1, *shape), 0, -1) for part in rows])
    return [np.moveaxis(part, -1, 0).reshape(len(rows[0]), -1) for part in correlated(stacked, whitening, level)]


def _flat(coefficients: InputCoefficients, record: int) -> np.ndarray:
    return np.concatenate([np.asarray(rows[record]) for rows in coefficients.values()])


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
