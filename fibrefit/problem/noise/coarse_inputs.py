"""Errors of an input that is read in coarse steps: where it stands still they do too, and no reading shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_signals
from fibrefit.rigs.signals.trace import Trace

SMOOTH = 0.05
"""Length in s over which coarse readings are averaged to be rounded anew."""
OFFSETS = 8
"""Places between two steps where that is done."""


def noise_of_rounding(traces: Sequence[Trace], channel: str, size: float) -> Noise:
    """Spectrum of what rounding does: courses as smooth as these, each elsewhere between two steps, are rounded.

    Parameters
    ----------
    size : float
        Of a step, in SI units.
    """
    counts = np.array([len(trace.times) for trace in traces])
    times, errors = np.zeros((len(traces), counts.max())), np.zeros((OFFSETS, len(traces), counts.max()))
    offsets = (np.arange(OFFSETS)[:, None] + 0.5) / OFFSETS
    for r, (trace, count) in enumerate(zip(traces, counts, strict=True)):
        seen = np.isfinite(trace.channels[channel])
        course = np.interp(trace.times, trace.times[seen], trace.channels[channel][seen]) / size
        course = uniform_filter1d(course, max(round(SMOOTH * trace.rate), 1), mode="nearest") + offsets
        times[r, :count] = trace.times
        errors[:, r, :count] = size * (np.round(course) - course)
    found = noise_of_signals(errors, times, counts)
    floor = size**2 / 12.0 / (0.5 * traces[0].rate)
    return replace(found, white=max(found.white, floor), samples=0, floor=floor)
