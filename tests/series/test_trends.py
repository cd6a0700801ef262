"""Trends: a line found again, chance not taken for one, a stray record named, errors of the condition allowed for."""

from __future__ import annotations

import gc
from collections.abc import Iterator
from itertools import product

import numpy as np
import pytest

from fibrefit.series.meta_analysis import Quantity, nearest_line, trend_of, trends
from fibrefit.series.thresholds import SIGNIFICANT
from fibrefit.study.summaries.series import TrendSummary

NUMBER = 30
NAMES = [f"record {n}" for n in range(NUMBER)]
RANDOM = np.random.default_rng(5)
LIFT = Quantity("lift", "m", RANDOM.uniform(5e-3, 2e-2, NUMBER), np.zeros(NUMBER))
ORDER = Quantity("order", "-", np.arange(float(NUMBER)), np.zeros(NUMBER))
MASS = Quantity("added_mass", "kg", RANDOM.choice([0.0, 5.0], NUMBER), np.zeros(NUMBER))


def parameter(slope: float, seed: int, scatter: float = 0.3, error: float = 0.2, name: str = "damping") -> Quantity:
    """25 and a slope over the lift, with scatter between records and an error of each."""
    random = np.random.default_rng(seed)
    spread = scatter * random.standard_normal(NUMBER) + error * random.standard_normal(NUMBER)
    return Quantity(name, "N s/m", 25.0 + slope * LIFT.values + spread, np.full(NUMBER, error))


def test_a_trend_is_found_with_its_slope_and_scatter() -> None:
    found = trends(NAMES, list(product([parameter(200.0, 1)], [LIFT, ORDER, MASS])))
    assert [line.condition for line in found if line.chance_corrected < SIGNIFICANT] == ["lift"]
    line = found[0]
    assert line.slope_interval_95[0] < 200.0 < line.slope_interval_95[1]
    assert line.between_records == pytest.approx(0.3, rel=0.4)
    lift = LIFT.values.mean()
    assert line.intercept + line.slope * lift == pytest.approx(25.0 + 200.0 * lift, abs=0.3)


def test_no_scatter_is_made_up() -> None:
    line = trend_of(NAMES, parameter(200.0, 2, scatter=0.0), LIFT)
    assert line is not None
    assert line.between_records < 0.15


@pytest.mark.slow
def test_chance_is_not_taken_for_a_trend() -> None:
    alarms = bare = 0
    for seed in range(40):
        several = [parameter(0.0, 10 * seed + n, name=str(n)) for n in range(3)]
        lines = trends(NAMES, list(product(several, [LIFT, ORDER, MASS])))
        alarms += any(line.chance_corrected < SIGNIFICANT for line in lines)
        bare += any(line.chance < SIGNIFICANT for line in lines)
    # One in twenty is expected; without the correction for nine looks, the control, it is one in three.
    assert alarms <= 6
    assert bare > 6


def test_a_stray_record_is_named_and_left_out() -> None:
    clean = parameter(200.0, 3)
    values = clean.values.copy()
    values[7] += 6.0
    line = trend_of(NAMES, Quantity("damping", "N s/m", values, clean.errors), LIFT)
    assert line is not None
    assert [outlier.record for outlier in line.outliers] == ["record 7"]
    assert line.outliers[0].score > 5.0
    assert line.records == NUMBER - 1
    assert line.slope_interval_95[0] < 200.0 < line.slope_interval_95[1]


SERIES = 50
"""In which records stray by chance: half a one is expected to name one, and of seventy such sums one exceeds two."""


def names_a_record(seed: int, corrected: bool) -> bool:
    """Whether a record of a series is named, in one of ten parameters of which all are sound."""
    several = [(parameter(0.0, 1000 + 10 * seed + n, name=str(n)), ORDER) for n in range(10)]
    if corrected:
        return any(line.outliers for line in trends(NAMES, several))
    return any(line.outliers for y, x in several if (line := trend_of(NAMES, y, x)) is not None)


@pytest.fixture
def collected() -> Iterator[None]:
    """What other tests have left is no garbage: statsmodels collects it at every correction, for a second each time."""
    gc.freeze()
    yield
    gc.unfreeze()


