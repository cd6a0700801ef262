"""Folders of long runs: cut short, gone on with, never lost by accident."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.core.errors import StudyError, UsageError
from fibrefit.workflow.growing import growing_folder
from fibrefit.workflow.sampling.start import CHAINS, KEPT, START


def test_a_run_cut_short_is_not_lost_by_accident(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt), growing_folder(out, KEPT) as directory:
        (directory.path / CHAINS).write_bytes(b"chains")
        raise KeyboardInterrupt
    with pytest.raises(UsageError, match="holds a run that was cut short"), growing_folder(out, KEPT):
        pass
    with growing_folder(out, KEPT, resume=True) as directory:
        assert (directory.path / CHAINS).read_bytes() == b"chains"
    assert (out / CHAINS).exists()


def test_a_finished_run_goes_on_in_a_copy(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with growing_folder(out, KEPT) as directory:
        (directory.path / START).write_text("start")
        (directory.path / CHAINS).write_bytes(b"chains")
        (directory.path / "chains-2.npz").write_bytes(b"of a second mode")
    with pytest.raises(UsageError, match="exists already"), growing_folder(out, KEPT):
        pass
    with pytest.raises(KeyboardInterrupt), growing_folder(out, KEPT, resume=True) as directory:
        assert (directory.path / START).read_text() == "start"
        assert (directory.path / "chains-2.npz").exists()
        (directory.path / CHAINS).write_bytes(b"more")
        raise KeyboardInterrupt
    assert (out / CHAINS).read_bytes() == b"chains"
    with growing_folder(out, KEPT, resume=True) as directory:
        assert (directory.path / CHAINS).read_bytes() == b"more"


def test_to_go_on_and_to_begin_anew_at_once_is_refused(tmp_path: Path) -> None:
    both = growing_folder(tmp_path / "out", KEPT, force=True, resume=True)
    with pytest.raises(UsageError, match="--resume beside it; expected one of the two"), both:
        pass


def test_a_run_refused_before_its_chains_leaves_nothing(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(StudyError), growing_folder(out, KEPT) as directory:
        (directory.path / START).write_text("start")
        raise StudyError("study", "wrong", "right", "")
    assert not list(tmp_path.iterdir())


def test_what_was_half_written_is_tidied_up(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with pytest.raises(KeyboardInterrupt), growing_folder(out, ("items",)) as directory:
        (directory.path / "items" / "a").mkdir(parents=True)
        (directory.path / "items" / "a" / ".item.json.12.tmp").write_text("{")
        (directory.path / ".items.copy").mkdir()
        raise KeyboardInterrupt
    with growing_folder(out, ("items",), resume=True) as directory:
        (directory.path / "items" / "a" / "item.json").write_text("{}")
    assert {path.name for path in out.rglob("*") if path.is_file()} == {".fibrefit", "item.json"}


def test_folders_go_on_in_a_copy_too(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with growing_folder(out, ("items",)) as directory:
        (directory.path / "items").mkdir()
        (directory.path / "items" / "one").write_text("1")
    with growing_folder(out, ("items",), resume=True) as directory:
        assert (directory.path / "items" / "one").read_text() == "1"
    assert (out / "items" / "one").exists()
