"""Records in which a rig finds nothing to begin with are refused, and the message says what is not there."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.rigs.catalogue import RIGS
from fibrefit.rigs.fibre_mass import FORCE_ONLY
from fibrefit.rigs.pendulum import PENDULUM
from fibrefit.rigs.signals.trace import Trace

TIMES = np.arange(1000) / 2000.0


def drop(taken: float, sign: float = 1.0, lift: float = np.nan) -> Trace:
    """Force of a weight of 3 kg that falls freely into a fibre, taut from an instant on."""
    inside = (taken < TIMES) & (taken + 0.05 > TIMES)
    force = sign * np.where(inside, 80.0 * np.sin(np.pi * (TIMES - taken) / 0.05), 0.0)
    conditions = {"weight_mass": 3.0, "added_mass": 0.0, "inclination": 0.5 * np.pi, "lift": lift}
    return Trace("a.csv", TIMES, {"force": force}, {}, conditions)


def test_the_fall_that_is_whole_is_taken() -> None:
    """The negative control of those below."""
    found = FORCE_ONLY.starting([drop(0.2)], (), {})
    assert 0.0 < found.each["release"][0] < 0.2


@pytest.mark.parametrize(
    ("trace", "says"),
    [
        (drop(0.02, lift=0.05), "a.csv: the weight falls before the first sample; expected the whole fall."),
        (drop(0.2, sign=-1.0), "a.csv: no catch in the force; expected a force that rises from rest"),
        (drop(-0.001), "a.csv: no catch in the force; expected a force that rises from rest"),
        (drop(1.0), "a.csv: no catch in the force; expected a force that rises from rest"),
    ],
    ids=["fallen", "pushed", "taut", "never"],
)
def test_a_force_without_a_whole_fall_is_refused(trace: Trace, says: str) -> None:
    with pytest.raises(DataError) as refused:
        FORCE_ONLY.starting([trace], (), {})
    assert says in str(refused.value)


@pytest.mark.parametrize("channel", ["position", "force"])
def test_a_channel_of_a_drive_that_is_masked_through_the_rest_is_named(channel: str) -> None:
    course = np.clip(0.2 * (TIMES - 0.2), 0.0, 0.04)
    drive = np.stack([course, np.gradient(course, TIMES)], axis=1)
    conditions = {"weight_mass": 3.0, "added_mass": 0.0, "inclination": 0.5 * np.pi}
    channels = {"position": 0.9 * course, "force": 29.4 + 14000.0 * 0.1 * course}
    starting = RIGS["pulley_drive"].starting
    begun = starting([Trace("a.csv", TIMES, channels, {"drive": drive}, conditions)], (), {})
    assert np.isfinite(begun.each["position_zero"]).all()
    channels |= {channel: np.where(TIMES < 0.19, np.nan, channels[channel])}
    said = f"samples of the {channel} before 190 ms are masked as saturated or damaged, the rest among them"
    with pytest.raises(DataError, match=said):
        starting([Trace("a.csv", TIMES, channels, {"drive": drive}, conditions)], (), {})


def test_an_angle_that_does_not_swing_is_refused() -> None:
    """It changes once, from where a hand holds the pendulum to where it hangs."""
    assert PENDULUM.prepared is not None
    let_down = PENDULUM.prepared(Trace("a.csv", TIMES, {"angle": np.where(TIMES < 0.1, 0.2, 0.0)}, {}, {}))
    with pytest.raises(DataError, match="a.csv: the angle does not swing; expected a pendulum that is let go"):
        PENDULUM.starting([let_down], (), {})
