"""A result's folder appears whole, and nothing that is not ours is ever lost."""

from __future__ import annotations

import errno
import json
import socket
from pathlib import Path

import pytest

from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory, default_directory
from fibrefit.store.directory import Run
from fibrefit.store.manifest import MARKER
from fibrefit.study import load_study
from tests.reliability.studies import copied


def make(out: Path, text: str = "one", **options: bool) -> None:
    with ResultDirectory(out, **options) as result:
        (result.path / "figures").mkdir(exist_ok=True)
        (result.path / "summary.json").write_text(text)
        (result.path / "figures" / "a.png").write_text(text)


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_it_appears_at_the_end(tmp_path: Path) -> None:
    out = tmp_path / "deep" / "out"
    with ResultDirectory(out) as result:
        (result.path / "summary.json").write_text("one")
        assert not out.exists()
    assert names(out) == {"summary.json", MARKER}
    assert names(out.parent) == {"out"}


def test_an_existing_folder_is_refused(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    with pytest.raises(UsageError, match="exists already.*--force"):
        make(out, "two")
    assert (out / "summary.json").read_text() == "one"


def test_force_replaces_all_of_an_earlier_result(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    with ResultDirectory(out, force=True) as result:
        (result.path / "result.h5").write_text("two")
    assert names(out) == {"result.h5", MARKER}
    assert names(tmp_path) == {"out"}


def test_force_takes_an_empty_folder(tmp_path: Path) -> None:
    (tmp_path / "out").mkdir()
    make(tmp_path / "out", force=True)
    assert (tmp_path / "out" / "summary.json").exists()


@pytest.mark.parametrize("inside_a_result", [False, True])
def test_force_never_removes_what_is_not_ours(tmp_path: Path, inside_a_result: bool) -> None:
    out = tmp_path / "out"
    if inside_a_result:
        make(out)
    out.mkdir(exist_ok=True)
    (out / "notes.txt").write_text("mine")
    with pytest.raises(UsageError, match=r'holds "notes.txt", which is not part of a result'):
        make(out, force=True)
    assert (out / "notes.txt").read_text() == "mine"


def test_force_never_replaces_a_file(tmp_path: Path) -> None:
    (tmp_path / "out").write_text("mine")
    with pytest.raises(UsageError, match="is a file"):
        make(tmp_path / "out", force=True)


def test_a_failure_leaves_nothing_and_spoils_nothing(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    with pytest.raises(ZeroDivisionError), ResultDirectory(out, force=True) as result:
        (result.path / "summary.json").write_text("half")
        raise ZeroDivisionError
    assert (out / "summary.json").read_text() == "one"
    assert names(tmp_path) == {"out"}


def test_an_interruption_keeps_what_was_written(tmp_path: Path) -> None:
    out = tmp_path / "out"
    result = ResultDirectory(out)
    with pytest.raises(KeyboardInterrupt), result:
        (result.path / "chain.h5").write_text("half")
        raise KeyboardInterrupt
    assert result.kept == tmp_path / "out.partial"
    assert not out.exists()
    with ResultDirectory(out, resume=True) as again:
        assert again.previous is not None
        assert (again.previous / "chain.h5").read_text() == "half"
        (again.path / "chain.h5").write_text("whole")
    assert (out / "chain.h5").read_text() == "whole"
    assert names(tmp_path) == {"out"}


def test_an_interruption_before_anything_was_written_leaves_nothing(tmp_path: Path) -> None:
    result = ResultDirectory(tmp_path / "out")
    with pytest.raises(KeyboardInterrupt), result:
        raise KeyboardInterrupt
    assert result.kept is None
    assert not names(tmp_path)


def test_a_finished_result_can_be_gone_on_with(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    with ResultDirectory(out, resume=True) as result:
        assert result.previous == out
        (result.path / "summary.json").write_text((result.previous / "summary.json").read_text() + " two")
    assert (out / "summary.json").read_text() == "one two"


def test_without_resume_an_interrupted_run_is_begun_anew(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt), ResultDirectory(out) as result:
        (result.path / "chain.h5").write_text("half")
        raise KeyboardInterrupt
    with ResultDirectory(out) as result:
        assert result.previous is None
        assert names(result.path) == {MARKER}


def test_a_failed_run_can_be_kept_for_resuming(tmp_path: Path) -> None:
    result = ResultDirectory(tmp_path / "out", keep=True)
    with pytest.raises(ZeroDivisionError), result:
        (result.path / "chain.h5").write_text("half")
        raise ZeroDivisionError
    assert result.kept is not None


def test_what_stands_where_we_would_write_is_left_alone(tmp_path: Path) -> None:
    (tmp_path / "out.partial").mkdir()
    (tmp_path / "out.partial" / "mine").write_text("mine")
    with pytest.raises(UsageError, match="is in the way"):
        make(tmp_path / "out")
    assert (tmp_path / "out.partial" / "mine").exists()


def test_a_marker_that_names_a_living_process_means_nothing(tmp_path: Path) -> None:
    """Numbers of processes are given again: only the lock tells whether somebody writes."""
    (tmp_path / "out.partial").mkdir()
    marker = {"pid": 1, "host": socket.gethostname()}
    (tmp_path / "out.partial" / MARKER).write_text(json.dumps(marker))
    make(tmp_path / "out")
    assert names(tmp_path) == {"out"}


def test_a_folder_that_cannot_be_made(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(UsageError, match="a folder to write to"):
        make(tmp_path / "file" / "out")


def test_the_default_folder_tells_runs_apart() -> None:
    one = default_directory("Drop series, 45°", "study", "digest")
    assert one.parent == Path("results")
    assert one.name.startswith("drop_series_45-")
    assert one == default_directory("Drop series, 45°", "study", "digest")
    assert one != default_directory("Drop series, 45°", "study", "other digest")
    assert default_directory("../..", "x").name.startswith("study-")


def test_a_run_is_the_same_by_whatever_path_its_study_is_called(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    folder = copied("drop_series", tmp_path, records=1)
    monkeypatch.chdir(tmp_path)
    ways = (Path(folder.name) / "study.toml", folder / "study.toml")
    near, far = (Run.of("sample", load_study(path)).parts for path in ways)
    assert near == far
    (data,) = (name for name in near if name.startswith("data "))
    record = folder / data.split('"')[1]
    record.write_text(record.read_text() + "\n")
    assert Run.of("sample", load_study(ways[0])).parts[data] != near[data]


def test_a_lock_that_only_its_handle_may_write_to_says_nothing_and_holds(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As Windows has it: what is locked cannot be written to by name."""
    written = Path.write_text

    def write_text(path: Path, *content: str, **how: str) -> int:
        if path.suffix == ".lock":
            raise PermissionError(13, "Permission denied", str(path))
        return written(path, *content, **how)

    monkeypatch.setattr(Path, "write_text", write_text)
    make(tmp_path / "out")
    assert names(tmp_path / "out") >= {"summary.json", MARKER}
    assert names(tmp_path) == {"out"}


def test_a_folder_of_somebody_else_is_told_as_such_before_force_is_advised(tmp_path: Path) -> None:
    """With --force it would be refused all the same."""
    (tmp_path / "notes.txt").write_text("mine")
    (tmp_path / "own").mkdir()
    (tmp_path / "own" / "notes.txt").write_text("mine")
    for out, says in (("notes.txt", "is a file; expected a folder"), ("own", 'holds "notes.txt", which is not part')):
        with pytest.raises(UsageError, match=says):
            ResultDirectory(tmp_path / out).check()


def test_what_cannot_be_read_elsewhere_is_not_said_of_the_result(tmp_path: Path) -> None:
    elsewhere = PermissionError(errno.EACCES, "Permission denied", str(tmp_path / "laws" / "x.py"))
    with pytest.raises(PermissionError), ResultDirectory(tmp_path / "out"):
        raise elsewhere
    with (
        pytest.raises(UsageError, match="out: cannot be written: Permission denied"),
        ResultDirectory(tmp_path / "out") as own,
    ):
        raise PermissionError(errno.EACCES, "Permission denied", str(own.path / "summary.json"))


def test_an_interruption_of_what_cannot_be_gone_on_with_is_not_said_to_be(tmp_path: Path) -> None:
    for keep, says in ((True, "--resume goes on from there."), (False, "until the same is asked for again.")):
        with (
            pytest.raises(KeyboardInterrupt) as interrupted,
            ResultDirectory(tmp_path / f"{keep}", keep=keep) as result,
        ):
            (result.path / "summary.json").write_text("half")
            raise KeyboardInterrupt
        assert interrupted.value.__notes__[0].endswith(says)
