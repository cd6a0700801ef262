"""Noise of a channel as its readings alone tell it, before any model: at rest, where steps are crossed, under load.

A logger's noise is not white: 1/f (pink) noise adds to the white one, and a rest of a tenth of a second shows little of
it. The spectrum of the rests is therefore modelled, and its total over the band of a whole record is the noise.

Readings that move tell the fast part of their noise by differences of high order, which a smooth motion hardly enters:
of white noise of variance v the mean square of differences of order n is ``v (2n)! / n!^2``.

Law
---
Noise of a force that grows with the load, as that of a gauge on a rig that shakes with its load does:
``sigma(F) = sigma_0 (1 + g |F| / F_max)``, by weighted least squares through the medians of sixth differences at eight
levels of the load. Those let nothing through that is slower than a fourth of the sampling rate: neither motion nor the
ringing of a gauge, which third ones show; of the readings at each level the median counts, as contacts are few.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from math import comb

import numpy as np

from fibrefit.core.spectra import MAINS, periodogram, whittle
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.thresholds import BESIDE_MAINS, COARSE_STEPS, CROSSED, FEW_MASKED, GROWS, LEVEL_READINGS
from fibrefit.rigs.signals.rest import fast_part, resolution, rests, runs, white_noise
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import SHORTEST_REST

WINDOW = 32
"""Samples of a window in which readings have to cross steps for their noise to show."""
ORDER = 6
"""Of the differences by which noise is compared with the load."""
LOUDEST_LOADED = 3.0
"""Noise over that without load, at the most: what is louder still says nothing of the noise."""


def estimate_noise(traces: Sequence[Trace], channel: str) -> Noise:
    """Noise of one channel from the rests of all records; from differences of moving readings where nothing rests."""
    pieces = at_rest(traces, channel)
    rate = float(np.mean([rate for _, rate in pieces] or [trace.rate for trace in traces]))
    # Rounding alone is white noise of variance 1/12 of a step squared, which a rest between two steps may not show.
    floor = float(min(resolution(trace.channels[channel]) for trace in traces) ** 2 / 12.0 / (0.5 * rate))
    if pieces:
        found = noise_of(pieces)
        return replace(found, white=max(found.white, floor), floor=floor)
    variance = np.mean([white_noise(trace.channels[channel]) ** 2 for trace in traces])
    return Noise(max(float(variance / (0.5 * rate)), floor), 0.0, 0.0, 0, floor=floor)


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
    # The stronger of the sinusoids at the mains frequencies, less what is 12 Hz on either side of it; a piece of less
    # than five periods says nothing of a line.
    total, number = 0.0, 0
    for values, rate in (piece for piece in pieces if len(piece[0]) / piece[1] > 5.0 / min(MAINS)):
        strongest, t, centred = 0.0, np.arange(len(values)) / rate, values - values.mean()
        for line in MAINS:
            turn = np.exp(-2j * np.pi * line * t)
            amplitude = 2.0 * abs(np.mean(centred * turn))
            away = [2.0 * abs(np.mean(centred * turn * np.exp(2j * np.pi * d * t))) for d in (-12, 12)]
            strongest = max(strongest, float(0.5 * (amplitude**2 - np.mean(np.square(away)))))
        total, number = total + strongest * len(values), number + len(values)
    return Noise(white, pink, total / max(number, 1), sum(len(values) for values, _ in pieces))


def coarse_step(traces: Sequence[Trace], channel: str) -> float | None:
    """Step of a channel whose noise does not reach across it; None where it is fine, in SI units."""
    signals = [trace.channels[channel] for trace in traces]
    size = min(resolution(signal) for signal in signals)
    fast = float(np.sqrt(np.mean([fast_part(signal) ** 2 for signal in signals])))
    return size if size > 0.0 and fast < COARSE_STEPS * size else None


def noise_in_motion(traces: Sequence[Trace], channel: str, size: float) -> float:
    """Noise of readings in coarse steps, that of rounding in it, where they cross steps; zero where they never do.

    At rest rounding shows as an offset, and hardly as noise.

    Parameters
    ----------
    size : float
        Of a step, in SI units.
    """
    found = []
    for trace in traces:
        values = trace.channels[channel]
        number = (len(values) - 3) // WINDOW
        windows = values[: number * WINDOW].reshape(number, WINDOW)
        differences = np.diff(values, 3)[: number * WINDOW].reshape(number, WINDOW)
        # Steps that are missing make a window unfit: a comparison with what is no number fails.
        crossing = np.ptp(windows, axis=1) > CROSSED * size
        found.append(np.mean(differences[crossing] ** 2, axis=1) / comb(6, 3))
    power = np.concatenate(found)
    power = power[np.isfinite(power)]
    return float(np.sqrt(np.median(power))) if power.size else 0.0


def growth_with_load(traces: Sequence[Trace], channel: str) -> float:
    """Share by which noise of a force is larger at the largest load than at none; zero where that is not clear."""
    growth, error = growth_and_error(traces, channel)
    return growth if growth > GROWS * error else 0.0


def growth_and_error(traces: Sequence[Trace], channel: str) -> tuple[float, float]:
    """The same, whether it is clear or not, and its standard error; ``(0, inf)`` where readings do not tell."""
    unknown = 0.0, np.inf
    if coarse_step(traces, channel) is not None:
        return unknown
    loads, sizes = [], []
    for trace in traces:
        values = trace.channels[channel]
        differences = np.abs(np.diff(values, ORDER)) / np.sqrt(comb(2 * ORDER, ORDER))
        seen = np.isfinite(differences)
        loads.append(_load(values)[ORDER // 2 : len(values) - ORDER // 2][seen])
        sizes.append(differences[seen])
    load, size = np.concatenate(loads), np.concatenate(sizes)
    if not load.size or not np.median(size) > 0.0:
        return unknown
    # Eight equal parts of the range of the load: a straight line needs three of them.
    level = np.minimum((8 * load / load.max()).astype(int), 7)
    levels = [level == one for one in range(8) if np.count_nonzero(level == one) >= LEVEL_READINGS]
    at = np.array([load[own].mean() for own in levels]) / load.max()
    noise = np.array([np.median(size[own]) for own in levels])
    if len(levels) < 3 or not np.all(noise > 0.0):
        return unknown
    # Relative error of a median of n absolute differences: 1.16 / sqrt(n) if they were independent; neighbours are
    # alike, and the sum of their squared correlations is 3.2: 2.07 / sqrt(n).
    precision = np.sqrt(np.array([np.count_nonzero(own) for own in levels])) / 2.07
    columns = np.stack([np.ones_like(at), at], axis=1) * (precision / noise)[:, None]
    covariance = np.linalg.inv(columns.T @ columns)
    still, more = covariance @ columns.T @ precision
    if not still > 0.0:
        return unknown
    return float(more / still), float(np.sqrt(covariance[1, 1]) / still)


def louder_under_load(trace: Trace, channel: str, growth: float, largest: float) -> np.ndarray:
    """Noise of each reading over that without load, ``(n_time,)``.

    Parameters
    ----------
    growth : float
        See `growth_with_load`.
    largest : float
        Load in SI units at which it is reached.
    """
    return np.minimum(1.0 + growth * _load(trace.channels[channel]) / largest, LOUDEST_LOADED)


def largest_load(traces: Sequence[Trace], channel: str) -> float:
    """In SI units."""
    return max(float(_load(trace.channels[channel]).max()) for trace in traces)


def _load(values: np.ndarray) -> np.ndarray:
    """Size of the readings, the mean of some neighbours."""
    seen, window = np.isfinite(values), np.ones(ORDER + 1)
    number = np.convolve(seen, window, "same")
    return np.abs(np.convolve(np.where(seen, values, 0.0), window, "same")) / np.maximum(number, 1.0)
