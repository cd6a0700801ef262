"""``fibrefit batch``: what it hands on, where it writes, how it ends."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from fibrefit.core.errors import DataError
from fibrefit.workflow.batches import batch
from fibrefit.workflow.batches.item import Job, Outcome, outcome_of
from tests.cli.conftest import Run
from tests.study.test_summaries import FIT


@pytest.fixture
def done(monkeypatch: pytest.MonkeyPatch) -> list[Job]:
    """Jobs that were carried out; none is possible while a file named "stop" is there."""
    made: list[Job] = []

    def identified(job: Job) -> Outcome:
        made.append(job)
        if Path("stop").exists():
            raise DataError(job.name, "nothing", "something", "")
        return outcome_of(job, FIT, job.digest())

    monkeypatch.setattr(batch, "identified", identified)
    return made


@pytest.fixture
def demo(fibrefit: Run, done: list[Any]) -> Run:
    fibrefit("init", "demo")
    return fibrefit


def test_it_prints_the_report_and_says_where_it_wrote(demo: Run) -> None:
    found = demo("batch", "demo", "--jobs", "1", "--out", "out")
    assert found.code == 0
    assert "1 identification: 1 ok." in found.out
    assert "Written to out" in found.err
    assert {path.name for path in Path("out").iterdir()} == {
        ".fibrefit",
        "summary.json",
        "results.csv",
        "table.csv",
        "table.parquet",
        "items",
        "figures",
    }
    again = demo("show", "out")
    assert again.out == found.out


def test_options_reach_the_jobs(demo: Run, done: list[Job]) -> None:
    demo("batch", "demo", "--starts", "7", "--seed", "3", "--robust", "--set", 'rig.weight_mass="2 kg"', "--out", "o")
    (job,) = done
    assert (job.starts, job.seed, job.robust, job.study.rig.weight_mass) == (7, 3, True, 2.0)


def test_json_is_the_summary(demo: Run) -> None:
    assert demo("batch", "demo", "--json", "--out", "out").document["schema"] == "fibrefit/batch/1"


def test_nothing_usable_exits_with_5_and_can_be_gone_on_with(demo: Run, done: list[Job]) -> None:
    Path("stop").touch()
    found = demo("batch", "demo", "--out", "out")
    assert found.code == 5
    assert "demo: nothing" in found.out or "nothing; expected something" in found.out
    Path("stop").unlink()
    assert demo("batch", "demo", "--out", "out").code == 2
    assert demo("batch", "demo", "--out", "out", "--resume").code == 0
    assert "1 of 1 had been done before" in demo("batch", "demo", "--out", "out", "--resume").err
    assert len(done) == 2


def test_mistakes_are_told(demo: Run) -> None:
    assert demo("batch", "nothing.toml").code == 4
    Path("record.csv").write_text("t [s],force [N]\n")
    assert "Add --rig" in demo("batch", "record.csv").err
    assert demo("batch").code == 2


def test_a_file_that_is_not_there_is_told_as_such(fibrefit: Run) -> None:
    found = fibrefit("batch", "nothing.csv")
    assert found.code == 2
    assert "nothing.csv: no such file or folder" in found.err
    assert "--rig" not in found.err
