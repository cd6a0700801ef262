"""Errors of an input that is read in coarse steps: where it stands still they do too, and no reading shows them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.ndimage import uniform_filter1d

from fibrefit.problem.noise.rounding import noise_in_motion
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_signals
from fibrefit.rigs.signals.trace import Trace

SMOOTH = 0.05
"""Length in s over which coarse readings are averaged to be rounded anew."""
OFFSETS = 8
"""Places between two steps where that is done."""
SEED = 0
"""Of the noise with which they are rounded."""


def noise_of_rounding(traces: Sequence[Trace], channel: str, size: float) -> Noise:
    """Spectrum of what rounding does: courses as smooth as these, each elsewhere between two steps, are rounded.

    They are rounded with the noise that readings show where they cross steps, which carries some of them to the next
    step: a course that rests between two is known the better for it.

    Parameters
    ----------
    size : float
        Of a step, in SI units.
    """
    counts = np.array([len(trace.times) for trace in traces])
    times, errors = np.zeros((len(traces), counts.max())), np.zeros((OFFSETS, len(traces), counts.max()))
    offsets = (np.arange(OFFSETS)[:, None] + 0.5) / OFFSETS
    floor, level = size**2 / 12.0, noise_in_motion(traces, channel, size) ** 2
    before, rng = np.sqrt(max(level - floor, 0.0)) / size, np.random.default_rng(SEED)
    for r, (trace, count) in enumerate(zip(traces, counts, strict=True)):
        seen = np.isfinite(trace.channels[channel])
        course = np.interp(trace.times, trace.times[seen], trace.channels[channel][seen]) / size
        course = uniform_filter1d(course, max(round(SMOOTH * trace.rate), 1), mode="nearest") + offsets
        times[r, :count] = trace.times
        errors[:, r, :count] = size * (np.round(course + before * rng.standard_normal(course.shape)) - course)
    found = noise_of_signals(errors, times, counts)
    white = max(floor, level) / (0.5 * traces[0].rate)
    return replace(found, white=max(found.white, white), samples=0, floor=floor / (0.5 * traces[0].rate))
