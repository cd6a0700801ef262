"""What a fit leaves: the simulated motion beside the records, and whether that has the size and structure of noise.

Noise of a logger is coloured, so "white" is the wrong question: residuals are compared with the spectrum of the
records' own rests, with each other across the phases of the motion, and with the states of the rig. Rests tell the
colour of noise whose size a study states, too; without any, only its power in all is known.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from scipy.special import chdtri, fdtri

from fibrefit.core.declarations import HELD, PHASES
from fibrefit.core.spectra import MAINS, periodogram
from fibrefit.fitting.result import Found, Gap
from fibrefit.fitting.thresholds import (
    CHANCE,
    FEWEST_SAMPLES,
    LOUDER_THAN_AT_REST,
    LOUDEST,
    ORDINATES,
    RARE_POWER,
    SLOWEST_OCTAVE,
    STANDS_OUT,
    STATE_CELLS,
    STATE_SHARE,
)
from fibrefit.problem import BESIDE_MAINS, CLEAR, Motion, Noise, Problem, ResidualSet, Task, unbroken
from fibrefit.rigs.signals.rest import rests
from fibrefit.study.summaries.results import ChannelGap


@dataclass(frozen=True)
class Evaluation:
    """A simulation beside its records.

    Parameters
    ----------
    record_gaps : mapping of record to Gap
    """

    motion: Motion
    gap: Gap
    record_gaps: Mapping[str, Gap]


def evaluate(task: Task, problem: Problem, local: np.ndarray) -> Evaluation:
    """Simulate and compare.

    Parameters
    ----------
    problem : Problem
        Of the task, errors of its inputs taken off.
    local : (n_record, n_local) in SI units
        Values of each record.
    """
    moved = Motion.of_fit(problem, local)
    return Evaluation(moved, *_gaps(task, moved.readings))


def _gaps(task: Task, readings: Mapping[str, np.ndarray]) -> tuple[Gap, Mapping[str, Gap]]:
    data, names = task.problem.observations, task.problem.layout.records
    gaps: dict[str, dict[str, ChannelGap]] = {name: {} for name in names}
    whole: dict[str, ChannelGap] = {}
    for channel, reading in readings.items():
        weight = np.asarray(data.weight[channel])
        counted = weight > 0.0
        measured = np.asarray(data.measured[channel])
        error = np.where(counted, measured - reading, 0.0)
        pieces = task.problem.model.pieces
        squares = np.array([_squares(row, seen, pieces) for row, seen in zip(measured, counted, strict=True)])
        # Where noise grows with the load each reading has its own: a perfect model is off by their mean square.
        noises = np.divide(1.0, weight, out=np.zeros_like(weight), where=counted)
        number = counted.sum(axis=1)
        for r, name in enumerate(names):
            rms, noise = (float(np.sqrt(np.sum(part[r] ** 2) / max(number[r], 1))) for part in (error, noises))
            share = _share_explained(float(np.sum(error[r] ** 2)), float(squares[r]))
            gaps[name][channel] = ChannelGap.against_noise(noise, rms, task.units[channel], share)
        rms, noise = (float(np.sqrt(np.sum(part**2) / number.sum())) for part in (error, noises))
        share = _share_explained(float(np.sum(error**2)), float(squares.sum()))
        whole[channel] = ChannelGap.against_noise(noise, rms, task.units[channel], share)
    return whole, gaps


def _squares(values: np.ndarray, counted: np.ndarray, pieces: int | None) -> float:
    """Sum of squared distances from the mean; in pieces, whose start is their own, from the best line of each."""
    if pieces is None:
        return float(np.sum((values[counted] - values[counted].mean()) ** 2)) if counted.any() else 0.0
    total, ahead = 0.0, np.arange(pieces) - 0.5 * (pieces - 1)
    for start in range(0, len(values), pieces):
        seen = counted[start : start + pieces]
        line = np.column_stack([np.ones(seen.sum()), ahead[: len(seen)][seen]])
        part = values[start : start + pieces][seen]
        if len(part):
            total += float(np.sum((part - line @ np.linalg.lstsq(line, part, rcond=None)[0]) ** 2))
    return total


def _share_explained(left: float, whole: float) -> float:
    return 1.0 - left / whole if whole > 0.0 else float("nan")


def readings_at_rest(task: Task) -> dict[str, list[tuple[np.ndarray, float]]]:
    """Readings at rest of each channel whose noise was taken from there, and their rates in Hz.

    Where the study states the noise, they are as much larger as it is: rests tell its colour, and the study its size.
    Where noise grows with the load they are taken back to the quietest reading of their record, as residuals are.
    """
    found: dict[str, list[tuple[np.ndarray, float]]] = {channel: [] for channel in task.problem.model.rig.channels}
    weights = {channel: np.asarray(task.problem.observations.weight[channel]) for channel in found}
    for r, trace in enumerate(task.traces):
        rate = trace.rate
        for rest in rests(trace):
            for channel in found:
                own = weights[channel][r, : len(trace.times)][rest]
                quieter = np.where(own > 0.0, own / weights[channel][r].max(), 1.0)
                values = trace.channels[channel][rest]
                # The load itself is no noise: a factor that follows its readings would take slow noise off with it.
                values = (values - values[np.isfinite(values)].sum() / max(np.isfinite(values).sum(), 1)) * quieter
                if task.noise[channel].samples and len(values := unbroken(values)):
                    found[channel].append((values * task.stated_over_rest.get(channel, 1.0), rate))
    return found


DRAWS = 20

OCTAVES = 10
"""Octaves below half the rate that are looked at in any case."""


def loudness(residual_set: ResidualSet, channel: int, inside: np.ndarray | None = None) -> float:
    """Fast part of the residuals over that at rest, at least one: noise that grows with the load is louder in motion.

    Parameters
    ----------
    inside : (n_record, n_time) bool, optional
        Samples that are looked at; all that count by default.
    """
    name, sigma = residual_set.channels[channel], residual_set.sigma[:, channel, None]
    noise, pieces = residual_set.noise[name], residual_set.rests.get(name, ())
    inside = residual_set.counted[:, channel] if inside is None else inside
    here = _fast(residual_set.residuals[:, channel] * sigma, inside)
    parts = [(_fast(values[None], np.ones((1, len(values)), dtype=bool)), len(values)) for values, _ in pieces]
    number = sum(size for _, size in parts)
    still = np.sqrt(sum(part**2 * size for part, size in parts) / number) if number else 0.0
    if still == 0.0:
        still = np.sqrt(noise.white * 0.5 * residual_set.rate)
    return float(np.clip(here / max(still, np.sqrt(noise.floor * 0.5 * residual_set.rate), 1e-300), 1.0, LOUDEST))


def _fast(scaled: np.ndarray, inside: np.ndarray) -> float:
    """Standard deviation of the fast part of some samples, from third differences: hardly anything else enters them."""
    whole = inside[:, 3:] & inside[:, 2:-1] & inside[:, 1:-2] & inside[:, :-3]
    differences = np.diff(scaled, 3, axis=1)[whole]
    if differences.size < ORDINATES:
        return 0.0
    # Squares rather than a median, which is zero where readings are coarse; the largest are those of a bounce.
    size = np.abs(differences)
    return float(np.sqrt(np.mean(np.minimum(size, 4.0 * np.mean(size)) ** 2) / 20.0))


def spectrum(residual_set: ResidualSet) -> Found:
    """Whether residuals have the spectrum of the noise at rest."""
    worst, where = 0.0, ("", 0.0)
    whole = [channel for channel in residual_set.stated if not residual_set.noise[channel].samples]
    for c, channel in enumerate(residual_set.channels):
        loud = loudness(residual_set, c) ** 2
        for low, ratio, chance in [_total(residual_set, c)] if channel in whole else _octaves(residual_set, c):
            # A low octave holds few frequencies: chance alone lifts it.
            excess = ratio / (chance * loud)
            if excess > worst:
                worst, where = excess, (channel, low)
    facts = {
        "channel": where[0],
        "low": where[1],
        "stated": residual_set.stated,
        "whole": tuple(whole),
        "whole_alone": len(whole) == len(residual_set.channels),
    }
    return Found(float(worst), facts)


def _total(residual_set: ResidualSet, channel: int) -> tuple[float, float, float]:
    """No edge, power of all frequencies over that of the stated noise, and what this ratio is by chance.

    A standard deviation without a rest does not say at which frequencies its power lies. The fitted spectrum tells how
    much the power of noise with such a memory scatters: that of its ordinates is exponential.
    """
    counted = residual_set.counted[:, channel]
    ratio = float(np.mean(residual_set.residuals[:, channel][counted] ** 2)) if counted.any() else 0.0
    fitted = residual_set.fitted[residual_set.channels[channel]]
    rows = zip(residual_set.counts, residual_set.rates, strict=True)
    expected = np.concatenate([rate * fitted.expected(int(count), float(rate)) for count, rate in rows])
    return 0.0, ratio, float(1.0 + CHANCE * np.sqrt(np.sum(expected**2)) / np.sum(expected))


def _octaves(residual_set: ResidualSet, channel: int) -> list[tuple[float, float, float]]:
    """Of each octave: lower edge [Hz], power over that at rest, and what this ratio is by chance."""
    name = residual_set.channels[channel]
    fitted, known = residual_set.fitted[name], residual_set.noise[name]
    pieces = []
    for r, count in enumerate(residual_set.counts):
        # Masked samples are zero and bring no power.
        scale = residual_set.sigma[r, channel] * np.sqrt(count / max(residual_set.counted[r, channel].sum(), 1))
        pieces.append((residual_set.residuals[r, channel, :count] * scale, float(residual_set.rates[r])))
    moving, resting = _shares(pieces, fitted), _shares(residual_set.rests.get(name, ()), fitted)
    found = []
    for edge in _edges(float(residual_set.rates.max())):
        left, still = (of.of_octave(edge) for of in (moving, resting))
        if len(left.power) < ORDINATES or (len(resting.power) and len(still.power) < ORDINATES):
            continue
        density, mean = fitted.density(left.frequency), float(np.mean(left.power))
        if not len(resting.power):
            stated = float(np.mean(known.density(left.frequency) / density))
            found.append((edge, mean / stated, 1.0 + CHANCE / np.sqrt(len(left.power))))
            continue
        # Steps of a coarse reading are noise that a rest may not show.
        ratio = mean / max(float(np.mean(still.power)), float(np.mean(known.floor / density)))
        chance = fdtri(2 * len(left.power), 2 * len(still.power), 1.0 - RARE_POWER)
        found.append((edge, ratio, float(chance)))
    return found


def _edges(rate: float) -> np.ndarray:
    """Lower edges in Hz of the octaves below half of a rate in Hz that are looked at, ``(n_octave,)``."""
    number = max(OCTAVES, int(np.log2(0.5 * rate / SLOWEST_OCTAVE)))
    return 0.5 * rate / 2.0 ** np.arange(1, number + 1)


class _Shares(NamedTuple):
    """Frequencies [Hz] that hold no line, and power there over what is expected, ``(n_ordinate,)`` each."""

    frequency: np.ndarray
    power: np.ndarray

    def of_octave(self, low: float) -> _Shares:
        """Those from `low` to twice that, in Hz."""
        inside = (low <= self.frequency) & (self.frequency < 2 * low)
        return _Shares(self.frequency[inside], self.power[inside])


def _shares(pieces: Sequence[tuple[np.ndarray, float]], noise: Noise) -> _Shares:
    """Those of some pieces, each against what is expected of a piece of that length."""
    found = [_Shares(np.empty(0), np.empty(0))]
    for values, rate in pieces:
        count = len(values)
        if count < 2 * ORDINATES:
            continue
        frequency, power = periodogram(values, rate)
        lines = [f for f, _ in noise.lines] + list(MAINS if not noise.lines else ())
        clear = np.min([np.abs(frequency - line) for line in lines], axis=0) > max(BESIDE_MAINS, CLEAR * rate / count)
        found.append(_Shares(frequency[clear], (power / noise.expected(count, rate))[clear]))
    return _Shares(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def phases(residual_set: ResidualSet) -> Found:
    """Whether no phase of the motion stands out."""
    worst, where = 0.0, ("", "")
    duration, rate = float(np.max(residual_set.counts)) / residual_set.rate, residual_set.rate
    for c, channel in enumerate(residual_set.channels):
        noise = residual_set.noise[channel]
        # Share of the noise's power at rest that is slow.
        slow = 1.0 - noise.white * 0.5 * rate / noise.rms(duration, rate) ** 2
        each = [(residual_set.motion.phase == index) & residual_set.counted[:, c] for index in range(len(PHASES))]
        # Where all are short the longest is looked at: chance is allowed for.
        fewest = max(min(FEWEST_SAMPLES, max(int(inside.sum()) for inside in each)), 1)
        for phase, inside in zip(PHASES, each, strict=True):
            if inside.sum() >= fewest:
                # Of noise of variance one the mean square scatters; its slow share hardly changes while a phase lasts,
                # so that each stretch of it counts as one sample of that.
                edges = np.diff(inside.astype(int), axis=1, prepend=0, append=0)
                lengths = np.concatenate([np.flatnonzero(row < 0) - np.flatnonzero(row > 0) for row in edges])
                number = lengths.sum()
                scatter = 2.0 * ((1.0 - slow) ** 2 / number + slow**2 * np.sum(lengths**2) / number**2)
                expected = 1.0 + CHANCE * float(np.sqrt(scatter))
                loud = loudness(residual_set, c, inside)
                ratio = float(np.sqrt(np.mean(residual_set.residuals[:, c][inside] ** 2) / expected)) / loud
                if ratio > worst:
                    worst, where = ratio, (channel, phase)
    return Found(worst, {"channel": where[0], "phase": where[1]})


def states(residual_set: ResidualSet) -> Found:
    """Whether residuals depend on no state of the rig."""
    worst, where = 0.0, ("", "")
    moving, known = residual_set.motion.phase != HELD, dict[tuple[str, bytes], np.ndarray]()
    for c, channel in enumerate(residual_set.channels):
        inside, noise = residual_set.counted[:, c] & moving, residual_set.noise[channel]
        drawn: np.ndarray | None = None
        for name, state in residual_set.motion.states.items():
            # Channels are mostly there at the same samples.
            if (key := (name, inside.tobytes())) not in known:
                known[key] = _steps(state[inside])
            steps = known[key]
            share = _explained(steps, residual_set.residuals[:, c][inside])
            if share > STATE_SHARE:
                if drawn is None:
                    # Noise with the spectrum of the rests: what it alone explains is by chance.
                    random = np.random.default_rng(0)
                    drawn = np.zeros((DRAWS, *inside.shape))
                    for draw in drawn:
                        for row, count, rate in zip(draw, residual_set.counts, residual_set.rates, strict=True):
                            row[:count] = noise.draw(int(count), float(rate), random)
                by_chance = [_explained(steps, one[inside]) for one in drawn]
                share *= min(1.0, STATE_SHARE / float(np.mean(by_chance) + CHANCE * np.std(by_chance)))
            if share > worst:
                worst, where = share, (channel, name)
    # Where no curve could be tried, nothing was found, and nothing was looked for.
    tried = any(steps.size for steps in known.values())
    facts = {"channel": where[0], "state": where[1], "states": tuple(residual_set.motion.states), "tried": tried}
    return Found(worst if tried else None, facts, tried and worst <= STATE_SHARE)


def _steps(state: np.ndarray) -> np.ndarray:
    """Which of equally filled cells each value belongs to; none where there is nothing to tell apart.

    Of two values in each cell a curve explains half of the noise: of fewer none is tried.
    """
    if len(state) < 2 * STATE_CELLS or np.ptp(state) == 0.0:
        return np.empty(0, dtype=int)
    return np.searchsorted(np.unique(np.quantile(state, np.linspace(0.0, 1.0, STATE_CELLS + 1)[1:-1])), state)


def _explained(steps: np.ndarray, residual: np.ndarray) -> float:
    """Share of the residual's power that a curve of steps explains."""
    if not steps.size:
        return 0.0
    sums = np.bincount(steps, weights=residual)
    return float(np.sum(sums**2 / np.maximum(np.bincount(steps), 1)) / np.sum(residual**2))


