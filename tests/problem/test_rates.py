"""Derivatives of measured signals: those of polynomials are exact, and those of noise are what SciPy finds."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import savgol_filter

from fibrefit.rigs.signals.rates import MANY, correlated, derivative, rates_of

TIMES = np.arange(400) / 2000.0


@pytest.mark.parametrize("degree", [2, 3])
@pytest.mark.parametrize("order", [0, 1, 2])
def test_it_is_the_filter_of_scipy_up_to_the_ends(order: int, degree: int) -> None:
    noise = np.random.default_rng(1).normal(size=TIMES.shape)
    found = derivative(noise, TIMES, 17 / 2000.0, order, degree)
    expected = savgol_filter(noise, 17, degree, deriv=order, delta=1 / 2000.0)
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())


def test_a_parabola_is_differentiated_exactly_across_damage() -> None:
    values = 3.0 - 2.0 * TIMES + 40.0 * TIMES**2
    values[200] = np.nan
    smooth, rate, second = rates_of(values, TIMES, 0.01)
    np.testing.assert_allclose(smooth, 3.0 - 2.0 * TIMES + 40.0 * TIMES**2, atol=2e-5)
    np.testing.assert_allclose(rate[:180], -2.0 + 80.0 * TIMES[:180], atol=1e-8)
    np.testing.assert_allclose(second[:180], 80.0, atol=1e-6)


def test_a_window_is_never_longer_than_the_record() -> None:
    short = TIMES[:7]
    np.testing.assert_allclose(derivative(5.0 * short, short, 1.0, 1), 5.0, atol=1e-9)


def test_a_long_window_is_summed_by_transforms() -> None:
    random = np.random.default_rng(5)
    for count, window in ((5000, MANY), (900, 2 * MANY + 1), (3 * MANY, 3 * MANY), (40_000, 5 * MANY)):
        values, kernel = random.normal(size=count), random.normal(size=window)
        expected = np.correlate(values, kernel, "valid")
        np.testing.assert_allclose(correlated(values, kernel), expected, atol=1e-11 * window)
