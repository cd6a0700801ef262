"""How readings react to errors of measured inputs, so that these can be eliminated from a likelihood."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.threads import for_each
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, expanded, input_errors
from fibrefit.problem.inputs.linearity_weights import downweights
from fibrefit.problem.noise.blocks import BlockFilter, in_blocks
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.noise.whitening import Levelled, Whitening
from fibrefit.problem.statement.layout import RAN_AWAY
from fibrefit.problem.task import Task

NEGLIGIBLE = 0.1
"""Power an error of the inputs adds to the readings, in units of their noise, below which it is left to the noise: it
would lower a sum of squares by less than a tenth of what noise adds to it in that direction."""

PRECISE = 1e7
"""The same, beyond which single precision is not enough: it loses a thousandth of what an error leaves of a slope."""


class Directions(NamedTuple):
    """How the readings of one record react to errors of its inputs, along the directions they show most of.

    Parameters
    ----------
    basis : (n_wave, n_direction)
        Orthonormal combinations of coefficients (principal components).
    rows : (n_direction, n_channel, n_seen)
        What each of these does to the readings up to the last one that counts; in single precision where that will do.
    inverse : (n_direction, n_direction)
        Of ``I + A'A``.
    """

    basis: np.ndarray
    rows: np.ndarray
    inverse: np.ndarray

    def products(self, rows: np.ndarray) -> np.ndarray:
        """Products ``(n_row, n_direction)`` of rows ``(n_row, n_channel * n_time)`` with what each direction does."""
        number, channels, seen = self.rows.shape
        # Directions are many: rows of a record that is not needed are nothing, and cost nothing.
        if not rows.any():
            return np.zeros((len(rows), number))
        whole = rows.reshape(len(rows), channels, -1)[:, :, :seen].reshape(len(rows), -1)
        return _in_precision_of_each(whole, self.rows.reshape(number, -1).T)

    def imitated(self, waves: np.ndarray, size: int) -> np.ndarray:
        """What errors ``(n_row, n_direction)`` do to all readings, ``(n_row, n_channel * n_time)`` of that `size`."""
        number, channels, seen = self.rows.shape
        moved = np.zeros((len(waves), channels, size // channels))
        moved[:, :, :seen] = _in_precision_of_each(waves, self.rows.reshape(number, -1)).reshape(-1, channels, seen)
        return moved.reshape(len(waves), size)

    def best(self, rows: np.ndarray) -> np.ndarray:
        """Errors ``(n_row, n_direction)`` that imitate most of rows, with what is known of errors beforehand."""
        return self.products(rows) @ self.inverse

    def share_of_root(self) -> np.ndarray:
        """``F`` of the symmetric root ``(I + AA')^(-1/2) = I - A F A'``, ``(n_direction, n_direction)``.

        Of a direction whose error adds the power a to readings, ``F = (1 - (1 + a)^(-1/2)) / a``: with ``c`` the
        eigenvalue ``1 / (1 + a)`` of the inverse that is ``c / (1 + c^(1/2))``.
        """
        values, vectors = np.linalg.eigh(0.5 * (self.inverse + self.inverse.T))
        values = np.clip(values, 0.0, 1.0)
        return np.asarray((vectors * (values / (1.0 + np.sqrt(values)))) @ vectors.T)


@RAN_AWAY
def _in_precision_of_each(rows: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Product of rows, which differ by many orders of magnitude, and a matrix in a precision that is that of each."""
    size = np.max(np.abs(rows), axis=1, keepdims=True, initial=0.0)
    size = np.where(size > 0.0, size, 1.0)
    # The matrix is the larger one by far: as the first factor BLAS reads it a fifth faster.
    return (others.T @ (rows / size).astype(others.dtype).T).T.astype(float) * size


class InputSensitivities(NamedTuple):
    """How readings react to errors of measured inputs, which are eliminated from every cost, see `errors_in_variables`.

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
    records : tuple of Directions
    far : bool
        Whether a record counts up to its first bounce alone, see `sensitivities_of`.
    """

    coefficients: InputCoefficients
    downweight: np.ndarray
    offset: np.ndarray
    records: tuple[Directions, ...]
    far: bool = False

    def roots(self) -> list[np.ndarray]:
        """Of the covariance of what is not known of the coefficients, ``(n_wave, n_wave)`` for each record."""
        found = []
        for record in self.records:
            # What no reading shows is as unknown as it was.
            narrowed = np.linalg.cholesky(record.inverse) - np.eye(len(record.inverse))
            found.append(np.eye(len(record.basis)) + record.basis @ narrowed @ record.basis.T)
        return found

    def about(self, coefficients: InputCoefficients) -> InputSensitivities:
        """The same reactions about other errors, which differ from these along the directions that readings show."""
        moved = np.concatenate([coefficients[name] - at for name, at in self.coefficients.items()], axis=1)
        waves = [wave[None] @ record.basis for wave, record in zip(moved, self.records, strict=True)]
        size = self.offset.shape[1]
        done = [record.imitated(wave, size)[0] for record, wave in zip(self.records, waves, strict=True)]
        return self._replace(coefficients=coefficients, offset=self.offset - np.stack(done))

    def until(self, counts: Sequence[int]) -> InputSensitivities:
        """Sensitivities of the first samples ``(n_record,)`` of each record; what comes after them does not count."""
        inside = np.arange(self.downweight.shape[-1]) < np.asarray(counts)[:, None, None]
        parts = [one._replace(rows=one.rows[:, :, : max(n, 1)]) for one, n in zip(self.records, counts, strict=True)]
        shorter = [one._replace(inverse=_inverse(one.rows.reshape(len(one.rows), -1))) for one in parts]
        offset = np.where(inside, self.offset.reshape(self.downweight.shape), 0.0).reshape(self.offset.shape)
        return self._replace(downweight=np.where(inside, self.downweight, 0.0), offset=offset, records=tuple(shorter))

    def scaled(self, factor: np.ndarray) -> InputSensitivities:
        """Sensitivities of readings ``(n_record, n_channel * n_time)`` times as large."""

        def one(record: Directions, by: np.ndarray, weight: np.ndarray) -> Directions:
            rows = record.rows * by.reshape(weight.shape)[:, : record.rows.shape[-1]].astype(record.rows.dtype)
            return record._replace(rows=rows, inverse=_inverse(rows.reshape(len(rows), -1)))

        records = tuple(for_each(one, self.records, factor, self.downweight))
        return self._replace(offset=self.offset * factor, records=records)

    def products(self, rows: np.ndarray) -> tuple[np.ndarray, ...]:
        """Products of rows ``(n_record, n_row, n_channel * n_time)`` with directions, ``(n_row, n_direction)`` each."""
        return tuple(for_each(Directions.products, self.records, rows))

    @RAN_AWAY
    def eliminated(self, grams: np.ndarray, products: Sequence[np.ndarray]) -> np.ndarray:
        """Products of rows ``(n_record, n_row, n_row)``, given those with directions, with the errors at their best."""
        pairs = zip(self.records, products, strict=True)
        return grams - np.stack([own @ record.inverse @ own.T for record, own in pairs])

    def left(self, rows: np.ndarray, products: Sequence[np.ndarray] | None = None) -> np.ndarray:
        """Rows ``(n_record, n_row, n_channel * n_time)`` without what errors of the inputs can imitate."""
        known = self.products(rows) if products is None else products
        parts = zip(self.records, rows, known, strict=True)
        return np.stack([own - record.imitated(of @ record.inverse, own.shape[1]) for record, own, of in parts])

    def whitened(self, rows: np.ndarray, products: Sequence[np.ndarray]) -> np.ndarray:
        """Rows ``(n_record, n_row, n_channel * n_time)`` whitened of the errors of the inputs, given their products.

        Noise of the readings and errors of the inputs together have the covariance ``I + AA'``. What is `left` of a row
        has the right products only together with the rows of the prior, and what the inputs absorb is hardly in it; the
        symmetric root of the inverse has them by itself, and of all roots leaves each reading nearest to where it was.

        Source
        ------
        Kessy, Lewin and Strimmer, Am. Stat. 72 (2018) 309 (ZCA whitening).
        """
        parts = zip(self.records, rows, products, strict=True)
        done = [own - record.imitated(of @ record.share_of_root(), own.shape[1]) for record, own, of in parts]
        return np.stack(done)

    def named(self, waves: Sequence[np.ndarray]) -> InputCoefficients:
        """Errors along the directions of each record, ``(n_direction,)``, as coefficients of each input."""
        whole = np.stack([record.basis @ wave for record, wave in zip(self.records, waves, strict=True)])
        ends = np.cumsum([wave.shape[1] for wave in self.coefficients.values()])[:-1]
        return dict(zip(self.coefficients, np.split(whole, ends, axis=1), strict=True))


def sensitivities_of(
    task: Task, values: np.ndarray, coefficients: InputCoefficients, far: bool = False
) -> InputSensitivities | None:
    """Sensitivities of a task's model; None where no input is noisy.

    Parameters
    ----------
    task : Task
    values : (n_free,) or, where records differ, (n_record, n_local) in SI units
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
    return weighted_sensitivities(coefficients, rows, downweight)._replace(far=far)


def weighted_sensitivities(
    coefficients: InputCoefficients, rows: Sequence[np.ndarray], downweight: np.ndarray
) -> InputSensitivities:
    """From sensitivities of each record, and factors on the weights of its samples.

    Parameters
    ----------
    coefficients : mapping of input to (n_record, n_wave)
    rows : sequence of (n_wave, n_channel * n_time)
        See `expanded`.
    downweight : (n_record, n_channel, n_time)
    """

    def one(wave: np.ndarray, part: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, Directions]:
        weighted = part * weight.ravel()
        return -wave @ weighted, _directions(weighted.reshape(len(part), len(weight), -1))

    waves = np.concatenate(list(coefficients.values()), axis=1)
    offsets, found = zip(*for_each(one, waves, rows, np.asarray(downweight)), strict=True)
    return InputSensitivities(coefficients, downweight, np.stack(offsets), tuple(found))


def _directions(rows: np.ndarray) -> Directions:
    """Those of a record, from what each wave does to its weighted readings ``(n_wave, n_channel, n_time)``."""
    channels = rows.shape[1]
    rows = rows[:, :, : _last(rows)].reshape(len(rows), -1)
    power, basis = np.linalg.eigh(_lower_gram(rows))
    power, basis = np.maximum(power[::-1], 0.0), basis[:, ::-1]
    number = max(1, int(np.count_nonzero(power > NEGLIGIBLE)))
    kind = np.float32 if power[0] < PRECISE else np.float64
    parts = np.ascontiguousarray(basis[:, :number].T, dtype=kind) @ rows.astype(kind, copy=False)
    # Principal directions do not mix: what is known of one says nothing of another.
    return Directions(basis[:, :number], parts.reshape(number, channels, -1), np.diag(1.0 / (1.0 + power[:number])))


def _last(rows: np.ndarray) -> int:
    """Number of instants up to the last one at which any of the rows is not zero; at least one."""
    return int(np.max(np.flatnonzero(rows.any(axis=(0, 1))), initial=0)) + 1


def _lower_gram(rows: np.ndarray) -> np.ndarray:
    """Products of rows ``(n_row, n)`` with each other, the lower triangle: half the work of all."""
    from scipy.linalg.blas import dsyrk

    return np.asarray(dsyrk(1.0, rows.T, trans=1, lower=1))


def _inverse(rows: np.ndarray) -> np.ndarray:
    """Of ``I + A'A``, from rows ``(n_direction, n)``."""
    # Directions differ by many orders of magnitude: single precision is that of each of them.
    size = np.sqrt(np.sum(rows.astype(float) ** 2, axis=1))
    unit = (rows / np.where(size > 0.0, size, 1.0)[:, None]).astype(rows.dtype)
    gram = (unit @ unit.T).astype(float) * size[:, None] * size
    return np.asarray(np.linalg.inv(gram + np.eye(len(gram))))


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
    left, waves = [], []
    for record, some in zip(sensitivities.records, rows, strict=True):
        best = record.best(some)
        left.append(some - record.imitated(best, some.shape[1]))
        waves.append(best @ record.basis.T)
    return np.array(left), np.array(waves)


def whitened_sensitivities(sensitivities: InputSensitivities, whitening: Whitening | BlockFilter) -> InputSensitivities:
    """Sensitivities seen through a whitening; what they are before it is not changed."""

    def one(record: Directions, rows: np.ndarray) -> Directions:
        return record._replace(rows=rows, inverse=_inverse(rows.reshape(len(rows), -1)))

    white = _whitened(whitening, [record.rows for record in sensitivities.records])
    return sensitivities._replace(records=tuple(for_each(one, sensitivities.records, white)))


def _whitened(whitening: Any, records: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Innovations of the first readings of each record, ``(n_row, n_channel, n_seen)`` each."""
    if isinstance(whitening, Levelled):
        level = np.asarray(whitening.level)[:, None]
        return [(rows / level).astype(rows.dtype) for rows in _whitened(whitening.whitening, records)]
    if isinstance(whitening, Coloured):
        whitening = in_blocks(whitening)
    if isinstance(whitening, BlockFilter):
        return whitening.whiten_many(records)
    whole = np.zeros((max(map(len, records)), len(records), *whitening.valid.shape[1:]))
    for r, rows in enumerate(records):
        whole[: len(rows), r, :, : rows.shape[-1]] = rows
    white = np.asarray(_each(whitening, jnp.asarray(whole)))
    return [white[: len(rows), r, :, : rows.shape[-1]].astype(rows.dtype) for r, rows in enumerate(records)]


@jax.jit
def _each(whitening: Whitening, rows: jax.Array) -> jax.Array:
    return jax.lax.map(whitening.whiten, rows)
