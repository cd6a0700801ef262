"""A file of several recordings is refused with a command that makes a file of each, which is then read."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
from layouts import f, rows, t, u
from test_refusals import book

from fibrefit.core.errors import DataError
from fibrefit.records import read_record


def _followed(error: DataError, folder: Path, wrapped: bool) -> None:
    """Do what the advice says, as it stands or as a terminal wraps it."""
    code = re.search(r'python -c "(.*)"$', error.do)
    assert code is not None
    text = code[1].replace(" for ", "\n  for ") if wrapped else code[1]
    subprocess.run([sys.executable, "-c", text], cwd=folder, check=True)


@pytest.mark.parametrize("wrapped", [False, True])
@pytest.mark.parametrize("lengths", [(20, 20), (12, 30, 25)])
@pytest.mark.parametrize("head", ["t [s];F [N];x [mm]\n", "Rig 3\n\nt [s];F [N];x [mm]\n"])
def test_recordings_one_below_the_other(
    head: str, lengths: tuple[int, ...], wrapped: bool, write, tmp_path: Path
) -> None:
    parts = [rows(lambda i, k=k: f"{t(i)};{f(i + 3 * k)};{u(i)}", n=n) for k, n in enumerate(lengths)]
    with pytest.raises(DataError, match=r"Split the file there: lines .*\[\[records\]\]") as refused:
        read_record(write(head + "".join(parts), "all.csv"))
    _followed(refused.value, tmp_path, wrapped)
    for i, part in enumerate(parts, 1):
        made = read_record(tmp_path / f"all_{i}.csv")
        plain = read_record(write(head + part, "plain.csv"))
        assert (made.channels["force"] == plain.channels["force"]).all()
    assert not (tmp_path / f"all_{len(parts) + 1}.csv").exists()


@pytest.mark.parametrize("titles", [("Drop1", "Drop2"), ("drop 10 mm", "drop 20 mm", "it's"), ("$a", "b")])
def test_a_workbook_of_several_sheets(titles: tuple[str, ...], write, tmp_path: Path) -> None:
    cells = [["t [s]", "F [N]"], *([1e-3 * i, 1.5 * i % 7.0] for i in range(30))]
    with pytest.raises(DataError, match=r"tables on . sheets .*\[\[records\]\]") as refused:
        read_record(write(book(**dict.fromkeys(titles, cells)), "book.xlsx"))
    _followed(refused.value, tmp_path, False)
    for i in range(1, len(titles) + 1):
        assert read_record(tmp_path / f"book_{i}.csv").channels["force"].size == 30


def _numbered(pause: float, leap: float, every: int = 30, head: str = "shot;t [s];F [N];x [mm]") -> str:
    """Rows whose first column counts on after some; times and the position may leap there."""
    told = [head]
    for i in range(90):
        k = i // every
        told.append(f"{k + 1};{5e-4 * i + pause * k:.4f};{10 + i % 7 / 10:.2f};{0.1 * i - leap * k:.3f}")
    return "\n".join(told) + "\n"


@pytest.mark.parametrize(("pause", "leap"), [(0.0, 3.0), (8.0, 0.0), (2.0, 3.0)])
@pytest.mark.parametrize("name", ["shot", "Versuch", "run no.", "n"])
def test_recordings_that_a_column_numbers(name: str, pause: float, leap: float, write, tmp_path: Path) -> None:
    path = write(_numbered(pause, leap, head=f"{name};t [s];F [N];x [mm]"), "all.csv")
    with pytest.raises(DataError, match="line 32.*counts to 3.*lines 2 to 31") as refused:
        read_record(path)
    _followed(refused.value, tmp_path, False)
    assert [len(read_record(tmp_path / f"all_{i}.csv")) for i in (1, 2, 3)] == [30, 30, 30]
    assert len(read_record(path, channels={"time": "t [s]"})) == 90


@pytest.mark.parametrize("every", [30, 10, 90])
def test_a_count_of_cycles_in_one_motion_stays_read(every: int, write) -> None:
    assert len(read_record(write(_numbered(0.0, 0.0, every)))) == 90
