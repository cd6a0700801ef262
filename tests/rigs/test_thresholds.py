"""Thresholds of motions decide: with twice or half of one a motion would be taken for another."""

from __future__ import annotations

from unittest.mock import patch

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.rigs import thresholds
from fibrefit.rigs.signals import motion, newton
from fibrefit.rigs.signals.newton import Pull, Sizes
from fibrefit.rigs.signals.trace import Trace
from tests.brackets import Bracket
from tests.brackets import thresholds as names_in

NUMBER = 20
"""Samples of a stretch."""
TIMES = np.arange(40 * NUMBER) / 1000.0


def stretches(speed: np.ndarray) -> int:
    """Stretches in which a weight of such speeds slides."""
    with patch.object(newton, "derivative", lambda *_: speed):
        return len(newton._stretches(np.zeros((2, len(speed))), TIMES, np.ones(len(speed), bool), NUMBER))


def slides(speed: float) -> bool:
    """Whether a weight slides that has such a share of its largest speed, which it has in half of the record."""
    return stretches(np.where(TIMES[len(TIMES) // 2] > TIMES, 1.0, speed)) > 50


def mostly_slides(share: float) -> bool:
    """Whether stretches count in such a share of which a weight moves."""
    return stretches(np.where(np.arange(len(TIMES)) % NUMBER < share * NUMBER, 1.0, 0.0)) > 20


def agree(number: float) -> bool:
    """Whether so many stretches tell the sizes of gravity and force."""
    found = Sizes(1.0, 1.0, 0.1, 0.1, 0.0, 1.0)
    with (
        patch.object(newton, "_stretches", lambda *_: np.zeros((int(number), 3, NUMBER))),
        patch.object(newton, "_fitted", lambda *_: found),
    ):
        return newton.newton_of(TIMES, TIMES, TIMES, Pull(1.0, 9.81, np.ones(len(TIMES)))) is not None


def stands(speed: float) -> bool:
    """Whether a mass stands that has such a share of its largest speed."""
    return bool(motion._stands(np.array([1.0, 1.0, speed, speed]))[2])


def leads(samples: float) -> bool:
    """Whether a motion in which the force was read so often leads a model."""
    times = np.arange(400) / 1000.0
    force = np.where(np.arange(400) < 100 + int(samples), 1.0, np.nan)
    force[:100] = np.nan
    place = np.column_stack([times, np.ones(400), times])
    try:
        motion.along_motion(Trace("a", times, {"force": force}, {"position": place}, {}))
    except DataError:
        return False
    return True


CASES = (
    Bracket("MOVES", newton, slides, 0.07, 0.035),
    Bracket("MOSTLY_SLIDES", newton, mostly_slides, 0.9, 0.7),
    Bracket("FEWEST_STRETCHES", newton, agree, 6, 5),
    Bracket("STANDS", motion, stands, 0.015, 0.03),
    Bracket("FEWEST_MOVING", motion, leads, 36, 28),
)


@pytest.mark.parametrize("case", CASES, ids=lambda case: case.name)
def test_a_motion_is_taken_for_another_at_the_threshold(case: Bracket, monkeypatch: pytest.MonkeyPatch) -> None:
    case.test(monkeypatch)


def test_no_threshold_is_without_a_case() -> None:
    assert names_in(thresholds) == {case.name for case in CASES}
