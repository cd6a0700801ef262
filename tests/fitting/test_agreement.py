"""Whether single records ask for the same values: sound fits in slow noise pass, and records that differ do not."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting import values as agreement
from fibrefit.fitting.checks import check as judge
from fibrefit.fitting.error_bars import error_bars
from fibrefit.fitting.uncertainty import Scores, newey_west_of
from fibrefit.problem.thresholds import UNLIKELY
from fibrefit.study.summaries.check import Check
from tests.fitting.made import RATE, coloured

SLOT = SimpleNamespace(name="stiffness", unit="N/m")
PROBLEM: Any = SimpleNamespace(
    layout=SimpleNamespace(shared_places=[0, 1], entries=[(SLOT, None)] * 2), model=SimpleNamespace(pieces=None)
)
SAMPLES = 500
TIME = np.arange(SAMPLES) / SAMPLES
SLOPES = np.stack([np.sin(9.0 * TIME) + 0.6, np.where(TIME > 0.5, np.cos(40.0 * TIME), 0.0), np.ones(SAMPLES)], -1)
"""Two shared values, and a zero of each record."""


def fitted(number: int, seed: int, differ: float = 0.0, loud: float = 1.0) -> Scores:
    """Records in noise half of whose amplitude is pink, at the best values; the first value differs by turns."""
    random = np.random.default_rng(seed)
    residuals = np.stack([coloured(SAMPLES, 0.5, random) + differ * SLOPES[:, 0] * (-1) ** r for r in range(number)])
    residuals[0] *= loud
    slopes, columns = np.stack([SLOPES] * number)[:, None], np.array([[0, 1, 2 + r] for r in range(number)])
    scores = Scores(residuals[:, None], slopes, np.full(number, SAMPLES), columns, 2 + number)
    step = np.linalg.solve(scores.normal_matrix(), scores.gradient())
    return replace(scores, residuals=scores.residuals - np.einsum("rcti,ri->rct", slopes, step[columns]))


def check(scores: Scores) -> Check | None:
    bars = error_bars(PROBLEM, scores, RATE)
    found = agreement.records_agree(PROBLEM, np.zeros(scores.size), scores, bars, RATE)
    return None if found is None else judge("records_agree", found)


def chance(scores: Scores) -> float:
    found = check(scores)
    assert found is not None
    assert found.statistic is not None
    return found.statistic


def test_sound_fits_of_many_records_in_slow_noise_pass(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = [fitted(20, seed) for seed in range(20)]
    assert min(map(chance, fits)) > UNLIKELY
    # The negative control: an eighth of a record's own scores knows little of noise as slow as a record is long.
    monkeypatch.setattr(agreement, "stationary_parts", lambda of, rate: lambda r: newey_west_of(of.of_record(r)))
    monkeypatch.setattr(agreement, "_above_spectrum", lambda bars: 1.0)
    monkeypatch.setattr(agreement, "_loudness", lambda of: np.ones(len(of.columns)))
    assert np.mean([chance(one) < UNLIKELY for one in fits]) > 0.15


def test_a_record_that_is_louder_than_the_others_passes(monkeypatch: pytest.MonkeyPatch) -> None:
    fits = [fitted(20, seed, loud=12.0) for seed in range(20)]
    assert min(map(chance, fits)) > UNLIKELY
    # The negative control: its error were that of the others.
    monkeypatch.setattr(agreement, "_loudness", lambda of: np.ones(len(of.columns)))
    assert min(map(chance, fits)) < UNLIKELY


def test_records_that_differ_by_more_than_their_errors_do_not() -> None:
    assert all(chance(fitted(5, seed, differ=1.0)) < UNLIKELY for seed in range(10))


def test_what_the_believed_error_holds_beyond_the_spectrum_counts() -> None:
    scores = fitted(5, 0, differ=1.0)
    bars = error_bars(PROBLEM, scores, RATE)
    larger = replace(bars, covariances={**bars.covariances, "windows": 25.0 * bars.covariance}, method="windows")
    found = agreement.records_agree(PROBLEM, np.zeros(scores.size), scores, larger, RATE)
    assert found is not None
    assert found.passed


def test_where_fewer_than_two_records_tell_a_value_nothing_is_said() -> None:
    scores = fitted(3, 0)
    silent = scores.slopes.copy()
    silent[1:, ..., :2] = 0.0
    assert check(scores) is not None
    assert check(replace(scores, slopes=silent)) is None
    assert check(fitted(1, 0)) is None


@pytest.mark.parametrize("lost", [np.nan, 1e200])
def test_a_record_whose_motion_ran_away_from_its_slopes_says_nothing_and_ends_nothing(lost: float) -> None:
    """A friction that is a small power of the speed has no slope where a weight comes to rest."""
    scores = fitted(5, 0)
    slopes = scores.slopes.copy()
    slopes[0, :, 300:, 1] = lost
    scores = replace(scores, slopes=slopes)
    with np.errstate(over="ignore", invalid="ignore"):
        assert scores.predicted_reduction(np.ones(scores.size, dtype=bool)) == np.inf
        check(scores)
    assert fitted(5, 0).predicted_reduction(np.ones(scores.size, dtype=bool)) < 1e-6
