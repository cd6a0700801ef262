"""A measured input made smooth enough to drive a simulation: its noise would be multiplied by the fibre's stiffness.

Each instant gets the value and slope of a parabola fitted to the samples around it. The window is short against the
corners of a drive's motion and long against the hiss of its sensor.
"""

from __future__ import annotations

import numpy as np

from fibrefit.core.errors import DataError

WINDOW = 0.008
"""In s. A drive that changes its acceleration by 10 m/s^2 is then rounded by less than a hundredth of a millimetre."""
FEWEST = 6
"""Valid samples a window must hold: twice the coefficients of a parabola."""


def smoothed(values: np.ndarray, times: np.ndarray, where: str) -> np.ndarray:
    """Value and slope of an input at each instant.

    Parameters
    ----------
    values : (n_time,) in SI units
        Measured; NaN where damaged.
    times : (n_time,) in s
        Equally spaced.
    where : str
        File and channel, for messages.

    Returns
    -------
    (n_time, 2)
        In SI units and SI units per second.

    Raises
    ------
    DataError
        If too many samples in a row are missing: an input is not guessed.
    """
    step = float(np.diff(times).mean())
    half = max(round(0.5 * WINDOW / step), 3)
    valid = np.isfinite(values)
    offsets = np.arange(-half, half + 1)
    filled = np.where(valid, values, 0.0)
    moments = [_around(valid * 1.0, offsets**power) for power in range(5)]
    sums = [_around(filled, offsets**power) for power in range(3)]
    if moments[0].min() < FEWEST:
        hole = int(np.argmin(moments[0]))
        raise DataError(
            where,
            f"only {moments[0][hole]:.0f} usable samples around {times[hole]:.4g} s",
            f"at least {FEWEST} in {1e3 * WINDOW:.0f} ms: the channel drives the simulation and is not guessed",
            "Cut the record there, or leave it out.",
        )
    normal = np.stack([np.stack([moments[i + j] for j in range(3)], axis=-1) for i in range(3)], axis=-2)
    level, slope, _ = np.linalg.solve(normal, np.stack(sums, axis=-1)[..., None])[..., 0].T
    return np.column_stack([level, slope / step])


def _around(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sum of weighted neighbours of each sample; nothing lies beyond the ends."""
    return np.convolve(values, weights[::-1].astype(float), mode="same")
