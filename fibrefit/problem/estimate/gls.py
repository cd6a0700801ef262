"""Least squares under noise with a memory: each sample counts by what it adds to those before it.

Where noise is autocorrelated, plain least squares listens to it for as long as a record lasts. Residuals and slopes are
whitened instead, and the same Gauss-Newton step taken on what they become: no unbiased estimate is surer.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from fibrefit.problem.noise.whitening import Whitening, innovations
from fibrefit.problem.statement.equilibration import equilibrated, scale_of
from fibrefit.problem.statement.layout import Layout, normal_equations
from fibrefit.problem.statement.problem import Linearised

QUIETEST = 1e-6
"""Level of a channel that says nothing."""


class Whitened(NamedTuple):
    """A linearised problem seen through a whitening.

    Parameters
    ----------
    covariance : (n_free, n_free)
        Of the estimate, if the whitening is right; zero where nothing is seen.
    gradient : (n_free,)
        Products of slopes and residuals.
    level : (n_channel,)
        Noise over what the whitening assumes.
    """

    covariance: np.ndarray
    gradient: np.ndarray
    level: np.ndarray

    @property
    def step(self) -> np.ndarray:
        """To where the whitened residuals are smallest, ``(n_free,)``."""
        return -self.covariance @ self.gradient


def whitened(
    layout: Layout, linear: Linearised, whitening: Whitening, level: np.ndarray | None, belief: np.ndarray | None = None
) -> Whitened:
    """Whiten a linearised problem.

    Law
    ---
    s = -(J'C^-1 J)^-1 J'C^-1 r, with C the covariance of the noise.

    Parameters
    ----------
    level : (n_channel,) or None
        Noise over what the whitening assumes; None: as large as the residuals are.
    belief : (n_free + 1, n_free + 1), optional
        See `Layout.prior_gram`.
    """
    columns = np.concatenate([np.asarray(linear.slopes), np.asarray(linear.residuals)[..., None]], axis=-1)
    fresh = np.asarray(innovations(whitening, columns))
    if level is None:
        level = _level(fresh[..., -1], np.maximum(np.count_nonzero(columns[..., -1], axis=(0, 2)), 1))
    fresh = fresh / level[:, None, None]
    normal, gradient = normal_equations(layout, fresh[..., :-1], fresh[..., -1], belief)
    return Whitened(inverse(normal), gradient, level)


def level_of(whitening: Whitening, residuals: np.ndarray, counts: np.ndarray) -> np.ndarray:
    """Noise of residuals over what a whitening assumes, ``(n_channel,)``.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time)
    counts : (n_channel,)
        Samples that count.
    """
    return _level(np.asarray(innovations(whitening, residuals)), counts)


def _level(fresh: np.ndarray, counts: np.ndarray) -> np.ndarray:
    return np.maximum(np.sqrt(np.sum(fresh**2, axis=(0, 2)) / counts), QUIETEST)


def inverse(matrix: np.ndarray) -> np.ndarray:
    """Pseudo-inverse of a symmetric matrix whose rows may have any units; zero where there is nothing."""
    scale = scale_of(matrix)
    return equilibrated(np.linalg.pinv(equilibrated(matrix, scale), rcond=1e-10, hermitian=True), scale)
