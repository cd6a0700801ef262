"""Round sampling rates, and the longest run of times that only moves forward."""

from __future__ import annotations

import bisect
import math

import numpy as np

from fibrefit.records.grammar.neighbours import typical
from fibrefit.records.thresholds import ROUND_DIGITS


def round_rate(step: float, error: float) -> float | None:
    """Roundest rate whose step agrees with a measured one.

    Parameters
    ----------
    step : float
        Measured time between samples, in s.
    error : float
        Its uncertainty, in s.

    Returns
    -------
    float or None
        Rate in Hz of the fewest digits, or of a step of the fewest digits, or a power of two times one; None where none
        agrees.
    """
    for digits in range(1, ROUND_DIGITS + 1):
        candidates = [float(f"{1 / step:.{digits}g}"), 1 / float(f"{step:.{digits}g}")]
        if digits >= 3:
            # 1024, 51200 or 12800 Hz: rates of frequency analysers.
            power = 2.0 ** math.floor(math.log2(1 / step))
            candidates += [power * float(f"{1 / step / power:.{digits - 1}g}")]
        for rate in candidates:
            if abs(1 / rate - step) <= error:
                return float(f"{rate:.12g}")
    return None


def longest_forward(times: np.ndarray) -> np.ndarray:
    """Positions of the longest strictly increasing selection, in order.

    Parameters
    ----------
    times : (n,) float array
        Times without NaN.

    Returns
    -------
    (m,) int array
        Positions kept; those left out stand still or run backward against them.
    """
    ends: list[float] = []
    where: list[int] = []
    before = np.full(times.size, -1)
    for i, time in enumerate(times.tolist()):
        place = bisect.bisect_left(ends, time)
        if place == len(ends):
            ends.append(time)
            where.append(i)
        else:
            ends[place], where[place] = time, i
        before[i] = where[place - 1] if place else -1
    kept = [where[-1]]
    while before[kept[-1]] >= 0:
        kept.append(int(before[kept[-1]]))
    return np.array(kept[::-1])


def robust_step(times: np.ndarray, counts: np.ndarray) -> tuple[float, float]:
    """Time between samples from many far pairs, and how many samples the pairs span.

    Parameters
    ----------
    times : (n,) float array
        In s, increasing.
    counts : (n,) int array
        Number of each sample, gaps counted.

    Returns
    -------
    tuple of float and float
        Median step in s; samples between the ends of a pair.
    """
    half = times.size // 2
    spans = counts[half:] - counts[:-half]
    steps = (times[half:] - times[:-half])[spans > 0] / spans[spans > 0]
    return typical(steps), typical(spans[spans > 0])
