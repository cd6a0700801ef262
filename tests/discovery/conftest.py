"""The short drops, and what a search of them would end with."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fibrefit.problem.task import Task
from fibrefit.study import Study, load_study
from fibrefit.workflow.discovery.candidates import candidates_of
from fibrefit.workflow.discovery.discover import Discovery, SearchOptions
from fibrefit.workflow.prepare import read_records, task_of
from tests.discovery.made import FINDINGS

DATA = Path(__file__).resolve().parent.parent / "data" / "discover"


@pytest.fixture(scope="session")
def study() -> Study:
    """Two drops in which a viscous friction is hidden."""
    return load_study(DATA / "viscous")


@pytest.fixture(scope="session")
def task(study: Study) -> Task:
    return task_of(study)


@pytest.fixture(scope="session")
def discovery(study: Study, task: Task) -> Callable[..., Discovery]:
    """A discovery with a given verdict."""

    def make(verdict: str = "named", options: SearchOptions | None = None) -> Discovery:
        options = options or SearchOptions()
        tried = candidates_of(study, options.only, options.exclude, options.also)
        return Discovery(study, read_records(study), FINDINGS[verdict](task), tried, options)

    return make


@pytest.fixture
def elsewhere(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty folder to work in."""
    monkeypatch.chdir(tmp_path)
    return Path(os.curdir)
