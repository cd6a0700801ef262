"""Equilibration (Jacobi scaling) of symmetric matrices, whose rows are of any units: diagonals become one.

Factorisations, ranks and pseudo-inverses of a matrix so scaled do not depend on units, and its condition number is
within a factor of its size of the least that a diagonal scaling reaches.

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
