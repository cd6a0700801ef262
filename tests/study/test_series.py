"""A table of records means the same as its rows written out."""

from __future__ import annotations

from pathlib import Path
from typing import get_args

import pytest

from fibrefit.core.declarations import KINDS
from fibrefit.core.errors import StudyError
from fibrefit.study import Study, load_study
from fibrefit.study.load import DIMENSIONLESS
from fibrefit.study.quantity import Unit
from fibrefit.study.rigs import study_type
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


def of_a_guided_mass(folder: Path, *lines: str) -> Study:
    text = 'schema = "fibrefit/study/1"\nname = "x"\nrecords = "series.csv"\n[rig]\nkind = "guided_mass"\n'
    (folder / "pure.toml").write_text(text)
    (folder / "series.csv").write_text("\n".join(lines))
    return load_study(folder / "pure.toml")


@pytest.mark.parametrize(
    ("column", "cells", "stated"),
    [
        ("gain", ("1.02", "2"), (1.02, 2.0)),
        ("gain [-]", ("1.02", "1e-1"), (1.02, 0.1)),
        ("gain", ("3", ""), (3.0, None)),
    ],
)
def test_pure_numbers_stand_in_a_table_as_they_are(
    folder: Path, column: str, cells: tuple[str, str], stated: tuple[float | None, float | None]
) -> None:
    study = of_a_guided_mass(folder, f"file,{column}", f"one.csv,{cells[0]}", f"two.csv,{cells[1]}")
    assert tuple(record.gain for record in study.records) == stated


@pytest.mark.parametrize(("cell", "says"), [("often", "often"), ("0", "0"), ("-2", "-2")])
def test_what_is_no_such_number_is_refused(folder: Path, cell: str, says: str) -> None:
    with pytest.raises(StudyError, match=f'column "gain": .*{says}'):
        of_a_guided_mass(folder, "file,gain", f"one.csv,{cell}")


def test_a_number_of_points_is_that_of_the_rig_not_of_one_record(folder: Path) -> None:
    with pytest.raises(StudyError, match=r'column "masses_per_fibre": unknown key.*It stands under \[rig\]'):
        load_study(write(folder, "file,masses_per_fibre\none.csv,3\n"))


def test_names_and_files_of_a_table_stay_text(folder: Path) -> None:
    (folder / "12").write_text((folder / "one.csv").read_text())
    study = load_study(write(folder, "file,name\n12,7\n"))
    assert (study.records[0].file, study.records[0].name) == ("12", "7")


def test_the_pure_numbers_are_those_of_the_rigs() -> None:
    found = set()
    for kind in KINDS:
        records = study_type(kind).model_fields["records"].annotation.__args__[0]
        for name, field in records.model_fields.items():
            choices = [get_args(choice) for choice in get_args(field.annotation)]
            numbers = [said for kind_of, *said in filter(None, choices) if kind_of in (int, float)]
            if any(not any(isinstance(one, Unit) for one in said) for said in numbers):
                found.add(name)
    assert found == set(DIMENSIONLESS)


@pytest.mark.parametrize("delimiter", [";", "\t"])
def test_decimal_commas_are_read_where_they_can_be_nothing_else(load: Loader, folder: Path, delimiter: str) -> None:
    table = TABLE.replace(",", delimiter).replace(".", ",").replace(",csv", ".csv")
    assert load_study(write(folder, table)).records == load().records


@pytest.mark.parametrize("lift", ["1,012", "1.012,5"])
def test_commas_that_may_part_thousands_are_refused(folder: Path, lift: str) -> None:
    rows = f"file;lift [mm];inclination [deg]\none.csv;{lift};90\ntwo.csv;5;45\n"
    with pytest.raises(StudyError, match=lift):
        load_study(write(folder, rows))
    both = "file;lift [mm];release [s]\none.csv;10,5;0.1432\ntwo.csv;5;0.1\n"
    with pytest.raises(StudyError, match="10,5"):
        load_study(write(folder, both))
