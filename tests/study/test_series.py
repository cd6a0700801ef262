"""A table of records means the same as its rows written out."""

from __future__ import annotations

from pathlib import Path

import pytest

from fibrefit.core.errors import StudyError
from fibrefit.study import load_study
from tests.study.conftest import TEXT, Loader

HEAD = TEXT[: TEXT.index("[[records]]")].replace("name =", 'records = "series.csv"\nname =')
TABLE = "file,lift [mm],release [s],inclination [deg],position_zero [mm]\none.csv,10,0.1432,,\ntwo.csv,5,,45,-0.12\n"


def write(folder: Path, table: str) -> Path:
    (folder / "study.toml").write_text(HEAD)
    (folder / "series.csv").write_text(table, encoding="utf-8")
    return folder / "study.toml"


@pytest.mark.parametrize("delimiter", [",", ";", "\t"])
def test_it_equals_the_records_written_out(load: Loader, folder: Path, delimiter: str) -> None:
    expected = load().records
    study = load_study(write(folder, TABLE.replace(",", delimiter)))
    assert study.records == expected
    assert folder / "series.csv" in study.input_files()


def test_its_resolved_study_stands_without_it(folder: Path) -> None:
    study = load_study(write(folder, TABLE))
    (folder / "resolved.toml").write_text(study.resolved_toml())
    assert load_study(folder / "resolved.toml").records == study.records


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("lift [mm]", "lift", r'series.csv, record 1, column "lift": "10" has no unit'),
        ("lift [mm]", "lift [N]", r'record 1, column "lift": unit "N"'),
        ("lift [mm]", "lfit [mm]", r'column "lfit": unknown key.*mean "lift"'),
        ("lift [mm]", "file", 'line 1: column "file" twice'),
        ("file,", "flie,", 'line 1: no column "file"'),
        ("two.csv,5", "tow.csv,5", r'record 2, column "file": no file "tow.csv"'),
        ("two.csv,5,", "two.csv,5,5,", "line 3: 6 cells; expected 5"),
        ("one.csv,10", "one.csv,ten", r'record 1, column "lift": "ten mm" is not a quantity'),
        ("one.csv,10", 'one.csv,"10', "series.csv, line 3"),
        (TABLE[TABLE.index("\n") :], "\n", "series.csv: no rows"),
        (TABLE, "", "series.csv: empty"),
    ],
)
def test_mistakes_are_explained(folder: Path, old: str, new: str, says: str) -> None:
    assert TABLE.count(old) == 1
    with pytest.raises(StudyError, match=says):
        load_study(write(folder, TABLE.replace(old, new)))


def test_a_missing_table_is_named(folder: Path) -> None:
    path = write(folder, TABLE)
    (folder / "series.csv").unlink()
    with pytest.raises(StudyError, match=r"series.csv: no such file"):
        load_study(path)


def test_overrides_reach_its_rows(folder: Path) -> None:
    study = load_study(write(folder, TABLE), ["records[1].lift=7 mm"])
    assert study.records[1].lift == 0.007
