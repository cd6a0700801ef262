"""``fibrefit batch``: what it hands on, where it writes, how it ends."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from fibrefit.core.errors import DataError
from fibrefit.workflow.batches import batch, run
from fibrefit.workflow.batches.item import Job, Outcome, outcome_of
from tests.cli.conftest import Run
from tests.study.test_summaries import EXAMPLES, FIT


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


@pytest.mark.parametrize(
    ("words", "handed_on"),
    [
        ((), {"each": None, "scheduler": None, "shard": None, "processes": None, "resume": False}),
        (("--each", "study"), {"each": "study"}),
        (("--scheduler", "tcp://node7:8786"), {"scheduler": "tcp://node7:8786"}),
        (("--shard", "3/20", "--resume"), {"shard": (3, 20), "resume": True}),
        (("--jobs", "4", "--force"), {"processes": 4, "force": True}),
    ],
)
def test_options_reach_the_batch(
    demo: Run, monkeypatch: pytest.MonkeyPatch, words: tuple[str, ...], handed_on: dict[str, Any]
) -> None:
    calls = []

    def stub(series: tuple[str, ...], out: Path | None, **options: Any) -> Any:
        calls.append((series, out, options))
        told = {"report": lambda: "many", "summary": lambda: EXAMPLES["fibrefit/batch/1"]}
        return SimpleNamespace(**told, status="ok", taken_up=0, jobs=(), folder=None)

    monkeypatch.setattr(run, "batch", stub)
    found = demo("batch", "demo", "--out", "out", *words)
    assert (found.code, found.out) == (0, "many\n")
    ((series, out, options),) = calls
    assert (series, out) == (("demo",), Path("out"))
    assert {name: options[name] for name in handed_on} == handed_on


@pytest.mark.parametrize(
    ("words", "says"),
    [
        (("--shard", "5/3"), "--shard 5/3: not a part of a whole; expected i/n with i from 1 to n."),
        (("--shard", "9/9999"), "--shard 9/9999: 1 record; expected as many parts at the most."),
        (
            ("--jobs", "2", "--scheduler", "tcp://a:1"),
            "--jobs 2: --scheduler tcp://a:1 beside it; expected one of both",
        ),
        (("--rig", "pendulum"), "--rig: pendulum; expected bare records. Override the study with --set rig.kind"),
        (("--each", "year"), "'year' is not one of 'record', 'study'"),
    ],
)
def test_what_no_batch_can_do_is_refused_before_anything_is_done(
    demo: Run, done: list[Job], words: tuple[str, ...], says: str
) -> None:
    found = demo("batch", "demo", "--out", "out", *words)
    assert found.code == 2
    assert says in found.err
    assert not done
    assert not list(Path().glob("out*"))


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
