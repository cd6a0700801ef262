"""Rates and integrals of measured signals, and the motions that begin with being let go or lead a model."""

from __future__ import annotations

import math
from functools import lru_cache

import numpy as np
from numpy.polynomial import polynomial
from scipy.ndimage import maximum_filter1d

from fibrefit.core.errors import DataError
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import BEGUN, FEWEST_MOVING, STANDS

LATE = 0.1
"""Share of a record, at its end, whose median is where the motion comes to rest."""
MANY = 256
"""Samples of a window from which transforms take less time than sums."""


def rates_of(values: np.ndarray, times: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A signal, its rate and the rate of that, smoothed over `length` [s]; damaged samples are bridged.

    Parameters
    ----------
    values, times : (n_time,)
        The times in s.
    length : float, in s
    """
    smooth, rate, second = (derivative(values, times, length, order) for order in range(3))
    return smooth, rate, second


def derivative(values: np.ndarray, times: np.ndarray, length: float, order: int, degree: int = 2) -> np.ndarray:
    """Derivative of a signal, ``(n_time,)`` in its unit over s**order, by polynomials over windows.

    Damaged samples are bridged: one of them would take all those around it along. SciPy's filter of this kind does the
    same, but comes with half a second of statistics that a fit has no other use for.

    Parameters
    ----------
    values, times : (n_time,)
        The times in s, evenly spaced.
    length : float, in s
        Of a window; at least five samples, at most all.
    order : int
        Of the derivative; 0 smooths.
    degree : int
        Of the polynomials.

    Source
    ------
    Savitzky and Golay, Analytical Chemistry 36 (1964).
    """
    step = float(np.diff(times).mean())
    seen = np.isfinite(values)
    whole = values if seen.all() else np.interp(times, times[seen], values[seen])
    half = min(max(2, round(length / step) // 2), (len(whole) - 1) // 2)
    near, fit = _fit_in_window(half, degree)
    scale = (half * step) ** -order
    inside = correlated(whole, math.factorial(order) * fit[order])
    first, last = (
        polynomial.polyval(near[part], polynomial.polyder(fit @ piece, order))
        for part, piece in ((slice(half), whole[: 2 * half + 1]), (slice(half + 1, None), whole[-2 * half - 1 :]))
    )
    return scale * np.concatenate([first, inside, last])


@lru_cache(maxsize=8)  # records of one rate ask for the same windows
def _fit_in_window(half: int, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Places of the samples of a window, and what makes coefficients of a polynomial of them."""
    near = np.arange(-half, half + 1) / half
    return near, np.linalg.pinv(np.vander(near, degree + 1, increasing=True))


def correlated(values: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """`numpy.correlate` where the kernel lies within, piece by piece by transforms where it is long.

    A window lasts as long whatever the rate of the samples, so that sums would grow with the square of that.

    Parameters
    ----------
    values : (n,)
    kernel : (m,)

    Returns
    -------
    (n - m + 1,)
    """
    if len(kernel) < MANY:
        return np.correlate(values, kernel, "valid")
    from scipy.fft import irfft, rfft

    size = 1 << (8 * len(kernel)).bit_length()
    turned, step = np.conj(rfft(kernel, size)), size - len(kernel) + 1
    found = np.empty(len(values) - len(kernel) + 1)
    for begin in range(0, len(found), step):
        piece = found[begin : begin + step]
        piece[:] = irfft(rfft(values[begin : begin + size], size) * turned, size)[: len(piece)]
    return found


def period_of(values: np.ndarray, times: np.ndarray) -> float:
    """Period of a signal in s from its spectrum; not a number where it does not swing once."""
    count = len(values)
    power = np.abs(np.fft.rfft((values - values.mean()) * np.hanning(count), 8 * count)) ** 2
    frequency = np.fft.rfftfreq(8 * count, float(np.diff(times).mean()))
    power[frequency < 1.5 / (times[-1] - times[0])] = 0.0
    best = int(np.argmax(power))
    return 1.0 / float(frequency[best]) if power[best] > 0.0 else float("nan")


def from_motion(trace: Trace, channel: str) -> Trace:
    """A record from where a motion that nothing drives begins: at its farthest place, where it was let go.

    What comes before, a hand that draws it aside and holds it, tells nothing of the motion.

    Raises
    ------
    DataError
        If it never moves.
    """
    values = trace.channels[channel]
    seen = np.isfinite(values)
    whole = np.interp(trace.times, trace.times[seen], values[seen])
    away = np.abs(whole - np.median(whole[-max(round(LATE * len(whole)), 1) :]))
    farthest = away > (1.0 - BEGUN) * away.max()
    first = int(np.argmax(farthest))
    moves = ~farthest[first:]
    start = first + int(np.argmax(moves)) if moves.any() else len(whole)
    if len(whole) - start < FEWEST_MOVING or not np.ptp(whole) > 0.0:
        do = "Check its column and unit."
        raise DataError(trace.name, f"the {channel} does not change", "a motion that is let go once", do)
    return trace._replace(
        times=trace.times[start:], channels={name: column[start:] for name, column in trace.channels.items()}
    )


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
    motions = {window: _motion(raw, window, step, by_velocity) for window in windows or [ORDER + 3]}
    window = min(motions, key=lambda window: _unexplained(motions[window], force))
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


def _motion(raw: np.ndarray, window: int, step: float, by_velocity: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Position, speed and acceleration, from one of the former two."""
    from scipy.signal import savgol_filter

    whole = _bridged(raw)
    found = [savgol_filter(whole, window, ORDER, deriv=d, delta=step) for d in range(2 if by_velocity else 3)]
    position, speed, acceleration = [integrated(whole, step), *found] if by_velocity else found
    return position, speed, acceleration


def _stands(speed: np.ndarray) -> np.ndarray:
    """Whether a mass stands, or turns round, at each sample."""
    return (np.abs(speed) <= STANDS * np.abs(speed).max()) | (np.diff(np.sign(speed), append=np.sign(speed[-1])) != 0.0)


def _unexplained(motion: tuple[np.ndarray, np.ndarray, np.ndarray], force: np.ndarray) -> float:
    """Sum of squares of the force that a motion leaves."""
    position, speed, acceleration = motion
    columns = np.column_stack([acceleration, np.sign(speed), speed, position, np.ones_like(speed)])
    there = np.isfinite(force) & ~_stands(speed)
    columns, wanted = columns[there], force[there]
    size = np.linalg.norm(columns, axis=0)
    columns = columns / np.where(size > 0.0, size, 1.0)
    residual = wanted - columns @ np.linalg.lstsq(columns, wanted, rcond=1e-8)[0]
    return float(residual @ residual) / max(len(wanted), 1)
