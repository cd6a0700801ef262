"""Samples compared with those around them."""

from __future__ import annotations

import numpy as np


def neighbourhood(run: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """What the samples on either side predict for each one, and by how much they differ among themselves.

    Parameters
    ----------
    run : (n,) float array
        Readings without NaN, at least 4.

    Returns
    -------
    tuple of (n,) float array and (n,) float array
        Mean of the two next neighbours, and the range of the four nearest; at the ends, of those there are.
    """
    padded = np.concatenate([2 * run[:1] - run[2:0:-1], run, 2 * run[-1:] - run[-2:-4:-1]])
    left, right = padded[1:-3], padded[3:-1]
    further = np.stack([padded[:-4], left, right, padded[4:]])
    middle = 0.5 * (left + right)
    # At the ends there is one side only; its own trend stands in for the other.
    middle[0], middle[-1] = run[1], run[-2]
    spread = np.ptp(further, axis=0)
    spread[0], spread[-1] = np.ptp(run[1:4]), np.ptp(run[-4:-1])
    if run.size > 3:
        spread[1], spread[-2] = np.ptp(run[[0, 2, 3]]), np.ptp(run[[-1, -3, -4]])
    return middle, spread
