"""How uncertain predicted readings are for the error bars of the values they are computed with."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from fibrefit.problem.statement.problem import Problem


def predictive_variance(
    problem: Problem, local: np.ndarray, names: Sequence[str], covariance: np.ndarray
) -> np.ndarray:
    """Variance of predicted readings, ``(n_record, n_channel, n_time)`` in units of the noise's.

    Parameters
    ----------
    problem : Problem
        Of the records that are predicted, its parameters free.
    local : (n_record, n_local) in SI units
    names : sequence of str
        Parameters that are not known exactly.
    covariance : (n_name, n_name)

    Law
    ---
    ``diag(P S C S' P)``, with S the slopes of the readings by the values. P takes out what each record's own values,
    which are fitted to it, make up for.
    """
    slopes = np.asarray(problem.linearised_at(jnp.asarray(local)).slopes)
    free = [problem.layout.names[i] for i in problem.layout.local_free]
    known = [free.index(name) for name in names]
    declared = {parameter.name for parameter in problem.model.parameters}
    own = [i for i, name in enumerate(free) if name not in declared]
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    variance = np.zeros(slopes.shape[:-1])
    for r, record in enumerate(slopes):
        rows = np.nan_to_num(record.reshape(-1, len(free)))
        variance[r] = np.sum(_without(rows[:, known] @ root, rows[:, own]) ** 2, axis=1).reshape(variance[r].shape)
    return variance


def _without(moved: np.ndarray, own: np.ndarray) -> np.ndarray:
    """Columns `moved` less their best fit by the columns `own`."""
    size = np.linalg.norm(own, axis=0)
    used = own[:, size > 0.0] / size[size > 0.0]
    return moved - used @ np.linalg.lstsq(used, moved, rcond=None)[0] if used.size else moved
