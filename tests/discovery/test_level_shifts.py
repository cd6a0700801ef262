"""Jumps of a reading: silent in noise of any loudness, loud where records jump at instants of their own."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.discovery.engine.thresholds import ALARM
from fibrefit.discovery.level_shifts import CLOSE, joint_probability, level_shifts
from fibrefit.discovery.residuals.innovations import Alarm
from fibrefit.problem.noise.coloured import BLOCK, BlockFilter
from fibrefit.report.sentences.discovery import discovery_sentence

RECORDS, SAMPLES = 5, 1600
COUNTS = np.full(RECORDS, SAMPLES)
NUMBER = SAMPLES // BLOCK
WHITE = BlockFilter(
    jnp.broadcast_to(jnp.eye(BLOCK), (NUMBER, RECORDS, 1, BLOCK, BLOCK)),
    jnp.zeros((NUMBER, RECORDS, 1, BLOCK, 1)),
    jnp.zeros((NUMBER, RECORDS, 1, 1, BLOCK)),
    jnp.zeros((NUMBER, RECORDS, 1, 1, 1)),
)
"""The filter of white noise: innovations are the residuals."""
INSTANTS = np.array([400, 560, 800, 960, 1200])


def noise(seed: int) -> np.ndarray:
    return np.random.default_rng(seed).standard_normal((RECORDS, 1, SAMPLES))


def jumping(height: float) -> np.ndarray:
    """A step in each record at an instant of its own, about its mean."""
    step = np.where(np.arange(SAMPLES) >= INSTANTS[:, None], height, 0.0)
    return (step - step.mean(axis=1, keepdims=True))[:, None]


def test_noise_is_no_jump() -> None:
    found = [joint_probability(level_shifts(WHITE, noise(seed), COUNTS)) for seed in range(20)]
    assert min(found) > 0.05
    assert joint_probability([]) == 1.0


def test_a_record_that_is_too_short_tells_nothing() -> None:
    assert level_shifts(WHITE, noise(0), np.full(RECORDS, 2 * BLOCK)) == []


def test_records_that_jump_at_instants_of_their_own_raise_an_alarm_together() -> None:
    found = level_shifts(WHITE, noise(1) + jumping(0.3), COUNTS)
    assert joint_probability(found) < ALARM
    # Each by itself says less than all do together.
    assert min(jump.probability for jump in found) > joint_probability(found)
    large = level_shifts(WHITE, noise(1) + jumping(3.0), COUNTS)
    assert np.abs(np.array([jump.sample for jump in large]) - INSTANTS).max() <= 2 * CLOSE


def test_what_is_loud_for_a_while_is_no_jump() -> None:
    loud = np.where(np.abs(np.arange(SAMPLES) - 700) < 60, 8.0, 1.0)
    found = [joint_probability(level_shifts(WHITE, loud * noise(seed), COUNTS)) for seed in range(10)]
    assert min(found) > ALARM


def test_masked_samples_say_nothing() -> None:
    residuals = noise(2)
    residuals[:, :, 500:900] = 0.0
    assert joint_probability(level_shifts(WHITE, residuals, COUNTS)) > 0.01


def test_the_sentence_says_where() -> None:
    alarm = Alarm("jump", 1e-9, ALARM, {"record": "drop.csv", "channel": "force", "instant": 1.1})
    said = discovery_sentence(alarm.statement)
    assert said == (
        "Readings jump more than their noise does, first of all the force of drop.csv at 1.100 s "
        "(p = 1e-09 of all records together)."
    )
    assert alarm.nats == pytest.approx(0.0)
