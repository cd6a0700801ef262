"""Errors of inputs in coarse steps have the spectrum of rounding errors."""

from __future__ import annotations

import numpy as np

from fibrefit.problem.noise.coarse_inputs import noise_of_rounding
from fibrefit.problem.noise.spectrum import periodogram
from fibrefit.rigs.signals.trace import Trace


def test_what_rounding_does_to_a_motion_that_stops_is_mostly_slow() -> None:
    random, rate, step = np.random.default_rng(7), 2000.0, 5e-5
    times = np.arange(6000) / rate
    traces, errors = [], []
    for _ in range(40):
        stops = np.cumsum(random.uniform(-0.02, 0.03, 5))
        course = np.interp(times, np.linspace(0.2, 2.8, 10), np.repeat(stops, 2))
        errors.append(step * np.round(course / step) - course)
        traces.append(Trace("drive.csv", times, {"drive": course + errors[-1]}, {}, {}))
    noise = noise_of_rounding(traces[:5], "drive", step)
    frequency = np.arange(1, 31) / 3.0
    power = np.mean([np.interp(frequency, *periodogram(error, rate)) for error in errors], axis=0)
    ratio = np.mean(noise.density(frequency) / power)
    assert 0.5 < ratio < 2.0
    # The negative control: noise as even as the steps allow.
    white = step**2 / 12.0 / (0.5 * rate)
    assert np.mean(white / power[:9]) < 0.05
