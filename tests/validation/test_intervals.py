"""Coverage: over many series the 95 % intervals of a fit hold the truth as often as they say."""

from __future__ import annotations

import itertools
import math
import os

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from tests.independent.laws import DROP
from tests.validation.cases import Case, interval_cases
from tests.validation.validate_intervals import UNITS, Fitted, carry_out, coverage

SERIES = int(os.environ.get("FIBREFIT_COVERAGE", "100"))
#: What is asked for; a true 95 % of 100 series scatters by 2.2 %, and more than three times that is no chance.
HONEST, SPREAD = (0.92, 0.98), math.sqrt(0.95 * 0.05 / SERIES)
#: Of 100 errors over their standard errors the root mean square is 1, give or take 0.07.
RMS = (0.8, 1.25)


@pytest.fixture(scope="module")
def rows() -> list[Fitted]:
    series = itertools.islice(interval_cases("coverage", "fibre_mass", "pink", 0.0), SERIES)
    found = [row for case in series for row in carry_out(case)]
    print("\n" + "\n".join(coverage(found).lines()))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("name", UNITS)
def test_intervals_hold_the_truth_as_often_as_they_say(rows: list[Fitted], name: str) -> None:
    share = np.mean([row.holds for row in rows if row.parameter == name])
    assert HONEST[0] - 2.0 * SPREAD <= share <= HONEST[1] + 2.0 * SPREAD


@pytest.mark.slow
def test_intervals_for_white_noise_do_not(rows: list[Fitted]) -> None:
    assert np.mean([row.white_holds for row in rows]) < HONEST[0] - 2.0 * SPREAD


@pytest.mark.slow
@pytest.mark.parametrize("name", UNITS)
def test_intervals_are_no_wider_than_they_have_to_be(rows: list[Fitted], name: str) -> None:
    """Errors of the values over the standard errors that are told."""
    scores = np.array([row.score for row in rows if row.parameter == name])
    assert RMS[0] <= np.sqrt(np.mean(scores**2)) <= RMS[1]


@pytest.mark.slow
def test_clean_series_are_not_suspected(rows: list[Fitted]) -> None:
    assert np.mean([row.status == "ok" for row in rows]) >= 0.95 - 2.0 * SPREAD


@pytest.mark.parametrize(
    ("noise", "scatter", "index"), [pytest.param("slow", 0.005, 1, marks=pytest.mark.slow), ("load", 0.01, 0)]
)
def test_a_short_rest_that_does_not_show_all_of_the_noise_makes_no_fit_suspect(
    noise: str, scatter: float, index: int
) -> None:
    """Two series whose records differ and which were suspected: the rest is quieter than the motion, or has a load."""
    case = next(itertools.islice(interval_cases("2026-11-30b", DROP, noise, scatter), index, None))
    rows = carry_out(case)
    assert {row.status for row in rows} == {"ok"}, rows[0].failed
    assert all(row.holds for row in rows)


@pytest.mark.slow
@pytest.mark.parametrize("index", range(3))
def test_series_that_hide_a_strong_effect_are_suspected(index: int) -> None:
    """The negative control of the statuses."""
    rows = carry_out(Case("coverage", "faint", DROP, index, "pink", 0.0, 2e4, "guide.quadratic_drag"))
    assert {row.status for row in rows} <= {"suspect", "failed"}
    assert all("the gap is noise" in row.failed for row in rows)
