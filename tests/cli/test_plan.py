"""``fibrefit plan``: which aim its options make. The plan itself is stubbed."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

import fibrefit.workflow.design.distinguish as distinguish
import fibrefit.workflow.design.plan as workflow
from fibrefit.store import ResultDirectory, write_summary
from fibrefit.study import Study
from fibrefit.study.summaries.check import Check
from fibrefit.workflow.design.doubts import doubts_of_fit
from fibrefit.workflow.design.plan import Aim
from tests.cli.conftest import Run
from tests.study.test_summaries import EXAMPLES


class Planned:
    """A plan with a given outcome."""

    status: str = "ok"

    def summary(self) -> Any:
        return EXAMPLES["fibrefit/plan/1"]

    def report(self) -> str:
        return "The next record"

    def save(self, folder: Path, *, force: bool) -> None:
        with ResultDirectory(folder, force=force) as directory:
            write_summary(directory.path, self.summary())


@pytest.fixture
def aims(monkeypatch: pytest.MonkeyPatch) -> list[Aim]:
    """What plans were made for."""
    made: list[Aim] = []

    def plan_study(study: Study, aim: Aim, *, progress: Any) -> Planned:
        made.append(aim)
        return Planned()

    monkeypatch.setattr(workflow, "plan_study", plan_study)
    return made


@pytest.fixture
def demo(fibrefit: Run) -> Run:
    fibrefit("init", "demo")
    return fibrefit


@pytest.mark.parametrize(
    ("words", "aim"),
    [
        ((), Aim()),
        (("--for", "power"), Aim("power")),
        (("--rivals", "fibre.mass, guide.quadratic_drag"), Aim(rivals=("fibre.mass", "guide.quadratic_drag"))),
        (("--cost", "lift=1.5", "--cost", " record =3"), Aim(minutes={"lift": 1.5, "record": 3.0})),
        (("--only", "guide.*", "--only", "fibre.mass"), Aim(only=("guide.*", "fibre.mass"))),
        (("--exclude", "guide.*"), Aim(exclude=("guide.*",))),
    ],
)
def test_options_reach_the_plan(demo: Run, aims: list[Aim], words: tuple[str, ...], aim: Aim) -> None:
    done = demo("plan", "demo", "--out", "out", *words)
    assert done.code == 0, done.err
    assert aims == [aim]
    assert done.out == "The next record\n"
    assert "Written to out: summary.json" in done.err


def test_a_cost_that_is_stated_twice_is_refused(demo: Run, aims: list[Aim]) -> None:
    done = demo("plan", "demo", "--out", "out", "--cost", "lift=1", "--cost", "lift=2")
    assert done.code == 2
    assert 'error: --cost "lift=2": the cost of lift for the second time; expected each once.' in done.err
    assert not aims


@pytest.mark.parametrize("cost", ["lift=soon", "lift=", "lift"])
def test_a_cost_without_a_number_is_refused(demo: Run, aims: list[Aim], cost: str) -> None:
    done = demo("plan", "demo", "--out", "out", "--cost", cost)
    assert done.code == 2
    assert done.err == f'error: --cost "{cost}": no number of minutes; expected for example inclination=15.\n'
    assert (aims, Path("out").exists()) == ([], False)


def test_a_purpose_that_nobody_knows_is_refused(demo: Run, aims: list[Aim]) -> None:
    done = demo("plan", "demo", "--out", "out", "--for", "fun")
    assert done.code == 2
    assert "'fun' is not one of 'errors', 'rivals', 'power'" in done.err
    assert not aims


@pytest.mark.parametrize(("status", "code"), [("ok", 0), ("suspect", 0), ("failed", 5)])
@pytest.mark.parametrize(
    ("command", "module", "step"),
    [("plan", workflow, "plan_study"), ("distinguish", distinguish, "distinguish_study")],
)
def test_what_rests_on_a_failed_fit_is_written_and_not_to_be_used(
    demo: Run, monkeypatch: pytest.MonkeyPatch, command: str, module: Any, step: str, status: str, code: int
) -> None:
    found = Planned()
    found.status = status
    monkeypatch.setattr(module, step, lambda *_, **__: found)
    done = demo(command, "demo", "--out", "out")
    assert done.code == code, done.err
    assert Path("out", "summary.json").exists()


def test_a_fit_that_failed_checks_is_remarked_on() -> None:
    passed, failed = (
        Check(name=name, passed=ok, identifier="size", quantity="") for name, ok in (("a", True), ("b", False))
    )
    fit: Any = SimpleNamespace(checks=(passed, failed), status="suspect")
    assert doubts_of_fit(fit) == (
        "The fit of the records at hand fails checks (b): what follows is no surer than that fit.",
    )
    assert doubts_of_fit(fit, ("size",)) == ()
    fit.checks = (failed,) * 5
    assert "fails checks (b, b, b and 2 more)" in doubts_of_fit(fit)[0]
    fit.status = "ok"
    assert doubts_of_fit(fit) == doubts_of_fit(None) == ()
