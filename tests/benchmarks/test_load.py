"""What a benchmark calls linear growth: of numbers whose law is known, with the scatter that memory has."""

from __future__ import annotations

import numpy as np
import pytest

from tests.benchmarks.load import LINEAR, LOADS, exponent, growth, too_fast

SIZES = LOADS["samples"].sizes
BASE, SCATTER = 400.0, 3.0
"""Of a process that fits one record, MB."""


def taken(power: float, most: float = 250.0, seed: int = 0) -> list[float]:
    """Memory of a process that takes so much at the largest size."""
    sizes = np.asarray(SIZES, dtype=float)
    chance = np.random.default_rng(seed).normal(0.0, SCATTER, len(SIZES))
    return list(BASE + most * (sizes / sizes[-1]) ** power + chance)


@pytest.mark.parametrize("power", [0.5, 1.0, 1.3, 2.0])
def test_the_power_is_found_beside_a_base(power: float) -> None:
    exact = list(BASE + 3e-3 * np.asarray(SIZES, dtype=float) ** power)
    assert exponent(SIZES, exact) == pytest.approx(power, abs=0.011)


def test_quadratic_growth_is_told_from_linear_growth_whatever_chance_does() -> None:
    found = {power: [exponent(SIZES, taken(power, seed=seed)) for seed in range(30)] for power in (1.0, 2.0)}
    assert np.mean(np.array(found[1.0]) <= LINEAR) > 0.8
    assert min(found[2.0]) > LINEAR


def test_what_does_not_grow_has_no_exponent() -> None:
    assert growth(SIZES, [400.0, 410.0, 395.0, 405.0, 420.0]) == "flat"


def test_only_a_second_run_is_judged_and_not_by_the_clock() -> None:
    assert not too_fast(["2.0", "2.0", "2.0", "2.0", "1.0", "flat"])
    assert too_fast(["1.0", "1.0", "1.0", "1.0", "1.2", "flat"])
    assert too_fast(["1.0", "1.0", "1.0", "1.0", "1.0", "1.2"])
