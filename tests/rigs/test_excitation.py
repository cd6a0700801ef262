"""What a planned movement of a drive cannot be."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from fibrefit.core.errors import UsageError
from fibrefit.rigs.excitation import Excitation

SOUND: dict[str, Any] = {"shape": "trapezoid", "amplitude": 0.06, "rate": 0.2}


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"shape": "circle"}, 'excitation: shape "circle"; expected rectangle or trapezoid or quasi_sine.'),
        ({"amplitude": 0.0}, "amplitude of the excitation: 0.0; expected a positive number."),
        ({"rate": float("nan")}, "rate of the excitation: nan; expected a positive number."),
        ({"acceleration": -40.0}, "acceleration of the excitation: -40.0; expected a positive number."),
        ({"lead": -0.1}, "lead of the excitation: -0.1; expected a number that is not negative."),
        ({"hold": -0.6}, "hold of the excitation: -0.6; expected a number that is not negative."),
    ],
)
def test_a_movement_that_cannot_be_is_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(UsageError) as refused:
        Excitation(**(SOUND | wrong))
    assert str(refused.value) == message


def test_without_rest_it_moves_at_once_and_never_stands() -> None:
    """The control: no rest at all is a movement like any other."""
    times = np.linspace(0.0, 2.0, 4001)
    position, rate = Excitation(**SOUND, lead=0.0, hold=0.0).motion(times)
    assert position[0] == 0.0
    assert np.ptp(position) == pytest.approx(0.06, rel=1e-3)
    assert np.mean(np.abs(rate) < 1e-3) < 0.02
