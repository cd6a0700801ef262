"""Files: names that a person would guess and no two alike, written whole or not at all."""

from __future__ import annotations

import errno
import hashlib
import os
from collections.abc import Callable
from pathlib import Path

import pytest

from fibrefit.core.errors import DataError, UsageError
from fibrefit.core.paths import (
    name_of_several,
    nearest_file,
    path_from,
    read_plain_file,
    record_stems,
    refuse_no_text,
    sha256_of,
    whole,
    write_whole,
)


@pytest.mark.parametrize(
    ("names", "stems"),
    [
        (["drop_5mm_90deg.csv", "drop 10 mm.csv", "Čeština.parquet"], ["drop_5mm_90deg", "drop 10 mm", "Čeština"]),
        (["drop_1.5", "drop_1.7"], ["drop_1.5", "drop_1.7"]),
        (["monday/drop.csv", "tuesday/drop.csv"], ["monday_drop", "tuesday_drop"]),
        (["a.csv", "A.csv", "a.txt"], ["a", "A_2", "a_3"]),
        (
            ["../../evil", "/etc/evil.csv", ".", "..", "x" * 300],
            ["_.._evil", "_etc_evil", "record", "record_2", "x" * 80],
        ),
        (
            ["run 1: 5 mm", "a?b", "a*b", "back\\slash", 'say "so"', "tab\tnul\0"],
            ["run 1_ 5 mm", "a_b", "a_b_2", "back_slash", "say _so_", "tab_nul_"],
        ),
        (["CON", "con.csv", "lpt1.5 mm", "console"], ["CON_", "con__2", "lpt1_.5 mm", "console"]),
    ],
)
def test_each_record_has_a_file_of_its_own(names: list[str], stems: list[str]) -> None:
    found = record_stems(names)
    assert len({stem.casefold() for stem in found}) == len(names)
    assert not any("/" in stem for stem in found)
    assert found == stems


def test_a_name_of_long_letters_leaves_room_for_what_a_file_is_called_while_it_is_written(tmp_path: Path) -> None:
    (stem,) = record_stems(["\N{CJK UNIFIED IDEOGRAPH-7EF3}" * 90 + ".csv"])
    write_whole(tmp_path / f"{stem}.csv", "1")
    assert len(stem) > 50


def test_a_file_that_is_not_there_suggests_its_neighbour(tmp_path: Path) -> None:
    for name in ("Fall 20mm.csv", "study.toml", "stud.txt"):
        (tmp_path / name).touch()
    assert nearest_file(tmp_path / "Fall 20m.csv") == 'Did you mean "Fall 20mm.csv"?'
    assert nearest_file(tmp_path / "stud.tml", ".toml") == 'Did you mean "study.toml"?'
    for path in ("nothing.like.it", "Fall 20m.csv/a.csv", "none/Fall 20mm.csv", "nul\0"):
        assert nearest_file(tmp_path / path) == ""


@pytest.mark.parametrize(
    ("files", "name"), [([], ""), (["a/one.csv"], "one"), (["one.csv", Path("two.csv"), "x.csv"], "one and 2 more")]
)
def test_several_files_are_called_by_the_first(files: list[str | Path], name: str) -> None:
    assert name_of_several(files) == name


def test_a_file_on_another_drive_is_named_whole(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As on Windows, where there is no way from one to the other."""
    assert path_from(tmp_path / "here", tmp_path / "there" / "a.csv") == "../there/a.csv"

    def refused(file: Path, folder: Path) -> str:
        raise ValueError("path is on mount 'D:', start on mount 'C:'")

    monkeypatch.setattr("os.path.relpath", refused)
    assert path_from(tmp_path / "here", tmp_path / "there" / "a.csv") == (tmp_path / "there" / "a.csv").as_posix()


@pytest.mark.parametrize("read", [lambda path: read_plain_file(path, "a file", DataError), sha256_of])
def test_a_file_that_may_not_be_read_is_told_as_data_that_are_not_there(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, read: Callable[[Path], object]
) -> None:
    """Permissions are nothing to root: the system says it here whoever asks."""
    file = tmp_path / "drop.csv"
    file.write_text("t,F\n")

    def refused(*of: object) -> int:
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(file))

    monkeypatch.setattr("fibrefit.core.paths.os.open", refused)
    with pytest.raises(DataError, match=r"drop\.csv: Permission denied; expected a file"):
        read(file)


def test_an_input_whose_name_is_no_text_is_refused_before_any_work(tmp_path: Path) -> None:
    """A result names what it rests on in text files: it could not be written at the end."""
    study = tmp_path / os.fsdecode(b"M\xfcller") / "study.toml"
    refuse_no_text([study], study.parent / "results")
    with pytest.raises(UsageError, match="a name that is no text in UTF-8.*Rename it"):
        refuse_no_text([study], tmp_path / "results")


def test_text_is_utf8_and_replaces(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_whole(path, "old")
    write_whole(path, "ρ")
    assert path.read_bytes() == "ρ".encode()
    assert list(tmp_path.iterdir()) == [path]


def test_a_failure_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "a"
    write_whole(path, "old")
    with pytest.raises(ZeroDivisionError), whole(path) as temporary:
        temporary.write_text("half")
        raise ZeroDivisionError
    assert path.read_text() == "old"
    assert list(tmp_path.iterdir()) == [path]


def test_digest(tmp_path: Path) -> None:
    (tmp_path / "a").write_bytes(b"content")
    assert sha256_of(tmp_path / "a") == hashlib.sha256(b"content").hexdigest()
