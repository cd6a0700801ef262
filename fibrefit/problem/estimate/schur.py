"""Small symmetric systems of arrowhead matrices: the records' own unknowns eliminated (Schur complement).

Source
------
Elimination of the records' own unknowns: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973).
"""

from __future__ import annotations

import numpy as np

from fibrefit.problem.statement.equilibration import equilibrated, scale_of


def eliminated(
    shared: np.ndarray, cross: np.ndarray, blocks: np.ndarray, pull: np.ndarray, pulls: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Normal matrix ``(..., n_shared, n_shared)`` and pull without the records' own unknowns (Schur complement).

    Parameters
    ----------
    shared : (n_shared, n_shared)
    cross : (n_record, n_shared, n_own)
    blocks : (..., n_record, n_own, n_own)
    pull : (n_shared,)
    pulls : (n_record, n_own)
    """
    if not blocks.shape[-1]:
        return np.broadcast_to(shared, (*blocks.shape[:-3], *shared.shape)), np.broadcast_to(
            pull, (*blocks.shape[:-3], *pull.shape)
        )
    right = np.concatenate([np.swapaxes(cross, -1, -2), pulls[..., None]], axis=-1)
    share = solved(blocks, np.broadcast_to(right, (*blocks.shape[:-2], *right.shape[-2:])))
    whole = np.einsum("rij,...rjk->...ik", cross, share)
    return shared - whole[..., :-1], pull - whole[..., -1]


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