def loudest_record(sizes: Mapping[str, float], residual_set: ResidualSet, expected: float) -> Found:
    """Whether the loudest record leaves no more than noise that is a little louder than at rest.

    It hardly shows in what all records leave together.

    Parameters
    ----------
    sizes : mapping of record to float
        Gap of each, in the order of the residuals.
    expected : float
        Gap of a perfect model.

    Law
    ---
    The mean square of normal noise whose periodogram is expected to be ``E_k`` has the relative variance
    ``Σ E_k² / (Σ E_k)²``: ``2/n`` of n samples of white noise, more of slow noise. It is distributed nearly as
    chi-squared with twice the inverse of that as degrees of freedom, over these.

    Source
    ------
    Satterthwaite, Biometrics Bull. 2 (1946).
    """
    limit, worst, which = LOUDER_THAN_AT_REST * expected, 0.0, ""
    for r, (name, size) in enumerate(sizes.items()):
        # Gap that noise alone leaves in a record, and rarely exceeds in any of so many.
        count, rate = int(residual_set.counts[r]), float(residual_set.rates[r])
        scatters = [
            scatter_of_noise(residual_set.noise[channel], count, rate, int(seen))
            for channel, seen in zip(residual_set.channels, residual_set.counted[r].sum(axis=-1), strict=True)
        ]
        freedom = 2.0 * len(scatters) ** 2 / sum(scatters)
        by_chance = float(np.sqrt(max(chdtri(freedom, RARE_POWER / len(sizes)) / freedom, 1.0)))
        ratio = size / by_chance if np.isfinite(size) else np.inf
        if limit < ratio < np.inf:
            # How much louder it is at all frequencies alike no lack of a model explains.
            own, channels = np.arange(len(residual_set.counts))[:, None] == r, range(len(residual_set.channels))
            loud = [loudness(residual_set, c, residual_set.counted[:, c] & own) for c in channels]
            ratio /= float(np.sqrt(np.mean(np.square(loud))))
        if ratio > worst:
            worst, which = ratio, name
    return Found(float(worst), {"record": which}, worst <= limit, {"threshold": float(limit)})


