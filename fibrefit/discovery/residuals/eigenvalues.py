"""The autocorrelation of noise, and the eigenvalues of its matrix: how the mean square of some samples scatters."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fibrefit.problem import Noise

EXACT = 128
"""Samples up to which the eigenvalues are computed; of longer windows the mean periodogram has them, within a percent
or two of the limit as long as the window is a small part of the record."""


def eigenvalues(correlation: np.ndarray) -> np.ndarray:
    """Eigenvalues of ``R_ij / n`` for the autocorrelation ``(n,)``, in no order."""
    number = len(correlation)
    lags = np.arange(number)
    if number <= EXACT:
        return np.maximum(np.linalg.eigvalsh(correlation[np.abs(lags[:, None] - lags)]), 0.0) / number
    seen = (1.0 - lags / number) * correlation
    seen[1:] = seen[1:] + seen[1:][::-1]
    return np.maximum(np.fft.fft(seen).real, 0.0) / number


@lru_cache(maxsize=64)
def autocorrelation(noise: Noise, count: int, rate: float) -> np.ndarray:
    """Of noise in units of its rms over a record of `count` samples at `rate` [Hz], at each lag ``(count,)``."""
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    density = noise.over_mean(np.maximum(frequency, frequency[1]), count / rate, rate)
    density[0] = 0.0
    turn, whole = 2.0 * np.pi * np.arange(count) / rate, noise.rms(count / rate, rate) ** 2
    lines = [variance / whole * np.cos(line * turn) for line, variance in noise.all_lines]
    return np.fft.irfft(density, count) + sum(lines, start=np.zeros(count))
