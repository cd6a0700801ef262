"""The commands that compute: what they hand on, where they write, how they end. The computation itself is stubbed."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fibrefit.cli.terminal import Terminal
from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory
from fibrefit.study import Study
from fibrefit.study.summaries.results import FitSummary
from tests.cli.conftest import Run
from tests.study.test_summaries import FIT


class Fit:
    """A fit with a given outcome."""

    def __init__(self, status: str) -> None:
        self.status = status

    def summary(self) -> FitSummary:
        return FIT.model_copy(update={"status": self.status})

    def report(self) -> str:
        return "the report"

    def save(self, out: Path, *, force: bool = False, stop: Callable[[], bool]) -> None:
        assert not stop()
        with ResultDirectory(out, force=force) as directory:
            (directory.path / "summary.json").write_text("{}")


@pytest.fixture
def calls(monkeypatch: pytest.MonkeyPatch) -> list[tuple[Study, dict[str, Any]]]:
    """What the workflow was called with; the fit ends well."""
    made: list[tuple[Study, dict[str, Any]]] = []

    def fit_study(study: Study, **options: Any) -> Fit:
        made.append((study, options))
        return Fit("ok")

    monkeypatch.setattr("fibrefit.workflow.fit.fit_study", fit_study)
    return made


@pytest.fixture
def demo(fibrefit: Run, calls: list[Any]) -> Run:
    """The demonstration study in the folder ``demo``."""
    fibrefit("init", "demo")
    return fibrefit


def test_it_prints_the_report_and_says_where_it_wrote(demo: Run) -> None:
    done = demo("fit", "demo", "--out", "out")
    assert done.code == 0
    assert done.out == "the report\n"
    assert "Written to out: summary.json" in done.err
    assert Path("out/summary.json").exists()


def test_options_reach_the_workflow(demo: Run, calls: list[tuple[Study, dict[str, Any]]]) -> None:
    words = ("--seed", "7", "--starts", "3", "--robust", "--profile", "--set", "rig.weight_mass=2 kg")
    assert demo("fit", "demo", "--out", "out", *words).code == 0
    ((study, options),) = calls
    assert study.records[0].weight_mass == 2.0
    options.pop("progress")
    assert not options.pop("stop")()
    assert options == {"seed": 7, "starts": 3, "robust": True, "profile": True}


def test_json_is_one_document(demo: Run) -> None:
    done = demo("fit", "demo", "--out", "out", "--json")
    assert done.document["schema"] == "fibrefit/fit/1"
    assert "Written" in done.err


@pytest.mark.parametrize("json", [False, True])
def test_what_was_found_is_saved_though_nobody_reads_the_answer(
    demo: Run, monkeypatch: pytest.MonkeyPatch, json: bool
) -> None:
    def gone(*_: Any) -> None:
        raise UsageError("the answer", "cannot be written to stdout", "room for it")

    monkeypatch.setattr(Terminal, "answer", gone)
    assert demo("fit", "demo", "--out", "out", *(["--json"] if json else [])).code == 2
    assert Path("out/summary.json").exists()


def test_a_program_is_answered_once_when_all_is_done(demo: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def full(*_: Any, **__: Any) -> None:
        raise UsageError("out", "no space left on device", "room for it")

    monkeypatch.setattr(Fit, "save", full)
    done = demo("fit", "demo", "--out", "out", "--json")
    assert done.code == 2
    assert done.document["error"]


def test_quiet_says_nothing_beside_the_answer(demo: Run) -> None:
    assert demo("fit", "demo", "--out", "out", "-q").err == ""


def test_bare_records(demo: Run, calls: list[tuple[Study, dict[str, Any]]]) -> None:
    words = ("--rig", "fibre_mass", "--set", "rig.weight_mass=3 kg", "--set", "rig.inclination=90 deg")
    assert demo("fit", "demo/drop_10mm_90deg.csv", *words, "--out", "out").code == 0
    assert calls[0][0].records[0].label == "drop_10mm_90deg.csv"


def test_the_default_folder_depends_on_what_is_computed(demo: Run) -> None:
    assert demo("fit", "demo").code == 0
    again = demo("fit", "demo")
    assert again.code == 2
    assert "exists already" in again.err
    assert demo("fit", "demo", "--seed", "1").code == 0
    assert demo("fit", "demo", "--set", "rig.weight_mass=2 kg").code == 0
    assert len(list(Path("results").glob("demonstration_drop-*"))) == 3


def test_an_existing_folder_is_refused_before_any_work(demo: Run, calls: list[Any]) -> None:
    Path("out").mkdir()
    done = demo("fit", "demo", "--out", "out")
    assert done.code == 2
    assert not calls
    assert demo("fit", "demo", "--out", "out", "--force").code == 0


@pytest.mark.parametrize(("status", "code"), [("ok", 0), ("suspect", 0), ("failed", 5)])
def test_the_exit_code_tells_a_failed_result(
    demo: Run, monkeypatch: pytest.MonkeyPatch, status: str, code: int
) -> None:
    monkeypatch.setattr("fibrefit.workflow.fit.fit_study", lambda *args, **options: Fit(status))
    assert demo("fit", "demo", "--out", "out").code == code
    assert Path("out/summary.json").exists()


def test_an_interruption_leaves_nothing_half_done(demo: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    def interrupted(*args: Any, **options: Any) -> Fit:
        raise KeyboardInterrupt

    monkeypatch.setattr("fibrefit.workflow.fit.fit_study", interrupted)
    done = demo("fit", "demo", "--out", "out")
    assert done.code == 130
    assert not Path("out").exists()


def test_simulate_names_its_files(demo: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    class Simulation:
        def save(self, out: Path, *, force: bool = False) -> None:
            with ResultDirectory(out, force=force) as directory:
                (directory.path / "simulated").mkdir()
                (directory.path / "simulated" / "a.csv").write_text("")

    monkeypatch.setattr("fibrefit.workflow.simulate.simulate_study", lambda study: Simulation())
    done = demo("simulate", "demo", "--out", "out", "--json")
    assert done.code == 0
    assert done.document["files"] == ["simulated/a.csv"]
    assert "  simulated/a.csv" in demo("simulate", "demo", "--out", "other").out


@pytest.mark.parametrize("seed", [str(2**63), "9" * 30])
def test_a_seed_that_no_file_holds_is_refused_before_the_work(
    fibrefit: Run, calls: list[Any], demo: Any, seed: str
) -> None:
    done = fibrefit("fit", "study", "--seed", seed)
    assert done.code == 2
    assert "'--seed'" in done.err
    assert not calls
