"""Spectrum of residuals by maximum likelihood: white noise, 1/f, first-order parts of fixed corners, and lines.

A periodogram ordinate of a record is exponentially distributed about its expectation, which is a sum of what each part
of the noise contributes, leakage and masked samples included. Lines are what stands out of that, and are taken off
before the rest is judged.

Law
---
A part of autocovariance ``c(l)`` gives the periodogram ``P(f) = 2 |sum of r_t exp(-2 pi i f t)|^2 / (n rate)`` of a
record with n valid samples the expectation ``4 / (n rate) Re sum over l of m(l) c(l) exp(-2 pi i f l)``, the term of
lag 0 halved, where ``m(l)`` counts pairs of valid samples at lag l: ``N - l`` in a record of N without holes, of which
that of ``c(l) = a^l`` has a closed form. With ``E(f) = sum of w_i E_i(f)`` minus the log likelihood is
``sum of ln E + P / E`` (Whittle). Multiplicative steps ``w_i <- w_i (sum of E_i P / E^2) / (sum of E_i / E)`` lower it
and keep variances from becoming negative; most of them vanish.

Source
------
Whittle, Ark. Mat. 2 (1953); expectation of the periodogram instead of the density: Sykulski et al., Biometrika 106
(2019); the steps: Fevotte, Bertin and Durrieu, Neural Comput. 21 (2009); BIC: Schwarz, Ann. Stat. 6 (1978).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import NamedTuple

import jax
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.core.spectra import whittle, without_lines
from fibrefit.problem.noise.coloured import LINES, Bank, Coloured, bank_for, bank_of, coloured_of
from fibrefit.problem.noise.readings import LOUDEST_LOADED
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whitening import unit_of
from fibrefit.problem.statement.observations import Steps
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.thresholds import CLEAR, LINE_BY_CHANCE, NEGLIGIBLE_PART, SLOWEST_LINE

STEPS = 400
"""Multiplicative steps of each spectrum."""


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
        values, frequencies = self.values.copy(), [frequency for frequency, _ in lines]
        for r, (seen, rate) in enumerate(zip(self.valid, np.asarray(self.bank.rate), strict=True)):
            if seen.any():
                values[:, r, seen] = without_lines(values[:, r, seen], np.flatnonzero(seen) / rate, frequencies)
        return self._replace(values=values)


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


def noise_of_steps(steps: Steps, rate: float, samples: int) -> Noise:
    """Noise of a channel in coarse steps: its residuals are those of a likelihood, white and of variance one.

    Parameters
    ----------
    rate : float, in Hz
    samples : int
        That tell of it.
    """
    return Noise(float(np.mean(np.asarray(steps.level) ** 2)) / (0.5 * rate), 0.0, 0.0, samples)


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
    rates = tuple(rate for _, rate in pieces)
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
    """Which samples count, ``(n_record, n_channel, n_time)``: those that are hardly weighed apart.

    A sample may be as loud as `LOUDEST_LOADED` and weigh a third; what weighs less than nine tenths of that was
    downweighted because the model does not predict it, and tells nothing of the noise.
    """
    weights = problem.observations.weight
    weight = np.stack([np.asarray(weights[channel]) for channel in problem.model.rig.channels], axis=1)
    return weight > 0.9 / LOUDEST_LOADED * np.maximum(weight.max(axis=-1, keepdims=True), 1e-300)


def _noise(draws: _Draws, lines: bool) -> Noise:
    samples, bank = int(draws.valid.sum()), draws.bank
    if samples < len(draws.valid) or not np.any(draws.values):
        return Noise(1.0, 0.0, 0.0, 0)
    # What stands out does so of any spectrum: which one is the simplest is tested once, of the rest.
    found, rest = _lines(draws) if lines else ([], periodograms(*draws))
    weights = rest.bands.simplest()
    variances, rate = weights[:-2], float(np.mean(np.asarray(bank.rate)))
    share = variances > NEGLIGIBLE_PART * (variances.sum() + weights[-1])
    slow = tuple(zip(np.asarray(bank.corners)[share].tolist(), variances[share].tolist(), strict=True))
    return Noise(float(weights[-1]) / (0.5 * rate), float(weights[-2]), 0.0, samples, slow, tuple(found))


@dataclass(frozen=True)
class Periodograms:
    """Power of one channel of all records, and what each part of the noise is expected to give.

    Parameters
    ----------
    frequency : (n_ordinate,) in Hz
    power : (n_ordinate,)
        One-sided density, in unit^2/Hz.
    expected : (n_ordinate, n_relaxation + 2)
        For a variance of one of each first-order part, a density of 1/f, and a variance of one of white noise.
    record : (n_ordinate,) int
    """

    frequency: np.ndarray
    power: np.ndarray
    expected: np.ndarray
    record: np.ndarray

    @cached_property
    def bands(self) -> _Bands:
        """Means over bands of a twelfth of an octave: a spectrum of first-order parts changes little within one."""
        place = np.floor(12 * np.log2(self.frequency / self.frequency.min())).astype(int)
        number = np.bincount(place).astype(float)
        some = number > 0.0
        power, *expected = (
            np.bincount(place, weights=column)[some] / number[some] for column in (self.power, *self.expected.T)
        )
        return _Bands(power, np.stack(expected, axis=1), number[some])

    def where(self, chosen: np.ndarray) -> Periodograms:
        """The ordinates that are `chosen`."""
        return Periodograms(self.frequency[chosen], self.power[chosen], self.expected[chosen], self.record[chosen])


@dataclass(frozen=True)
class _Bands:
    """Means over narrow bands of periodograms.

    Parameters
    ----------
    power, number : (n_band,)
        And ordinates in each.
    expected : (n_band, n_part)
    """

    power: np.ndarray
    expected: np.ndarray
    number: np.ndarray

    @cached_property
    def of_any_corner(self) -> np.ndarray:
        """Variances ``(n_part,)`` of first-order parts of all corners and of white noise."""
        corners = self.expected.shape[1] - 2
        return self.fitted([np.r_[np.arange(corners), corners + 1]])[0]

    def simplest(self) -> np.ndarray:
        """Variances ``(n_part,)`` of the spectrum with the lowest BIC.

        Of white noise, that with 1/f, with a first-order part, with both, and with first-order parts of all corners.
        Few ordinates tell of the slowest noise: the simplest spectrum that will do says most of it, and of what a
        record of its length does not show at all.
        """
        corners, of_any_corner = self.expected.shape[1] - 2, self.of_any_corner
        first = int(np.argmax(of_any_corner[: corners - 1] + of_any_corner[1:corners])) if corners > 1 else 0
        pair, either = np.array([first, first + 1])[:corners], np.array([corners, corners + 1])
        simple = [either[1:], either, np.r_[pair, either[1:]], np.r_[pair, either]]
        weights = np.concatenate([of_any_corner[None], self.fitted(simple)])
        used = of_any_corner[:corners] > NEGLIGIBLE_PART * (of_any_corner[:corners].sum() + of_any_corner[-1])
        # A pair of neighbouring corners stands for one part whose corner lies between them.
        sizes = np.array([1 + np.count_nonzero(used), 1, 2, 3, 4])
        return np.asarray(weights[int(np.argmin(self.costs(weights) + sizes * np.log(self.number.sum())))])

    def fitted(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """Variances ``(n_choice, n_part)`` that are most likely where some parts alone are there."""
        size = 0.1 * np.average(self.power, weights=self.number) / self.expected.mean(axis=0)
        widest = max(map(len, parts))
        # Bands that hold nothing make up the rows of a program that other records share, and parts that are nothing,
        # and remain so under multiplicative steps, its columns.
        spare = -len(self.number) % 64
        rows = np.pad(self.expected, ((0, spare), (0, 0)), constant_values=1.0)
        power, number = (np.pad(band, (0, spare)) for band in (self.power, self.number))
        places = np.array([np.resize(some, widest) for some in parts])
        there = np.arange(widest) < np.array([len(some) for some in parts])[:, None]
        found = _stepped(np.where(there, size[places], 0.0), np.moveaxis(rows[:, places], 1, 0), power, number)
        weights = np.zeros((len(parts), len(size)))
        for row, some, those in zip(weights, parts, np.asarray(found), strict=True):
            row[some] = those[: len(some)]
        return weights

    def costs(self, weights: np.ndarray) -> np.ndarray:
        """Minus twice Whittle's log likelihood of variances ``(n_choice, n_part)``."""
        density = np.maximum(weights @ self.expected.T, 1e-300)
        return np.asarray(2.0 * (np.log(density) + self.power / density) @ self.number)


