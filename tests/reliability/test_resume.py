"""A run goes on from its own only: the same study, data, settings and layout, else it says what differs."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import sha256_of
from fibrefit.discovery.engine.journal import Journal
from fibrefit.store import ResultDirectory, Run
from fibrefit.store.manifest import MARKER
from fibrefit.store.summary import provenance
from fibrefit.study import load_study
from fibrefit.workflow.discovery.discover import SearchOptions
from fibrefit.workflow.discovery.journal import forgotten, journal_folder
from fibrefit.workflow.growing import growing_folder
from fibrefit.workflow.prepare import read_records
from fibrefit.workflow.sampling import sample
from fibrefit.workflow.sampling.start import CHAINS
from tests.cli.conftest import Run as Words
from tests.reliability.studies import copied


@pytest.fixture
def cut_short(fibrefit: Words, monkeypatch: pytest.MonkeyPatch) -> Callable[..., Any]:
    """A sampling of the demonstration study that was interrupted, and the way to go on with it."""

    def sample_study(study: Any, **options: Any) -> None:
        (options["folder"] / CHAINS).write_text("chains")
        raise KeyboardInterrupt

    monkeypatch.setattr(sample, "sample_study", sample_study)
    fibrefit("init", "study")
    assert fibrefit("sample", "study", "--out", "out").code == 130
    return lambda *words: fibrefit("sample", "study", "--out", "out", "--resume", *words)


def test_the_same_run_goes_on(cut_short: Callable[..., Any]) -> None:
    with Path("study/study.toml").open("a") as file:
        file.write("# a comment changes nothing\n")
    assert cut_short().code == 130
    assert cut_short("--max-steps", "9").code == 130, "a budget may change"


@pytest.mark.parametrize(
    ("change", "words", "says"),
    [
        ("data", (), r'holds a run with another data "drop_10mm_90deg.csv": it has changed'),
        ("study", (), "holds a run with another study: it has changed"),
        ("", ("--set", "rig.weight_mass=2 kg"), "holds a run with another study: it has changed"),
        ("", ("--seed", "3"), "holds a run with other settings"),
        ("layout", (), "was begun by another version of the program"),
        ("command", (), "holds a run of batch, not of sample"),
    ],
)
def test_another_run_is_refused(cut_short: Callable[..., Any], change: str, words: tuple[str, ...], says: str) -> None:
    marker = Path("out.partial", MARKER)
    content = json.loads(marker.read_text())
    if change == "data":
        record = Path("study/drop_10mm_90deg.csv")
        record.write_text(record.read_text().replace("0.01", "0.02", 1))
    elif change == "study":
        file = Path("study/study.toml")
        file.write_text(file.read_text("utf-8") + '[parameters.stiffness]\ninitial = "20 kN/m"\n', "utf-8")
    elif change == "layout":
        marker.write_text(json.dumps(content | {"layout": 0}))
    elif change == "command":
        marker.write_text(json.dumps(content | {"run": content["run"] | {"command": "batch"}}))
    done = cut_short(*words)
    assert done.code == 2
    assert says in done.err
    assert "Start anew, with --force" in done.err
    assert Path("out.partial", CHAINS).read_text() == "chains"


def test_a_finished_run_is_gone_on_with_only_by_its_own(tmp_path: Path) -> None:
    one, other = (Run((), {"command": "sample", "study": name}) for name in ("one", "other"))
    with growing_folder(tmp_path / "out", ("items",), run=one) as directory:
        (directory.path / "items").mkdir()
        (directory.path / "items" / "a.json").write_text("{}")
    with (
        pytest.raises(UsageError, match="another study"),
        growing_folder(tmp_path / "out", ("items",), resume=True, run=other),
    ):
        pass
    with growing_folder(tmp_path / "out", ("items",), resume=True, run=one) as directory:
        assert (directory.path / "items" / "a.json").exists()


def test_a_run_killed_with_something_to_go_on_from_is_not_begun_anew_by_accident(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt), ResultDirectory(tmp_path / "out", keep=True) as directory:
        (directory.path / "chains.npz").write_text("")
        raise KeyboardInterrupt
    with pytest.raises(UsageError, match="holds a run that was cut short.*--resume.*--force"):
        ResultDirectory(tmp_path / "out").check()
    ResultDirectory(tmp_path / "out", force=True).check()


def test_force_forgets_a_search_that_was_cut_short(tmp_path: Path) -> None:
    study = load_study(copied("drop_series", tmp_path, records=1))
    with (
        pytest.raises(KeyboardInterrupt),
        journal_folder(tmp_path / "out", study, SearchOptions()) as (_, folder),
    ):
        Journal(folder).recall("a", lambda: 1.0)
        raise KeyboardInterrupt
    assert list((tmp_path / "out.partial").rglob("a.job"))
    with journal_folder(tmp_path / "out", study, SearchOptions(), force=True) as (_, folder):
        assert not list(folder.iterdir())


def test_a_search_whose_time_ended_goes_on_from_what_it_found(tmp_path: Path) -> None:
    """With more time it is the same search."""
    study, out = load_study(copied("drop_series", tmp_path, records=1)), tmp_path / "out"
    with journal_folder(out, study, SearchOptions(seconds=1.0)) as (_, folder):
        Journal(folder).recall("a", lambda: 1.0)
    with journal_folder(out, study, SearchOptions(seconds=600.0), resume=True) as (_, folder):
        assert Journal(folder).recall("a", lambda: 2.0) == 1.0
        forgotten(folder)
    assert not list(out.rglob("*.job"))


def test_a_search_does_not_go_on_with_another_law_in_a_file_of_the_user(tmp_path: Path) -> None:
    """What it has found so far is that of the law as it was."""
    study = load_study(copied("drop_series", tmp_path, records=1))
    law, options = tmp_path / "mine.py", SearchOptions(also=(f"{tmp_path / 'mine.py'}:Mine",))
    law.write_text("# as it was")
    with (
        pytest.raises(KeyboardInterrupt),
        journal_folder(tmp_path / "out", study, options) as (_, folder),
    ):
        Journal(folder).recall("a", lambda: 1.0)
        raise KeyboardInterrupt
    law.write_text("# mended")
    with (
        pytest.raises(UsageError, match=r"mine\.py.*expected the same study, data and settings"),
        journal_folder(tmp_path / "out", study, options, resume=True),
    ):
        pass
    law.write_text("# as it was")
    with journal_folder(tmp_path / "out", study, options, resume=True) as (_, folder):
        assert [path.stem for path in folder.glob("*.job")] == ["a"]


@pytest.mark.parametrize("after", ["changed", "removed"])
def test_a_result_tells_the_data_as_they_were_read(tmp_path: Path, after: str) -> None:
    """A run may take hours: what becomes of its files in the meantime costs no result, and it names no others."""
    folder = copied("drop_series", tmp_path, records=1)
    study = load_study(folder)
    (file,) = study.data_files()
    digests = {path.as_posix(): sha256_of(path) for path in study.input_files()}
    read_records(study.model_copy(update={"name": "another"}))
    assert study == load_study(folder), "digests tell no studies apart"
    for path in (file, folder / "study.toml"):
        path.write_text("changed") if after == "changed" else path.unlink()
    assert provenance(study, [folder / "study.toml", file]).inputs == digests


def test_a_file_that_was_never_read_and_is_gone_costs_no_result(tmp_path: Path) -> None:
    assert provenance("studies", [tmp_path / "gone.csv"]).inputs == {f"{tmp_path.as_posix()}/gone.csv": "gone"}
