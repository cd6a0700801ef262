"""The time of another program over ours, and what one record that is hard for it does to that."""

from __future__ import annotations

import re

import numpy as np
import pytest

from tests.validation.beside_scipy import Rival, _over, of_rival
from tests.validation.validate_batch import Look, _grown


def test_a_ratio_of_totals_has_an_interval_that_tells_of_single_records() -> None:
    ours = np.full(40, 0.1)
    assert _over(np.full(40, 2.0), ours) == "20.0 (20.0 to 20.0)"
    said = _over(np.r_[np.full(39, 1.0), 120.0], ours)
    ratio, low, high = (float(number) for number in re.findall(r"[\d.]+", said))
    assert ratio == pytest.approx(39.75, abs=0.1)
    assert low < 11.0
    assert high > 80.0


def test_what_does_not_come_to_the_same_minimum_is_told() -> None:
    rows = [Rival(f"{n}", 0.1, 0.3, 5.0, n > 0, n != 3, 2 + n) for n in range(10)]
    said = "\n".join(of_rival(rows))
    assert "11 at the most; 1 had not come to the same minimum" in said
    assert "50.0 (50.0 to 50.0)" in said


def test_memory_of_parent_and_workers_is_told_by_record() -> None:
    looks = [Look(done, done, done, 700.0, 1.0, 300.0 + 0.02 * done) for done in range(0, 1001, 50)]
    said = "\n".join(_grown(looks))
    assert "Memory of a worker at the end over that at a quarter: 1.000" in said
    assert "20.0 kB a record" in said
    assert "The most the parent took, tables at the end included: 320 MB." in said
