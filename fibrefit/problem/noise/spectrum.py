"""Noise of a channel as a spectrum: white, 1/f (pink), first-order parts and lines."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from fibrefit.core.spectra import MAINS


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
