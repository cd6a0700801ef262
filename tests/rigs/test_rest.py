"""Rest before a motion is found whatever the band of the noise, and no motion is taken for rest."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.signal import butter, lfilter, sosfilt

from fibrefit.rigs.signals.rest import once_of_readings, rests
from fibrefit.rigs.signals.trace import Trace

RATE, LEAD, LENGTH = 2000.0, 600, 3000


def trace_of(force: np.ndarray, position: np.ndarray) -> Trace:
    times = np.arange(LENGTH) / RATE
    return Trace("a.csv", times, {"force": force, "position": position}, {}, {})


def moved() -> tuple[np.ndarray, np.ndarray]:
    """Force and position of a weight that rests, is driven and stays where it came to."""
    along = np.clip((np.arange(LENGTH) - LEAD) / 1200.0, 0.0, 1.0)
    return 15.0 + 20.0 * along, 0.06 * along


def slow(random: np.random.Generator, share: float) -> np.ndarray:
    """Unit noise, a share of its power of first order with a corner at 8 Hz."""
    pole = np.exp(-2.0 * np.pi * 8.0 / RATE)
    wandering = lfilter([np.sqrt(1.0 - pole**2)], [1.0, -pole], random.standard_normal(LENGTH + 4000))[4000:]
    return np.sqrt(share) * wandering + np.sqrt(1.0 - share) * random.standard_normal(LENGTH)


@pytest.mark.parametrize("share", [0.0, 0.3, 0.7])
@pytest.mark.parametrize("seed", range(8))
def test_the_rest_before_a_motion_is_found_in_noise_of_any_colour(share: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    force, position = moved()
    found = rests(trace_of(force + 0.3 * slow(random, share), position + 2e-5 * slow(random, share)))
    first = [rest for rest in found if rest.start == 0]
    assert len(first) == 1
    assert 0.75 * LEAD < first[0].stop <= LEAD + 2


def filtered(random: np.random.Generator, corner: float) -> np.ndarray:
    """Unit noise behind a filter of second order."""
    passed = sosfilt(butter(2, corner, fs=RATE, output="sos"), random.standard_normal(LENGTH + 4000))[4000:]
    return passed / passed.std()


@pytest.mark.parametrize("corner", [100.0, 200.0, 500.0])
@pytest.mark.parametrize("seed", range(16))
def test_the_rest_before_a_motion_is_found_in_noise_behind_a_filter(corner: float, seed: int) -> None:
    random = np.random.default_rng(seed)
    force, position = moved()
    found = rests(trace_of(force + 0.3 * filtered(random, corner), position + 2e-5 * filtered(random, corner)))
    first = [rest for rest in found if rest.start == 0]
    assert len(first) == 1
    assert 0.75 * LEAD < first[0].stop <= LEAD + 2


@pytest.mark.parametrize("seed", range(4))
def test_a_record_that_moves_from_its_first_sample_has_no_rest_there(seed: int) -> None:
    random = np.random.default_rng(seed)
    force, position = (np.roll(values, -LEAD) for values in moved())
    force[-LEAD:], position[-LEAD:] = force[-LEAD - 1], position[-LEAD - 1]
    found = rests(trace_of(force + 0.3 * slow(random, 0.7), position + 2e-5 * slow(random, 0.7)))
    assert not [rest for rest in found if rest.start == 0]


@pytest.mark.parametrize("lead", [100, 110, 127, 140])
@pytest.mark.parametrize("seed", range(3))
def test_a_short_rest_before_a_fall_is_found(lead: int, seed: int) -> None:
    random = np.random.default_rng(seed)
    fallen = np.minimum(0.5 * 9.81 * np.clip((np.arange(LENGTH) - lead) / RATE, 0.0, None) ** 2, 0.012)
    noise = random.standard_normal((2, LENGTH))
    found = rests(trace_of(0.3 * noise[0], -0.01 + fallen + 2e-5 * noise[1]))
    assert [rest for rest in found if rest.start == 0 and 64 <= rest.stop <= lead]


@pytest.mark.parametrize("period", [24, 32, 40])
def test_a_swing_as_long_as_a_block_is_no_rest(period: int) -> None:
    """The mean over each of its periods is that of a mass at rest."""
    swing = np.where(np.arange(LENGTH) < LEAD, np.sin(2.0 * np.pi * np.arange(LENGTH) / period), 0.0)
    position = 0.05 * swing * np.exp(-np.arange(LENGTH) / LEAD)
    found = rests(trace_of(np.zeros(LENGTH), np.round(position / 0.002) * 0.002))
    assert all(rest.start >= LEAD - 64 for rest in found)
    assert found


def test_a_swing_that_is_over_within_a_block_is_no_rest() -> None:
    swing = 0.05 * np.cos(2.0 * np.pi * np.arange(LENGTH) / 32) * np.clip(1.0 - np.arange(LENGTH) / 27.0, 0.0, None)
    found = rests(trace_of(np.zeros(LENGTH), np.round(swing / 0.002) * 0.002))
    assert [rest.start > 0 for rest in found] == [True]


def test_what_is_asked_of_the_same_readings_is_found_once() -> None:
    asked: list[float] = []

    @once_of_readings
    def largest(signal: np.ndarray) -> float:
        asked.append(float(signal.max()))
        return asked[-1]

    one, other = np.arange(5.0), np.arange(5.0)
    assert [largest(one), largest(one), largest(other)] == [4.0, 4.0, 4.0]
    assert asked == [4.0, 4.0]
    # What takes the place in memory of readings that are gone is not taken for them.
    del one, other
    assert [largest(np.full(5, size)) for size in range(9)] == list(range(9))
