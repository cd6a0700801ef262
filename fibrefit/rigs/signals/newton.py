"""Newton's law in two measured channels: what scale, sign and clock of a force and a position must be together.

A weight on which only gravity, a measured force and friction act moves as these have it, whatever bears the force. Its
positions over a short time are the double integrals of gravity and of the force, and of friction, which turns round
with the motion: their sizes are known, and differ from them where a column is in another unit, has another sign, or was
sampled at another rate than was read.
"""

from __future__ import annotations

import math
from typing import NamedTuple

import numpy as np

from fibrefit.rigs.signals.rates import derivative
from fibrefit.rigs.thresholds import FEWEST_STRETCHES, MOSTLY_SLIDES, MOVES

LENGTHS = (20, 40, 80, 160, 320, 640)
"""Samples of stretches that are tried: by their number and not in s, as the clock is in question. Short ones drown in
the noise of the position, and in long ones a weight stands: the surest are taken."""
TURNS = 0.02
"""Share of the largest speed within which friction turns round."""
MOST_STRETCHES = 4000
"""Stretches of a long record that are enough, spread over all of it."""
SINGULAR = 1e-10
"""Eigenvalue over the largest below which sizes are not distinguished."""


class Pull(NamedTuple):
    """What acts on a weight along its position, by the rig: ``ü = gravity + lever F / mass`` besides friction.

    Parameters
    ----------
    mass : float, in kg
    gravity : float, in m/s^2
    lever : (n_time,)
        Share of the measured force, with its sign.
    """

    mass: float
    gravity: float
    lever: np.ndarray


class Sizes(NamedTuple):
    """Sizes of gravity and of the force over those that are known, and how late the force is.

    Parameters
    ----------
    gravity, force : float
        1 where scales, signs and times are as they were read.
    gravity_error, force_error : float
        Standard errors, by how stretches of the record differ.
    late : float
        In s.
    explained : float
        Share of the squares of the positions, within stretches, that such sizes explain.
    """

    gravity: float
    force: float
    gravity_error: float
    force_error: float
    late: float
    explained: float

    @property
    def unsure(self) -> float:
        """Standard errors of both sizes over these."""
        if not (self.gravity and self.force):
            return math.inf
        return self.gravity_error / abs(self.gravity) + self.force_error / abs(self.force)


def newton_of(times: np.ndarray, position: np.ndarray, force: np.ndarray, pull: Pull) -> Sizes | None:
    """Sizes by least squares over all stretches of a record; None where it has too few.

    Parameters
    ----------
    times, position, force : (n_time,)
        In s, m and N; NaN where there is no reading.

    Law
    ---
    Positions of a stretch are ``a + b t + G g t² / 2 + S ∬ F / m + L ∫ F / m - f ∬ sign(v) / m`` with G, S, L and f
    shared by all of them. L is S times the time by which the force is late.
    """
    step, seen = float(np.diff(times).mean()), np.isfinite(position) & np.isfinite(force)
    lengths = [number for number in LENGTHS if number <= np.count_nonzero(seen)]
    if not lengths:
        return None
    whole, pulled = (np.interp(times, times[seen], signal[seen]) for signal in (position, force))
    signals = np.stack([whole, pull.lever * pulled / pull.mass])
    tables = [_stretches(signals, times, seen, number) for number in lengths]
    found = [_fitted(table, step, pull) for table in tables if len(table) >= FEWEST_STRETCHES]
    return min((one for one in found if one is not None), key=lambda sizes: sizes.unsure, default=None)


def _stretches(signals: np.ndarray, times: np.ndarray, seen: np.ndarray, number: int) -> np.ndarray:
    """Position, force over mass and direction, ``(n_stretch, 3, number)``, of stretches in which a weight slides."""
    speed = derivative(signals[0], times, 0.5 * number * float(np.diff(times).mean()), 1)
    fastest = max(float(np.abs(speed).max()), np.finfo(float).tiny)
    direction = np.clip(speed / (TURNS * fastest), -1.0, 1.0)
    rows = np.stack([*signals, direction, np.abs(speed) > MOVES * fastest, seen])
    halves = [rows[:, start:] for start in (0, number // 2)]  # those of the second lie across the ends of the first's
    whole = [half[:, : half.shape[1] // number * number].reshape(len(rows), -1, number) for half in halves]
    parts = np.concatenate(whole, axis=1).swapaxes(0, 1)
    sliding = np.flatnonzero((parts[:, 3].mean(axis=1) >= MOSTLY_SLIDES) & (parts[:, 4].min(axis=1) > 0.0))
    return parts[sliding[:: len(sliding) // MOST_STRETCHES + 1], :3]


def _fitted(parts: np.ndarray, step: float, pull: Pull) -> Sizes | None:
    """Sizes by stretches, none of which tells anything by where it begins, and how fast."""
    number = parts.shape[2]
    time = step * (np.arange(number) - 0.5 * (number - 1))
    once, rubbed = _integrated(parts[:, 1], step), _integrated(_integrated(parts[:, 2], step), step)
    falls = np.broadcast_to(0.5 * pull.gravity * time**2, once.shape)
    tables = np.stack([parts[:, 0], falls, _integrated(once, step), once, -rubbed / pull.mass], axis=2)
    own, _ = np.linalg.qr(np.column_stack([np.ones(number), time]))
    tables = tables - own @ (own.T @ tables)
    wide = np.sqrt(np.sum(tables**2, axis=(0, 1)))
    if not (np.isfinite(wide).all() and (wide > 0.0).all()):
        return None
    shapes = tables[:, :, 1:] / wide[1:]
    inverse = np.linalg.pinv(np.einsum("stk,stl->kl", shapes, shapes), rcond=SINGULAR)
    found = inverse @ np.einsum("stk,st->k", shapes, tables[:, :, 0])
    left = tables[:, :, 0] - shapes @ found
    slopes = np.einsum("stk,st->sk", shapes, left)
    errors = np.sqrt(np.diag(inverse @ (slopes.T @ slopes) @ inverse)) / wide[1:]
    gravity, force, later, _ = (found / wide[1:]).tolist()
    explained = 1.0 - float(np.sum(left**2)) / float(wide[0] ** 2)
    return Sizes(gravity, force, float(errors[0]), float(errors[1]), later / force if force else 0.0, explained)


def _integrated(rate: np.ndarray, step: float) -> np.ndarray:
    """Integral along the last axis from its first sample, by trapezoids."""
    sums = np.cumsum(0.5 * step * (rate[:, 1:] + rate[:, :-1]), axis=1)
    return np.pad(sums, ((0, 0), (1, 0)))
