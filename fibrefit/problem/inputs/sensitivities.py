"""How readings react to errors of measured inputs, so that these can be eliminated from a likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, expanded, input_errors
from fibrefit.problem.inputs.linearity_weights import downweights
from fibrefit.problem.noise.blocks import BlockFilter
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.noise.whitening import Levelled
from fibrefit.problem.task import Task

CHUNK = 64
"""Reactions that are whitened at once."""


class InputSensitivities(NamedTuple):
    """How readings react to errors of measured inputs, which are eliminated from every cost, see `input_error`.

    They are those of the model a search begins with, and of the errors found with it: effects change them at second
    order.

    Parameters
    ----------
    coefficients : mapping of input to (n_record, n_wave)
        The errors; they are taken off the inputs.
    downweight : (n_record, n_channel, n_time)
        Factor on each sample's weight, see `downweights`.
    offset : (n_record, n_channel * n_time)
        What the readings would be without that.
    rows : (n_record, n_wave, n_channel * n_time)
        In single precision, as they are many.
    inverse : (n_record, n_wave, n_wave)
        Of ``I + A'A``.
    """

    coefficients: InputCoefficients
    downweight: np.ndarray
    offset: jax.Array
    rows: jax.Array
    inverse: jax.Array


def sensitivities_of(
    task: Task, values: np.ndarray, coefficients: InputCoefficients, far: bool = False
) -> InputSensitivities | None:
    """Reactions of a task's model; None where no input is noisy.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    coefficients : mapping of input to (n_record, n_wave)
    far : bool
        Whether the model lacks so much that a right one moves otherwise after the first bounce of a record: only what
        is before it counts then.
    """
    if not (known := input_errors(task)):
        return None
    rows = [rows for _, _, rows in expanded(task.problem, known, values, coefficients)]
    downweight = downweights(task.problem, known, values, coefficients, rows)
    if far:
        downweight = np.minimum.accumulate(
            np.broadcast_to(downweight.min(axis=1, keepdims=True), downweight.shape), axis=-1
        )
    return weighted_sensitivities(coefficients, rows, downweight)


def weighted_sensitivities(
    coefficients: InputCoefficients, rows: Sequence[np.ndarray], downweight: np.ndarray
) -> InputSensitivities:
    """From reactions of each record, and factors on the weights of its samples.

    Parameters
    ----------
    coefficients : mapping of input to (n_record, n_wave)
    rows : sequence of (n_wave, n_channel * n_time)
        See `expanded`.
    downweight : (n_record, n_channel, n_time)
    """
    offsets, parts, inverses = [], [], []
    for r, wave in enumerate(np.concatenate(list(coefficients.values()), axis=1)):
        weaker = jnp.asarray(rows[r] * downweight[r].ravel())
        offsets.append(-wave @ weaker)
        inverses.append(jnp.linalg.inv(weaker @ weaker.T + jnp.eye(len(weaker))))
        parts.append(weaker.astype(jnp.float32))
    return InputSensitivities(coefficients, downweight, jnp.stack(offsets), jnp.stack(parts), jnp.stack(inverses))


def without_input_errors(sensitivities: InputSensitivities, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What of some rows no error of the inputs can imitate, and the coefficients of the errors that imitate the rest.

    Parameters
    ----------
    sensitivities : InputSensitivities
    rows : (n_record, n_row, n_channel * n_time)
        In units of the noise, `downweight` included.

    Returns
    -------
    ((n_record, n_row, n_channel * n_time), (n_record, n_row, n_wave))
    """
    left, waves = np.empty_like(rows), []
    for r, some in enumerate(rows):
        seen = np.asarray(sensitivities.rows[r], dtype=float)
        waves.append(some @ seen.T @ np.asarray(sensitivities.inverse[r]))
        left[r] = some - waves[-1] @ seen
    return left, np.array(waves)


def whitened_sensitivities(
    sensitivities: InputSensitivities, whitening: Coloured | BlockFilter | Levelled
) -> InputSensitivities:
    """Reactions seen through a whitening; what they are before it is not changed."""
    rows = _whitened_rows(whitening, sensitivities.rows, sensitivities.downweight.shape[1])
    # Where bounces multiply an error, its prior is small beside what the readings say: sums are in double precision.
    inverse = [jnp.linalg.inv(part @ part.T + jnp.eye(len(part))) for part in (row.astype(float) for row in rows)]
    return sensitivities._replace(rows=rows, inverse=jnp.stack(inverse))


def _whitened_rows(whitening: Coloured | BlockFilter | Levelled, rows: jax.Array, channels: int) -> jax.Array:
    parts = []
    for first in range(0, rows.shape[1], CHUNK):
        some = rows[:, first : first + CHUNK].astype(float)
        split = jnp.moveaxis(some.reshape(*some.shape[:2], channels, -1), 1, 0)
        parts.append(jnp.moveaxis(_whitened(whitening, split), 0, 1).reshape(some.shape).astype(jnp.float32))
    return jnp.concatenate(parts, axis=1)


@jax.jit
def _whitened(whitening: Coloured | BlockFilter | Levelled, rows: jax.Array) -> jax.Array:
    return whitening.whiten_rows(rows)


__all__ = [
    "InputSensitivities",
    "sensitivities_of",
    "weighted_sensitivities",
    "whitened_sensitivities",
    "without_input_errors",
]
