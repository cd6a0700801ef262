"""Events: found where something happens in the middle of a record, and nowhere else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fibrefit.core.declarations import STICKING
from fibrefit.discovery.residuals.events import events
from fibrefit.discovery.residuals.residuals import SHORTEST_WINDOW
from fibrefit.discovery.residuals.where import onset
from tests.discovery.left import BOUNCE, COUNT, RATE, RECORDS, TAUT, noise_alone, with_gap

SERIES = 100
BY_CHANCE = 2
SAMPLE = np.arange(COUNT)
INTO = SAMPLE % BOUNCE - (BOUNCE - TAUT)
AT = 1130
WAVE = 6.0 * np.sin(0.7 * SAMPLE)
STEP = np.where(SAMPLE >= AT, WAVE, 0.0)


@pytest.mark.parametrize("pink", [0.0, 0.5])
def test_nothing_happens_in_noise(pink: float) -> None:
    assert sum(len(events(noise_alone(seed, pink))) for seed in range(SERIES)) <= BY_CHANCE


def test_an_event_is_seen_in_a_single_record() -> None:
    left = with_gap(noise_alone(0, records=1), STEP)
    ((record, instant),) = events(left)
    assert record == "0.csv"
    assert abs(instant - AT / RATE) <= SHORTEST_WINDOW
    assert onset(left) == (record, instant)


def test_and_in_several_of_many() -> None:
    gap = np.zeros((RECORDS, COUNT))
    gap[1] = gap[3] = STEP
    left = with_gap(noise_alone(1), gap)
    assert [record for record, _ in events(left)] == ["1.csv", "3.csv"]
    assert onset(left) is None, "not one record alone"


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_one_record_among_several_is_found_as_ever(sign: float) -> None:
    gap = np.zeros((RECORDS, COUNT))
    gap[2] = sign * np.abs(STEP)
    left = with_gap(noise_alone(2), gap)
    found = onset(left)
    assert found is not None
    assert found[0] == "2.csv"
    assert abs(found[1] - AT / RATE) <= SHORTEST_WINDOW
    assert [record for record, _ in events(left)] == ["2.csv"]


@pytest.mark.parametrize(
    "gap",
    [
        np.where(INTO >= 0, WAVE, 0.0),
        WAVE,
        WAVE * (SAMPLE / COUNT) ** 3,
        np.where((SAMPLE >= AT) & (SAMPLE < AT + 150), WAVE, 0.0),
        np.where(SAMPLE >= COUNT - 100, WAVE, 0.0),
    ],
    ids=["in every contact", "always", "by and by", "for a while", "at the very end"],
)
def test_what_is_no_event_is_not_called_one(gap: np.ndarray) -> None:
    assert sum(len(events(with_gap(noise_alone(seed, records=1), gap))) for seed in range(20)) == 0


def test_what_begins_with_a_phase_that_is_new_is_no_event() -> None:
    left = with_gap(noise_alone(3, records=1), STEP)
    phase = np.where(SAMPLE >= AT - 5, STICKING, left.motion.phase)
    faster = {**left.motion.states, "speed": left.motion.states["speed"] + 3.0 * (SAMPLE >= AT - 5)}
    assert events(replace(left, motion=replace(left.motion, phase=phase))) == ()
    assert events(replace(left, motion=replace(left.motion, states=faster))) == ()
