"""A force that does not read zero while the fibre is slack is told, with its zero; noise and drift are none."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from fibrefit.fitting.checks import check as judge
from fibrefit.fitting.misstatements import SlackZero, slack_zeros
from fibrefit.fitting.result import Advice, Found
from fibrefit.laws.sensor.calibration import ForceOffset
from fibrefit.report.sentences.fit import advice_sentence, fit_sentence
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.fitting import made

CONFIGS = Path(__file__).resolve().parents[2] / "configs"


def zeros_of(folder: Path, offset: float, share: float = 0.5, seed: int = 0, drift: float = 0.0) -> Found | None:
    ones = [
        made.replace(one, force=one.channels["force"] + offset + drift * (one.time - one.time[0]))
        for one in made.records(share=share, seed=seed)
    ]
    return slack_zeros(made.task(folder, ones))


@pytest.mark.parametrize("offset", [7.3, 1.5, -7.3])
def test_a_zero_that_was_left_in_is_told_for_each_record(tmp_path: Path, offset: float) -> None:
    found = zeros_of(tmp_path, offset)
    assert found is not None
    assert len(found.facts["zeros"]) == 2
    for one in found.facts["zeros"]:
        assert one.zero == pytest.approx(offset, abs=0.15)
        assert 0.0 < one.error < 0.1
    assert found.statistic is not None
    assert found.statistic > found.instead["threshold"]


@pytest.mark.parametrize("seed", range(12))
def test_noise_and_drift_are_no_zero(tmp_path: Path, seed: int) -> None:
    """The negative control: slow noise, a drift over the record, and a zero within the noise."""
    assert zeros_of(tmp_path, 0.0, share=0.9, seed=seed) is None
    assert zeros_of(tmp_path, 0.0, seed=seed, drift=0.3) is None
    assert zeros_of(tmp_path, 0.1, seed=seed) is None


@pytest.mark.parametrize("name", ["drop_series", "second_fibre"])
def test_the_records_that_are_shipped_read_zero(name: str) -> None:
    assert slack_zeros(task_of(load_study(CONFIGS / name))) is None


def test_a_model_that_finds_the_zero_is_not_asked(tmp_path: Path) -> None:
    ones = [made.replace(one, force=one.channels["force"] + 7.3) for one in made.records()]
    assert slack_zeros(made.task(tmp_path, ones, effects=(ForceOffset,))) is None


def test_no_zero_is_told_where_the_hold_is_masked(tmp_path: Path) -> None:
    ones = [
        made.replace(one, force=np.where(one.time < 0.1, np.nan, one.channels["force"] + 7.3)) for one in made.records()
    ]
    assert slack_zeros(made.task(tmp_path, ones)) is None


def test_what_to_state_is_said() -> None:
    one = SlackZero("a.csv", 7.3, 0.02)
    check = judge("slack_zero", Found(7.2, {"zeros": (one,)}, False, {"threshold": 0.4}))
    assert not check.passed
    assert not check.fatal
    assert fit_sentence(check).startswith(
        "The force reads 7.3 N +/- 0.02 N before release, where the fibre is slack; chance allowed for, at most 0.4 N"
    )
    assert "zero = 7.3 where they are newtons" in advice_sentence(Advice("slack_zero", check.facts))
    more = judge("slack_zero", Found(7.2, {"zeros": (one,) * 5}, False, {"threshold": 0.4}))
    assert "7.3 N +/- 0.02 N in a.csv and so on in 2 more before release" in fit_sentence(more)
