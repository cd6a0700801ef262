"""Whether anything is left in the residuals that noise would not leave there.

Noise of a logger is coloured, so "white" is the wrong question: residuals are compared with the spectrum of the
records' own rests, with each other across the phases of the motion, and with the states of the rig.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fibrefit.core.check import Check
from fibrefit.problem.diagnose.phases import HELD, PHASES, Motion
from fibrefit.problem.noise.spectrum import MAINS, Noise

SPECTRUM_RATIO = 1.25
"""Power of an octave over that of the noise at rest that still passes: short rests tell the spectrum no better."""
PHASE_RATIO = 1.15
CHANCE = 3.3
"""Standard deviations that are put down to chance: one in two thousand goes beyond."""
STATE_SHARE = 0.10
HATS = 12
DRAWS = 20
FEWEST = 200
"""Samples below which a phase is too short to be judged."""


@dataclass(frozen=True)
class Residuals:
    """Residuals with what is needed to judge them.

    Parameters
    ----------
    scaled : (n_record, n_channel, n_time) in units of the noise
    counted : (n_record, n_channel, n_time) bool
    counts : (n_record,) samples
    rate : float, in Hz
    channels : tuple of str
    sigma : (n_record, n_channel) noise rms in SI units
    noise : dict of channel to Noise
    motion : Motion
    """

    scaled: np.ndarray
    counted: np.ndarray
    counts: np.ndarray
    rate: float
    channels: tuple[str, ...]
    sigma: np.ndarray
    noise: Mapping[str, Noise]
    motion: Motion


def structure_checks(residuals: Residuals) -> tuple[Check, ...]:
    """Checks of spectrum, phases and states, in this order."""
    return (_spectrum(residuals), _phases(residuals), _states(residuals))


def _spectrum(residuals: Residuals) -> Check:
    worst, where = 0.0, ""
    for c, channel in enumerate(residuals.channels):
        for low, ratio, count in _octaves(residuals, c):
            # A low octave holds few frequencies: chance alone lifts it by some standard errors.
            excess = ratio / (1.0 + CHANCE / np.sqrt(count))
            if excess > worst:
                worst, where = excess, f"{channel} between {low:.3g} and {2 * low:.3g} Hz"
    passed = worst <= SPECTRUM_RATIO
    says = (
        "Residuals have the spectrum of the noise at rest."
        if passed
        else f"Residuals are not noise: their power in the {where} is {worst:.3g} times that of the records at rest."
    )
    return Check("residuals have the noise's spectrum", passed, says, worst, SPECTRUM_RATIO)


def _octaves(residuals: Residuals, channel: int) -> list[tuple[float, float, int]]:
    """Lower edge [Hz], mean power over noise power, and number of frequencies, of each octave."""
    frequencies, ratios = [], []
    for r, count in enumerate(residuals.counts):
        values = residuals.scaled[r, channel, :count] * residuals.sigma[r, channel]
        power = 2.0 * np.abs(np.fft.rfft(values - values.mean())) ** 2 / (count * residuals.rate)
        frequency = np.fft.rfftfreq(count, 1.0 / residuals.rate)
        density = residuals.noise[residuals.channels[channel]].density(np.maximum(frequency, frequency[1]))
        clear = (np.min([np.abs(frequency - line) for line in MAINS], axis=0) > 4.0) & (frequency > 0.0)
        frequencies.append(frequency[clear])
        ratios.append((power / density)[clear])
    frequency, ratio = np.concatenate(frequencies), np.concatenate(ratios)
    edges = 0.5 * residuals.rate / 2.0 ** np.arange(1, 11)
    inside = [(edge, ratio[(frequency >= edge) & (frequency < 2 * edge)]) for edge in edges]
    return [(edge, float(part.mean()), len(part)) for edge, part in inside if len(part) >= 8]


def _phases(residuals: Residuals) -> Check:
    worst, where = 0.0, ""
    for c, channel in enumerate(residuals.channels):
        for index, phase in enumerate(PHASES):
            inside = (residuals.motion.phase == index) & residuals.counted[:, c]
            if inside.sum() >= FEWEST:
                expected = 1.0 + CHANCE * _scatter(inside, _pink_share(residuals, c))
                ratio = float(np.sqrt(np.mean(residuals.scaled[:, c][inside] ** 2) / expected))
                if ratio > worst:
                    worst, where = ratio, f"{channel} while {phase}"
    passed = worst <= PHASE_RATIO
    says = (
        "No phase of the motion is explained worse than the noise allows."
        if passed
        else f"The model is worst in the {where}: {worst:.3g} times the noise."
    )
    return Check("no phase stands out", passed, says, worst, PHASE_RATIO)


def _pink_share(residuals: Residuals, channel: int) -> float:
    """Share of the noise's power that is pink."""
    noise = residuals.noise[residuals.channels[channel]]
    duration = float(np.max(residuals.counts)) / residuals.rate
    return noise.pink * np.log(0.5 * residuals.rate * duration) / noise.rms(duration, residuals.rate) ** 2


