"""How readings react to errors of measured inputs, so that these can be eliminated from a likelihood."""

from __future__ import annotations

from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.problem.inputs.errors_in_variables import Waves, expanded, input_errors
from fibrefit.problem.inputs.linearity_weights import fades
from fibrefit.problem.noise.coloured import Coloured
from fibrefit.problem.task import Task

CHUNK = 64
"""Reactions that are whitened at once."""


class Reactions(NamedTuple):
    """How readings react to errors of measured inputs, which are eliminated from every cost, see `input_error`.

    They are those of the model a search begins with, and of the errors found with it: effects change them at second
    order.

    Parameters
    ----------
    waves : mapping of input to (n_record, n_wave)
        The errors; they are taken off the inputs.
    fade : (n_record, n_channel, n_time)
        Factor on each sample's weight, see `foretold`.
    offset : (n_record, n_channel * n_time)
        What the readings would be without that.
    rows : (n_record, n_wave, n_channel * n_time)
        In single precision, as they are many.
    inverse : (n_record, n_wave, n_wave)
        Of ``I + A'A``.
    """

    waves: Waves
    fade: np.ndarray
    offset: jax.Array
    rows: jax.Array
    inverse: jax.Array


def reactions_of(task: Task, values: np.ndarray, waves: Waves, far: bool = False) -> Reactions | None:
    """Reactions of a task's model; None where no input is noisy.

    Parameters
    ----------
    task : Task
    values : (n_free,) in SI units
    waves : mapping of input to (n_record, n_wave)
    far : bool
        Whether the model lacks so much that a right one moves otherwise after the first bounce of a record: only what
        is before it counts then.
    """
    if not (known := input_errors(task)):
        return None
    rows = [rows for _, _, rows in expanded(task.problem, known, values, waves)]
    fade = fades(task.problem, known, values, waves, rows)
    if far:
        fade = np.minimum.accumulate(np.broadcast_to(fade.min(axis=1, keepdims=True), fade.shape), axis=-1)
    offsets, parts, inverses = [], [], []
    for r, wave in enumerate(np.concatenate([waves[name] for name in known], axis=1)):
        weaker = jnp.asarray(rows[r] * fade[r].ravel())
        offsets.append(-wave @ weaker)
        inverses.append(jnp.linalg.inv(weaker @ weaker.T + jnp.eye(len(weaker))))
        parts.append(weaker.astype(jnp.float32))
    return Reactions(waves, fade, jnp.stack(offsets), jnp.stack(parts), jnp.stack(inverses))


def reactions_through(reactions: Reactions, whitening: Coloured) -> Reactions:
    """Reactions seen through a whitening; what they are before it is not changed."""
    rows = _whitened_rows(whitening, reactions.rows)
    products = jnp.einsum("rwn,rvn->rwv", rows, rows).astype(float)
    return reactions._replace(rows=rows, inverse=jnp.linalg.inv(products + jnp.eye(rows.shape[1])))


def _whitened_rows(whitening: Coloured, rows: jax.Array) -> jax.Array:
    parts, channels = [], whitening.gain.shape[2]
    for first in range(0, rows.shape[1], CHUNK):
        some = rows[:, first : first + CHUNK].astype(float)
        split = jnp.moveaxis(some.reshape(*some.shape[:2], channels, -1), 1, 0)
        parts.append(jnp.moveaxis(_whitened(whitening, split), 0, 1).reshape(some.shape).astype(jnp.float32))
    return jnp.concatenate(parts, axis=1)


@jax.jit
def _whitened(whitening: Coloured, rows: jax.Array) -> jax.Array:
    return whitening.whiten_rows(rows)


__all__ = ["Reactions", "reactions_of", "reactions_through"]
