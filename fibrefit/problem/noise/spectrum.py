"""Noise of a channel, from the parts of the records in which nothing moves.

A logger's noise is not white: 1/f noise adds to the white one, and a rest of a tenth of a second shows little of it.
The spectrum of the rests is therefore modelled, and its total over the band of a whole record is the noise.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Any

import numpy as np

from fibrefit.problem.thresholds import BESIDE_MAINS, FEW_MASKED, SHORTEST_LINE
from fibrefit.rigs.signals.rest import resolution, rests, runs, white_noise
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import SHORTEST_REST

MAINS = (50.0, 60.0)


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
        size = _wave_sizes(self, count, rate)
        wave = random.normal(size=len(size)) + 1j * random.normal(size=len(size))
        return np.fft.irfft(wave * size, count)


@lru_cache(maxsize=8)
def _wave_sizes(noise: Noise, count: int, rate: float) -> np.ndarray:
    """Standard deviation of both parts of each wave of `count` samples at `rate` [Hz], ``(count // 2 + 1,)``."""
    frequency = np.fft.rfftfreq(count, 1.0 / rate)
    density = np.zeros(len(frequency))
    density[1:] = noise.density(frequency[1:])
    return np.sqrt(0.25 * density * count * rate)


def estimate_noise(traces: Sequence[Trace], channel: str) -> Noise:
    """Noise of one channel, from the rests of all records."""
    pieces = at_rest(traces, channel)
    if not pieces:
        return _from_differences(traces, channel)
    found, rate = noise_of(pieces), float(np.mean([rate for _, rate in pieces]))
    floor = min(resolution(trace.channels[channel]) for trace in traces) ** 2 / 12.0 / (0.5 * rate)
    return replace(found, white=max(found.white, floor), floor=floor)


def at_rest(traces: Sequence[Trace], channel: str) -> list[tuple[np.ndarray, float]]:
    """Readings of one channel in the rests of all records, and their rates in Hz."""
    pieces = []
    for trace in traces:
        for rest in rests(trace):
            values = unbroken(trace.channels[channel][rest])
            if len(values) >= SHORTEST_REST and np.ptp(values) > 0.0:
                pieces.append((values, trace.rate))
    return pieces


def unbroken(values: np.ndarray) -> np.ndarray:
    """Readings of a rest without the masked ones; the longest stretch without one where these are many.

    A few repeat the reading before them: the level of the noise stays as it is, and so do steps of coarse readings.

    Parameters
    ----------
    values : (n,)
        Masked ones are not numbers.

    Returns
    -------
    (m,)
        None where all are masked.
    """
    seen = np.isfinite(values)
    if seen.mean() < 1.0 - FEW_MASKED:
        stretches = runs(seen)
        first, end = stretches[np.argmax(np.diff(stretches, axis=1))] if len(stretches) else (0, 0)
        return values[first:end]
    last = np.maximum.accumulate(np.where(seen, np.arange(len(values)), np.argmax(seen)))
    return values[last]


def noise_of(pieces: Sequence[tuple[np.ndarray, float]]) -> Noise:
    """Noise of pieces that hold nothing else.

    Parameters
    ----------
    pieces : sequence of ((n,), float)
        Readings in SI units, and their rate in Hz.
    """
    frequency, power = (np.concatenate(parts) for parts in zip(*(periodogram(*p) for p in pieces), strict=True))
    near_mains = np.min([np.abs(frequency - line) for line in MAINS], axis=0) < BESIDE_MAINS
    white, pink = whittle(frequency[~near_mains], power[~near_mains])
    # A piece that is too short for a line says nothing of one.
    told = [
        (_line_variance(values, rate), len(values)) for values, rate in pieces if len(values) / rate > SHORTEST_LINE
    ]
    line = sum(variance * number for variance, number in told) / max(sum(number for _, number in told), 1)
    return Noise(white, pink, line, sum(len(piece[0]) for piece in pieces))


def _from_differences(traces: Sequence[Trace], channel: str) -> Noise:
    rate = np.mean([trace.rate for trace in traces])
    variance = np.mean([white_noise(trace.channels[channel]) ** 2 for trace in traces])
    floor = float(min(resolution(trace.channels[channel]) for trace in traces) ** 2 / 12.0 / (0.5 * rate))
    return Noise(max(float(variance / (0.5 * rate)), floor), 0.0, 0.0, 0, floor=floor)


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
    waves = np.concatenate([np.cos(angle), np.sin(angle)], axis=1)
    # A level is no part of a line, of which a short record need not hold whole periods.
    basis = np.linalg.qr(waves - waves.mean(axis=0))[0]
    return values - (values @ basis) @ basis.T


def whittle(frequency: np.ndarray, power: np.ndarray) -> tuple[float, float]:
    """White level in unit²/Hz and pink level in unit² by maximum likelihood of a periodogram ``(n_ordinate,)``.

    Source
    ------
    Whittle, Ark. Mat. 2 (1953).
    """
    floor, shape = 1e-6 * power.mean(), np.stack([np.ones_like(frequency), 1.0 / frequency])
    level = np.log(np.median(power[frequency > 0.5 * frequency.max()]) / np.log(2.0) + floor)
    starts = [np.array([level, level + shift]) for shift in (-4.0, 0.0, 4.0)]
    logs = min(starts, key=lambda start: _misfit(start, shape, power, floor)[0])
    here, damping = _misfit(logs, shape, power, floor), 1e-3
    while damping < STIFF:
        bend = here[2] * (1.0 + damping * np.eye(2)) + TINY * np.eye(2)
        there = logs + np.clip(-np.linalg.solve(bend, here[1]), -FARTHEST, FARTHEST)
        found = _misfit(there, shape, power, floor)
        gain = here[0] - found[0]
        logs, here, damping = (there, found, 0.1 * damping) if gain > 0.0 else (logs, here, 10.0 * damping)
        if 0.0 < gain < SETTLED:
            break
    return float(np.exp(logs[0])), float(np.exp(logs[1]))


STIFF, SETTLED, FARTHEST, TINY = 1e9, 1e-9, 2.0, 1e-12
"""Damping that ends a search, gain that ends it, longest step of a logarithm, and what a matrix must not be below."""


def _misfit(logs: np.ndarray, shape: np.ndarray, power: np.ndarray, floor: float) -> tuple[float, np.ndarray, Any]:
    """Minus the log likelihood of logarithms of white and pink level, its slope ``(2,)`` and its bend ``(2, 2)``."""
    parts = np.exp(logs)[:, None] * shape
    density = parts.sum(axis=0) + floor
    share, pull = power / density, parts / density
    return float(np.sum(np.log(density) + share)), pull @ (1.0 - share), pull @ pull.T


def _line_variance(values: np.ndarray, rate: float) -> float:
    """Variance of a sinusoid at the stronger mains frequency, less what white noise would show."""
    found, t = [], np.arange(len(values)) / rate
    for line in MAINS:
        wave = np.exp(-2j * np.pi * line * t)
        amplitude = 2.0 * abs(np.mean((values - values.mean()) * wave))
        beside = [2.0 * abs(np.mean((values - values.mean()) * wave * np.exp(2j * np.pi * d * t))) for d in (-12, 12)]
        found.append(max(0.0, 0.5 * (amplitude**2 - np.mean(np.square(beside)))))
    return float(max(found))
