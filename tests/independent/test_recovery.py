"""The program on data that another simulator made: it finds the truth, and the gap that the maker promised."""

from __future__ import annotations

import math
from pathlib import Path

import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

import fibrefit
from tests.independent.laws import DROP
from tests.independent.make import hide, write
from tests.independent.series import Series

STARTS = 2
# Error bars are good to some ten per cent: of three parameters none beyond four of them, one time in five thousand.
STANDARD_ERRORS = 4.0
PERFECT = 1.05
# The maker's refit works with coarse steps, and gaps vary with the noise of 18 000 samples by a per cent.
PROMISED = 0.1


def fit_to(series: Series, folder: Path):
    write(series, folder)
    return fibrefit.fit(fibrefit.load_study(folder), starts=STARTS)


def test_nothing_hidden(tmp_path: Path) -> None:
    series = hide(DROP, [], 21)
    found = fit_to(series, tmp_path)
    for name, truth in series.base._asdict().items():
        estimate = found.parameters[name]
        assert abs(estimate.value - truth) <= STANDARD_ERRORS * estimate.std_error, name
    assert found.summary().gap.total <= PERFECT
    assert found.status == "ok"


@pytest.mark.slow
def test_a_hidden_effect_leaves_the_gap_it_should(tmp_path: Path) -> None:
    series = hide(DROP, ["fibre.hardening"], 23, 1.5)
    found = fit_to(series, tmp_path)
    expected = math.sqrt(1.0 + series.base_gap**2)
    assert found.summary().gap.total == pytest.approx(expected, rel=PROMISED)
    assert found.status == "suspect"