@pytest.mark.usefixtures("collected")
def test_one_series_in_a_hundred_names_a_record_by_chance() -> None:
    assert sum(names_a_record(seed, True) for seed in range(SERIES)) <= 2
    # The negative control: each line for itself, of which one in a hundred does.
    assert sum(names_a_record(seed, False) for seed in range(SERIES)) > 2


def test_a_record_that_strays_is_named_among_many_lines() -> None:
    stray = parameter(0.0, 1)
    stray.values[7] += 6.0
    pairs = [(stray, ORDER), *((parameter(0.0, n, name=str(n)), x) for n in range(2, 10) for x in (LIFT, ORDER))]
    named = {line.parameter: [one.record for one in line.outliers] for line in trends(NAMES, pairs) if line.outliers}
    assert named == {"damping": ["record 7"]}
    (outlier,) = next(line.outliers for line in trends(NAMES, pairs) if line.outliers)
    alone = trend_of(NAMES, stray, ORDER)
    assert alone is not None
    assert outlier.chance == pytest.approx(len(pairs) * alone.outliers[0].chance)


def test_an_uncertain_condition_widens_what_is_said_of_the_slope() -> None:
    exact = trend_of(NAMES, parameter(200.0, 4, scatter=0.0, error=0.05), LIFT)
    blurred = Quantity("lift", "m", LIFT.values, np.full(NUMBER, 2e-3))
    unsure = trend_of(NAMES, parameter(200.0, 4, scatter=0.0, error=0.05), blurred)
    assert exact is not None
    assert unsure is not None
    assert unsure.slope_error > 3.0 * exact.slope_error


def test_what_does_not_vary_or_is_not_known_gives_no_trend() -> None:
    assert trend_of(NAMES, parameter(0.0, 1), Quantity("mass", "kg", np.ones(NUMBER), np.zeros(NUMBER))) is None
    lost = np.full(NUMBER, np.nan)
    assert trends(NAMES, [(Quantity("damping", "N s/m", lost, lost), LIFT)]) == ()


#: Pearson's points with York's weights, the line of which several authors have published: York et al. (2004), table II.
PEARSON_X = np.array([0.0, 0.9, 1.8, 2.6, 3.3, 4.4, 5.2, 6.1, 6.5, 7.4])
PEARSON_Y = np.array([5.9, 5.4, 4.4, 4.6, 3.5, 3.7, 2.8, 2.8, 2.4, 1.5])
WEIGHTS_X = np.array([1000.0, 1000.0, 500.0, 800.0, 200.0, 80.0, 60.0, 20.0, 1.8, 1.0])
WEIGHTS_Y = np.array([1.0, 1.8, 4.0, 8.0, 20.0, 20.0, 70.0, 70.0, 100.0, 500.0])


def test_the_line_is_that_of_york() -> None:
    line = nearest_line(PEARSON_X, PEARSON_Y, WEIGHTS_X**-0.5, 1.0 / WEIGHTS_Y)
    middle = np.average(PEARSON_X, weights=line.weights), np.average(PEARSON_Y, weights=line.weights)
    assert line.slope == pytest.approx(-0.480533407, abs=1e-8)
    assert middle[1] - line.slope * middle[0] == pytest.approx(5.47991022, abs=1e-7)
    away = line.x - np.average(line.x, weights=line.weights)
    assert (line.weights @ away**2) ** -0.5 == pytest.approx(0.0579850090, rel=1e-8)


def of_uncertain_conditions(seed: int, told: bool) -> TrendSummary:
    """A slope of 200 over lifts that were read with an error of 3 mm, where they vary by 4 mm."""
    random, size = np.random.default_rng(seed), np.full(NUMBER, 3e-3)
    read = LIFT.values + size * random.standard_normal(NUMBER)
    line = trend_of(NAMES, parameter(200.0, 500 + seed), Quantity("lift", "m", read, size if told else 0.0 * size))
    assert line is not None
    return line


