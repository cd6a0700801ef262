"""Partial pooling: closed forms at both ends, and that intervals hold as often as they say."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.series.meta_analysis import population

SERIES = 100
#: Of so many series, an interval of 95 % holds in this share or more with a probability of 0.998.
LEAST = 0.87
#: Median width of an interval, over that of Student's interval from the true scatter and the errors of the records.
WIDEST = 1.3
STUDENT = 2.5706
"""Quantile of 97.5 % for the five degrees of freedom of six records."""


def drawn(seed: int, tau: float, error: float, number: int = 6) -> tuple[np.ndarray, np.ndarray, float]:
    """Values, errors, and the true value of one more record; the mean is 20 000."""
    random = np.random.default_rng(seed)
    errors = error * random.uniform(0.5, 2.0, number)
    truth = 2e4 * np.exp(tau * random.standard_normal(number + 1))
    values = truth[:-1] * (1.0 + errors * random.standard_normal(number))
    return values, values * errors, float(truth[-1])


def test_records_that_agree_give_their_weighted_mean() -> None:
    errors = np.array([1.0, 2.0, 4.0])
    found = population(np.array([100.0, 100.0, 100.0]), errors)
    assert found is not None
    assert found.mean == pytest.approx(100.0)
    assert found.sd_interval[0] == 0.0
    assert found.chance == pytest.approx(1.0)
    # Little is known of the differences of three records: the mean is less sure than if there were none.
    assert found.mean_interval[1] - 100.0 > 1.96 / np.sqrt(np.sum(errors**-2.0))


def test_exact_values_give_students_interval() -> None:
    values = np.exp(np.array([0.1, -0.2, 0.05, 0.3, -0.1]))
    found = population(values, 1e-6 * values)
    assert found is not None
    logs = np.log(values)
    half = 2.776445 * logs.std(ddof=1) / np.sqrt(5)
    np.testing.assert_allclose(np.log(found.mean_interval), logs.mean() + np.array([-half, half]), rtol=0.02, atol=2e-3)
    np.testing.assert_allclose(
        found.sd_interval, logs.std(ddof=1) * np.sqrt(4.0 / np.array([11.143, 0.4844])), rtol=1e-3
    )
    np.testing.assert_allclose(found.shrunk, values, rtol=1e-6)


def test_an_uncertain_record_is_drawn_to_the_others() -> None:
    values, errors = np.array([100.0, 101.0, 99.0, 100.5, 130.0]), np.array([0.1, 0.1, 0.1, 0.1, 20.0])
    found = population(values, errors)
    assert found is not None
    assert abs(found.shrunk[-1] - 100.0) < 3.0
    assert found.shrunk_error[-1] < 3.0
    np.testing.assert_allclose(found.shrunk[:-1], values[:-1], rtol=1e-3)


def test_a_single_record_has_no_population() -> None:
    assert population(np.array([1.0, np.nan]), np.array([0.1, np.nan])) is None


def test_a_value_that_may_be_negative_is_told_as_it_is() -> None:
    found = population(np.array([0.1, -0.2, 0.3]), np.array([0.1, 0.1, 0.1]))
    assert found is not None
    assert not found.logarithmic
    assert found.mean_interval[0] < 0.0 < found.mean_interval[1]


@pytest.mark.parametrize(("tau", "error"), [(0.01, 0.002), (0.05, 0.01), (0.01, 0.01)])
def test_intervals_hold_as_often_as_they_say(tau: float, error: float) -> None:
    held, not_held, widths = np.zeros(3), np.zeros(2), []
    for seed in range(SERIES):
        values, errors, further = drawn(seed, tau, error)
        found = population(values, errors)
        assert found is not None
        pairs = ((found.mean_interval, 2e4), (found.sd_interval, tau), (found.new_record, further))
        held += [low <= truth <= high for (low, high), truth in pairs]
        # The negative control: three times the scatter, and a record that lies three times as far away.
        wrong = ((found.sd_interval, 3.0 * tau), (found.new_record, 2e4 * (further / 2e4) ** 3))
        not_held += [low <= truth <= high for (low, high), truth in wrong]
        widths.append(np.log(found.mean_interval[1] / found.mean_interval[0]))
    assert (held >= LEAST * SERIES).all(), held
    assert (not_held < LEAST * SERIES).all(), not_held
    # Errors lie between half of `error` and twice of it; their root mean square is 1.3 times `error`.
    assert np.median(widths) < WIDEST * 2.0 * STUDENT * np.hypot(tau, 1.3 * error) / np.sqrt(6.0)


@pytest.mark.parametrize(("told", "least", "most"), [(True, 0.9, 1.0), (False, 0.0, 0.6)])
def test_an_error_that_all_records_share_is_not_averaged(told: bool, least: float, most: float) -> None:
    """Of a scale that is known to 10 % twenty-five records leave 10 %; taken for errors of their own they would not."""
    held = 0
    for seed in range(SERIES):
        values, errors, _ = drawn(seed, 0.01, 0.01, 25)
        shared = 1.0 + 0.1 * np.random.default_rng(seed + 1000).standard_normal()
        common = 0.1 * 2e4
        own = errors if told else np.hypot(errors, common)
        found = population(values * shared, own, common if told else 0.0)
        assert found is not None
        held += found.mean_interval[0] <= 2e4 <= found.mean_interval[1]
        if told:
            assert found.new_record[1] - found.new_record[0] > 2.0 * 1.9 * common
            assert found.mean_interval[1] - found.mean_interval[0] < 2.0 * 2.1 * common
            assert found.sd < 0.03
    assert least * SERIES <= held <= most * SERIES


def test_errors_that_are_told_too_small_are_found_out() -> None:
    """The scatter between records is seen, and intervals hold; without it, the control, they miss far too often."""
    held = missed = seen = 0
    for seed in range(SERIES):
        values, errors, _ = drawn(seed, 0.05, 0.005)
        found = population(values, errors)
        assert found is not None
        held += found.mean_interval[0] <= 2e4 <= found.mean_interval[1]
        seen += found.chance < 0.05
        weights = (values / errors) ** 2
        middle, error = np.average(np.log(values), weights=weights), 1.0 / np.sqrt(weights.sum())
        missed += abs(middle - np.log(2e4)) > 1.96 * error
    assert held >= 0.9 * SERIES
    assert seen > 0.9 * SERIES
    assert missed > 0.4 * SERIES


def test_the_interval_of_what_records_differ_by_holds_what_is_told_of_it() -> None:
    """Of records that agree better than their errors have it, the Q profile is nil; what is believed is not."""
    values = 2e4 * np.array([1.0, 1.0001, 0.9999, 1.0, 1.0002])
    found = population(values, 0.02 * values)
    assert found is not None
    assert found.sd > 0.0
    assert found.sd_interval[0] <= found.sd <= found.sd_interval[1]
