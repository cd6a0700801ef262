"""A motion that was measured as what leads a model: smoothed, with its speed and acceleration."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import maximum_filter1d

from fibrefit.core.errors import DataError
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import FEWEST_MOVING, STANDS

LENGTHS = (0.006, 0.012, 0.025, 0.05, 0.1, 0.2)
"""Lengths in s over which a position is taken for a polynomial; the force tells which of them suits it."""
ORDER = 4
"""Of the polynomials."""


def along_motion(trace: Trace) -> Trace:
    """A record with position and speed as inputs, and the force where the mass moves.

    A position that is smoothed too little has an acceleration full of noise, one that is smoothed too much has lost
    some of it: either leaves more of the force unexplained by mass, friction, damping, spring and offset.

    Raises
    ------
    DataError
        If the mass hardly moves.
    """
    force, step = trace.channels["force"], trace.step
    by_velocity = "velocity" in trace.inputs
    raw = trace.inputs["velocity" if by_velocity else "position"][:, 2]
    windows = sorted({max(round(length / step) | 1, ORDER + 3) for length in LENGTHS if length < len(raw) * step / 4.0})
    taken = _motion_of_velocity if by_velocity else _motion
    motions = {window: taken(raw, window, step) for window in windows or [ORDER + 3]}
    window = min(motions, key=lambda window: _left(motions[window], force))
    position, speed, acceleration = motions[window]
    # At a reversal friction turns round and the acceleration jumps: no polynomial across it follows that.
    moving = ~maximum_filter1d(_stands(speed), window)
    if np.count_nonzero(moving & np.isfinite(force)) < FEWEST_MOVING:
        raise DataError(trace.name, "the mass hardly moves", "a position that changes", "Check its column and unit.")
    inputs = trace.inputs | {
        "position": np.column_stack([position, speed, position if by_velocity else raw]),
        "speed": np.column_stack([speed, acceleration, speed]),
    }
    return trace._replace(channels={"force": np.where(moving, force, np.nan)}, inputs=inputs)


def with_place(trace: Trace) -> Trace:
    """A record of a velocity with the position it leads to as an input, from zero at the first sample."""
    velocity = trace.inputs["anchor"][:, 0]
    position = integrated(velocity, trace.step)
    return trace._replace(inputs=trace.inputs | {"position": np.column_stack([position, velocity, position])})


def integrated(rate: np.ndarray, step: float) -> np.ndarray:
    """Integral of a signal from its first sample, by trapezoids; what is missing is bridged by straight lines.

    Parameters
    ----------
    rate : (n_time,)
    step : float, in s
    """
    whole = _bridged(rate)
    return np.concatenate([[0.0], np.cumsum(0.5 * step * (whole[1:] + whole[:-1]))])


def _bridged(raw: np.ndarray) -> np.ndarray:
    seen = np.isfinite(raw)
    places = np.arange(len(raw))
    return np.interp(places, places[seen], raw[seen])


def _motion(raw: np.ndarray, window: int, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from scipy.signal import savgol_filter

    whole = _bridged(raw)
    position, speed, acceleration = (savgol_filter(whole, window, ORDER, deriv=d, delta=step) for d in range(3))
    return position, speed, acceleration


def _motion_of_velocity(raw: np.ndarray, window: int, step: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    from scipy.signal import savgol_filter

    whole = _bridged(raw)
    speed, acceleration = (savgol_filter(whole, window, ORDER, deriv=d, delta=step) for d in range(2))
    return integrated(whole, step), speed, acceleration


def _stands(speed: np.ndarray) -> np.ndarray:
    """Whether a mass stands, or turns round, at each sample."""
    return (np.abs(speed) <= STANDS * np.abs(speed).max()) | (np.diff(np.sign(speed), append=np.sign(speed[-1])) != 0.0)


def _left(motion: tuple[np.ndarray, np.ndarray, np.ndarray], force: np.ndarray) -> float:
    """Sum of squares of the force that a motion leaves."""
    position, speed, acceleration = motion
    columns = np.column_stack([acceleration, np.sign(speed), speed, position, np.ones_like(speed)])
    there = np.isfinite(force) & ~_stands(speed)
    columns, wanted = columns[there], force[there]
    size = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(size > 0.0, size, 1.0)
    left = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=1e-8)[0]
    return float(left @ left) / max(len(wanted), 1)
