"""Errors in variables: what measured inputs do to a posterior.

A likelihood takes the inputs for exact. Where a drive's position is measured and multiplied by a stiff fibre it is not:
its error is one more unknown of each record. As in a fit, readings are linearised in the errors at the mode, found
together with the values and with how records differ; the errors are then integrated out of the density, and draws of
them are made again where something is predicted.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.inputs.error_signals import taken_off
from fibrefit.problem.inputs.errors_in_variables import (
    InputCoefficients,
    InputErrors,
    corrected,
    input_errors,
    no_errors,
)
from fibrefit.problem.inputs.linearity_weights import downweighted
from fibrefit.problem.inputs.sensitivities import sensitivities_of
from fibrefit.problem.linear_model.view import View
from fibrefit.problem.noise.whitening import Whitening, innovations
from fibrefit.problem.posterior.log_posterior import InputEffects
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task


def seen_at(task: Task, values: np.ndarray, coefficients: InputCoefficients | None = None) -> View:
    """Records with the errors of their inputs eliminated, linearised at given ones; as they are where inputs are exact.

    Parameters
    ----------
    task : Task
        With its inputs as measured.
    values : (n_free,) or (n_record, n_local) in SI units
    coefficients : mapping of input to (n_record, n_wave), optional
        None by default.
    """
    known = input_errors(task)
    if not known:
        return View(task.problem)
    coefficients = coefficients or no_errors(known)
    seen = sensitivities_of(task, values, coefficients)
    assert seen is not None
    problem = downweighted(corrected(task.problem, known, coefficients), seen.downweight)
    return View(problem, None, seen, seen)


def input_effects_of(seen: View, local: np.ndarray, spread: np.ndarray) -> InputEffects | None:
    """What integrates the errors of inputs out; None where inputs are exact.

    Parameters
    ----------
    seen : View
        Through a whitening and these levels.
    local : (n_record, n_local) in SI units
        Values of each record at the mode.
    spread : (n_channel,)
        Noise over what the whitening itself assumes.
    """
    if seen.sensitivities is None or seen.whitening is None:
        return None
    columns = seen.problem.layout.local_free
    linear = seen.problem.followed(local)[0]
    residuals = np.asarray(linear.residuals)
    zero = seen.without_errors(residuals)
    offset = zero - residuals
    rows = np.concatenate([np.asarray(linear.slopes), zero[..., None], offset[..., None]], axis=-1)
    white = np.moveaxis(np.asarray(innovations(seen.whitening, rows)), -1, 1)
    shape, records = white.shape[2:], seen.sensitivities.records
    found = []
    for record, own in zip(records, white.reshape(*white.shape[:2], -1), strict=True):
        best = -record.best(own[:-1])
        moved = record.imitated(best, own.shape[1])
        moved[-1] += own[-1]
        parts = np.moveaxis(record.rows, 1, 0).astype(float)
        told = [float(np.sum((record.inverse @ part) * part)) for part in parts]
        found.append((moved.reshape(-1, *shape), best @ best.T, -np.linalg.slogdet(record.inverse)[1], told))
    moves, squares, log_dets, number = (np.array(part) for part in zip(*found, strict=True))
    moves = np.moveaxis(moves, 1, -1) * spread[:, None, None]
    return InputEffects(
        local=jnp.asarray(local[:, list(columns)]),
        offset=jnp.asarray(moves[..., -1]),
        slopes=jnp.asarray(moves[..., :-1]),
        squares=jnp.asarray(squares),
        log_det=jnp.asarray(log_dets.sum()),
        told=jnp.asarray(number.sum(axis=0)),
        curvature=jnp.asarray(spread**-2.0),
        columns=tuple(int(column) for column in columns),
    )


def _offset(seen: View) -> np.ndarray:
    """What takes readings back to inputs without errors, linearly, ``(n_record, n_channel, n_time)``."""
    assert seen.raw is not None
    return np.asarray(seen.raw.offset).reshape(seen.raw.downweight.shape)


class BlockPredictor(NamedTuple):
    """Blocks of readings predicted from all others, errors of inputs integrated out.

    Parameters
    ----------
    factors : tuple of (int, (n_time,) int, (n, n))
        Record and instants of a block, and the lower root of the covariance of its innovations, channel by channel.
    log_det : (n_block,)
        Logarithm of the determinant of that root.
    spread : (n_channel,)
        Noise over what the whitening assumes.
    """

    factors: tuple[tuple[int, np.ndarray, np.ndarray], ...]
    log_det: np.ndarray
    spread: np.ndarray

    def predicted(self, innovations: np.ndarray) -> np.ndarray:
        """What is not expected of innovations ``(n_point, n_record, n_channel, n_time)`` at the best errors."""
        innovations = innovations / self.spread[:, None]
        found = innovations.copy()
        for r, where, factor in self.factors:
            own = innovations[:, r][:, :, where]
            found[:, r, :, where] = np.moveaxis((own.reshape(len(own), -1) @ factor).reshape(own.shape), -1, 0)
        return np.asarray(found * self.spread[:, None])


@dataclass(frozen=True)
class DrawnInputs:
    """Errors of measured inputs, drawn from what is known of them at given values.

    Parameters
    ----------
    problem : Problem
        With the inputs as the density takes them, every sample counted in full.
    known : mapping of input to InputErrors
    seen : View
        Through a whitening and the noise at the mode.
    spread : (n_channel,)
        That noise over what the whitening itself assumes.
    """

    problem: Problem
    known: Mapping[str, InputErrors]
    seen: View
    spread: np.ndarray

    def drawn(self, white: np.ndarray, random: np.random.Generator) -> InputCoefficients:
        """Errors beside those that are taken off already, a mapping of input to ``(n_point, n_record, n_wave)``.

        Parameters
        ----------
        white : (n_point, n_record, n_channel, n_time)
            Innovations with the inputs as the density takes them.
        """
        assert self.seen.sensitivities is not None
        assert self.seen.whitening is not None
        sensitivities = self.seen.sensitivities
        rows = white / self.spread[:, None] + np.asarray(innovations(self.seen.whitening, _offset(self.seen)))
        here = np.concatenate(list(sensitivities.coefficients.values()), axis=1)
        waves = []
        for r, record in enumerate(sensitivities.records):
            wave = random.standard_normal((len(rows), len(record.inverse))) @ np.linalg.cholesky(record.inverse).T
            wave -= record.best(rows[:, r].reshape(len(rows), -1))
            waves.append(wave @ record.basis.T - here[r])
        ends = np.cumsum([of.size.shape[1] for of in self.known.values()])[:-1]
        return dict(zip(self.known, np.split(np.stack(waves, axis=1), ends, axis=-1), strict=True))

    def left_out(self, blocks: np.ndarray, n_block: int) -> BlockPredictor:
        """What predicts blocks from the others.

        Law
        ---
        With the errors integrated out innovations have the precision ``P = 1 - W (1 + W'W)^-1 W'``. Those of a block b
        given all others have the covariance ``P_bb^-1 = L L'``, and are ``P_bb^-1 (P m)_b`` off what is expected of
        them; divided by L that is ``L' (P m)_b``, and ``P m`` are the innovations at the best errors.

        Source
        ------
        Buerkner, Gabry and Vehtari, Computational Statistics 36 (2021).

        Parameters
        ----------
        blocks : (n_record, n_time) int
            Block of each instant; the last one is that of what is masked.
        """
        assert self.seen.sensitivities is not None
        factors, log_det = [], np.zeros(n_block)
        for r, record in enumerate(self.seen.sensitivities.records):
            seen = blocks[r, : record.rows.shape[-1]]
            for block in np.setdiff1d(seen, [n_block - 1]):
                where = np.flatnonzero(seen == block)
                rows = record.rows[:, :, where].reshape(len(record.rows), -1).astype(float)
                inside = np.eye(rows.shape[1]) - rows.T @ record.inverse @ rows
                factor = np.linalg.cholesky(np.linalg.inv(inside))
                factors.append((r, where, factor))
                log_det[block] += np.sum(np.log(np.diag(factor)))
        return BlockPredictor(tuple(factors), log_det, self.spread)

    def readings(self, local: np.ndarray, errors: InputCoefficients) -> dict[str, jax.Array]:
        """The model's readings by channel, ``(n_point, n_record, n_time)`` in SI units, such errors taken off as well.

        Parameters
        ----------
        local : (n_point, n_record, n_local) in SI units
        errors : mapping of input to (n_point, n_record, n_wave)
        """
        return _readings(self.problem, dict(self.known), jnp.asarray(local), jax.tree.map(jnp.asarray, dict(errors)))


@eqx.filter_jit
def _readings(problem: Problem, known: Any, local: jax.Array, errors: Any) -> dict[str, jax.Array]:
    experiment = problem.observations.experiment

    def one(row: tuple[jax.Array, Any]) -> dict[str, jax.Array]:
        inputs = jax.vmap(taken_off)(experiment.inputs, experiment.times, known, row[1])
        return problem.predict(row[0], experiment._replace(inputs=inputs))

    return jax.lax.map(one, (local, errors))


def drawn_inputs_of(task: Task, seen: View, spread: np.ndarray) -> DrawnInputs | None:
    """What draws the errors of a task's inputs; None where these are exact.

    Parameters
    ----------
    seen, spread
        As in `input_effects_of`.
    """
    if seen.raw is None:
        return None
    known = input_errors(task)
    return DrawnInputs(corrected(task.problem, known, seen.raw.coefficients), known, seen, spread)


def whitened_residuals(problem: Problem, whitening: Whitening, local: np.ndarray) -> np.ndarray:
    """Innovations ``(n_point, n_record, n_channel, n_time)`` at values ``(n_point, n_record, n_local)``."""
    return np.array(_whitened_residuals(problem, whitening, jnp.asarray(local)))


@eqx.filter_jit
def _whitened_residuals(problem: Problem, whitening: Whitening, local: jax.Array) -> jax.Array:
    return jax.lax.map(lambda own: whitening.whiten(problem.residuals_at(own)), local)
