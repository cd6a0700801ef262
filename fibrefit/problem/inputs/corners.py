"""Corners of a measured motion: instants at which its acceleration jumps, found as knots of a quadratic spline.

A motor accelerates, goes on and brakes: its acceleration is constant for a while and then another. A parabola fitted
across such an instant is off in its slope by the jump times a share of the window, and no noise of the reading holds
that. Found as knots and taken off before the smoothing, corners leave it a motion that parabolas hold.

Law
---
``u(t) = sum_k a_k max(t - t_k, 0)^2 / 2 + what is smooth``. Both sides without their running parabolas: there a corner
is a short wave of known shape, and the rest is noise. A corner is where the matched filter of that shape is highest,
beyond what its own spread over the record allows; all instants and jumps are then fitted together (Gauss-Newton).

Source
------
Free knots by forward selection: Friedman and Silverman, Technometrics 31 (1989). Matched filter: Turin, IRE Trans.
Inf. Theory 6 (1960). Joint fits of all that was selected: Pati, Rezaiifar and Krishnaprasad, Asilomar (1993).
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from fibrefit.problem.thresholds import CORNER

REACH = 0.017
"""Half-width in s of the running parabolas: as long as a drive's acceleration usually lasts, and a jump of it stands
out by the power 5/2 of this."""
CLOSEST_CORNERS = 0.004
"""s between corners: closer ones would follow a single reading that is far off."""
MOST = 64
"""Corners of a record; a motion of more is none of constant accelerations."""
STEPS = 12
"""Gauss-Newton steps at the most after further corners; most are settled after four, close pairs after ten."""
SETTLED = 0.01
"""Share of a sample by which an instant still moves."""
MAD = 1.4826
"""Standard deviation of a normal variable over the median of its absolute value."""

Filter = Callable[[np.ndarray], np.ndarray]


def corner_motion(values: np.ndarray, step: float, noise: float, parabolas: Callable[..., np.ndarray]) -> np.ndarray:
    """Value and slope ``(n_time, 2)`` of the part of a motion that its corners make; zero where it has none.

    Parameters
    ----------
    values : (n_time,) in SI units
        NaN where damaged.
    step : s
    noise : in SI units
        Standard deviation of the readings, at the least.
    parabolas : values and half-width in samples to the values of the running parabolas
    """
    half, found = round(REACH / step), np.zeros((len(values), 2))
    if len(values) <= 8 * half or half < 2:
        return found

    def left(motion: np.ndarray) -> np.ndarray:
        return np.nan_to_num(motion - parabolas(motion, half))

    instants, jumps = _selected(left(values), _Shapes(half, step, left), noise)
    since = np.maximum(step * np.arange(len(values))[:, None] - instants, 0.0)
    return np.stack([0.5 * since**2 @ jumps, since @ jumps], axis=-1)


class _Shapes:
    """What corners leave of a motion without its running parabolas; zero beyond twice their half-width.

    Of a corner between two samples it is a sum of what the powers of the time since the sample nearest to it leave.
    """

    def __init__(self, half: int, step: float, left: Filter) -> None:
        self.reach, self.step = 2 * half, step
        since = step * np.arange(-2 * self.reach, 2 * self.reach + 1)
        powers = [np.maximum(since, 0.0) ** 2 / 2.0, np.maximum(since, 0.0), since > 0.0, since == 0.0]
        self.powers = np.stack([left(power * 1.0)[self.reach : -self.reach] for power in powers])

    @property
    def middle(self) -> np.ndarray:
        """That of a corner at a sample."""
        return self.powers[0]

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


def _selected(left: np.ndarray, shapes: _Shapes, noise: float) -> tuple[np.ndarray, np.ndarray]:
    """Instants in s and jumps in SI units of the corners, ``(n_corner,)`` each."""
    instants = jumps = np.zeros(0)
    filtered = _filtered(left, shapes)
    limit = CORNER * max(MAD * float(np.median(np.abs(filtered))), noise)
    while len(instants) < MOST:
        further = _highest(filtered, limit, instants, shapes)
        if not len(further):
            break
        instants, jumps = _fitted(np.concatenate([instants, further]), left, shapes)
        filtered = _filtered(left - shapes.columns(instants, len(left))[0] @ jumps, shapes)
    return instants, jumps


def _filtered(left: np.ndarray, shapes: _Shapes) -> np.ndarray:
    """Matched filter, of white noise as large as the noise is."""
    return np.convolve(left, shapes.middle[::-1], mode="same") / float(np.linalg.norm(shapes.middle))


def _highest(filtered: np.ndarray, limit: float, instants: np.ndarray, shapes: _Shapes) -> np.ndarray:
    """Instants where the filter is beyond the limit and highest, as far apart as their shapes reach."""
    height, apart = np.abs(filtered), round(CLOSEST_CORNERS / shapes.step)
    found: list[float] = []
    height[: shapes.reach] = height[len(height) - shapes.reach :] = 0.0
    for place in np.round(instants / shapes.step).astype(int):
        height[max(place - apart, 0) : place + apart + 1] = 0.0
    while height.max() >= limit and len(instants) + len(found) < MOST:
        place = int(np.argmax(height))
        found.append(place * shapes.step)
        height[max(place - 2 * shapes.reach, 0) : place + 2 * shapes.reach + 1] = 0.0
    return np.array(found)


def _fitted(instants: np.ndarray, left: np.ndarray, shapes: _Shapes) -> tuple[np.ndarray, np.ndarray]:
    """Instants and jumps that leave the least squares."""
    last = shapes.step * (len(left) - 1)
    for _ in range(STEPS):
        along, later = shapes.columns(instants, len(left))
        jumps = _least_squares(along, left)
        moves = _least_squares(np.concatenate([along, later * jumps], axis=1), left)[len(instants) :]
        moves = np.clip(moves, -shapes.step, shapes.step)
        instants = np.clip(instants + moves, 0.0, last)
        if np.abs(moves).max() < SETTLED * shapes.step:
            break
    return instants, _least_squares(shapes.columns(instants, len(left))[0], left)


def _least_squares(columns: np.ndarray, left: np.ndarray) -> np.ndarray:
    """Sizes of the columns, ``(n_column,)``; of those that are alike the smallest."""
    rows = columns.any(axis=1)
    columns, left = columns[rows], left[rows]
    size = np.maximum(np.linalg.norm(columns, axis=0), np.finfo(float).tiny)
    scaled = columns / size
    return np.linalg.lstsq(scaled.T @ scaled, scaled.T @ left, rcond=None)[0] / size
