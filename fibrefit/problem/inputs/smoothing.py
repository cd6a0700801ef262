"""A measured input made smooth enough to drive a simulation: its noise would be multiplied by the fibre's stiffness.

Each instant gets the value and slope of a parabola fitted to the samples around it, the farther ones weighted less and
less: windows with sharp edges let a share of the noise through at every frequency, and what accelerates a mass shows
it. How many samples is decided by the samples: as many as agree with the parabolas of all narrower windows, so that
rests and steady strokes are smoothed strongly and the corners of the motion stay corners.

A motor accelerates, goes on and brakes: its acceleration is constant for a while and then another. A parabola fitted
across such an instant is off in its slope by the jump times a share of the window, and no noise of the reading holds
that. Found as knots of a quadratic spline and taken off before the smoothing, corners leave it a motion that parabolas
hold.

Law
---
``u(t) = sum_k a_k max(t - t_k, 0)^2 / 2 + what is smooth``. Both sides without their running parabolas: there a corner
is a short wave of known shape, and the rest is noise. A corner is where the matched filter of that shape is highest,
beyond what its own spread over the record allows; all instants and jumps are then fitted together (Gauss-Newton).

Source
------
Intersection of confidence intervals: Goldenshluger and Nemirovski, Math. Methods Stat. 6 (1997); Katkovnik, IEEE Trans.
Signal Process. 47 (1999). Tapered windows: Cleveland, J. Am. Stat. Assoc. 74 (1979). Free knots by forward selection:
Friedman and Silverman, Technometrics 31 (1989). Matched filter: Turin, IRE Trans. Inf. Theory 6 (1960). Joint fits of
all that was selected: Pati, Rezaiifar and Krishnaprasad, Asilomar (1993).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from scipy.ndimage import minimum_filter1d, uniform_filter1d

from fibrefit.core.errors import DataError
from fibrefit.problem.thresholds import CORNER, FEWEST_AROUND
from fibrefit.rigs.signals.rest import fast_part, resolution

WIDTHS = (0.0015, 0.0025, 0.004, 0.006, 0.0085)
"""Half-widths of the windows, in s. Wider ones were measured to lose more of a drive's own motion than of its noise."""
MOST_CORNERS = 64
"""Of a record; a motion of more is none of constant accelerations."""

Filter = Callable[[np.ndarray], np.ndarray]


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
    corners = corner_motion(values, times, _fast_noise(values))
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
    noise = _fast_noise(values)
    return _weights(values - corner_motion(values, times, noise)[:, 0], times, noise, where)


def _weights(values: np.ndarray, times: np.ndarray, noise: float, where: str) -> np.ndarray:
    """Those of `smoother` for readings without corners, and with so much noise."""
    step = float(np.diff(times).mean())
    some = [width for width in WIDTHS if 2.0 * width < step * len(values) / 3.0]
    halves = sorted({max(round(width / step), FEWEST_AROUND) for width in some}) or [FEWEST_AROUND]
    _refuse_holes(values, times, halves[0], where)
    valid = np.isfinite(values)
    fits = [_parabolas(values, half, step) for half in halves]
    # The widest window whose intervals, and those of all narrower ones, share a point. An interval is three standard
    # errors to either side: of normal noise one in 370 misses the truth.
    low, high = np.full_like(fits[0][0], -np.inf), np.full_like(fits[0][0], np.inf)
    sharing, agreed = np.ones(len(values), dtype=bool), np.zeros(len(values), dtype=int)
    for place, (fit, error, _) in enumerate(fits):
        low, high = np.maximum(low, fit - 3.0 * (noise * error)), np.minimum(high, fit + 3.0 * (noise * error))
        sharing &= (low <= high).all(axis=1)
        agreed[sharing] = place
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


def _fast_noise(values: np.ndarray) -> float:
    """Noise of the fast part; coarse readings may stand still for long, and differ by whole steps then."""
    return max(fast_part(values), resolution(values) / np.sqrt(12.0)) + 1e-12


def _around(values: np.ndarray, weights: np.ndarray) -> np.ndarray:
    """Sum of weighted neighbours of each sample; nothing lies beyond the ends."""
    return np.convolve(values, weights[::-1].astype(float), mode="same")


