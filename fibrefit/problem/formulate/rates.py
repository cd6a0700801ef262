"""Rates of measured signals for starting values, by parabolas; and where a motion that nothing drives begins."""

from __future__ import annotations

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.problem.statement.observations import Trace

BEGUN = 0.02
"""Share of its largest deviation by which a channel has left that place when its motion has surely begun."""
LATE = 0.1
"""Share of a record, at its end, whose median is where the motion comes to rest."""
FEWEST = 32
"""Samples that a motion has to last."""


def rates_of(values: np.ndarray, times: np.ndarray, length: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A signal, its rate and the rate of that, smoothed over `length` [s]; damaged samples are bridged.

    Parameters
    ----------
    values, times : (n_time,)
        The times in s.
    length : float, in s
    """
    from scipy.signal import savgol_filter

    step = float(np.diff(times).mean())
    window = max(5, round(length / step) | 1)
    seen = np.isfinite(values)
    whole = values if seen.all() else np.interp(times, times[seen], values[seen])
    window = min(window, (len(whole) - 1) | 1)
    smooth, rate, second = (savgol_filter(whole, window, 2, deriv=d, delta=step) for d in range(3))
    return smooth, rate, second


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
    far = away > (1.0 - BEGUN) * away.max()
    first = int(np.argmax(far))
    left = ~far[first:]
    start = first + int(np.argmax(left)) if left.any() else len(whole)
    if len(whole) - start < FEWEST or not np.ptp(whole) > 0.0:
        do = "Check its column and unit."
        raise DataError(trace.name, f"the {channel} does not change", "a motion that is let go once", do)
    return trace._replace(
        times=trace.times[start:], channels={name: column[start:] for name, column in trace.channels.items()}
    )
