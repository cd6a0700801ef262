"""Records that differ by more than the grid of a search goes to: the interval of their mean, and what is said."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from scipy.stats import t

from fibrefit.problem.estimate.evidence import EXTENSION, SIGMA_LEVELS, MarginalLikelihood, grid_over, usual_axes
from fibrefit.report.sentences.fit import fit_checks
from fibrefit.study.summaries.check import Check, status_by
from tests.problem.test_population import RECORDS, weighed

APART = np.array([-1.2, -0.4, 0.1, 0.3, 1.2]) / np.std([-1.2, -0.4, 0.1, 0.3, 1.2], ddof=1)


def checked(found: MarginalLikelihood) -> tuple[Check, ...]:
    return fit_checks(tuple(found.between_records_checks()))


@pytest.mark.parametrize("sd", [0.1, 0.15, 0.3])
def test_the_mean_of_records_that_differ_much_has_the_interval_of_student(sd: float) -> None:
    narrow, wide = weighed(sd * APART), weighed(sd * APART).extended()
    student = t.ppf(0.975, RECORDS - 1) * sd / np.sqrt(RECORDS)
    low, high = wide.interval_95(0)
    assert 0.8 * student < 0.5 * (high - low) < 1.3 * student
    assert 0.5 * np.subtract(*narrow.interval_95(0)[::-1]) < 0.6 * student or sd < 0.15
    assert wide.between_records()["stiffness"].interval_95[0] < sd < wide.between_records()["stiffness"].interval_95[1]
    # Models are compared on one grid.
    assert wide.log == narrow.log
    (check,) = checked(wide)
    assert check.passed is (sd < 0.3)


def test_what_differs_by_more_than_is_looked_for_makes_a_fit_suspect() -> None:
    found = weighed(0.6 * APART).extended()
    (check,) = checked(found)
    assert status_by([check]) == "suspect"
    assert check.says.startswith("The stiffness differs from record to record by at least 3")
    assert "The interval of its mean is too narrow. Fit the records one by one (batch) or in groups" in check.says


@pytest.mark.parametrize("sd", [0.0, 0.01, 0.03])
def test_records_that_differ_as_usual_keep_the_grid_of_a_search(sd: float) -> None:
    found = weighed(sd * APART)
    assert found.extended() is found
    assert checked(found) == ()


def test_records_that_say_nothing_leave_the_last_level_what_it_was() -> None:
    grid, prior = grid_over(usual_axes(3, (1,)))
    said: Any = SimpleNamespace(grid=grid, weight=np.exp(prior), prior=prior)
    ratios = MarginalLikelihood.last_level_ratios.fget(said)  # type: ignore[attr-defined]
    np.testing.assert_allclose(ratios, 1.0)
    assert grid.max(axis=0).tolist() == [SIGMA_LEVELS[-1], EXTENSION[-1], SIGMA_LEVELS[-1]]


@pytest.mark.parametrize("sd", [0.06, 0.15])
def test_no_standard_deviation_is_larger_than_its_prior_has_them(sd: float) -> None:
    low, high = weighed(sd * APART).between_records()["stiffness"].interval_95
    assert low < high <= SIGMA_LEVELS[-1] * (1.0 + 1e-12)