def test_errors_of_conditions_do_not_draw_a_slope_to_nil() -> None:
    aware, naive = ([of_uncertain_conditions(seed, told) for seed in range(200)] for told in (True, False))
    slopes = np.array([[line.slope for line in lines] for lines in (aware, naive)])
    holds = [
        np.mean([one.slope_interval_95[0] < 200.0 < one.slope_interval_95[1] for one in lines])
        for lines in (aware, naive)
    ]
    assert abs(np.median(slopes[0]) / 200.0 - 1.0) < 0.05
    assert 0.9 < holds[0] < 0.99
    # The negative control: errors that are not told of.
    assert np.median(slopes[1]) < 0.8 * 200.0
    assert holds[1] < 0.7


def surely(told: float, number: int, scatter: float = 0.3) -> TrendSummary:
    """A slope of 200 of many records, whose lift differs by 4 mm and was read with an error of 3 mm."""
    random = np.random.default_rng(9)
    true = 0.01 + 4e-3 * random.standard_normal(number)
    read = true + 3e-3 * random.standard_normal(number)
    values = 25.0 + 200.0 * true + scatter * random.standard_normal(number)
    y = Quantity("damping", "N s/m", values, np.full(number, 0.1))
    line = trend_of([str(n) for n in range(number)], y, Quantity("lift", "m", read, np.full(number, told)))
    assert line is not None
    return line


def test_a_slope_is_as_uncertain_as_fuller_has_it() -> None:
    """His variance (1.2.27) of equal errors, where how much records scatter is not known beforehand."""
    number, blur, true = 2000, 3e-3, 4e-3**2
    left = 0.3**2 + (200.0 * blur) ** 2
    variance = (left / true + (left * blur**2 + 200.0**2 * blur**4) / true**2) / number
    line = surely(blur, number)
    # How the lift of 2000 records differs, less the errors, is known to 5 %, and the variance goes with its square.
    assert line.slope_error == pytest.approx(variance**0.5, rel=0.12)
    assert line.slope_interval_95[0] < 200.0 < line.slope_interval_95[1]


def test_of_a_condition_that_differs_by_its_errors_alone_no_slope_is_sure() -> None:
    line = surely(6e-3, NUMBER)
    assert not line.slope_interval_95[0] > 0.0
    assert line.chance_corrected >= SIGNIFICANT


def test_of_a_condition_known_worse_than_it_differs_no_slope_is_told() -> None:
    """And the trends with other conditions can still be written."""
    names, random = tuple("abcdefgh"), np.random.default_rng(0)
    level = Quantity("damping", "N s/m", 25.0 + 0.2 * random.standard_normal(8), np.full(8, 0.2))
    lift = np.array([4.9, 4.95, 5.0, 5.02, 5.06, 5.1, 4.97, 5.05])
    blurred, order = Quantity("lift", "mm", lift, np.full(8, 0.2)), Quantity("order", "-", np.arange(8.0), np.zeros(8))
    assert trend_of(names, level, blurred) is None
    (line,) = trends(names, [(level, blurred), (level, order)])
    assert line.condition == "order"


def test_others_that_agree_by_luck_make_no_record_stray() -> None:
    """Four records on a line to a hundredth of their errors, and one two errors away from it."""
    values = np.array([1.0, 2.0, 3.0, 4.0, 5.0]) + np.array([0.01, -0.01, 0.01, -0.01, 2.0])
    y = Quantity("stiffness", "N/m", values, np.ones(5))
    x = Quantity("lift", "m", np.arange(1.0, 6.0), np.zeros(5))
    found = trend_of([f"{i}" for i in range(5)], y, x)
    assert found is not None
    assert found.outliers == ()


def test_a_record_of_a_short_series_strays_all_the_same() -> None:
    """Where it makes the scatter itself, and no known error explains it."""
    random = np.random.default_rng(11)
    values = 25.0 + 0.2 * random.standard_normal(8)
    values[5] += 20.0
    y = Quantity("damping", "N s/m", values, np.full(8, 0.2))
    x = Quantity("lift", "m", np.arange(1.0, 9.0), np.zeros(8))
    found = trend_of([f"{i}" for i in range(8)], y, x)
    assert found is not None
    assert [outlier.record for outlier in found.outliers] == ["5"]
