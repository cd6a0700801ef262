"""The chain of the force gauge against SciPy, which solves weight and gauge together from switch to switch."""

from __future__ import annotations

import math

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.simulation.sensing import Lags, in_series, lag
from tests.simulation.drop_by_scipy import Drop
from tests.simulation.drops import CONDITIONS, STEP, VALUES, deviation, drop, jacobian, respond

LAG, DELAY, GAUGE = (CATALOGUE[f"sensor.{name}"] for name in ("force_lag", "force_delay", "gauge_resonance"))
TIME_CONSTANT, LATE = "sensor.force_lag.time_constant", "sensor.force_delay.delay"
FREQUENCY, RATIO = "sensor.gauge_resonance.natural_frequency", "sensor.gauge_resonance.damping_ratio"

#: SciPy's own tolerance leaves about 3e-8 of the range in a drop of 0.4 s with its switches.
AS_SCIPY = 5e-7
#: Central differences of a force that was solved to 1e-7 of its range.
AS_DIFFERENCES = 1e-4

SHORT = drop(801)
TIMES = np.asarray(SHORT.times)


def test_the_bare_force() -> None:
    assert deviation(respond(SHORT)["force"], Drop().reading(TIMES)) < AS_SCIPY


def heights(*effects: type, **values: float) -> np.ndarray:
    """Of the force, at the switches where the fibre goes taut or slack at speed."""
    model, values = Model(RIGS["fibre_mass"], effects), VALUES | values
    jumps = model.respond({name: jnp.asarray(value) for name, value in values.items()}, SHORT).jumps
    return np.asarray(jumps.heights["force"])


def test_a_jump_of_the_reading_is_what_the_sensors_make_of_one_of_the_force() -> None:
    true = heights()
    assert np.abs(true).max() > 1.0
    gain, offset = (CATALOGUE[f"sensor.force_{name}"] for name in ("gain", "offset"))
    np.testing.assert_allclose(heights(gain, **{f"{gain.name}.gain": 1.3}), 1.3 * true, rtol=1e-12)
    np.testing.assert_allclose(heights(offset, **{f"{offset.name}.offset": 5.0}), true, atol=1e-12)
    # Of a slow gauge, what comes through until the next sample.
    for constant in (1e-4, 2e-2):
        passed = 1.0 - math.exp(-STEP / constant)
        np.testing.assert_allclose(heights(LAG, **{TIME_CONSTANT: constant}), passed * true, rtol=1e-9)
    np.testing.assert_array_equal(heights(LAG, **{TIME_CONSTANT: 0.0}), true)
    np.testing.assert_allclose(heights(LAG, GAUGE, **{TIME_CONSTANT: 0.0, FREQUENCY: 1e9, RATIO: 0.5}), true, rtol=1e-3)


def test_the_acceleration_that_a_gauge_feels_jumps_with_the_force() -> None:
    """Where the fibre goes taut or slack, its force is all that jumps on a weight that slides on."""
    crosstalk = CATALOGUE["sensor.acceleration_crosstalk"]
    true, found = heights(), heights(crosstalk, **{f"{crosstalk.name}.seismic_mass": 0.2})
    jumps = np.abs(true) > 0.1
    np.testing.assert_allclose(found[jumps], (1.0 - 0.2 / CONDITIONS["weight_mass"]) * true[jumps], rtol=1e-9)


@pytest.mark.parametrize("constant", [2e-5, 1e-4, 1e-3, 1e-2])
def test_a_lag_from_far_below_to_far_above_the_sampling_interval(constant: float) -> None:
    found = respond(SHORT, (LAG,), **{TIME_CONSTANT: constant})
    assert deviation(found["force"], Drop(lag=constant).reading(TIMES)) < AS_SCIPY


@pytest.mark.parametrize("delay", [1.37e-4, 5e-4, 2.36e-3])
def test_a_delay_that_is_no_whole_number_of_samples(delay: float) -> None:
    assert deviation(respond(SHORT, (DELAY,), **{LATE: delay})["force"], Drop().reading(TIMES, delay)) < AS_SCIPY


