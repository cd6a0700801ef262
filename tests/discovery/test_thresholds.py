"""Chances of a name although nothing is missing, against gains that are drawn."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from fibrefit.discovery.engine.thresholds import NAMED, PRICE, false_alarm, gate, occam

CANDIDATES = ((1, 2.0), (1, 3.5), (2, 4.0), (3, 6.0), (1, 2.5))
"""Parameters each adds, and nats they cost."""
DRAWS = 100_000
SURE = 4.0
"""Standard errors of a share of so many draws."""


def best(alike: bool = False) -> np.ndarray:
    """Largest logarithm of a Bayes factor of the candidates over noise alone, ``(DRAWS,)``."""
    random, found = np.random.default_rng(1), []
    common = random.standard_normal((DRAWS, 3))
    for parameters, cost in CANDIDATES:
        drawn = common if alike else random.standard_normal((DRAWS, 3))
        found.append(0.5 * np.sum(drawn[:, :parameters] ** 2, axis=1) - cost)
    return np.max(found, axis=0)


@pytest.mark.parametrize("log_factor", [-1.0, 0.0, 1.0, 3.0])
def test_a_false_alarm_is_as_probable_as_it_is_often(log_factor: float) -> None:
    said, often = false_alarm(log_factor, CANDIDATES), np.mean(best() >= log_factor)
    assert said == pytest.approx(often, abs=SURE * np.sqrt(said * (1.0 - said) / DRAWS))


def test_candidates_that_are_alike_are_on_the_safe_side() -> None:
    for log_factor in (0.0, 1.0, 3.0):
        said, often = false_alarm(log_factor, CANDIDATES), np.mean(best(alike=True) >= log_factor)
        assert said > often
        # By no more than there are candidates.
        assert said < len(CANDIDATES) * often


def test_one_candidate_is_not_the_best_of_many() -> None:
    """The negative control: were the best of many told as if it were the only one, chance would be larger than said."""
    alone = false_alarm(1.0, CANDIDATES[:1])
    assert np.mean(best() >= 1.0) > 1.5 * alone


def test_a_name_is_hardly_ever_chance() -> None:
    # A catalogue of forty effects with two parameters that cost four nats each.
    assert false_alarm(NAMED, [(2, 2.0 * PRICE)] * 40) < 1e-3
    assert false_alarm(NAMED, []) == 0.0
    assert false_alarm(200.0, CANDIDATES) == 0.0
    falling = [false_alarm(x, CANDIDATES) for x in np.linspace(-10.0, 30.0, 50)]
    assert falling == sorted(falling, reverse=True)
    assert falling[0] == pytest.approx(1.0)


def test_what_parameters_cost_is_the_gain_less_the_bayes_factor() -> None:
    before, after = (
        cast(Any, SimpleNamespace(log=log, mode=SimpleNamespace(objective=objective)))
        for log, objective in ((-100.0, 180.0), (-80.0, 132.0))
    )
    assert occam(before, after) == pytest.approx(24.0 - 20.0)


def test_an_effect_is_expected_to_be_named_at_its_gate() -> None:
    for parameters in (1, 2, 3):
        assert 0.5 * gate(parameters) - PRICE * parameters == pytest.approx(NAMED)
