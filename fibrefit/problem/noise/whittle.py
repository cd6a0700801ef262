"""Spectrum of residuals by maximum likelihood: white noise, 1/f, first-order parts of fixed corners, and lines.

A periodogram ordinate of a record is exponentially distributed about its expectation, which is a sum of what each part
of the noise contributes, leakage and masked samples included (`periodogram_fit`). Lines are what stands out of that,
and are taken off before the rest is judged.

Source
------
Whittle, Ark. Mat. 2 (1953); expectation of the periodogram instead of the density: Sykulski et al., Biometrika 106
(2019).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.problem.noise.coloured import LINES, Bank, Coloured, bank_for, bank_of, coloured_of
from fibrefit.problem.noise.lags import lag_transforms
from fibrefit.problem.noise.likelihood import unit_of
from fibrefit.problem.noise.periodogram_fit import Periodograms, fitted
from fibrefit.problem.noise.rounding import noise_of_steps
from fibrefit.problem.noise.spectrum import Noise, whittle, without_lines
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.thresholds import CLEAR, LINE_BY_CHANCE, NEGLIGIBLE_PART, SAMPLE_COUNTS, SLOWEST_LINE

FINE = 8
"""Padding of the record where the frequency of a line is looked for."""


class _Draws(NamedTuple):
    """Residuals of one channel.

    Parameters
    ----------
    values : (n_draw, n_record, n_time)
        Zero where not valid.
    valid : (n_record, n_time) bool
    counts : (n_record,) int
    """

    values: np.ndarray
    valid: np.ndarray
    counts: np.ndarray
    bank: Bank

    def without(self, lines: Sequence[tuple[float, float]]) -> _Draws:
        """What lines leave, of any phase and height in each record: the ends of a record spread a line over all."""
        left, frequencies = self.values.copy(), [frequency for frequency, _ in lines]
        for r, (seen, rate) in enumerate(zip(self.valid, np.asarray(self.bank.rate), strict=True)):
            if not seen.any():
                continue
            left[:, r, seen] = without_lines(left[:, r, seen], np.flatnonzero(seen) / rate, frequencies)
        return self._replace(values=left)


def noise_of_residuals(problem: Problem, residuals: np.ndarray) -> tuple[Noise, ...]:
    """Noise of each channel in SI units.

    Parameters
    ----------
    residuals : (..., n_record, n_channel, n_time) in units of the noise
        That hold nothing else; the power of several is averaged.
    """
    data, channels = problem.observations, problem.model.rig.channels
    valid = sample_mask(problem)
    counts = np.asarray(data.experiment.count)
    bank, unit = bank_for(np.asarray(data.experiment.times), counts), unit_of(data, channels)
    draws = np.where(valid, residuals, 0.0).reshape(-1, *valid.shape) * unit[:, :, None]
    rate = float(np.mean(np.asarray(bank.rate)))
    return tuple(
        noise_of_steps(data.steps[channel], rate, int(valid[:, c].sum()))
        if channel in data.steps
        else _noise(_Draws(draws[:, :, c], valid[:, c], counts, bank), lines=True)
        for c, channel in enumerate(channels)
    )


def noise_of_signals(signals: np.ndarray, times: np.ndarray, counts: np.ndarray) -> Noise:
    """Noise of signals of one channel that hold nothing else, lines left out.

    Parameters
    ----------
    signals : (n_draw, n_record, n_time)
        In SI units, zero beyond the end of a record; the power of several draws is averaged.
    times : (n_record, n_time) in s
    counts : (n_record,) int
    """
    valid = np.arange(times.shape[1]) < counts[:, None]
    return _noise(_Draws(np.where(valid, signals, 0.0), valid, counts, bank_for(times, counts)), lines=False)


def with_lines(noise: Noise, pieces: Sequence[tuple[np.ndarray, float]]) -> Noise:
    """Noise of readings at rest with the lines they hold at frequencies of their own, in place of that of the mains.

    Parameters
    ----------
    noise : Noise
        As `noise_of` finds it.
    pieces : sequence of ((n,), float)
        Readings in SI units, and their rate in Hz.
    """
    counts = np.array([len(values) for values, _ in pieces], dtype=int)
    if not len(counts):
        return noise
    valid = np.arange(counts.max()) < counts[:, None]
    values = np.zeros(valid.shape)
    values[valid] = np.concatenate([part - part.mean() for part, _ in pieces])
    rates = [rate for _, rate in pieces]
    draws = _Draws(values[None], valid, counts, bank_of(rates, float(np.max(counts / np.array(rates)))))
    found, rest = _lines(draws)
    if not found:
        return noise
    white, pink = whittle(rest.frequency, rest.power)
    return replace(noise, white=max(white, noise.floor), pink=pink, line=0.0, lines=tuple(found))


def whitening_of(problem: Problem, noise: Sequence[Noise]) -> Coloured:
    """Innovations filter of a problem's residuals for noise of known spectra.

    Parameters
    ----------
    noise : sequence of Noise
        One for each channel, in SI units.
    """
    data, channels = problem.observations, problem.model.rig.channels
    valid = sample_mask(problem)
    bank = bank_for(np.asarray(data.experiment.times), np.asarray(data.experiment.count))
    return coloured_of(bank, noise, unit_of(data, channels), valid)


def sample_mask(problem: Problem) -> np.ndarray:
    """Which samples count, ``(n_record, n_channel, n_time)``: those that are hardly weighed apart."""
    weights = problem.observations.weight
    weight = np.stack([np.asarray(weights[channel]) for channel in problem.model.rig.channels], axis=1)
    return weight > SAMPLE_COUNTS * np.maximum(weight.max(axis=-1, keepdims=True), 1e-300)


def _noise(draws: _Draws, lines: bool) -> Noise:
    samples, bank = int(draws.valid.sum()), draws.bank
    if samples < len(draws.valid) or not np.any(draws.values):
        return Noise(1.0, 0.0, 0.0, 0)
    # What stands out does so of any spectrum: which one is the simplest is tested once, of the rest.
    found, rest = _lines(draws) if lines else ([], periodograms(*draws))
    weights = fitted(rest)
    variances, rate = weights[:-2], float(np.mean(np.asarray(bank.rate)))
    share = variances > NEGLIGIBLE_PART * (variances.sum() + weights[-1])
    slow = tuple(zip(np.asarray(bank.corners)[share].tolist(), variances[share].tolist(), strict=True))
    return Noise(float(weights[-1]) / (0.5 * rate), float(weights[-2]), 0.0, samples, slow, tuple(found))


def periodograms(draws: np.ndarray, valid: np.ndarray, counts: np.ndarray, bank: Bank) -> Periodograms:
    """Periodograms of one channel and their expectations.

    Parameters
    ----------
    draws : (n_draw, n_record, n_time)
        Zero where not valid.
    valid : (n_record, n_time) bool
    counts : (n_record,) int
    """
    parts, rates = [], np.asarray(bank.rate)
    for r, (mask, count) in enumerate(zip(valid, counts, strict=True)):
        number, rate = int(mask.sum()), float(rates[r])
        if number < 2:
            continue
        inner = slice(1, (int(count) + 1) // 2)
        frequency = np.fft.rfftfreq(count, 1.0 / rate)[inner]
        power = _power(draws[:, r, :count], number, rate)
        decay, seen = np.asarray(bank.decay)[r], mask[:count]
        expected = lag_transforms(decay, seen)[:, inner] * (4.0 / (number * rate))
        pink = np.asarray(bank.pink)[r] @ expected[:-1]
        # Records have the density of white noise in common; its variance is that of the mean rate.
        white = expected[-1:] * (rate / rates.mean())
        expected = np.concatenate([expected[:-1], pink[None], white])
        parts.append((frequency, power, expected.T, np.full(len(frequency), r)))
    return Periodograms(*(np.concatenate(part) for part in zip(*parts, strict=True)))


def _power(draws: np.ndarray, number: int, rate: float) -> np.ndarray:
    """Mean periodogram of draws ``(n_draw, n)`` of a record of which so many samples count."""
    inner = slice(1, (draws.shape[-1] + 1) // 2)
    return 2.0 * (np.abs(np.fft.rfft(draws, axis=-1)) ** 2).mean(axis=0)[inner] / (number * rate)


def _clear(whole: Periodograms, found: Sequence[tuple[float, float]], draws: _Draws) -> np.ndarray:
    """Which ordinates hold no line."""
    spacing = (np.asarray(draws.bank.rate) / draws.counts)[whole.record]
    far = [np.abs(whole.frequency - frequency) > CLEAR * spacing for frequency, _ in found]
    return np.logical_and.reduce([np.ones(len(whole.frequency), dtype=bool), *far])


def _lines(draws: _Draws) -> tuple[list[tuple[float, float]], Periodograms]:
    """Frequencies and variances of what stands out, and the ordinates of the rest."""
    found: list[tuple[float, float]] = []
    left, whole = draws, periodograms(*draws)
    rest = whole
    while len(found) < LINES and (line := _line(left, whole, rest.bands.of_any_corner, found)):
        found.append(line)
        left = draws.without(found)
        whole = replace(whole, power=_powers(left))
        rest = whole.where(_clear(whole, found, draws))
    return found, rest


def _powers(draws: _Draws) -> np.ndarray:
    """``Periodograms.power`` of some draws."""
    rows = zip(draws.valid.sum(axis=-1), draws.counts, np.asarray(draws.bank.rate), strict=True)
    parts = [_power(draws.values[:, r, :n], m, rate) for r, (m, n, rate) in enumerate(rows) if m > 1]
    return np.concatenate(parts)


def _line(
    draws: _Draws, whole: Periodograms, weights: np.ndarray, found: Sequence[tuple[float, float]]
) -> tuple[float, float] | None:
    """Frequency and variance of the strongest line beside those found; None where chance is as strong."""
    density = whole.expected @ weights
    free = _clear(whole, found, draws) & (whole.frequency > SLOWEST_LINE)
    if not free.any():
        return None
    # Frequencies of records of several lengths: the sum over records of what lies nearest to each of the longest one's.
    # Those of a short one are too far apart for the line to be found between them.
    numbers, ordinates = np.unique(whole.record, return_counts=True)
    grid = whole.frequency[whole.record == numbers[np.argmax(ordinates)]]
    sums, number = np.zeros(len(grid)), np.zeros(len(grid))
    for r in numbers:
        mine = whole.record == r
        near = _nearest(whole.frequency[mine], grid)
        sums += np.where(free[mine], whole.power[mine] / density[mine], 0.0)[near]
        number += free[mine][near]
    from scipy.special import gammaincc

    tail = gammaincc(np.maximum(number, 1.0), sums) * len(grid)
    best = int(np.argmin(np.where(number > 0.0, tail, 1.0)))
    if tail[best] > LINE_BY_CHANCE:
        return None
    return _refined(draws, float(grid[best]), density, whole)


def _nearest(frequencies: np.ndarray, grid: np.ndarray) -> np.ndarray:
    """Places ``(n_grid,)`` of the nearest ones of rising frequencies."""
    above = np.clip(np.searchsorted(frequencies, grid), 1, max(len(frequencies) - 1, 1))
    below = above - 1
    above = np.minimum(above, len(frequencies) - 1)
    return np.where(grid - frequencies[below] < frequencies[above] - grid, below, above)


def _refined(draws: _Draws, near: float, density: np.ndarray, whole: Periodograms) -> tuple[float, float]:
    """Frequency and variance of the line near a frequency."""
    rate, counts, valid = np.asarray(draws.bank.rate), draws.counts, draws.valid
    spacing = float(np.min(rate / counts))
    frequency = near + spacing * np.linspace(-1.5, 1.5, 3 * FINE + 1)
    total = np.zeros(len(frequency))
    for r in np.unique(whole.record):
        count = counts[r]
        turn = np.exp(-2j * np.pi * frequency[:, None] * np.arange(count) / rate[r])
        number = max(int(valid[r].sum()), 1)
        amplitude = np.mean(np.abs(draws.values[:, r, :count] @ turn.T) ** 2, axis=0) / number**2
        level = np.interp(near, whole.frequency[whole.record == r], density[whole.record == r])
        total += 2.0 * np.maximum(amplitude - 0.5 * level * rate[r] / number, 0.0) * number
    best = int(np.argmax(total))
    return _top(frequency, total, best), float(total[best] / max(valid.sum(), 1))


def _top(places: np.ndarray, heights: np.ndarray, best: int) -> float:
    """Where a parabola through the highest of equidistant heights and its neighbours has its top."""
    around = heights[max(best - 1, 0) : best + 2]
    if len(around) < 3:
        return float(places[best])
    bend = around[0] - 2.0 * around[1] + around[2]
    aside = 0.5 * (around[0] - around[2]) / bend if bend < 0.0 else 0.0
    return float(places[best] + aside * (places[1] - places[0]))