def corner_motion(values: np.ndarray, times: np.ndarray, noise: float) -> np.ndarray:
    """Value and slope ``(n_time, 2)`` of the part of a motion that its corners make; zero where it has none.

    Parameters
    ----------
    values : (n_time,) in SI units
        NaN where damaged.
    times : (n_time,) in s
        Equally spaced.
    noise : in SI units
        Standard deviation of the readings, at the least.
    """
    # The running parabolas are as wide as a drive's acceleration usually lasts, 17 ms to either side: a jump of it
    # stands out by the power 5/2 of this.
    step, found = float(np.diff(times).mean()), np.zeros((len(values), 2))
    half = round(0.017 / step)
    if len(values) <= 8 * half or half < 2:
        return found

    def without_parabolas(motion: np.ndarray) -> np.ndarray:
        return np.nan_to_num(motion - _parabolas(motion, half, step)[0][:, 0])

    instants, jumps = _selected(without_parabolas(values), _Shapes(half, step, without_parabolas), noise)
    since = np.maximum(step * np.arange(len(values))[:, None] - instants, 0.0)
    return np.stack([0.5 * since**2 @ jumps, since @ jumps], axis=-1)


class _Shapes:
    """What corners leave of a motion without its running parabolas; zero beyond twice their half-width.

    Of a corner between two samples it is a sum of what the powers of the time since the sample nearest to it leave.
    """

    def __init__(self, half: int, step: float, without_parabolas: Filter) -> None:
        self.reach, self.step = 2 * half, step
        since = step * np.arange(-2 * self.reach, 2 * self.reach + 1)
        powers = [np.maximum(since, 0.0) ** 2 / 2.0, np.maximum(since, 0.0), since > 0.0, since == 0.0]
        self.powers = np.stack([without_parabolas(power * 1.0)[self.reach : -self.reach] for power in powers])

    def columns(self, instants: np.ndarray, size: int) -> tuple[np.ndarray, np.ndarray]:
        """What corners leave for a jump of one, and how it moves with their instants, ``(size, n_corner)`` each."""
        places = np.round(instants / self.step).astype(int)
        late = instants - places * self.step
        early, none, one = np.maximum(-late, 0.0), np.zeros(len(late)), np.ones(len(late))
        return (
            self._placed(np.stack([one, -late, late**2 / 2.0, early**2 / 2.0], axis=1), places, size),
            self._placed(np.stack([none, -one, late, -early], axis=1), places, size),
        )

    def _placed(self, parts: np.ndarray, places: np.ndarray, size: int) -> np.ndarray:
        found = np.zeros((size + 2 * self.reach, len(places)))
        for column, place, part in zip(found.T, places, parts, strict=True):
            column[place : place + 2 * self.reach + 1] = part @ self.powers
        return found[self.reach : -self.reach]


def _selected(signal: np.ndarray, shapes: _Shapes, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants in s and jumps in SI units of the corners, ``(n_corner,)`` each."""
    instants, jumps, remainder, limit = np.zeros(0), np.zeros(0), signal, 0.0
    step, reach, shape = shapes.step, shapes.reach, shapes.powers[0]
    while len(instants) < MOST_CORNERS:
        # Matched filter of a corner at a sample: of white noise as large as the noise is, whose standard deviation is
        # 1.4826 times the median of its absolute value.
        height = np.abs(np.convolve(remainder, shape[::-1], mode="same") / float(np.linalg.norm(shape)))
        limit = limit or CORNER * max(1.4826 * float(np.median(height)), noise)
        # Where it is beyond the limit and highest, as far apart as the shapes reach; corners closer than 4 ms would
        # follow a single reading that is far off.
        height[:reach] = height[len(height) - reach :] = 0.0
        for place in np.round(instants / step).astype(int):
            height[max(place - round(0.004 / step), 0) : place + round(0.004 / step) + 1] = 0.0
        further: list[float] = []
        while height.max() >= limit and len(instants) + len(further) < MOST_CORNERS:
            place = int(np.argmax(height))
            further.append(place * step)
            height[max(place - 2 * reach, 0) : place + 2 * reach + 1] = 0.0
        if not further:
            break
        # All instants and jumps together; most are settled after four Gauss-Newton steps, close pairs after ten.
        instants = np.concatenate([instants, further])
        for _ in range(12):
            along, later = shapes.columns(instants, len(signal))
            jumps = _least_squares(along, signal)
            moves = _least_squares(np.concatenate([along, later * jumps], axis=1), signal)[len(instants) :]
            moves = np.clip(moves, -step, step)
            instants = np.clip(instants + moves, 0.0, step * (len(signal) - 1))
            if np.abs(moves).max() < 0.01 * step:
                break
        along = shapes.columns(instants, len(signal))[0]
        jumps = _least_squares(along, signal)
        remainder = signal - along @ jumps
    return instants, jumps


def _least_squares(columns: np.ndarray, signal: np.ndarray) -> np.ndarray:
    """Sizes of the columns, ``(n_column,)``; of those that are alike the smallest."""
    rows = columns.any(axis=1)
    columns, signal = columns[rows], signal[rows]
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    scaled = columns / size
    return np.linalg.lstsq(scaled.T @ scaled, scaled.T @ signal, rcond=None)[0] / size
