"""Noise of a channel as a spectrum: white, 1/f (pink), first-order parts and lines; periodograms and their likelihood.

Law
---
Ordinates ``P_k`` of a periodogram are independent and exponentially distributed about the density ``S(f_k)``: minus the
log likelihood of a spectrum is ``sum of ln S(f_k) + P_k / S(f_k)`` (Whittle). With ``S = exp(a) + exp(b) / f`` its
gradient is ``sum of s_i (1 - P / S)`` and its expected curvature ``sum of s_i s_j``, ``s_i`` the share of each part in
S: damped Gauss-Newton steps in the logarithms a and b find the minimum.

Source
------
Whittle, Ark. Mat. 2 (1953).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import numpy as np

from fibrefit.core.arrays import RAN_AWAY

MAINS = (50.0, 60.0)
"""Frequencies in Hz of the grids of the world: a line that is not known better lies at one of them."""


@dataclass(frozen=True)
class Noise:
    """Spectrum of a channel's noise: white, 1/f, first-order parts, and lines.

    Law
    ---
    ``S(f) = white + pink / f + sum of v (2 / pi) c / (c^2 + f^2)`` over the first-order parts of corner c and variance
    v, and the lines.

    Parameters
    ----------
    white : float
        One-sided level, in unit^2/Hz.
    pink : float
        Level at 1 Hz, in unit^2/Hz.
    line : float
        Variance of a line at a mains frequency that is not known better, in unit^2.
    samples : int
        Number of samples it was taken from, of rests or of residuals; 0: from differences of moving ones, fast part
        only, or from none, where it is stated, planned, exact, or that of rounding.
    slow : tuple of (corner in Hz, variance in unit^2)
        First-order parts.
    lines : tuple of (frequency in Hz, variance in unit^2)
        Lines whose frequencies were found.
    floor : float
        One-sided level of the steps of coarse readings, which a rest may not show, in unit^2/Hz.
    """

    white: float
    pink: float
    line: float
    samples: int
    slow: tuple[tuple[float, float], ...] = ()
    lines: tuple[tuple[float, float], ...] = ()
    floor: float = 0.0

    def rms(self, duration: float, rate: float) -> float:
        """Noise rms over a record of `duration` [s] sampled at `rate` [Hz]."""
        band = 0.5 * rate
        parts = sum(variance for _, variance in (*self.slow, *self.lines))
        return float(np.sqrt(self.white * band + self.pink * np.log(band * duration) + self.line + parts))

    @property
    def all_lines(self) -> tuple[tuple[float, float], ...]:
        """Frequency in Hz and variance in unit^2 of each line; one not known better lies at the first of the mains."""
        return (*self.lines, *(((MAINS[0], self.line),) if self.line > 0.0 else ()))

    @property
    def silent(self) -> bool:
        """Whether there is none."""
        return not self.density(np.ones(1))[0] + sum(variance for _, variance in self.all_lines) > 0.0

    def density(self, frequency: np.ndarray) -> np.ndarray:
        """One-sided power density at `frequency` [Hz] > 0, without the lines, in unit^2/Hz."""
        parts = [variance * (2.0 / np.pi) * corner / (corner**2 + frequency**2) for corner, variance in self.slow]
        return self.white + self.pink / frequency + sum(parts, start=np.zeros_like(frequency, dtype=float))

    def expected(self, count: int, rate: float) -> np.ndarray:
        """What a periodogram of `count` samples at `rate` [Hz] is expected to be, without lines, leakage included."""
        inner = slice(1, (count + 1) // 2)
        frequency = np.fft.rfftfreq(count, 1.0 / rate)[inner]
        lags = np.arange(count)
        decay = [variance * np.exp(-2.0 * np.pi * corner * lags / rate) for corner, variance in self.slow]
        kernel = sum(decay, start=np.zeros(count)) * (1.0 - lags / count)
        kernel[0] *= 0.5
        return self.white + self.pink / frequency + 4.0 * np.fft.rfft(kernel).real[inner] / rate

    def corner(self) -> float:
        """Frequency in Hz at which slow parts and white noise are equal; 0 where slow parts are nowhere as strong."""
        frequency = np.geomspace(1e-2, 1e4, 600)
        slow = self.density(frequency) > 2.0 * self.white
        return float(frequency[slow].max(initial=0.0))

    def scaled(self, factor: float) -> Noise:
        """The same colour, `factor` times as large."""
        power = factor**2
        slow, lines = (tuple((f, power * v) for f, v in parts) for parts in (self.slow, self.lines))
        white, pink, line, floor = (power * part for part in (self.white, self.pink, self.line, self.floor))
        return Noise(white, pink, line, self.samples, slow, lines, floor)

    def over_mean(self, frequency: np.ndarray, duration: float, rate: float) -> np.ndarray:
        """Power density at `frequency` [Hz] > 0 over its mean in a record of `duration` [s] sampled at `rate` [Hz]."""
        return self.density(frequency) * (0.5 * rate) / self.rms(duration, rate) ** 2

    def variance_of_sum(self, weights: np.ndarray, rate: float) -> float:
        """Variance of a weighted sum of samples at `rate` [Hz], the weights ``(count,)`` of which add up to nothing."""
        count = len(weights)
        frequency = np.fft.rfftfreq(count, 1.0 / rate)[1:]
        power = np.abs(np.fft.rfft(weights)[1:]) ** 2
        twice = np.where(2.0 * frequency < rate, 2.0, 1.0)
        broad = float(np.sum(twice * power * self.density(frequency))) * 0.5 * rate / count
        lines = [*self.lines, *((mains, self.line / len(MAINS)) for mains in MAINS)]
        turns = [np.exp(-2j * np.pi * line * np.arange(count) / rate) for line, _ in lines]
        return broad + sum(
            variance * float(np.abs(weights @ turn) ** 2) for turn, (_, variance) in zip(turns, lines, strict=True)
        )

    def draw(self, count: int, rate: float, random: np.random.Generator) -> np.ndarray:
        """Some noise with this spectrum, the lines left out, ``(count,)``."""
        size = _amplitudes(self, count, rate)
        phasors = random.normal(size=len(size)) + 1j * random.normal(size=len(size))
        return np.fft.irfft(phasors * size, count)


@lru_cache(maxsize=8)
def _amplitudes(noise: Noise, count: int, rate: float) -> np.ndarray:
    """Standard deviation of both parts of each Fourier coefficient of `count` samples, ``(count // 2 + 1,)``."""
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    density = np.zeros(len(frequency))
    density[1:] = noise.density(frequency[1:])
    return np.sqrt(0.25 * density * count * rate)


def periodogram(values: np.ndarray, rate: float) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies [Hz] between zero and half the rate, and the one-sided power density of `values` ``(n,)`` there.

    Returns
    -------
    (n_ordinate,) in Hz, (n_ordinate,) in unit²/Hz
    """
    n = len(values)
    power = 2.0 * np.abs(np.fft.rfft(values - values.mean())) ** 2 / (n * rate)
    frequency = np.fft.rfftfreq(n, 1.0 / rate)
    inner = slice(1, (n + 1) // 2)
    return frequency[inner], power[inner]


def without_lines(values: np.ndarray, times: np.ndarray, lines: Sequence[float]) -> np.ndarray:
    """What is left of readings ``(..., n)`` by the sinusoids of some frequencies in Hz that they hold most likely."""
    angle = 2.0 * np.pi * np.multiply.outer(times, lines)
    sinusoids = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    # A level is no part of a line, of which a short record need not hold whole periods.
    basis = np.linalg.qr(sinusoids - sinusoids.mean(axis=0))[0]
    return values - (values @ basis) @ basis.T


def whittle(frequency: np.ndarray, power: np.ndarray) -> tuple[float, float]:
    """White level in unit²/Hz and pink level in unit² by maximum likelihood of a periodogram ``(n_ordinate,)``."""
    floor, shape = 1e-6 * power.mean(), np.stack([np.ones_like(frequency), 1.0 / frequency])
    # The median of an exponential law is ln 2 of its mean; pink noise begins far below white noise, as it, and above.
    level = np.log(np.median(power[frequency > 0.5 * frequency.max()]) / np.log(2.0) + floor)
    starts = [np.array([level, level + shift]) for shift in (-4.0, 0.0, 4.0)]
    logs = min(starts, key=lambda start: _misfit(start, shape, power, floor)[0])
    here, damping = _misfit(logs, shape, power, floor), 1e-3
    while damping < 1e9:
        bend = here[2] * (1.0 + damping * np.eye(2)) + 1e-12 * np.eye(2)
        # A level changes by a factor of seven a step at the most: far away the curvature says little.
        there = logs + np.clip(-np.linalg.solve(bend, here[1]), -2.0, 2.0)
        found = _misfit(there, shape, power, floor)
        gain = here[0] - found[0]
        logs, here, damping = (there, found, 0.1 * damping) if gain > 0.0 else (logs, here, 10.0 * damping)
        if 0.0 < gain < 1e-9:
            break
    return float(np.exp(logs[0])), float(np.exp(logs[1]))


def _misfit(logs: np.ndarray, shape: np.ndarray, power: np.ndarray, floor: float) -> tuple[float, np.ndarray, Any]:
    """Minus the log likelihood of logarithms of white and pink level, its slope ``(2,)`` and its bend ``(2, 2)``."""
    parts = np.exp(logs)[:, None] * shape
    density = parts.sum(axis=0) + floor
    share, pull = power / density, parts / density
    return float(np.sum(np.log(density) + share)), pull @ (1.0 - share), pull @ pull.T


def half_weights(size: int) -> np.ndarray:
    """Weights ``(size // 2 + 1,)`` of the frequencies of a real transform of `size` samples in the mean over all."""
    found = np.full(size // 2 + 1, 2.0 / size)
    found[0] = 1.0 / size
    if size % 2 == 0:
        found[-1] = 1.0 / size
    return found


@RAN_AWAY
def products_of_spectra(left: np.ndarray, right: np.ndarray) -> np.ndarray:
    """Real parts of the sums of ``conj(left[i]) right[j]`` over all but the first axis, ``(n_left, n_right)``."""
    # Real and imaginary parts as so many numbers: their products are the real part.
    pairs = [np.ascontiguousarray(part).reshape(len(part), -1).view(float) for part in (left, right)]
    return pairs[0] @ pairs[1].T