@pytest.mark.parametrize("frequency", [30.0, 88.0, 400.0, 2000.0])
def test_a_gauge_that_rings_below_and_above_the_sampling_rate(frequency: float) -> None:
    found = respond(SHORT, (GAUGE,), **{FREQUENCY: frequency, RATIO: 0.04})
    assert deviation(found["force"], Drop(period=1 / frequency, damping_ratio=0.04).reading(TIMES)) < AS_SCIPY


def test_all_three_in_any_order() -> None:
    values = {TIME_CONSTANT: 2e-4, FREQUENCY: 300.0, RATIO: 0.1, LATE: 1.37e-4}
    true = Drop(lag=2e-4, period=1 / 300.0, damping_ratio=0.1).reading(TIMES, 1.37e-4)
    for order in ((LAG, GAUGE, DELAY), (DELAY, GAUGE, LAG)):
        assert deviation(respond(SHORT, order, **values)["force"], true) < AS_SCIPY


def test_the_comparison_sees_an_error_of_a_thousandth_of_a_sample() -> None:
    found = respond(SHORT, (DELAY,), **{LATE: 1.37e-4 + 5e-7})
    assert deviation(found["force"], Drop().reading(TIMES, 1.37e-4)) > 10 * AS_SCIPY


@pytest.mark.parametrize(
    ("effects", "name", "values"),
    [
        ((LAG,), TIME_CONSTANT, {TIME_CONSTANT: 1e-3}),
        ((DELAY,), LATE, {LATE: 1.37e-3}),
        ((GAUGE,), RATIO, {FREQUENCY: 120.0, RATIO: 0.05}),
    ],
    ids=["lag", "delay", "resonance"],
)
def test_derivatives_are_those_of_the_readings(effects: tuple, name: str, values: dict[str, float]) -> None:
    exact = jacobian(SHORT, effects, **values)["force"][name]
    size = 1e-5 * values[name]
    up, down = (respond(SHORT, effects, **(values | {name: values[name] + d}))["force"] for d in (size, -size))
    error = (up - down) / (2 * size) - exact
    assert np.sqrt(np.mean(error**2)) < AS_DIFFERENCES * np.sqrt(np.mean(exact**2))


@pytest.mark.slow
def test_the_slope_at_no_lag_at_all_is_that_of_a_small_one() -> None:
    zero = {TIME_CONSTANT: 0.0, LATE: 0.0, FREQUENCY: math.inf, RATIO: 0.05}
    found = jacobian(SHORT, (GAUGE, LAG, DELAY), **zero)["force"]
    # To first order a lag, a delay and a gauge of period p are one and the same: -F', and -2 ζ p / 2π F'.
    np.testing.assert_allclose(found[TIME_CONSTANT], found[LATE], atol=1e-6 * np.abs(found[LATE]).max())
    scaled = found[LATE] * 2 * 0.05 / (2 * np.pi)
    np.testing.assert_allclose(found[FREQUENCY], scaled, atol=1e-6 * np.abs(scaled).max())
    size = 1e-8
    difference = (respond(SHORT, (LAG,), **{TIME_CONSTANT: size})["force"] - respond(SHORT)["force"]) / size
    error = difference - found[TIME_CONSTANT]
    assert np.sqrt(np.mean(error**2)) < AS_DIFFERENCES * np.sqrt(np.mean(difference**2))


def test_a_lag_of_a_cubic_has_the_same_value_by_series_and_by_particular_solution() -> None:
    cubic = tuple(jnp.asarray(c) for c in (1.0, -2.0, 0.7, 3.1))
    near = 1e-9
    for s in (0.3, 1.0):
        below, above = (lag(cubic, jnp.asarray(1.0 + shift), jnp.asarray(s)) for shift in (-near, near))
        np.testing.assert_allclose(below, above, rtol=10 * near)


def test_partial_fractions_of_two_lags_add_up_to_the_series() -> None:
    one, two = 1e-3, 4e-4
    both = in_series(Lags(jnp.zeros(()), (jnp.ones(()),), (jnp.asarray(one),)), ((jnp.ones(()), jnp.asarray(two)),))
    for frequency in (1.0, 300.0, 5e3):
        s = 2j * np.pi * frequency
        parts = both.direct + sum(w / (1 + c * s) for w, c in zip(both.weights, both.constants, strict=True))
        assert abs(parts - 1 / (1 + one * s) / (1 + two * s)) < 1e-14
