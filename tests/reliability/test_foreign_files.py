"""Files of others survive whatever we write, and where they come to stand in our way."""

from __future__ import annotations

import json
import os
from pathlib import Path

import pytest

from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory, Run, manifest


def make(out: Path, text: str = "one", **options: bool) -> None:
    with ResultDirectory(out, **options) as result:
        (result.path / "figures").mkdir(exist_ok=True)
        (result.path / "summary.json").write_text(text)
        (result.path / "figures" / "a.png").write_text(text)


def names(folder: Path) -> set[str]:
    return {path.relative_to(folder).as_posix() for path in folder.rglob("*")} - {".fibrefit"}


@pytest.fixture(params=["exchanged in one step", "renamed in two"])
def way(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> str:
    """Both ways in which a folder takes the place of another."""
    if request.param == "renamed in two":
        monkeypatch.setattr(manifest, "_rename", lambda *_: False)
    return str(request.param)


@pytest.mark.usefixtures("way")
@pytest.mark.parametrize("force", [False, True])
@pytest.mark.parametrize("content", [("thesis.tex",), ()])
def test_a_folder_that_appears_during_a_run_is_left_alone(
    tmp_path: Path, force: bool, content: tuple[str, ...]
) -> None:
    out = tmp_path / "out"
    with pytest.raises(UsageError, match=r"left alone.*complete in .*out-2"), ResultDirectory(out, force=force) as d:
        (d.path / "summary.json").write_text("{}")
        out.mkdir()
        for name in content:
            (out / name).write_text("x")
    assert names(out) == set(content)
    assert names(tmp_path / "out-2") == {"summary.json"}
    assert {path.name for path in tmp_path.iterdir()} == {"out", "out-2"}


@pytest.mark.usefixtures("way")
def test_files_that_come_into_an_earlier_result_are_carried_over(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    with ResultDirectory(out, force=True) as result:
        (result.path / "summary.json").write_text("two")
        (out / "notes.txt").write_text("mine")
        (out / "figures" / "mine.png").write_text("mine")
        (out / "empty").mkdir()
    assert (out / "summary.json").read_text() == "two"
    assert names(out) == {"summary.json", "notes.txt", "figures", "figures/mine.png", "empty"}
    assert (out / "figures" / "mine.png").read_text() == (out / "notes.txt").read_text() == "mine"
    assert {path.name for path in tmp_path.iterdir()} == {"out"}


def test_what_cannot_be_carried_over_is_left_beside(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    with ResultDirectory(out, force=True) as result:
        (result.path / "curves").mkdir()
        (result.path / "curves" / "a.csv").write_text("ours")
        (out / "curves").mkdir()
        (out / "curves" / "a.csv").write_text("mine")
    assert (out / "curves" / "a.csv").read_text() == "ours"
    assert (tmp_path / "out.left" / "curves" / "a.csv").read_text() == "mine"


def test_a_foreign_file_in_the_working_folder_stays(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(ZeroDivisionError), ResultDirectory(out) as result:
        (result.path / "thesis.tex").write_text("mine")
        (result.path / "summary.json").write_text("{}")
        raise ZeroDivisionError
    assert names(tmp_path / "out.partial") == {"thesis.tex"}
    with pytest.raises(UsageError, match=r'holds "thesis.tex", which is not part of a result'):
        make(out)
    assert (tmp_path / "out.partial" / "thesis.tex").exists()


def test_an_empty_folder_of_somebody_else_is_not_replaced(tmp_path: Path) -> None:
    make(tmp_path / "out")
    (tmp_path / "out" / "later").mkdir()
    with pytest.raises(UsageError, match='holds "later"'):
        make(tmp_path / "out", force=True)


@pytest.mark.usefixtures("way")
def test_a_link_stays_a_link(tmp_path: Path) -> None:
    (tmp_path / "big" / "res").mkdir(parents=True)
    link = tmp_path / "link"
    link.symlink_to(tmp_path / "big" / "res")
    make(link, force=True)
    make(link, "two", force=True)
    assert link.is_symlink()
    assert (tmp_path / "big" / "res" / "summary.json").read_text() == "two"
    assert {path.name for path in tmp_path.iterdir()} == {"big", "link"}
    assert {path.name for path in (tmp_path / "big").iterdir()} == {"res"}


def refused(out: Path, says: str, *, force: bool = True, run: Run | None = None) -> None:
    """Before the block begins, that is before anything is computed."""
    with pytest.raises(UsageError, match=says), ResultDirectory(out, force=force, run=run):
        raise AssertionError("the computation has begun")


def test_places_where_no_result_can_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "study").mkdir()
    (tmp_path / "study" / "records").mkdir()
    record = tmp_path / "study" / "records" / "a.csv"
    record.write_text("")
    monkeypatch.chdir(tmp_path / "study")
    (tmp_path / "dangling").symlink_to(tmp_path / "nowhere")
    refused(tmp_path / "dangling", "is a link to .*nowhere, which does not exist")
    refused(Path("/"), "holds the working folder")
    refused(Path("."), "is the working folder")
    refused(Path(".."), "holds the working folder")
    refused(Path(" "), "is nothing but blanks")
    refused(tmp_path / "\t\n", "is nothing but blanks")
    refused(Path("/proc"), "is the root of a file system")
    refused(tmp_path / "study" / "records", r"holds .*a\.csv, which is read", run=Run((record,)))
    refused(tmp_path / ("x" * 250), "File name too long")
    refused(tmp_path / "study" / "records" / "a.csv" / "out", "a folder to write to")
    assert record.exists()


@pytest.mark.skipif(os.name == "nt" or os.path.realpath("/dev/fd") == "/dev/fd", reason="asks for /proc")
def test_a_folder_that_cannot_be_written(tmp_path: Path) -> None:
    refused(Path("/proc/self/out"), "a folder to write to")


def test_a_kill_between_any_two_steps_leaves_the_old_result_or_the_new_one(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, way: str
) -> None:
    """Each removal and each renaming of the publication in turn is the last thing that happens."""

    class KilledError(BaseException):
        pass

    survived = []
    for last in range(40):
        place = tmp_path / f"{way[:4]}{last}"
        out = place / "out"
        make(out)
        done = 0

        def counted(step, done_at=last):  # type: ignore[no-untyped-def]
            def call(*args, **kwargs):  # type: ignore[no-untyped-def]
                nonlocal done
                if done >= done_at:
                    raise KilledError
                done += 1
                return step(*args, **kwargs)

            return call

        with monkeypatch.context() as patch:
            for name in ("rename", "unlink", "rmdir", "replace"):
                patch.setattr(os, name, counted(getattr(os, name)))
            patch.setattr(manifest, "_rename", counted(manifest._rename))
            try:
                make(out, "two", force=True)
            except KilledError:
                pass
            else:
                survived.append(last)
        for lock in place.glob(".*.lock"):
            lock.unlink()  # the lock of a process that was killed is free; only its file stays
        there = [folder for folder in (out, place / "out.replaced") if folder.exists()]
        assert out.exists() or way == "renamed in two", last
        assert there, last
        for folder in there[:1]:
            texts = {(folder / "summary.json").read_text(), (folder / "figures" / "a.png").read_text()}
            assert len(texts) == 1, (last, texts)
        make(out, "three", force=True)
        assert (out / "summary.json").read_text() == "three"
        assert {path.name for path in place.iterdir()} == {"out"}, last
        if survived:
            break
    assert survived, "no run came to its end: the test kills too early"
    assert survived[0] > 5


LISTED = ("../thesis.tex", "{folder}/thesis.tex", "link/a.csv", "../side/a.csv", "a\0b", "", 5, None)
"""What a marker may say that somebody else has written."""


@pytest.mark.usefixtures("way")
def test_a_marker_lists_nothing_outside_its_folder(tmp_path: Path) -> None:
    """A result that came from elsewhere, replaced with `--force`: what its marker names besides is not removed."""
    out, side = tmp_path / "out", tmp_path / "side"
    make(out)
    side.mkdir()
    (tmp_path / "empty").mkdir()
    for file in (tmp_path / "thesis.tex", side / "a.csv"):
        file.write_text("mine")
    (out / "link").symlink_to(side)
    marker = json.loads((out / ".fibrefit").read_text())
    marker["files"] += ["link", *(name.format(folder=tmp_path) if isinstance(name, str) else name for name in LISTED)]
    marker["folders"] += ["../empty", "../side", 7]
    (out / ".fibrefit").write_text(json.dumps(marker))
    make(out, "two", force=True)
    assert (out / "summary.json").read_text() == "two"
    assert (tmp_path / "thesis.tex").read_text() == (side / "a.csv").read_text() == "mine"
    assert (tmp_path / "empty").is_dir()


@pytest.mark.parametrize("content", ['{"files": 5}', '{"files": ["summary.json"], "run": 3, "layout": 1}', "[" * 9999])
def test_a_marker_of_another_form_is_none_of_ours(tmp_path: Path, content: str) -> None:
    out = tmp_path / "out"
    make(out)
    (out / ".fibrefit").write_text(content)
    with pytest.raises(UsageError, match="not part of a result"):
        make(out, force=True)
    assert (out / "summary.json").read_text() == "one"


def test_a_pipe_in_place_of_the_marker_is_not_waited_for(tmp_path: Path) -> None:
    out = tmp_path / "out"
    make(out)
    (out / ".fibrefit").unlink()
    os.mkfifo(out / ".fibrefit")
    with pytest.raises(UsageError, match="not part of a result"):
        make(out, force=True)


@pytest.mark.parametrize("kind", ["file", "link", "folder"])
def test_what_stands_in_the_place_of_the_lock_stays(tmp_path: Path, kind: str) -> None:
    lock, thesis = tmp_path / ".out.lock", tmp_path / "thesis.tex"
    thesis.write_text("mine")
    if kind == "file":
        lock.write_text("mine")
    elif kind == "link":
        lock.symlink_to(thesis)
    else:
        lock.mkdir()
    with pytest.raises(UsageError, match=r"\.out\.lock.*is in the way"):
        make(tmp_path / "out")
    assert os.path.lexists(lock)
    assert thesis.read_text() == "mine"
    assert kind != "file" or lock.read_text() == "mine"


@pytest.mark.parametrize("left", ["", "process ", "process 12 on here"])
def test_a_lock_that_a_killed_run_has_left_is_taken(tmp_path: Path, left: str) -> None:
    (tmp_path / ".out.lock").write_text(left)
    make(tmp_path / "out")
    assert {path.name for path in tmp_path.iterdir()} == {"out"}


@pytest.mark.parametrize("ending", ["partial", "replaced"])
def test_a_result_is_not_called_like_a_working_folder(tmp_path: Path, ending: str) -> None:
    """The next run into `out` would take it for what a killed run has left, and move or remove it."""
    with pytest.raises(UsageError, match="as working folders do"):
        make(tmp_path / f"out.{ending}")
    old = tmp_path / "old"
    make(old)
    (tmp_path / f"out.{ending}").symlink_to(old)
    if ending == "partial":
        with pytest.raises(UsageError, match="is in the way"):
            make(tmp_path / "out")
    else:
        make(tmp_path / "out")
    assert (tmp_path / f"out.{ending}").is_symlink()
    assert (old / "summary.json").read_text() == "one"
