"""How readings react to errors of measured inputs, so that these can be eliminated from a likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, expanded, input_errors
from fibrefit.problem.inputs.linearity_weights import downweights
from fibrefit.problem.noise.blocks import BlockFilter, in_blocks
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.noise.whitening import Levelled, Whitening
from fibrefit.problem.task import Task

NEGLIGIBLE = 0.1
"""Power an error of the inputs adds to the readings, in units of their noise, below which it is left to the noise: it
would lower a sum of squares by less than a tenth of what noise adds to it in that direction."""

PRECISE = 1e7
"""The same, beyond which single precision is not enough: it loses a thousandth of what an error leaves of a slope."""


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
    basis : (n_record, n_wave, n_direction)
        Orthonormal combinations of coefficients that the readings show most of (principal components).
    rows : (n_record, n_direction, n_channel * n_time)
        What each of these does to the readings; in single precision where that will do, as they are many.
    inverse : (n_record, n_direction, n_direction)
        Of ``I + A'A``.
    """

    coefficients: InputCoefficients
    downweight: np.ndarray
    offset: jax.Array
    basis: np.ndarray
    rows: jax.Array
    inverse: jax.Array

    def roots(self) -> list[np.ndarray]:
        """Of the covariance of what is not known of the coefficients, ``(n_wave, n_wave)`` for each record."""
        found = []
        for basis, inverse in zip(self.basis, np.asarray(self.inverse), strict=True):
            # What no reading shows is as unknown as it was.
            narrowed = np.linalg.cholesky(inverse) - np.eye(len(inverse))
            found.append(np.eye(len(basis)) + basis @ narrowed @ basis.T)
        return found


def sensitivities_of(
    task: Task, values: np.ndarray, coefficients: InputCoefficients, far: bool = False
) -> InputSensitivities | None:
    """Sensitivities of a task's model; None where no input is noisy.

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
    coefficients: InputCoefficients, rows: Sequence[np.ndarray], downweight: np.ndarray, least: float = NEGLIGIBLE
) -> InputSensitivities:
    """From sensitivities of each record, and factors on the weights of its samples.

    Parameters
    ----------
    coefficients : mapping of input to (n_record, n_wave)
    rows : sequence of (n_wave, n_channel * n_time)
        See `expanded`.
    downweight : (n_record, n_channel, n_time)
    least : float
        Power in the readings, in units of their noise, below which an error does not count.
    """
    offsets, powers, bases = [], [], []
    weighted = [part * downweight[r].ravel() for r, part in enumerate(rows)]
    for r, wave in enumerate(np.concatenate(list(coefficients.values()), axis=1)):
        offsets.append(-wave @ weighted[r])
        power, basis = np.linalg.eigh(_lower_gram(weighted[r]))
        powers.append(np.maximum(power[::-1], 0.0))
        bases.append(basis[:, ::-1])
    number = max(1, *(int(np.count_nonzero(power > least)) for power in powers))
    basis = np.stack(bases)[:, :, :number]
    kind = jnp.float32 if max(power[0] for power in powers) < PRECISE else jnp.float64
    parts = [
        jnp.asarray(own.T, dtype=kind) @ jnp.asarray(row, dtype=kind) for own, row in zip(basis, weighted, strict=True)
    ]
    # Principal directions do not mix: what is known of one says nothing of another.
    inverse = jnp.stack([jnp.diag(1.0 / (1.0 + jnp.asarray(power[:number]))) for power in powers])
    return InputSensitivities(coefficients, downweight, jnp.stack(offsets), basis, jnp.stack(parts), inverse)


def _lower_gram(rows: np.ndarray) -> np.ndarray:
    """Products of rows ``(n_row, n)`` with each other, the lower triangle: half the work of all."""
    from scipy.linalg.blas import dsyrk

    return np.asarray(dsyrk(1.0, rows.T, trans=1, lower=1))


def _inverses(rows: jax.Array) -> jax.Array:
    """Of ``I + A'A``, ``(n_record, n_direction, n_direction)``."""
    return jnp.stack([_inverse(part) for part in rows])


@jax.jit
def _inverse(rows: jax.Array) -> jax.Array:
    # Directions differ by many orders of magnitude: single precision is that of each of them.
    size = jnp.sqrt(jnp.sum(rows.astype(float) ** 2, axis=1))
    unit = (rows / jnp.where(size > 0.0, size, 1.0)[:, None]).astype(rows.dtype)
    gram = (unit @ unit.T).astype(float) * size[:, None] * size
    return jnp.linalg.inv(gram + jnp.eye(len(gram)))


def pulled_by(sensitivities: InputSensitivities, rows: np.ndarray) -> np.ndarray:
    """Products ``(n_record, n_row, n_direction)`` of rows ``(n_record, n_row, n)`` with sensitivities.

    Sensitivities are many: a record whose rows are nothing, as it is not asked for, costs nothing.
    """
    along = np.asarray(sensitivities.rows)
    # Rows differ by many orders of magnitude: single precision is that of each row.
    size = np.sqrt(np.einsum("rkn,rkn->rk", rows, rows))[:, :, None]
    unit, pulled = np.where(size > 0.0, size, 1.0), np.zeros((*rows.shape[:2], along.shape[1]))
    for r in np.flatnonzero(size.any(axis=(1, 2))):
        pulled[r] = (rows[r] / unit[r]).astype(along.dtype) @ along[r].T * size[r]
    return pulled


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
        best = some @ seen.T @ np.asarray(sensitivities.inverse[r])
        left[r] = some - best @ seen
        waves.append(best @ sensitivities.basis[r].T)
    return left, np.array(waves)


def whitened_sensitivities(sensitivities: InputSensitivities, whitening: Whitening | BlockFilter) -> InputSensitivities:
    """Sensitivities seen through a whitening; what they are before it is not changed."""
    rows = np.asarray(sensitivities.rows)
    channels = rows.reshape(*rows.shape[:2], sensitivities.downweight.shape[1], -1)
    white = jnp.asarray(_whitened(whitening, channels).reshape(rows.shape), dtype=rows.dtype)
    return sensitivities._replace(rows=white, inverse=_inverses(white))


def _whitened(whitening: Any, rows: np.ndarray) -> np.ndarray:
    """Innovations of ``(n_record, n_row, n_channel, n_time)``, which are many."""
    if isinstance(whitening, Levelled):
        return _whitened(whitening.whitening, rows) / np.asarray(whitening.level)[:, None]
    if isinstance(whitening, Coloured):
        return in_blocks(whitening).whiten_many(rows)
    return whitening.whiten_many(rows) if isinstance(whitening, BlockFilter) else np.asarray(_each(whitening, rows))


@jax.jit
def _each(whitening: Whitening, rows: jax.Array) -> jax.Array:
    return jnp.moveaxis(jax.lax.map(whitening.whiten, jnp.moveaxis(rows, 1, 0)), 0, 1)


__all__ = [
    "InputSensitivities",
    "pulled_by",
    "sensitivities_of",
    "weighted_sensitivities",
    "whitened_sensitivities",
    "without_input_errors",
]
