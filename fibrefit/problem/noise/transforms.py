"""Quadratic forms of stationary noise: sums over all pairs of samples as sums over frequencies."""

from __future__ import annotations

import numpy as np

from fibrefit.problem.statement.layout import RAN_AWAY


def half_weights(size: int) -> np.ndarray:
    """Weights ``(size // 2 + 1,)`` of the frequencies of a real transform of `size` samples in the mean over all."""
    found = np.full(size // 2 + 1, 2.0 / size)
    found[0] = 1.0 / size
    if size % 2 == 0:
        found[-1] = 1.0 / size
    return found


@RAN_AWAY
def products_of_spectra(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Real parts of the sums of ``conj(left[i]) right[j]`` over all but the first axis, ``(n_left, n_right)``."""
    # Real and imaginary parts as so many numbers: their products are the real part.
    pairs = [np.ascontiguousarray(part).reshape(len(part), -1).view(float) for part in (left, right)]
    return pairs[0] @ pairs[1].T
