"""Every threshold of residuals and estimates decides: with twice or half of it a verdict here would be another."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from fibrefit.problem import thresholds
from fibrefit.problem.diagnose import inverse_dynamics
from fibrefit.problem.diagnose.inverse_dynamics import ForceBalance, balance_check
from fibrefit.problem.estimate import hausman
from fibrefit.problem.estimate.hausman import HausmanTest, hausman_check, hausman_test
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in


def compared(share: float) -> bool:
    """Whether a difference is left unjudged where the better estimate saves so small a share of the variance."""
    found = hausman_test(np.array([5.0]), np.array([[1.0]]), np.array([[1.0 - share]]))
    return not np.isfinite(found.scores).any()


def standing(speed: float) -> bool:
    """Whether a mass of such a speed counts as one that stands: no force is asked of it but the measured one."""
    guide = SimpleNamespace(net_force=lambda drive, direction, sliding: drive - 2.0 * direction)
    system = SimpleNamespace(gain=1.0, offset=0.0, mass=3.0, guide=guide)
    one = np.ones(1)
    return bool(inverse_dynamics._asked(system, 0.0 * one, speed * one, 0.0 * one, 5.0 * one) == 5.0)


CASES = (
    Bracket(
        "UNLIKELY",
        hausman,
        lambda x: hausman_check(("a",), HausmanTest(np.ones(1), 1.0 / x, np.ones(1))).passed,
        1 / 0.0013,
        1 / 0.0007,
    ),
    Bracket("STANDING", inverse_dynamics, standing, 7e-4, 1.3e-3),
    Bracket("SLIGHT", hausman, compared, 0.015, 0.025),
    Bracket("BALANCE", inverse_dynamics, lambda x: balance_check(ForceBalance(1.0, x, 1.0 - x**2)).passed, 0.08, 0.12),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_verdict_turns_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    """`GAP` decides in the checks of a fit and of a posterior, which have a case of it each."""
    assert names_in(thresholds) == {case.name for case in CASES} | {"GAP"}
