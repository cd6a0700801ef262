"""Samples compared with those around them."""

from __future__ import annotations

import numpy as np

#: Samples that are enough for a typical value.
_ENOUGH = 1 << 16


def typical(values: np.ndarray) -> float:
    """Median of an array without NaN; of evenly spread members where it is long.

    Parameters
    ----------
    values : (n,) float array
        At least one.

    Returns
    -------
    float
        Their median, or one of a sample of them.
    """
    stride = max(1, values.size // _ENOUGH) | 1  # odd: a pattern of two alternating values is seen whole
    return float(np.median(values[::stride]))


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
    middle = 0.5 * (left + right)
    highest = np.maximum(np.maximum(left, right), np.maximum(padded[:-4], padded[4:]))
    spread = np.minimum(np.minimum(left, right), np.minimum(padded[:-4], padded[4:]))
    np.subtract(highest, spread, out=spread)
    # At the ends there is one side only; its own trend stands in for the other.
    middle[0], middle[-1] = run[1], run[-2]
    spread[0], spread[-1] = np.ptp(run[1:4]), np.ptp(run[-4:-1])
    if run.size > 3:
        spread[1], spread[-2] = np.ptp(run[[0, 2, 3]]), np.ptp(run[[-1, -3, -4]])
    return middle, spread


def smallest_step(run: np.ndarray) -> float:
    """Step in which readings change, in their unit: that which one in a hundred changes does not exceed; 0 without any.

    Parameters
    ----------
    run : (n,) float array
        Readings without NaN.
    """
    changes = np.abs(np.diff(run))
    changes = changes[changes > 0.0]
    return float(np.quantile(changes, 0.01)) if changes.size else 0.0
