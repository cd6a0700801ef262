"""A measured input made smooth enough to drive a simulation: its noise would be multiplied by the fibre's stiffness.

Each instant gets the value and slope of a parabola fitted to the samples around it, the farther ones weighted less and
less: windows with sharp edges let a share of the noise through at every frequency, and what accelerates a mass shows
it. How many samples is decided by the samples: as many as agree with the parabolas of all narrower windows, so that
rests and steady strokes are smoothed strongly and the corners of the motion stay corners.

Source
------
Intersection of confidence intervals: Goldenshluger and Nemirovski, Math. Methods Stat. 6 (1997); Katkovnik, IEEE Trans.
Signal Process. 47 (1999). Tapered windows: Cleveland, J. Am. Stat. Assoc. 74 (1979).
"""

from __future__ import annotations

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from fibrefit.core.errors import DataError
from fibrefit.problem.inputs.corners import corner_motion
from fibrefit.problem.thresholds import FEWEST_AROUND
from fibrefit.rigs.signals.rest import fast_part, resolution

WIDTHS = (0.0015, 0.0025, 0.004, 0.006, 0.0085)
"""Half-widths of the windows, in s. Wider ones were measured to lose more of a drive's own motion than of its noise."""
TRUST = 3.0
"""Standard errors within which two windows agree."""


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
    corners = _corners(values, times)
    smooth = values - corners[:, 0]
    weights = _weights(smooth, times, _fast_noise(values), where)
    reach = weights.shape[1] // 2
    around = sliding_window_view(np.pad(np.nan_to_num(smooth), reach), weights.shape[1])
    return corners + np.einsum("nti,nt->ni", weights, around)


def smoother(values: np.ndarray, times: np.ndarray, where: str) -> np.ndarray:
    """Weights with which `smoothed` takes each instant's value and slope from the samples around it.

    Parameters and errors as `smoothed`.

    Returns
    -------
    (n_time, n_near, 2)
        For the samples from ``n_near // 2`` before to as many after; zero beyond the ends and where damaged.
    """
    return _weights(values - _corners(values, times)[:, 0], times, _fast_noise(values), where)


def _corners(values: np.ndarray, times: np.ndarray) -> np.ndarray:
    """Value and slope of what the corners of a motion make."""
    step = float(np.diff(times).mean())
    return corner_motion(values, step, _fast_noise(values), lambda v, half: _parabolas(v, half, step)[0][:, 0])


def _weights(values: np.ndarray, times: np.ndarray, noise: float, where: str) -> np.ndarray:
    """Those of `smoother` for readings without corners, and with so much noise."""
    step = float(np.diff(times).mean())
    some = [width for width in WIDTHS if 2.0 * width < step * len(values) / 3.0]
    halves = sorted({max(round(width / step), FEWEST_AROUND) for width in some}) or [FEWEST_AROUND]
    _refuse_holes(values, times, halves[0], where)
    valid = np.isfinite(values)
    fits = [_parabolas(values, half, step) for half in halves]
    agreed = _widest_agreed([(fit, noise * error) for fit, error, _ in fits])
    # Next to a corner a window may agree by chance: the narrowest of the neighbours is taken. It goes from one width to
    # the next by degrees, since a jump would accelerate what the input drives.
    size = 2 * FEWEST_AROUND + 1
    chosen = uniform_filter1d(minimum_filter1d(agreed, size).astype(float), size, mode="nearest")
    weights = np.zeros((len(values), 2 * halves[-1] + 1, 2))
    for place, half in enumerate(halves):
        share = np.maximum(1.0 - np.abs(chosen - place), 0.0)
        rows = np.flatnonzero(share)
        near = slice(halves[-1] - half, halves[-1] + half + 1)
        there = sliding_window_view(np.pad(valid, half), 2 * half + 1)[rows]
        powers = _taper(half)[:, None] * (np.arange(-half, half + 1) / half)[:, None] ** np.arange(3)
        own = np.einsum("nij,tj,nt->nti", fits[place][2][rows], powers, there)
        weights[rows, near] += share[rows, None, None] * own
    return weights


def _refuse_holes(values: np.ndarray, times: np.ndarray, half: int, where: str) -> None:
    around = _around(np.isfinite(values) * 1.0, np.ones(2 * half + 1))
    edge = np.minimum(np.arange(len(values)), np.arange(len(values))[::-1])
    lacking = around < np.minimum(half + 1, FEWEST_AROUND + np.minimum(edge, 1))
    if lacking.any():
        hole = int(np.argmax(lacking))
        raise DataError(
            where,
            f"only {around[hole]:.0f} usable samples around {times[hole]:.4g} s",
            f"at least {FEWEST_AROUND + 1}: the channel drives the simulation and is not guessed",
            "Cut the record there, or leave it out.",
        )


def _parabolas(values: np.ndarray, half: int, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Value and slope ``(n_time, 2)`` of the parabola around each sample, and their errors for noise of size one.

    The last is what takes them from the weighted moments of the samples around, ``(n_time, 2, 3)``.
    """
    valid, taper = np.isfinite(values), _taper(half)
    offsets = np.arange(-half, half + 1) / half
    normal = _matrix([_around(valid * 1.0, taper * offsets**power) for power in range(5)])
    squares = _matrix([_around(valid * 1.0, taper**2 * offsets**power) for power in range(5)])
    sums = [_around(np.where(valid, values, 0.0), taper * offsets**power) for power in range(3)]
    inverse = np.linalg.inv(normal)[:, :2]
    found = np.einsum("nij,jn->ni", inverse, np.stack(sums))
    scale = np.array([1.0, 1.0 / (half * step)])
    errors = np.sqrt(np.einsum("nij,njk,nik->ni", inverse, squares, inverse)) * scale
    return found * scale, errors, inverse * scale[:, None]


def _taper(half: int) -> np.ndarray:
    """Weights ``(2 half + 1,)`` of the samples of a window: those beyond its ends would have none."""
    return (1.0 - np.abs(np.arange(-half, half + 1) / (half + 1)) ** 3) ** 3


def _matrix(moments: list[np.ndarray]) -> np.ndarray:
    """Matrices ``(n_time, 3, 3)`` of moments by their powers."""
    return np.stack([np.stack([moments[i + j] for j in range(3)], axis=-1) for i in range(3)], axis=-2)


def _widest_agreed(fits: list[tuple[np.ndarray, np.ndarray]]) -> np.ndarray:
    """Index of the widest window whose intervals, and those of all narrower ones, share a point."""
    low, high = np.full_like(fits[0][0], -np.inf), np.full_like(fits[0][0], np.inf)
    agreed, chosen = np.ones(len(low), dtype=bool), np.zeros(len(low), dtype=int)
    for place, (fit, error) in enumerate(fits):
        low, high = np.maximum(low, fit - TRUST * error), np.minimum(high, fit + TRUST * error)
        agreed &= (low <= high).all(axis=1)
        chosen[agreed] = place
    return chosen


def _fast_noise(values: np.ndarray) -> float:
    """Noise of the fast part; coarse readings may stand still for long, and differ by whole steps then."""
    return max(fast_part(values), resolution(values) / np.sqrt(12.0)) + 1e-12


def _around(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sum of weighted neighbours of each sample; nothing lies beyond the ends."""
    return np.convolve(values, weights[::-1].astype(float), mode="same")
