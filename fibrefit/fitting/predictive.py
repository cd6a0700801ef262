"""How uncertain predicted readings are for the error bars of the values they are computed with."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np

from fibrefit.problem.statement.problem import Problem


class Freedom(NamedTuple):
    """Degrees of freedom of F, the law of a mean square that errors of values leave, over what is expected of it.

    Parameters
    ----------
    directions : float
        Independent directions in which readings are off: one where the error of one value outweighs all others.
    known : float
        With which the variance of the values is known; infinite where that is integrated over.
    """

    directions: float
    known: float = np.inf


def predictive_slopes(problem: Problem, local: np.ndarray, names: Sequence[str]) -> np.ndarray:
    """Change of predicted readings by each value, ``(n_record, n_channel, n_time, n_name)`` in units of the noise's.

    Parameters
    ----------
    problem : Problem
        Of the records that are predicted, its parameters free.
    local : (n_record, n_local) in SI units
    names : sequence of str
        Parameters that are not known exactly.

    Law
    ---
    ``P S``, with S the slopes of the readings by the values. P takes out what each record's own values, which are
    fitted to it, make up for.
    """
    slopes = np.asarray(problem.linearised_at(jnp.asarray(local)).slopes)
    free = [problem.layout.names[i] for i in problem.layout.local_free]
    known = [free.index(name) for name in names]
    declared = {parameter.name for parameter in problem.model.parameters}
    own = [i for i, name in enumerate(free) if name not in declared]
    moved = np.zeros((*slopes.shape[:-1], len(known)))
    for r, record in enumerate(slopes):
        rows = np.nan_to_num(record.reshape(-1, len(free)))
        # Columns of the values less their best fit by those of the record's own.
        size = np.linalg.norm(rows[:, own], axis=0)
        used, found = rows[:, own][:, size > 0.0] / size[size > 0.0], rows[:, known]
        if used.size:
            found = found - used @ np.linalg.lstsq(used, found, rcond=None)[0]
        moved[r] = found.reshape(moved[r].shape)
    return moved


def predictive_variance(slopes: np.ndarray, covariance: np.ndarray) -> np.ndarray:
    """Variance of predicted readings ``(...)``, the diagonal of ``P S C S' P``.

    Parameters
    ----------
    slopes : (..., n_name)
        Of `predictive_slopes`.
    covariance : (n_name, n_name)
    """
    values, vectors = np.linalg.eigh(covariance)
    root = vectors * np.sqrt(np.maximum(values, 0.0))
    return np.asarray(np.sum((slopes @ root) ** 2, axis=-1))


def freedom_of(slopes: np.ndarray, covariance: np.ndarray, own: np.ndarray, known: np.ndarray) -> Freedom:
    """Degrees of freedom of the mean square of errors that values leave in the readings of some records.

    Parameters
    ----------
    slopes : (n_record, n_time, n_name)
        Of the readings that count, each in units in which their squares are added.
    covariance : (n_name, n_name)
        Of the values that are predicted with, what a new record differs by included.
    own : (n_name,)
        Part of each variance that every record has for itself; the rest is off alike in all.
    known : (n_name,)
        Degrees of freedom with which each variance is known.

    Law
    ---
    The mean square is ``sum_r e_r'e_r`` with ``Cov(e_r, e_s) = S_r (A + [r = s] W) S_s'``, A what is common and W what
    is a record's own: its degrees of freedom are those of the chi-square law of the same mean and variance. Variances
    that are known with degrees of freedom of their own add up likewise.

    Source
    ------
    Satterthwaite, Biometrics Bulletin 2 (1946).
    """
    gram = np.einsum("rti,rtj->rij", slopes, slopes)
    shares = np.diagonal(covariance) * np.einsum("rii->i", gram)
    mean = float(np.einsum("rij,ji->", gram, covariance))
    if not mean > 0.0:
        return Freedom(1.0)
    common = covariance - np.diag(own)
    half = _square(common @ gram.sum(axis=0)) + np.sum(_square(covariance @ gram) - _square(common @ gram))
    unsure = float(np.sum((shares / mean) ** 2 / known))
    return Freedom(mean**2 / float(half), 1.0 / unsure if unsure > 0.0 else np.inf)


def _square(matrices: np.ndarray) -> np.ndarray:
    """Trace of the squares of matrices ``(..., n, n)``."""
    return np.einsum("...ij,...ji->...", matrices, matrices)
