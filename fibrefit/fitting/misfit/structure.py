"""Whether anything is left in the residuals that noise would not leave there.

Noise of a logger is coloured, so "white" is the wrong question: residuals are compared with the spectrum of the
records' own rests, with each other across the phases of the motion, and with the states of the rig. Rests tell the
colour of noise whose size a study states, too; without any, only its power in all is known.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from scipy.special import fdtri

from fibrefit.core.declarations import HELD, PHASES
from fibrefit.fitting.thresholds import (
    CHANCE,
    FEWEST_IN_MOTION,
    FEWEST_SAMPLES,
    LOUDEST,
    ORDINATES,
    PHASE_RATIO,
    RARE_POWER,
    SHORTEST_PIECE,
    SLOWEST_OCTAVE,
    SPECTRUM_RATIO,
    STATE_SHARE,
)
from fibrefit.problem.diagnose.motion import ResidualSet
from fibrefit.problem.noise.spectrum import MAINS, Noise, periodogram
from fibrefit.problem.thresholds import BESIDE_MAINS, CLEAR
from fibrefit.study.summaries.check import Check

CELLS = 12
"""Cells, visited equally often, that a state is cut into."""
DRAWS = 20
OCTAVES = 10
"""Octaves below half the rate that are looked at in any case."""


def structure_checks(residual_set: ResidualSet) -> tuple[Check, ...]:
    """Checks of spectrum, phases and states, in this order."""
    return (_spectrum(residual_set), _phases(residual_set), _states(residual_set))


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


def _spectrum(residual_set: ResidualSet) -> Check:
    worst, where = 0.0, ("", 0.0)
    whole = [channel for channel in residual_set.stated if not residual_set.noise[channel].samples]
    for c, channel in enumerate(residual_set.channels):
        loud = loudness(residual_set, c) ** 2
        for low, ratio, chance in [_total(residual_set, c)] if channel in whole else _octaves(residual_set, c):
            # A low octave holds few frequencies: chance alone lifts it.
            excess = ratio / (chance * loud)
            if excess > worst:
                worst, where = excess, (channel, low)
    return Check(
        name="residuals have the noise's spectrum",
        passed=worst <= SPECTRUM_RATIO,
        statistic=float(worst),
        threshold=SPECTRUM_RATIO,
        identifier="residual_spectrum",
        quantity="residual spectrum",
        about="model",
        facts={
            "channel": where[0],
            "low": where[1],
            "stated": residual_set.stated,
            "whole": tuple(whole),
            "whole_alone": len(whole) == len(residual_set.channels),
        },
    )


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
        if count < SHORTEST_PIECE:
            continue
        frequency, power = periodogram(values, rate)
        lines = [f for f, _ in noise.lines] + list(MAINS if not noise.lines else ())
        clear = np.min([np.abs(frequency - line) for line in lines], axis=0) > max(BESIDE_MAINS, CLEAR * rate / count)
        found.append(_Shares(frequency[clear], (power / noise.expected(count, rate))[clear]))
    return _Shares(*(np.concatenate(parts) for parts in zip(*found, strict=True)))


def _phases(residual_set: ResidualSet) -> Check:
    worst, where = 0.0, ("", "")
    for c, channel in enumerate(residual_set.channels):
        each = [(residual_set.motion.phase == index) & residual_set.counted[:, c] for index in range(len(PHASES))]
        # Where all are short the longest is looked at: chance is allowed for.
        fewest = max(min(FEWEST_SAMPLES, max(int(inside.sum()) for inside in each)), 1)
        for phase, inside in zip(PHASES, each, strict=True):
            if inside.sum() >= fewest:
                expected = 1.0 + CHANCE * _scatter(inside, _slow_share(residual_set, c))
                loud = loudness(residual_set, c, inside)
                ratio = float(np.sqrt(np.mean(residual_set.residuals[:, c][inside] ** 2) / expected)) / loud
                if ratio > worst:
                    worst, where = ratio, (channel, phase)
    return Check(
        name="no phase stands out",
        passed=worst <= PHASE_RATIO,
        statistic=worst,
        threshold=PHASE_RATIO,
        identifier="residual_phase",
        quantity="residuals by phase",
        about="model",
        facts={"channel": where[0], "phase": where[1]},
    )


def _slow_share(residual_set: ResidualSet, channel: int) -> float:
    """Share of the noise's power at rest that is slow."""
    noise = residual_set.noise[residual_set.channels[channel]]
    duration = float(np.max(residual_set.counts)) / residual_set.rate
    return 1.0 - noise.white * 0.5 * residual_set.rate / noise.rms(duration, residual_set.rate) ** 2


