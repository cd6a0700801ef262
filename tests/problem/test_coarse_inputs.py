"""Errors of inputs in coarse steps have the spectrum of rounding errors."""

from __future__ import annotations

import numpy as np

from fibrefit.problem.noise.rounding import noise_of_rounding
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


def test_readings_that_noise_carries_across_steps_are_known_by_their_noise_too() -> None:
    random, rate, step, noise = np.random.default_rng(3), 2000.0, 5e-5, 1e-5
    times = np.arange(6400) / rate
    traces, rested = [], []
    for place in np.linspace(0.0, step, 5, endpoint=False):
        # Half a stroke, then a rest at some place between two steps.
        course = np.where(times < 1.6, 0.03 * times, 0.048) + place
        read = step * np.round((course + noise * random.standard_normal(times.size)) / step)
        rested.append(float(np.mean((read - course)[times > 1.7])))
        traces.append(Trace("drive.csv", times, {"drive": read}, {}, {}))
    found = noise_of_rounding(traces, "drive", step)
    assert abs(found.white * 0.5 * rate / (noise**2 + step**2 / 12.0) - 1.0) < 0.15
    # What is constant at a rest is less than rounding without noise would leave there, and not nothing.
    slow = float(np.sum(found.density(np.linspace(0.16, 2.0, 60))) * (2.0 - 0.16) / 60)
    assert 0.2 * np.var(rested) < slow < step**2 / 12.0
