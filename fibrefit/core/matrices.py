"""Symmetric matrices whose rows are of any units: equilibrated (Jacobi scaling) before they are factorised.

Factorisations, ranks and pseudo-inverses of a matrix with a diagonal of ones do not depend on units, and its condition
number is within a factor of its size of the least that a diagonal scaling reaches.

Source
------
van der Sluis, Numerische Mathematik 14 (1969).
"""

from __future__ import annotations

import numpy as np


def scale_of(matrix: np.ndarray) -> np.ndarray:
    """Scale ``(..., n)`` of each row of symmetric matrices ``(..., n, n)``; 1 where nothing is seen."""
    diagonal = np.diagonal(matrix, axis1=-2, axis2=-1)
    return np.sqrt(np.where(diagonal > 0.0, diagonal, 1.0))


def equilibrated(matrix: np.ndarray, scale: np.ndarray) -> np.ndarray:
    """Matrices ``(..., n, n)`` with rows and columns divided by scales ``(..., n)``; their inverses are, too."""
    return matrix / (scale[..., :, None] * scale[..., None, :])


def correlation_matrix(covariance: np.ndarray) -> np.ndarray:
    """Correlations from covariances, ``(n, n)``; NaN in the rows and columns of values that are not determined."""
    spread = np.sqrt(np.diag(covariance))
    known = np.isfinite(spread) & (spread > 0.0)
    with np.errstate(invalid="ignore"):
        return equilibrated(covariance, np.where(known, spread, np.nan))


def log_determinant(matrices: np.ndarray) -> np.ndarray:
    """Logarithms of the determinants of symmetric matrices ``(..., n, n)`` whose rows may have any units."""
    if not matrices.shape[-1]:
        return np.zeros(matrices.shape[:-2])
    scale = scale_of(matrices)
    inside = equilibrated(matrices, scale)
    return np.linalg.slogdet(inside + 1e-14 * np.eye(inside.shape[-1]))[1] + 2.0 * np.log(scale).sum(axis=-1)


def inverses(matrices: np.ndarray) -> np.ndarray:
    """Inverses of symmetric matrices ``(..., n, n)`` whose rows may have any units; zero where there is nothing."""
    return solved(matrices, np.broadcast_to(np.eye(matrices.shape[-1]), matrices.shape))


def solved(blocks: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solutions ``(..., n, m)`` of symmetric systems ``(..., n, n)`` whose rows may have any units.

    Zero where there is nothing.

    Parameters
    ----------
    blocks : (..., n, n)
    right : (..., n, m)
    """
    if not blocks.shape[-1]:
        return np.zeros_like(right)
    scale, size = scale_of(blocks), blocks.shape[-1]
    inside = equilibrated(blocks, scale)
    # What no record sees has an empty row: it stays where it is.
    empty = np.diagonal(inside, axis1=-2, axis2=-1) == 0.0
    inside = inside + empty[..., None] * np.eye(size) + 1e-14 * np.eye(size)
    return np.linalg.solve(inside, right / scale[..., None]) / scale[..., None]


def least_squares(normal: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Solution ``(n,)`` of normal equations whose rows may have any units; the smallest where several solve them.

    Not a number where the equations hold what is none, as slopes are of a motion that the least change leads elsewhere.
    """
    if not (np.isfinite(normal).all() and np.isfinite(right).all()):
        return np.full(len(right), np.nan)
    scale = scale_of(normal)
    return np.linalg.lstsq(equilibrated(normal, scale), right / scale, rcond=1e-10)[0] / scale


def pseudo_inverse(matrix: np.ndarray) -> np.ndarray:
    """Pseudo-inverse of a symmetric matrix whose rows may have any units; zero where there is nothing."""
    scale = scale_of(matrix)
    return equilibrated(np.linalg.pinv(equilibrated(matrix, scale), rcond=1e-10, hermitian=True), scale)
