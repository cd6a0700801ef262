"""At which frequencies model and measurement part, against the noise at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fibrefit.core.spectra import MAINS
from fibrefit.discovery.engine.thresholds import FEWEST_IN_BAND, NARROW, OUTSIDE, SHORTEST_SEGMENT
from fibrefit.discovery.residuals.residuals import ChannelResidual
from fibrefit.problem import BESIDE_MAINS, Noise

LONGEST_SEGMENT = 4096
"""Samples of a segment, at most."""
OVERLAP = 0.947
"""Share of the segments that are as good as independent: those of Hann's window that overlap by half."""
THIRD = 2.0 ** (1.0 / 6.0)
"""Half of the width of a narrow band, a third of an octave, as a factor."""


@dataclass(frozen=True)
class Spectrum:
    """Power density of the residuals of one channel, all records together, and of their noise; SI units.

    Parameters
    ----------
    frequency : (n_frequency,) in Hz
        Above zero.
    power : (n_frequency,) in unit^2/Hz
    floor : (n_frequency,) in unit^2/Hz
        Of the noise at rest, without the mains.
    chance : tuple of float
        Factors on the floor between which noise stays at nineteen frequencies of twenty.
    """

    frequency: np.ndarray
    power: np.ndarray
    floor: np.ndarray
    chance: tuple[float, float]


def spectrum_of(own: Sequence[ChannelResidual]) -> Spectrum:
    """Spectrum of one channel.

    Parameters
    ----------
    own : sequence of ChannelResidual
        The channel in each record.

    Source
    ------
    Welch, IEEE Trans. Audio Electroacoust. 15 (1967).
    """
    from scipy.signal import welch
    from scipy.stats import chi2

    # Three segments of the shortest record: of a single one, half of the power would be chance.
    size = min(LONGEST_SEGMENT, min(len(piece.times) for piece in own) // 2)
    frequency = np.fft.rfftfreq(size, 1.0 / own[0].rate)
    powers, segments = [], []
    for piece in own:
        own_frequency, power = welch(piece.residual * piece.sigma, piece.rate, "hann", size, detrend="constant")
        powers.append(np.interp(frequency, own_frequency, power))
        segments.append(2 * len(piece.times) // size - 1)
    freedom = max(2.0 * OVERLAP * sum(segments), 2.0)
    low, high = (float(chi2.ppf(chance, freedom) / freedom) for chance in (OUTSIDE, 1.0 - OUTSIDE))
    # The mean is taken off each segment, and half the rate has one phase only: neither is what it was.
    inner = slice(2, -1) if size >= SHORTEST_SEGMENT else slice(1, None)
    power = np.average(powers, axis=0, weights=segments)
    return Spectrum(frequency[inner], power[inner], own[0].noise.density(frequency[inner]), (low, high))


def narrow_band(found: Spectrum, noise: Noise) -> tuple[float, float, float] | None:
    """Ends [Hz] of a third of an octave that holds more than half of the gap, and its share; None where none does.

    Parameters
    ----------
    found : Spectrum
    noise : Noise
        Where it knows of a line, nothing is said of its frequency; of one not known better, of none of the mains.
    """
    excess = found.power - found.floor
    known = [line for line, _ in noise.lines] + list(MAINS if noise.line > 0.0 else ())
    for line in known:
        excess = np.where(np.abs(found.frequency - line) < BESIDE_MAINS, 0.0, excess)
    whole = float(excess.sum())
    if whole <= 0.0:
        return None
    running = np.concatenate([[0.0], np.cumsum(excess)])
    first = np.searchsorted(found.frequency, found.frequency / THIRD)
    last = np.searchsorted(found.frequency, found.frequency * THIRD, side="right")
    shares = np.where(last - first >= FEWEST_IN_BAND, (running[last] - running[first]) / whole, 0.0)
    best = int(shares.argmax())
    inside = slice(first[best], last[best])
    loud = found.power[inside].sum() > found.chance[1] * found.floor[inside].sum()
    if shares[best] <= NARROW or not loud:
        return None
    return float(found.frequency[first[best]]), float(found.frequency[last[best] - 1]), float(min(shares[best], 1.0))