@kept_program
def _stepped(weights: jax.Array, expected: jax.Array, power: jax.Array, number: jax.Array) -> jax.Array:
    """Variances ``(n_start, n_part)`` after `STEPS` multiplicative steps, each of parts ``(n_start, n_band, n_part)``.

    One start after the other: products with a vector are compiled into the loop, those of four rows leave it for a
    library each time, and take four times as long.
    """

    def one(row: tuple[jax.Array, jax.Array]) -> jax.Array:
        start, expected = row

        def step(_: int, weights: jax.Array) -> jax.Array:
            density = expected @ weights
            share = number / density
            return weights * ((share * power / density) @ expected) / (share @ expected)

        return jax.lax.fori_loop(0, STEPS, step, start)

    return jax.lax.map(one, (weights, expected))


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


def lag_transforms(decay: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Transforms ``(n_relaxation + 1, n_frequency)`` of what parts of variance one share at each lag of a record.

    Parameters
    ----------
    decay : (n_relaxation,)
        Factor on each first-order part from one sample to the next.
    seen : (n_time,) bool
        Samples that count.
    """
    # Channels, iterations and records of a series share them: eight of a record of 16384 samples are some ten MB.
    of = _transforms.__wrapped__ if len(seen) > 1 << 14 else _transforms
    return of(decay.tobytes(), seen.tobytes())


@lru_cache(maxsize=8)
def _transforms(decay: bytes, seen: bytes) -> np.ndarray:
    factors, mask = np.frombuffer(decay), np.frombuffer(seen, dtype=bool)
    count = len(mask)
    if mask.all():
        # Without holes there is one pair of samples fewer at each lag: the sum of a known series.
        turn = np.exp(-2j * np.pi * np.arange(count // 2 + 1) / count)
        found = np.full((len(factors) + 1, len(turn)), 0.5 * count)
        # One after the other: of a long record, each fits into the fast memory.
        for row, factor in zip(found, factors, strict=False):
            # The last power of each term is that of its factor alone: a whole number of turns.
            term, rest = factor * turn, 1.0 / (1.0 - factor * turn)
            row[:] = (count * rest - term * (1.0 - factor**count) * rest**2).real - 0.5 * count
    else:
        lags = np.arange(count)
        pairs = np.fft.irfft(np.abs(np.fft.rfft(mask.astype(float), 2 * count)) ** 2, 2 * count)[:count]
        kernels = np.concatenate([factors[:, None] ** lags, (lags == 0)[None]]) * pairs
        kernels[:, 0] *= 0.5
        found = np.ascontiguousarray(np.fft.rfft(kernels, axis=-1).real)
    found.flags.writeable = False
    return found


def _clear(whole: Periodograms, found: Sequence[tuple[float, float]], draws: _Draws) -> np.ndarray:
    """Which ordinates hold no line."""
    spacing = (np.asarray(draws.bank.rate) / draws.counts)[whole.record]
    clear = [np.abs(whole.frequency - frequency) > CLEAR * spacing for frequency, _ in found]
    return np.logical_and.reduce([np.ones(len(whole.frequency), dtype=bool), *clear])


def _lines(draws: _Draws) -> tuple[list[tuple[float, float]], Periodograms]:
    """Frequencies and variances of what stands out, and the ordinates of the rest."""
    found: list[tuple[float, float]] = []
    remaining, whole = draws, periodograms(*draws)
    rest, numbers, rates = whole, draws.valid.sum(axis=-1), np.asarray(draws.bank.rate)
    while len(found) < LINES and (line := _line(remaining, whole, rest.bands.of_any_corner, found)):
        found.append(line)
        # Off the readings, not off ordinates alone: what ends of a record spread of a line would pass for slow noise.
        remaining = draws.without(found)
        rows = enumerate(zip(numbers, draws.counts, rates, strict=True))
        power = [_power(remaining.values[:, r, :count], m, rate) for r, (m, count, rate) in rows if m > 1]
        whole = replace(whole, power=np.concatenate(power))
        rest = whole.where(_clear(whole, found, draws))
    return found, rest


def _line(
    draws: _Draws, whole: Periodograms, weights: np.ndarray, found: Sequence[tuple[float, float]]
) -> tuple[float, float] | None:
    """Frequency and variance of the strongest line but those found; None where chance is as strong."""
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
    # Eight places between two ordinates: a parabola through the highest of them holds the top of a line well.
    frequency = near + spacing * np.linspace(-1.5, 1.5, 25)
    total = np.zeros(len(frequency))
    for r in np.unique(whole.record):
        count = counts[r]
        turn = np.exp(-2j * np.pi * frequency[:, None] * np.arange(count) / rate[r])
        number = max(int(valid[r].sum()), 1)
        amplitude = np.mean(np.abs(draws.values[:, r, :count] @ turn.T) ** 2, axis=0) / number**2
        level = np.interp(near, whole.frequency[whole.record == r], density[whole.record == r])
        total += 2.0 * np.maximum(amplitude - 0.5 * level * rate[r] / number, 0.0) * number
    best = int(np.argmax(total))
    top, around = float(frequency[best]), total[max(best - 1, 0) : best + 2]
    if len(around) == 3:
        bend = around[0] - 2.0 * around[1] + around[2]
        aside = 0.5 * (around[0] - around[2]) / bend if bend < 0.0 else 0.0
        top = float(frequency[best] + aside * (frequency[1] - frequency[0]))
    return top, float(total[best] / max(valid.sum(), 1))
