"""The grid of standard deviations between records: as fine as records tell them, and as small as it can be."""

from __future__ import annotations

from dataclasses import replace
from unittest.mock import patch

import numpy as np
import pytest
from scipy.stats import chi2, t

from fibrefit.problem.estimate import evidence as weighing
from fibrefit.problem.estimate.evidence import (
    ALONE,
    MOST_POINTS,
    SIGMA_LEVELS,
    MarginalLikelihood,
    SigmaAxis,
    finest_step,
    grid_over,
    usual_axes,
)
from tests.problem.test_population import weighed

SDS = (0.008, 0.0095, 0.0113, 0.0135, 0.015)
"""From a level of the grid almost to the next one."""


def apart(records: int, sd: float) -> MarginalLikelihood:
    """Of records whose values have exactly this standard deviation."""
    logs = np.random.default_rng(records).standard_normal(records)
    return weighed(sd * (logs - logs.mean()) / logs.std(ddof=1))


def half_width(found: MarginalLikelihood) -> float:
    low, high = found.interval_95(0)
    return 0.5 * (high - low)


@pytest.mark.parametrize("records", [10, 20, 50, 200])
def test_intervals_of_many_records_are_those_of_student_and_of_chi_square(records: int) -> None:
    student = t.ppf(0.975, records - 1) / np.sqrt(records)
    ends = np.sqrt((records - 1) / chi2.ppf([0.975, 0.025], records - 1))
    coarse = []
    for sd in SDS:
        found = apart(records, sd)
        fine = found.refined()
        coarse.append(half_width(found) / (student * sd))
        assert half_width(fine) / (student * sd) == pytest.approx(1.0, abs=0.06)
        assert fine.between_records()["stiffness"].sd / sd == pytest.approx(1.0, abs=0.1)
        # Ends are interpolated between levels; the prior to one percent is uniform.
        np.testing.assert_allclose(fine.between_records()["stiffness"].interval_95, sd * ends, rtol=0.12)
        assert fine.log == found.log
        assert fine.weight.sum() == pytest.approx(1.0)
        assert len(fine.grid) < 20
    # The grid on which models are compared says what its nearest level says.
    assert records < 20 or (min(coarse) < 0.9 and max(coarse) > 1.2)


def test_five_records_ask_for_the_usual_levels_where_these_are_a_factor_of_two_apart() -> None:
    assert finest_step(5) > np.log(2.0)
    assert finest_step(6) < np.log(2.0)
    assert finest_step(1) == finest_step(2)


def test_halving_keeps_what_was_known_beforehand() -> None:
    (axis,) = usual_axes(1)
    assert axis.shares.sum() == pytest.approx(1.0)
    everywhere = np.ones(len(SIGMA_LEVELS))
    once = axis.halved(everywhere, 0.01)
    assert len(once.levels) == 2 * len(SIGMA_LEVELS) - 2
    assert once.widths.sum() == pytest.approx(axis.widths.sum())
    assert once.shares.sum() == pytest.approx(1.0, abs=0.03)
    assert once.shares[0] == ALONE
    assert np.all(np.diff(once.levels) > 0.0)
    again = once.halved(np.ones(len(once.levels)), 0.01)
    # Log-uniform from one percent on: a level has a share for its cell.
    inside = (again.levels[1:] > 0.01) & (again.levels[1:] < 0.08)
    density = again.shares[1:][inside] / again.widths[inside]
    np.testing.assert_allclose(density, density[0])


def test_levels_without_weight_go_but_for_the_first_and_the_last() -> None:
    (axis,) = usual_axes(1)
    weight = np.where(np.array(SIGMA_LEVELS) == 0.008, 1.0, 1e-12)
    found = axis.halved(weight, 0.3).levels
    np.testing.assert_allclose(found, [0.0, 0.004, np.sqrt(0.004 * 0.008), 0.008, np.sqrt(0.008 * 0.016), 0.016, 0.08])
    assert axis.halved(weight, 0.7) is axis


def test_a_grid_of_several_is_that_of_each() -> None:
    first, second = SigmaAxis.of((0.0, 0.001, 0.01)), SigmaAxis.of((0.0, 0.02, 0.05, 0.1))
    grid, prior = grid_over((first, second))
    assert grid.tolist()[:5] == [[0.0, 0.0], [0.0, 0.02], [0.0, 0.05], [0.0, 0.1], [0.001, 0.0]]
    assert np.exp(prior).sum() == pytest.approx(1.0)
    assert np.exp(prior[0]) == pytest.approx(0.5)
    share = first.shares[1] * second.shares[2] / (1.0 - ALONE**2)
    assert np.exp(prior[6]) == pytest.approx(0.5 * share)


def with_log_at(found: MarginalLikelihood, sigma: float, more: float) -> MarginalLikelihood:
    """What was found at a standard deviation, in place of what slopes predict of it."""
    logs = found.logs + np.where(found.grid[:, 0] == sigma, more, 0.0)
    weight = np.exp(logs - logs.max())
    return replace(found, logs=logs, weight=weight / weight.sum())


def test_what_was_found_beside_what_slopes_predict_is_carried_on() -> None:
    """Less was found at 0.8 % than predicted: there and near it less is believed, and most where it was found."""
    found = apart(20, 0.0113)
    usual, fine = found.refined(), with_log_at(found, 0.008, -3.0).refined()
    levels = (0.008, 0.008 * np.sqrt(2.0), 0.016)
    found_there = [[float(one.logs[np.isclose(one.grid[:, 0], sd)][0]) for sd in levels] for one in (fine, usual)]
    np.testing.assert_allclose(np.subtract(*found_there), [-3.0, -1.5, 0.0], atol=1e-6)


def test_a_standard_deviation_that_led_nowhere_leaves_the_grid_as_it_is() -> None:
    told = with_log_at(apart(20, 0.0113), 0.008, -np.inf)
    assert told.refined() is told


@pytest.mark.parametrize("sd", [0.15, 0.3])
def test_many_records_that_differ_by_more_are_told_as_finely(sd: float) -> None:
    fine = apart(50, sd).refined()
    assert half_width(fine) / (t.ppf(0.975, 49) * sd / np.sqrt(50)) == pytest.approx(1.0, abs=0.05)
    assert fine.grid.max() == 0.5


def test_a_grid_that_would_be_too_large_stays() -> None:
    found = apart(50, 0.0113)
    with patch.object(weighing, "MOST_POINTS", 3):
        assert found.refined() is found
    assert len(found.refined().grid) < MOST_POINTS


def test_what_is_no_number_on_a_finer_grid_is_left() -> None:
    found = apart(50, 0.0113)

    laplace = MarginalLikelihood.of

    def lost(*given: object) -> MarginalLikelihood:
        there = laplace(*given)  # type: ignore[arg-type]
        return replace(there, covariance=np.full_like(there.covariance, np.nan))

    with patch.object(MarginalLikelihood, "of", lost):
        assert found.refined() is found
