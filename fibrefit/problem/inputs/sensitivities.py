"""How readings react to errors of measured inputs, so that these can be eliminated from a likelihood.

Law
---
Sensitivities A of a record's weighted readings to the coefficients of its inputs, ``A A' = V diag(a) V'``: along the
principal directions V errors add the powers a to the readings, and ``(I + A'A)^-1 = diag(1 / (1 + a))``. What no error
can imitate of rows r is ``r - A (I + A'A)^-1 A' r``, and products of two such rows, with the prior of the errors that
imitate the rest, are ``r' s - r' A (I + A'A)^-1 A' s``.

Readings in coarse steps: errors of inputs are found from readings taken for fine ones first, which is linear; at these
errors the likelihood of the steps is linearised once more, its slope that where readings were linearised. What errors
do to it from there on is little: a part of a step. With readings ``e + S w`` of errors ``w ~ N(0, I)``, in units of the
noise, ``w1`` those that leave least of fine readings, and deviance residuals ``d``: ``min |d(e + S w)|^2 + |w|^2`` is
that of ``d(e + S w1) + D S (w - w1)``.

Source
------
Kessy, Lewin and Strimmer, Am. Stat. 72 (2018) 309 (ZCA whitening).
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.arrays import RAN_AWAY
from fibrefit.core.threads import for_each
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, downweights, expanded, input_errors
from fibrefit.problem.noise.coloured import BlockFilter
from fibrefit.problem.noise.rounding import before_rounding
from fibrefit.problem.noise.whitening import Levelled, Whitening
from fibrefit.problem.statement.observations import Steps, rows_in_steps
from fibrefit.problem.task import Task

NEGLIGIBLE = 0.1
"""Power an error of the inputs adds to the readings, in units of their noise, below which it is taken for noise: it
would lower a sum of squares by less than a tenth of what noise adds to it in that direction."""


class Directions(NamedTuple):
    """How the readings of one record react to errors of its inputs, along the directions they show most of.

    Parameters
    ----------
    basis : (n_coef, n_direction)
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

    def imitated(self, errors: np.ndarray, size: int) -> np.ndarray:
        """What errors ``(n_row, n_direction)`` do to all readings, ``(n_row, n_channel * n_time)`` of that `size`."""
        number, channels, seen = self.rows.shape
        moved = np.zeros((len(errors), channels, size // channels))
        moved[:, :, :seen] = _in_precision_of_each(errors, self.rows.reshape(number, -1)).reshape(-1, channels, seen)
        return moved.reshape(len(errors), size)

    def best(self, rows: np.ndarray) -> np.ndarray:
        """Errors ``(n_row, n_direction)`` that imitate most of rows, with what is known of errors beforehand."""
        return self.products(rows) @ self.inverse


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
    coefficients : mapping of input to (n_record, n_coef)
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

    @classmethod
    def of(
        cls, coefficients: InputCoefficients, rows: Sequence[np.ndarray], downweight: np.ndarray
    ) -> InputSensitivities:
        """From sensitivities of each record, and factors on the weights of its samples.

        Parameters
        ----------
        coefficients : mapping of input to (n_record, n_coef)
        rows : sequence of (n_coef, n_channel * n_time)
            See `expanded`.
        downweight : (n_record, n_channel, n_time)
        """

        def one(row: np.ndarray, part: np.ndarray, weight: np.ndarray) -> tuple[np.ndarray, Directions]:
            weighted = part * weight.ravel()
            return -row @ weighted, _directions(weighted.reshape(len(part), len(weight), -1))

        errors = np.concatenate(list(coefficients.values()), axis=1)
        offsets, found = zip(*for_each(one, errors, rows, np.asarray(downweight)), strict=True)
        return cls(coefficients, downweight, np.stack(offsets), tuple(found))

    def roots(self) -> list[np.ndarray]:
        """Of the covariance of what is not known of the coefficients, ``(n_coef, n_coef)`` for each record."""
        found = []
        for record in self.records:
            # What no reading shows is as unknown as it was.
            narrowed = np.linalg.cholesky(record.inverse) - np.eye(len(record.inverse))
            found.append(np.eye(len(record.basis)) + record.basis @ narrowed @ record.basis.T)
        return found

    def about(self, coefficients: InputCoefficients) -> InputSensitivities:
        """The same reactions about other errors, which differ from these along the directions that readings show."""
        moved = np.concatenate([coefficients[name] - at for name, at in self.coefficients.items()], axis=1)
        errors = [row[None] @ record.basis for row, record in zip(moved, self.records, strict=True)]
        size = self.offset.shape[1]
        done = [record.imitated(row, size)[0] for record, row in zip(self.records, errors, strict=True)]
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

    def without_errors(self, rows: np.ndarray, products: Sequence[np.ndarray] | None = None) -> np.ndarray:
        """Rows ``(n_record, n_row, n_channel * n_time)`` without what errors of the inputs can imitate."""
        known = self.products(rows) if products is None else products
        parts = zip(self.records, rows, known, strict=True)
        return np.stack([own - record.imitated(of @ record.inverse, own.shape[1]) for record, own, of in parts])

    def split(self, rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What of rows no error of the inputs can imitate, and the coefficients of the errors that imitate the rest.

        Parameters
        ----------
        rows : (n_record, n_row, n_channel * n_time)
            In units of the noise, `downweight` included.

        Returns
        -------
        ((n_record, n_row, n_channel * n_time), (n_record, n_row, n_coef))
        """
        products = self.products(rows)
        known = zip(self.records, products, strict=True)
        coefficients = np.array([own @ record.inverse @ record.basis.T for record, own in known])
        return self.without_errors(rows, products), coefficients

    def through(self, whitening: Whitening | BlockFilter) -> InputSensitivities:
        """Sensitivities seen through a whitening; what they are before it is not changed."""

        def one(record: Directions, rows: np.ndarray) -> Directions:
            return record._replace(rows=rows, inverse=_inverse(rows.reshape(len(rows), -1)))

        white = _whitened(whitening, [record.rows for record in self.records])
        return self._replace(records=tuple(for_each(one, self.records, white)))

    def whitened(self, rows: np.ndarray, products: Sequence[np.ndarray]) -> np.ndarray:
        """Rows ``(n_record, n_row, n_channel * n_time)`` whitened of the errors of the inputs, given their products.

        Noise of the readings and errors of the inputs together have the covariance ``I + AA'``. What `without_errors`
        leaves of a row has the right products only together with the rows of the prior, and what the inputs absorb is
        hardly in it; the symmetric root of the inverse has them by itself, and of all roots leaves each reading nearest
        to where it was (ZCA whitening). It is ``(I + AA')^(-1/2) = I - A F A'``: of a direction whose error adds the
        power a to readings ``F = (1 - (1 + a)^(-1/2)) / a``, with ``c = 1 / (1 + a)`` of the inverse that is
        ``c / (1 + c^(1/2))``.
        """
        done = []
        for record, own, of in zip(self.records, rows, products, strict=True):
            values, vectors = np.linalg.eigh(0.5 * (record.inverse + record.inverse.T))
            values = np.clip(values, 0.0, 1.0)
            root = (vectors * (values / (1.0 + np.sqrt(values)))) @ vectors.T
            done.append(own - record.imitated(of @ root, own.shape[1]))
        return np.stack(done)

    def named(self, errors: Sequence[np.ndarray]) -> InputCoefficients:
        """Errors along the directions of each record, ``(n_direction,)``, as coefficients of each input."""
        whole = np.stack([record.basis @ row for record, row in zip(self.records, errors, strict=True)])
        ends = np.cumsum([row.shape[1] for row in self.coefficients.values()])[:-1]
        return dict(zip(self.coefficients, np.split(whole, ends, axis=1), strict=True))


def sensitivities_of(
    task: Task, values: np.ndarray, coefficients: InputCoefficients, far: bool = False
) -> InputSensitivities | None:
    """Sensitivities of a task's model; None where no input is noisy.

    Parameters
    ----------
    task : Task
    values : (n_free,) or, where records differ, (n_record, n_local) in SI units
    coefficients : mapping of input to (n_record, n_coef)
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
    return InputSensitivities.of(coefficients, rows, downweight)._replace(far=far)


def _directions(rows: np.ndarray) -> Directions:
    """Those of a record, from what each coefficient does to its weighted readings ``(n_coef, ...)``."""
    from scipy.linalg.blas import dsyrk

    # Up to the last instant at which any of the rows is not zero.
    last = int(np.max(np.flatnonzero(rows.any(axis=(0, 1))), initial=0)) + 1
    channels, rows = rows.shape[1], rows[:, :, :last].reshape(len(rows), -1)
    # Products of rows with each other, the lower triangle: half the work of all.
    power, basis = np.linalg.eigh(np.asarray(dsyrk(1.0, rows.T, trans=1, lower=1)))
    power, basis = np.maximum(power[::-1], 0.0), basis[:, ::-1]
    number = max(1, int(np.count_nonzero(power > NEGLIGIBLE)))
    # Beyond it single precision would lose a thousandth of what an error leaves of a slope.
    kind = np.float32 if power[0] < 1e7 else np.float64
    parts = np.ascontiguousarray(basis[:, :number].T, dtype=kind) @ rows.astype(kind, copy=False)
    # Principal directions do not mix: what is known of one says nothing of another.
    return Directions(basis[:, :number], parts.reshape(number, channels, -1), np.diag(1.0 / (1.0 + power[:number])))


def _inverse(rows: np.ndarray) -> np.ndarray:
    """Of ``I + A'A``, from rows ``(n_direction, n)``."""
    # Directions differ by many orders of magnitude: single precision is that of each of them.
    size = np.sqrt(np.sum(rows.astype(float) ** 2, axis=1))
    unit = (rows / np.where(size > 0.0, size, 1.0)[:, None]).astype(rows.dtype)
    gram = (unit @ unit.T).astype(float) * size[:, None] * size
    return np.asarray(np.linalg.inv(gram + np.eye(len(gram))))


def _whitened(whitening: Any, records: Sequence[np.ndarray]) -> list[np.ndarray]:
    """Innovations of the first readings of each record, ``(n_row, n_channel, n_seen)`` each."""
    if isinstance(whitening, Levelled):
        level = np.asarray(whitening.level)[:, None]
        return [(rows / level).astype(rows.dtype) for rows in _whitened(whitening.whitening, records)]
    if hasattr(whitening, "whiten_many"):
        return list(whitening.whiten_many(records))
    whole = np.zeros((max(map(len, records)), len(records), *np.shape(whitening.scales)[1:]))
    for r, rows in enumerate(records):
        whole[: len(rows), r, :, : rows.shape[-1]] = rows
    white = np.asarray(_each(whitening, jnp.asarray(whole)))
    return [white[: len(rows), r, :, : rows.shape[-1]].astype(rows.dtype) for r, rows in enumerate(records)]


@jax.jit
def _each(whitening: Whitening, rows: jax.Array) -> jax.Array:
    return jax.lax.map(whitening.whiten, rows)


_in_steps = jax.jit(rows_in_steps)


@dataclass(frozen=True)
class StepLikelihood:
    """What readings in coarse steps say, given residuals of readings taken for fine ones.

    Parameters
    ----------
    channels : tuple of str
        In the order of the residuals.
    steps : mapping of channel to Steps
        Of those that are read in coarse ones.
    fine : InputSensitivities or None
        Of readings taken for fine ones; None where no input is noisy.
    slope : (n_record, n_channel * n_time) or None
        Of the likelihood's residuals with those of fine readings, where these were linearised.
    """

    channels: tuple[str, ...]
    steps: Mapping[str, Steps]
    fine: InputSensitivities | None = None
    slope: np.ndarray | None = None

    def rows(self, rows: jax.Array, weights: Mapping[str, Any]) -> jax.Array:
        """Residuals of fine readings and their changes as those of readings in steps.

        Parameters
        ----------
        rows : (n_record, n_row, n_channel * n_time) in units of the noise
            Residuals first, of inputs without errors where they are noisy.
        weights : mapping of channel to (n_record, n_time) per SI unit
        """
        if self.fine is None or self.slope is None:
            return self._seen(rows, weights)
        without = jnp.asarray(self.fine.without_errors(np.asarray(rows[:, :1])))
        seen = self._seen(rows.at[:, :1].set(without), weights)
        return seen.at[:, 0].add(self.slope * (rows - without)[:, 0])

    def _seen(self, rows: jax.Array, weights: Mapping[str, Any]) -> jax.Array:
        parts = jnp.split(rows, len(self.channels), axis=2)
        for c, channel in enumerate(self.channels):
            if channel in self.steps:
                parts[c] = _in_steps(parts[c], jnp.asarray(weights[channel]), self.steps[channel])
        return jnp.concatenate(parts, axis=2)

    @cached_property
    def sensitivities(self) -> InputSensitivities | None:
        """To errors of inputs, of what readings in steps say."""
        return None if self.fine is None or self.slope is None else self.fine.scaled(self.slope)


def step_likelihood(
    channels: Sequence[str],
    known: Mapping[str, Steps],
    residuals: np.ndarray,
    weights: Mapping[str, Any],
    fine: InputSensitivities | None,
) -> StepLikelihood:
    """Likelihood of readings in coarse steps, with the noise before rounding that is most probable where they are.

    Parameters
    ----------
    channels : sequence of str
    known : mapping of channel to Steps
        Before anything is known of the noise before rounding.
    residuals : (n_record, n_channel * n_time) in units of the noise
        Of readings taken for fine ones, of inputs without errors where they are noisy.
    weights : mapping of channel to (n_record, n_time) per SI unit
    fine : InputSensitivities or None
    """
    unexplained = residuals if fine is None else fine.without_errors(residuals[:, None])[:, 0]
    away = unexplained.reshape(len(unexplained), len(channels), -1)
    found = {}
    for c, channel in enumerate(channels):
        if channel in known:
            weight, level = np.asarray(weights[channel]), np.asarray(known[channel].level)[:, None]
            seen = weight > 0.0
            distance, share = away[:, c][seen] / weight[seen], (weight * level)[seen] ** 2
            found[channel] = before_rounding(known[channel], distance, share)
    plain = StepLikelihood(tuple(channels), found)
    if fine is None or not found:
        return plain
    # One step about fine readings, no second: that goes too far where slopes were taken in the middle of steps.
    rows = jnp.stack([jnp.asarray(unexplained), jnp.ones_like(unexplained)], axis=1)
    return StepLikelihood(plain.channels, found, fine, np.asarray(plain.rows(rows, weights)[:, 1]))