def scatter_of_noise(noise: Noise, count: int, rate: float, counted: int) -> float:
    """Relative variance of the mean square of noise over a record.

    Parameters
    ----------
    count, counted : int
        Samples of the record, and those of them that count.
    rate : float
        Samples a second, in Hz.
    """
    power = noise.expected(count, rate) if count > 2 else np.zeros(0)
    whole = float(power.sum())
    slow = float(np.sum(power**2)) / whole**2 * count / max(counted, 1) if whole > 0.0 else 0.0
    return max(slow, 2.0 / max(counted, 1))


NEIGHBOURS = 2
"""Samples on each side with which one is compared: two strays side by side are still found."""


class LoneSample(NamedTuple):
    """A reading that lies far off, and by how many times the noise.

    Parameters
    ----------
    time : float, in s
    size : float
    """

    record: str
    channel: str
    time: float
    size: float


class LoneSamples(NamedTuple):
    """The samples, largest first, and the share of what is left beyond the noise, in squares, that they carry."""

    samples: tuple[LoneSample, ...]
    share: float


def lone_samples(residual_set: ResidualSet) -> LoneSamples | None:
    """The few samples that carry most of the misfit; None where it is carried by more, or there is none."""
    residuals = np.where(residual_set.counted, residual_set.residuals, 0.0)
    squares = residuals**2
    beyond = float(squares.sum()) - int(residual_set.counted.sum())
    alone = stands_out(residuals, residual_set.counted)
    share = float(squares[alone].sum()) / beyond if beyond > 0.0 else 0.0
    # They carry most of it.
    if share < 0.5:
        return None
    places = sorted(np.argwhere(alone).tolist(), key=lambda place: -squares[tuple(place)])
    records, channels, times = residual_set.problem.layout.records, residual_set.channels, residual_set.times
    found = [
        LoneSample(records[r], channels[c], float(times[r, t]), abs(float(residuals[r, c, t]))) for r, c, t in places
    ]
    return LoneSamples(tuple(found), min(share, 1.0))


def stands_out(residuals: np.ndarray, counted: np.ndarray) -> np.ndarray:
    """Which residuals ``(..., n_time)`` in units of the noise are far beyond it, and beyond those beside them."""
    size = np.where(counted, np.abs(residuals), np.nan)
    padded = np.pad(size, [(0, 0)] * (size.ndim - 1) + [(NEIGHBOURS, NEIGHBOURS)], constant_values=np.nan)
    near = np.lib.stride_tricks.sliding_window_view(padded, 2 * NEIGHBOURS + 1, axis=-1)
    # Where all are masked there is nothing to compare: the sample itself is masked, too.
    usual = np.ma.median(np.ma.masked_invalid(near), axis=-1).filled(np.inf)
    alone: np.ndarray = counted & (np.abs(residuals) > STANDS_OUT * np.maximum(usual, 1.0))
    return alone
