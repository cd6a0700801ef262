"""``fibrefit plan``: which aim its options make. The plan itself is stubbed."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

import fibrefit.workflow.design.plan as workflow
from fibrefit.store import ResultDirectory, write_summary
from fibrefit.study import Study
from fibrefit.workflow.design.plan import Aim
from tests.cli.conftest import Run
from tests.study.test_summaries import EXAMPLES


class Planned:
    """A plan with a given outcome."""

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
