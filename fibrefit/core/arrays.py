"""Arrays that are NumPy's where nothing is compiled and JAX's inside compiled programs: one formula for both."""

from __future__ import annotations

from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

RAN_AWAY = np.errstate(over="ignore", invalid="ignore")
"""Decorates products of slopes: of a motion that ran away they are not finite, and not believed where they are used."""


def functions_for(array: Any) -> Any:
    """`jax.numpy` for what JAX holds or traces, `numpy` for all else: a number at hand needs no compiler."""
    return jnp if isinstance(array, jax.Array) else np


@RAN_AWAY
def assembled(local: Any, columns: Any, size: int) -> Any:
    """Sum of the records' own matrices in the places of the free values; NumPy or JAX.

    Parameters
    ----------
    local : (n_record, n_local, n_local)
    columns : (n_record, n_local) int
        Places; one beyond `size` stands for nothing.

    Returns
    -------
    (size, size)
    """
    places = columns[:, :, None], columns[:, None, :]
    if (xp := functions_for(local)) is not np:
        return xp.zeros((size, size)).at[places].add(local, mode="drop")
    whole = np.zeros((max(size, int(columns.max(initial=0)) + 1),) * 2)
    np.add.at(whole, places, local)
    return whole[:size, :size]


@RAN_AWAY
def gathered(local: np.ndarray, columns: np.ndarray, size: int) -> np.ndarray:
    """Sum of the records' own rows ``(n_record, n_local, ...)`` in the places of the free values, ``(size, ...)``."""
    whole = np.zeros((max(size, int(columns.max(initial=0)) + 1), *local.shape[2:]))
    np.add.at(whole, columns, local)
    return whole[:size]


def gram_root(gram: Any) -> Any:
    """A square matrix R with ``R'R = gram``, for a symmetric, positive semidefinite `gram`; NumPy or JAX.

    With ``gram = [J r]'[J r]`` the last column of R and the others are a residual vector and its Jacobian that have the
    same cost, gradient and normal matrix as those of all samples.
    """
    # Columns differ by many orders of magnitude; an eigenvalue is lost only against others of its own scale.
    xp = functions_for(gram)
    scale = xp.sqrt(xp.diag(gram))
    scale = xp.where(scale > 0.0, scale, 1.0)
    values, vectors = xp.linalg.eigh(gram / (scale[:, None] * scale))
    return xp.sqrt(xp.maximum(values, 0.0))[:, None] * vectors.T * scale
