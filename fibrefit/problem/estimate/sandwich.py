"""How much more scores scatter than their information says: the sandwich variance over the inverse information.

The sandwich variance is that by how scores of parts of the records scatter. It exceeds the other where innovations are
not what they are taken for: heavy tails, slopes that predict little, a spectrum that is not quite right.

Source
------
White, Econometrica 50 (1982).
"""

from __future__ import annotations

import numpy as np

from fibrefit.problem.estimate.normal_equations import PosteriorMode, held_places, own_precision
from fibrefit.problem.estimate.schur import solved


def overdispersion_of_scores(
    found: PosteriorMode, products: np.ndarray, grams: np.ndarray, covariance: np.ndarray
) -> np.ndarray:
    """Variance of each shared value by how its scores scatter over the one it is taken to have, ``(n_shared,)``.

    Parameters
    ----------
    found : PosteriorMode
    products : (n_record, n_stretch, n_column + 1, n_column + 1)
        Of changes and residuals within each stretch of a record, the residuals last.
    grams : (n_record, n_column + 1, n_column + 1)
        Their sums, per unit of the coordinates.
    covariance : (n_shared, n_shared)
    """
    unknowns = found.unknowns
    raw = np.sqrt(np.maximum(np.einsum("rsii->ri", products), 1e-300))
    rate = np.sqrt(np.maximum(np.einsum("rii->ri", grams), 0.0)) / raw
    scores = products[..., :-1, -1] * rate[:, None, :-1]
    n, mine = len(unknowns.shared), unknowns.own
    blocks = found.normal.blocks + np.diag(own_precision(unknowns, found.sigma))
    share = solved(blocks, np.swapaxes(found.normal.cross, 1, 2))
    own = np.where(held_places(unknowns)[:, None], 0.0, scores[..., mine])
    moved = (scores[..., :n] - np.einsum("rsj,rji->rsi", own, share)) @ covariance
    return np.asarray(np.sum(moved**2, axis=(0, 1)) / np.maximum(np.diag(covariance), 1e-300))


def overdispersion_of_change(products: np.ndarray) -> float:
    """The same along one finite change of the readings, such as that which an effect makes.

    Where a change bends, as a bounce makes it, slopes at its end say nothing of it: it may lie in a few readings that
    tails of the noise have made loud.

    Parameters
    ----------
    products : (n_record, n_stretch, 2, 2)
        Of the change and of residuals within each stretch of a record, the residuals last.
    """
    size = float(np.sum(products[..., 0, 0]))
    return float(np.sum(products[..., 0, 1] ** 2)) / size if size > 0.0 else 1.0