def _scatter(inside: np.ndarray, slow: float) -> float:
    """Standard deviation of the mean square of noise of variance one over the samples `inside` ``(n_record, n_time)``.

    The slow share hardly changes while a phase lasts: each stretch of it counts as one sample of that.
    """
    edges = np.diff(inside.astype(int), axis=1, prepend=0, append=0)
    lengths = np.concatenate([np.flatnonzero(row < 0) - np.flatnonzero(row > 0) for row in edges])
    total = lengths.sum()
    return float(np.sqrt(2.0 * ((1.0 - slow) ** 2 / total + slow**2 * np.sum(lengths**2) / total**2)))


def _states(residual_set: ResidualSet) -> Check:
    worst, where = 0.0, ("", "")
    moving, known = residual_set.motion.phase != HELD, dict[tuple[str, bytes], np.ndarray]()
    for c, channel in enumerate(residual_set.channels):
        inside, drawn = residual_set.counted[:, c] & moving, None
        for name, state in residual_set.motion.states.items():
            # Channels are mostly there at the same samples.
            if (key := (name, inside.tobytes())) not in known:
                known[key] = _steps(state[inside])
            steps = known[key]
            share = _explained(steps, residual_set.residuals[:, c][inside])
            if share > STATE_SHARE:
                drawn = _drawn(residual_set, c) if drawn is None else drawn
                share *= min(1.0, STATE_SHARE / _by_chance([one[inside] for one in drawn], steps))
            if share > worst:
                worst, where = share, (channel, name)
    # Where no curve could be tried, nothing was found, and nothing was looked for.
    tried = any(steps.size for steps in known.values())
    return Check(
        name="residuals do not depend on the state",
        passed=tried and worst <= STATE_SHARE,
        statistic=worst if tried else None,
        threshold=STATE_SHARE,
        identifier="residual_state",
        quantity="residuals vs state",
        about="model",
        facts={"channel": where[0], "state": where[1], "states": tuple(residual_set.motion.states), "tried": tried},
    )


def _steps(state: np.ndarray) -> np.ndarray:
    """Which of at most `CELLS` equally filled ones each value belongs to; none where there is nothing to tell apart."""
    if len(state) < FEWEST_IN_MOTION or np.ptp(state) == 0.0:
        return np.empty(0, dtype=int)
    return np.searchsorted(np.unique(np.quantile(state, np.linspace(0.0, 1.0, CELLS + 1)[1:-1])), state)


def _explained(steps: np.ndarray, residual: np.ndarray) -> float:
    """Share of the residual's power that a curve of steps explains."""
    if not steps.size:
        return 0.0
    sums = np.bincount(steps, weights=residual)
    return float(np.sum(sums**2 / np.maximum(np.bincount(steps), 1)) / np.sum(residual**2))


def _drawn(residual_set: ResidualSet, channel: int) -> np.ndarray:
    """Noise with the spectrum of the rests, ``(DRAWS, n_record, n_time)``."""
    random, noise = np.random.default_rng(0), residual_set.noise[residual_set.channels[channel]]
    found = np.zeros((DRAWS, *residual_set.counted[:, channel].shape))
    for draw in found:
        for row, count, rate in zip(draw, residual_set.counts, residual_set.rates, strict=True):
            row[:count] = noise.draw(int(count), float(rate), random)
    return found


def _by_chance(drawn: Sequence[np.ndarray], steps: np.ndarray) -> float:
    """Share that noise alone would have explained, and rarely more."""
    shares = [_explained(steps, noise) for noise in drawn]
    return float(np.mean(shares) + CHANCE * np.std(shares))
