"""A result is saved where it takes nothing away that it rests on."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from types import SimpleNamespace

import pytest

from fibrefit.core.errors import UsageError
from fibrefit.plots.figures import Figures
from fibrefit.store import ResultDirectory
from fibrefit.study import Study, load_study
from fibrefit.workflow.discovery.discover import Discovery, SearchOptions
from fibrefit.workflow.saved import FoundResult
from tests.fitting import made


@dataclass(frozen=True, repr=False)
class OnPaper(FoundResult):
    """A result of which only the study is there."""

    study: Study

    def plot(self) -> Figures:
        """None."""
        return Figures()

    def summary(self) -> SimpleNamespace:
        """Nothing."""
        return SimpleNamespace()

    def write_data(self, directory: ResultDirectory) -> None:
        """One file."""
        (directory.path / "summary.json").write_text("{}", encoding="utf-8")


def test_a_result_does_not_take_the_place_of_what_it_rests_on(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with ResultDirectory(out) as directory:
        made.study(directory.path)
    before = sorted(path.name for path in out.iterdir())
    result = OnPaper(load_study(out))
    with pytest.raises(UsageError, match=r"holds .*study.toml, which is read"):
        result.save(out, force=True)
    assert sorted(path.name for path in out.iterdir()) == before
    assert result.save(tmp_path / "other") == tmp_path / "other"


def test_a_search_rests_on_the_laws_that_it_tried(tmp_path: Path) -> None:
    study = made.study(tmp_path)
    tried = SearchOptions(also=("my.py:Mine",))
    found = Discovery(study, (), None, {}, tried)  # type: ignore[arg-type]
    assert set(found.inputs()) == {*study.input_files(), tmp_path / "my.py"}
