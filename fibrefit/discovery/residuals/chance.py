"""How loud noise of a known colour gets by chance, in as many looks as are taken.

Law
---
The mean square of n samples of normal noise with autocorrelation R is ``Σ λ_i z_i²`` with the eigenvalues λ of
``R_ij / n`` and independent normal z. It exceeds q with a probability of at most ``exp(-t q) Π (1 - 2 t λ_i)^(-1/2)``,
for any t up to ``1 / (2 max λ)``; the best t is taken, and each look is given an equal part of the error (Bonferroni).

Source
------
Chernoff, Ann. Math. Stat. 23 (1952); for sums of squares Laurent and Massart, Ann. Stat. 28 (2000), Lemma 1.
"""

from __future__ import annotations

from functools import lru_cache

import numpy as np

from fibrefit.problem.noise.spectrum import MAINS, Noise

WRONGLY = 0.01
"""Chance that noise alone is called loud anywhere in all the looks."""
KNOWN = 3.3
"""Standard errors by which the noise at rest may have been taken for less than it is."""
EXACT = 128
"""Samples up to which the eigenvalues are computed; of longer windows the mean periodogram has them, within a percent
or two of the limit as long as the window is a small part of the record."""
TRIED = 400


@lru_cache(maxsize=512)
def loudest(noise: Noise, width: int, count: int, rate: float, looks: int) -> float:
    """Mean square, in units of the noise, that noise alone exceeds in one of many windows once in a hundred times.

    Parameters
    ----------
    noise : Noise
        Where its colour is not known it is taken for white.
    width : int
        Samples of a window.
    count : int
        Samples of the record.
    rate : float
        In Hz.
    looks : int
        Number of windows that are looked at.
    """
    sizes = _eigenvalues(autocorrelation(noise, count, rate)[:width])
    t = np.linspace(0.0, 1.0, TRIED)[1:-1] / (2.0 * sizes.max())
    bound = np.log(looks / WRONGLY) - 0.5 * np.log1p(-2.0 * t[:, None] * sizes).sum(axis=1)
    doubt = 1.0 + KNOWN * np.sqrt(2.0 / noise.samples) if noise.samples else 1.0
    return float(doubt * np.min(bound / t))


def _eigenvalues(correlation: np.ndarray) -> np.ndarray:
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
    line = noise.line / noise.rms(count / rate, rate) ** 2
    return np.fft.irfft(density, count) + line * np.cos(2.0 * np.pi * MAINS[0] * np.arange(count) / rate)
