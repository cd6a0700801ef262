"""Readings in coarse steps: their likelihood, the noise before rounding, and what rounding does to an input."""

from __future__ import annotations

import dataclasses

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.signal import butter, sosfilt
from scipy.stats import norm

from fibrefit.core.spectra import periodogram
from fibrefit.problem.noise.readings import coarse_step, noise_in_motion
from fibrefit.problem.noise.rounding import noise_of_rounding, steps_of, with_noise_before_rounding
from fibrefit.problem.noise.whittle import noise_of_steps
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.problem.statement.observations import Steps, log_probability, stack, step_residuals
from fibrefit.problem.statement.problem import Problem
from fibrefit.rigs.signals.trace import Trace

STEP = 0.5
RATE = 2000.0


def steps(noise: float) -> Steps:
    return Steps(jnp.array(STEP), jnp.array(noise), jnp.array(0.2))


def test_probabilities_are_those_of_the_normal_distribution() -> None:
    distance, half = np.linspace(-4.0, 4.0, 41), 1.3
    expected = np.log(norm.cdf(distance + half) - norm.cdf(distance - half))
    np.testing.assert_allclose(log_probability(jnp.asarray(distance), jnp.asarray(half)), expected, rtol=1e-9)


@pytest.mark.parametrize("noise", [0.05, 0.1, 0.25, 1.0])
def test_squares_of_residuals_are_twice_the_log_likelihood(noise: float) -> None:
    distance = np.linspace(-1.0, 1.0, 601) * (STEP / 2 + 5.0 * noise)
    found = np.asarray(step_residuals(jnp.asarray(distance), steps(noise)))
    log = np.log(norm.cdf((distance + STEP / 2) / noise) - norm.cdf((distance - STEP / 2) / noise))
    best = np.log(2.0 * norm.cdf(STEP / 2 / noise) - 1.0)
    np.testing.assert_allclose(found**2, 2.0 * (best - log), atol=1e-6)
    assert np.all(np.diff(found) > 0.0)
    np.testing.assert_allclose(found, -found[::-1], atol=1e-12)


def test_slopes_are_finite_and_those_of_differences() -> None:
    residual = lambda x: step_residuals(x, steps(0.1))  # noqa: E731
    for x in (0.0, 1e-6, 9.9e-5, 1.01e-4, 0.01, 0.2, 1.0, 50.0):
        slope = float(jax.grad(lambda y: residual(y[None])[0])(jnp.array(x)))
        step = 1e-6
        difference = float((residual(jnp.array([x + step])) - residual(jnp.array([x - step])))[0] / (2.0 * step))
        assert slope == pytest.approx(difference, rel=2e-3)


def test_far_above_the_step_it_is_plain_noise() -> None:
    distance = jnp.linspace(-3.0, 3.0, 13)
    fine = Steps(jnp.array(0.01), jnp.array(0.2), jnp.array(0.2))
    np.testing.assert_allclose(step_residuals(distance, fine), distance / 0.2, rtol=2e-3)


@dataclasses.dataclass(frozen=True)
class Ramp:
    """A model that says what it is told: one channel, a sine of a given size."""

    class rig:  # noqa: N801
        channels = ("force",)

    def answer(self, values: dict, experiment: object) -> object:
        raise NotImplementedError


def _trace(noise: float, step: float, seed: int = 0) -> tuple[Trace, np.ndarray]:
    random, times = np.random.default_rng(seed), np.arange(6000) / RATE
    signal = 20.0 * np.exp(-2.0 * times) * np.sin(40.0 * times)
    read = np.round((signal + noise * random.standard_normal(len(times))) / step) * step
    return Trace("made", times, {"force": read}, {}, {}), signal


