"""The true covariance of a logger's noise, and the filter that turns noise into innovations of variance one.

The noise is made in `sensors`; its covariance is known in closed form, so nothing is estimated here. Durbin's recursion
gives the best prediction of each sample from those before it; beyond `MEMORY` samples back nothing is used.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from scipy.fft import irfft, next_fast_len, rfft

from tests.independent.kernel import compiled
from tests.independent.sensors import Noise

MEMORY = 256


def covariance(noise: Noise, channel: str, n: int, rate: float) -> np.ndarray:
    """Covariance of the noise of a channel at rest at lags of 0 to n - 1 samples, lines left out.

    Rounding counts as white noise of a twelfth of the squared step.
    """
    correlation = noise.pink**2 * _pink(n) if noise.pink else np.zeros(n)
    if noise.slow:
        correlation = correlation + noise.slow**2 * np.exp(-2.0 * math.pi * noise.corner / rate * np.arange(n))
    correlation[0] += 1.0 - noise.pink**2 - noise.slow**2
    found = noise.rms[channel] ** 2 * correlation
    found[0] += noise.resolution[channel] ** 2 / 12.0
    return found


@lru_cache(maxsize=64)
def _pink(n: int) -> np.ndarray:
    """Correlation of noise whose power falls as 1/f, made twice as long and cut."""
    frequencies = np.fft.rfftfreq(2 * n)[1:]
    power = 1.0 / frequencies
    power /= power.sum()
    return np.fft.irfft(np.concatenate([[0.0], power * n]), 2 * n)[:n]


@dataclass(frozen=True)
class Whitening:
    """The innovations filter of one channel.

    Parameters
    ----------
    first : ``(order, order)``, lower triangular: innovations of the first samples out of those before them
    rest : ``(order + 1,)``, filter of all later samples
    scale : ``(n,)``, amplitude of the noise over that at rest
    """

    first: np.ndarray
    rest: np.ndarray
    scale: np.ndarray

    def __call__(self, columns: np.ndarray) -> np.ndarray:
        """Innovations of signals ``(n, m)``: of the noise they have variance one and no memory."""
        signals = np.ascontiguousarray(columns.T) / self.scale
        order, n = len(self.first), signals.shape[1]
        if order == 1:
            return signals.T * self.rest[0]
        size = next_fast_len(n + order, real=True)
        spectrum = rfft(signals, size)
        spectrum *= rfft(self.rest, size)
        found = irfft(spectrum, size)[:, :n]
        found[:, :order] = signals[:, :order] @ self.first.T
        return found.T


def whitening(noise: Noise, channel: str, force: np.ndarray, rate: float) -> Whitening:
    """The filter for the true spectrum of a channel's noise; `force` is the true reading of the gauge.

    Where the noise grows with the load, rounding is taken to grow with it.
    """
    n = force.size
    return Whitening(*_filter(_key(noise, channel, n, rate)), noise.scale(channel, force))


def _key(noise: Noise, channel: str, n: int, rate: float) -> tuple[float, ...]:
    return tuple(covariance(noise, channel, n, rate)[: MEMORY + 1])


@lru_cache(maxsize=64)
def _filter(found: tuple[float, ...]) -> tuple[np.ndarray, np.ndarray]:
    lags = np.array(found)
    order = MEMORY if np.any(np.abs(lags[1:]) > 1e-9 * lags[0]) else 1
    return _durbin(lags, order)


@compiled
def _durbin(lags, order):
    """Rows that predict each sample from all before it, for as long as their number is below `order`; the last one."""
    first = np.zeros((order, order))
    weights, before, rest = np.zeros(order), np.zeros(order), np.zeros(order + 1)
    variance = lags[0]
    for i in range(order + 1):
        size = 1.0 / math.sqrt(variance)
        if i < order:
            first[i, i] = size
            for j in range(i):
                first[i, i - 1 - j] = -weights[j] * size
        else:
            rest[0] = size
            for j in range(order):
                rest[1 + j] = -weights[j] * size
            break
        reflection = lags[i + 1]
        for j in range(i):
            reflection -= weights[j] * lags[i - j]
        reflection /= variance
        before[:i] = weights[:i]
        for j in range(i):
            weights[j] = before[j] - reflection * before[i - 1 - j]
        weights[i] = reflection
        variance *= 1.0 - reflection**2
    return first, rest
