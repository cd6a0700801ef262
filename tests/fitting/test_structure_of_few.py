"""Structure of residuals at any rate and of few readings: what is looked at, and what is said where nothing can be."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np

from fibrefit.core.declarations import HELD, REST, SLACK
from fibrefit.fitting.checks import CHECKS
from fibrefit.fitting.residuals import _edges
from fibrefit.problem.diagnose.motion import Motion, ResidualSet
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.report.sentences.fit import fit_sentence
from fibrefit.study.summaries.check import Check
from tests.fitting.made import structure_checks


def checks(residual: np.ndarray, rate: float, phase: np.ndarray | None = None) -> tuple[Check, ...]:
    """Of one record ``(n,)`` of white noise of variance one, of a weight that swings."""
    count = len(residual)
    times, row = np.arange(count)[None] / rate, np.ones((1, count))
    data: Any = SimpleNamespace(weight={"angle": row}, experiment=SimpleNamespace(times=times, count=np.array([count])))
    problem: Any = SimpleNamespace(observations=data, model=SimpleNamespace(rig=SimpleNamespace(channels=("angle",))))
    states = {"position": np.cos(5.0 * times), "speed": np.sin(5.0 * times)}
    phase = np.full(count, SLACK) if phase is None else phase
    motion = Motion(phase[None], states, np.zeros(1, dtype=bool), {})
    noise = {"angle": Noise(2.0 / rate, 0.0, 0.0, 4000)}
    return structure_checks(ResidualSet(problem, residual[None, None], motion, noise, noise))


def white(count: int) -> np.ndarray:
    return np.random.default_rng(count).standard_normal(count)


def test_octaves_go_down_to_the_same_frequency_at_every_high_rate() -> None:
    np.testing.assert_allclose(_edges(2000.0), 1000.0 / 2.0 ** np.arange(1, 11))
    assert len(_edges(50.0)) == 10
    for rate in (5e3, 2e4, 1e5):
        assert 0.9 <= _edges(rate).min() < 1.8


def test_what_is_slow_is_seen_at_a_high_rate() -> None:
    """A wave of 15 Hz, 16 ordinates of 100 kHz of white noise apart from the next octave."""
    rate, noise = 1e5, white(100_000)
    wave = 0.05 * np.sin(2.0 * np.pi * 15.0 * np.arange(len(noise)) / rate)
    assert checks(noise, rate)[0].passed
    spectrum = checks(noise + wave, rate)[0]
    assert not spectrum.passed
    assert "between 12.2 and 24.4 Hz" in fit_sentence(spectrum)


def test_a_short_record_is_judged_with_what_there_is() -> None:
    """A swing of 3 s at 50 Hz: noise passes, more does not."""
    noise, times = white(150), np.arange(150) / 50.0
    for check in checks(noise, 50.0):
        assert check.passed, fit_sentence(check)
    _, phases, states = checks(noise + 2.0 * np.sin(5.0 * times), 50.0)
    assert not phases.passed
    assert not states.passed
    assert states.facts["state"] == "speed"
    # Beside one that is long enough a short one is not judged.
    phase = np.where(np.arange(450) < 300, REST, SLACK)
    loud = np.concatenate([white(300), noise + 2.0 * np.sin(5.0 * times)])
    assert checks(loud, 50.0, phase)[1].passed


def test_noise_of_short_records_rarely_fails() -> None:
    """The other one: of 400 of noise alone."""
    random = np.random.default_rng(7)
    failed = [[not check.passed for check in checks(random.standard_normal(60), 50.0)[1:]] for _ in range(400)]
    assert np.mean(failed) < 0.01


def test_where_nothing_can_be_looked_at_nothing_passes() -> None:
    still = checks(white(150), 50.0, np.full(150, HELD))[2]
    assert (still.passed, still.statistic, still.identifier) == (False, None, "residual_state")
    assert next(row.remedy for row in CHECKS if row.identifier == still.identifier) == "search"
    assert "whether residuals depend on one is not known" in fit_sentence(still)