def _scatter(inside: np.ndarray, pink: float) -> float:
    """Standard deviation of the mean square of noise of variance one over the samples `inside` ``(n_record, n_time)``.

    The pink share hardly changes while a phase lasts: each stretch of it counts as one sample of that.
    """
    edges = np.diff(inside.astype(int), axis=1, prepend=0, append=0)
    lengths = np.concatenate([np.flatnonzero(row < 0) - np.flatnonzero(row > 0) for row in edges])
    total = lengths.sum()
    return float(np.sqrt(2.0 * ((1.0 - pink) ** 2 / total + pink**2 * np.sum(lengths**2) / total**2)))


def _states(residuals: Residuals) -> Check:
    worst, where = 0.0, ""
    moving = residuals.motion.phase != HELD
    for c, channel in enumerate(residuals.channels):
        inside = residuals.counted[:, c] & moving
        for name, state in residuals.motion.states.items():
            steps = _steps(state[inside])
            share = _explained(steps, residuals.scaled[:, c][inside])
            if share > STATE_SHARE:
                share *= min(1.0, STATE_SHARE / _by_chance(residuals, c, inside, steps))
            if share > worst:
                worst, where = share, f"{channel} residual depends on the {name}"
    passed = worst <= STATE_SHARE
    names = list(residuals.motion.states)
    says = (
        f"Residuals do not depend on {', '.join(names[:-1])} or {names[-1]}."
        if passed
        else f"The {where}: a curve in it explains {100 * worst:.0f} % of what is left."
    )
    return Check("residuals do not depend on the state", passed, says, worst, STATE_SHARE)


def _steps(state: np.ndarray) -> np.ndarray:
    """Which of at most `HATS` equally filled steps each value belongs to; none where there is nothing to tell apart."""
    if len(state) < FEWEST or np.ptp(state) == 0.0:
        return np.empty(0, dtype=int)
    return np.searchsorted(np.unique(np.quantile(state, np.linspace(0.0, 1.0, HATS + 1)[1:-1])), state)


def _explained(steps: np.ndarray, residual: np.ndarray) -> float:
    """Share of the residual's power that a curve of steps explains."""
    if not steps.size:
        return 0.0
    sums = np.bincount(steps, weights=residual)
    return float(np.sum(sums**2 / np.maximum(np.bincount(steps), 1)) / np.sum(residual**2))


def _by_chance(residuals: Residuals, channel: int, inside: np.ndarray, steps: np.ndarray) -> float:
    """Share that noise alone, with the spectrum of the rests, would have explained, and rarely more."""
    random, shares = np.random.default_rng(0), []
    noise = residuals.noise[residuals.channels[channel]]
    for _ in range(DRAWS):
        drawn = np.zeros(inside.shape)
        for r, count in enumerate(residuals.counts):
            drawn[r, :count] = noise.draw(int(count), residuals.rate, random)
        shares.append(_explained(steps, drawn[inside]))
    return float(np.mean(shares) + CHANCE * np.std(shares))