@pytest.mark.parametrize(("noise", "coarse"), [(0.05, True), (0.2, True), (0.8, False), (2.0, False)])
def test_which_channels_are_coarse(noise: float, coarse: bool) -> None:
    found = coarse_step([_trace(noise, 1.0)[0]], "force")
    assert (found is not None) == coarse
    assert found is None or found == pytest.approx(1.0)


def test_a_fine_logger_is_not_coarse() -> None:
    random = np.random.default_rng(0)
    assert (
        coarse_step([Trace("made", np.arange(500) / RATE, {"force": random.standard_normal(500)}, {}, {})], "force")
        is None
    )
    constant = Trace("made", np.arange(500) / RATE, {"force": np.zeros(500)}, {}, {})
    assert steps_of([constant], "force", [1.0]) is None


def test_noise_behind_a_filter_that_reaches_across_many_steps_is_not_coarse() -> None:
    """From sample to sample it hardly changes; the noise at rest says how far it goes."""
    noise = sosfilt(butter(2, 0.1, output="sos"), np.random.default_rng(1).standard_normal(6000))
    noise *= 4.0 / noise.std()
    filtered = Trace("made", np.arange(6000) / RATE, {"force": np.round(noise)}, {}, {})
    assert coarse_step([filtered], "force") is not None
    assert steps_of([filtered], "force", [4.0]) is None


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.35])
def test_noise_in_motion_is_that_of_rounding_too_and_a_rest_says_nothing_of_it(noise: float) -> None:
    moving, still = _trace(noise, 1.0)[0], np.random.default_rng(2).standard_normal(4000)
    resting = Trace("made", np.arange(4000) / RATE, {"force": np.round(0.1 + noise * still)}, {}, {})
    assert noise_in_motion([moving, resting], "force", 1.0) == pytest.approx(np.hypot(12.0**-0.5, noise), rel=0.2)
    assert noise_in_motion([resting], "force", 1.0) == 0.0


@pytest.mark.parametrize("noise", [0.1, 0.2, 0.35])
def test_the_noise_before_rounding_is_found(noise: float, monkeypatch: pytest.MonkeyPatch) -> None:
    trace, signal = _trace(noise, 1.0)
    known = steps_of([trace], "force", [0.3])
    assert known is not None
    data = stack([trace], {"force": [0.3]})._replace(steps={"force": known})
    layout = Layout((Slot("size", "N", Range(0.0, 10.0, 1.0)),), ("made",))
    problem = Problem(Ramp(), layout, data)  # type: ignore[arg-type]
    padded = np.zeros((1, data.experiment.times.shape[1]))
    padded[0, : len(signal)] = signal
    monkeypatch.setattr("fibrefit.problem.noise.rounding._predicted", lambda problem, local: {"force": padded})
    found = with_noise_before_rounding(problem, np.ones((1, 1)))
    assert float(np.asarray(found.observations.steps["force"].noise)[0]) == pytest.approx(noise, rel=0.06)
    # The residuals at the truth are white then; taken for uniform noise, errors of rounding are not.
    white = noise_of_steps(found.observations.steps["force"], RATE, 100)
    assert white.rms(3.0, RATE) == pytest.approx(0.3, rel=1e-6)


def test_at_the_truth_residuals_in_steps_are_nearly_white_and_plain_ones_are_not() -> None:
    random, times = np.random.default_rng(3), np.arange(20000) / RATE
    slow = 3.0 * np.sin(2.0 * np.pi * 0.3 * times)
    read = np.round(slow + 0.1 * random.standard_normal(len(times)))
    left = np.asarray(step_residuals(jnp.asarray(slow - read), Steps(jnp.array(1.0), jnp.array(0.1), jnp.array(0.3))))
    plain = slow - read

    def memory(rows: np.ndarray) -> float:
        return float(np.mean(rows[1:] * rows[:-1]) / np.mean(rows**2))

    # Nearly: it is their slopes times residuals, the scores, whose mean is zero everywhere.
    assert abs(memory(left)) < 0.05
    assert memory(plain) > 0.2


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
