"""Trends: a line found again, chance not taken for one, a stray record named, errors of the condition allowed for."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from fibrefit.series.trends import Quantity, trend_of, trends

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
    assert [line.condition for line in found if line.found] == ["lift"]
    line = found[0]
    assert line.slope_interval_95[0] < 200.0 < line.slope_interval_95[1]
    assert line.between_records == pytest.approx(0.3, rel=0.4)
    assert line.intercept + line.slope * line.middle == pytest.approx(line.level)


def test_no_scatter_is_made_up() -> None:
    line = trend_of(NAMES, parameter(200.0, 2, scatter=0.0), LIFT)
    assert line is not None
    assert line.between_records < 0.15


@pytest.mark.slow
def test_chance_is_not_taken_for_a_trend() -> None:
    alarms = 0
    for seed in range(40):
        several = [parameter(0.0, 10 * seed + n, name=str(n)) for n in range(3)]
        alarms += any(line.found for line in trends(NAMES, list(product(several, [LIFT, ORDER, MASS]))))
    # One in twenty is expected; without the correction for nine looks it would be one in three.
    assert alarms <= 6


def test_a_stray_record_is_named_and_left_out() -> None:
    clean = parameter(200.0, 3)
    values = clean.values.copy()
    values[7] += 6.0
    line = trend_of(NAMES, Quantity("damping", "N s/m", values, clean.errors), LIFT)
    assert line is not None
    assert [stray.record for stray in line.outliers] == ["record 7"]
    assert line.outliers[0].score > 5.0
    assert line.records == NUMBER - 1
    assert line.slope_interval_95[0] < 200.0 < line.slope_interval_95[1]


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
