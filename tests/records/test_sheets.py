"""What a spreadsheet says beside its cells: comments, units in number formats, numbers that are texts."""

from __future__ import annotations

import io
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import openpyxl
import pytest
from openpyxl.comments import Comment

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

N = 60
FORCE = np.round(20.0 + 3.0 * np.sin(0.3 * np.arange(N)), 4)
HEAD = ["Time [s]", "Force [N]", "Position [mm]"]


def book(head: list[str], change: Callable[[Any], None], row: Callable[[int], list[Any]] | None = None) -> bytes:
    made, file = openpyxl.Workbook(), io.BytesIO()
    sheet = made.active
    sheet.append(head)
    for i in range(N):
        sheet.append(row(i) if row else [i / 1000, float(FORCE[i]), -3.0 + 0.01 * i])
    change(sheet)
    made.save(file)
    return file.getvalue()


def commented(cell: str, text: str) -> bytes:
    def change(sheet: Any) -> None:
        sheet[cell].comment = Comment(text, "me")

    return book(HEAD, change)


@pytest.mark.parametrize("cell", ["B1", "E7"])
def test_a_comment_is_accounted_for(cell: str, write: Callable) -> None:
    with pytest.raises(DataError, match=rf'comment on cell {cell}: "multiply by 2!"'):
        read_record(write(commented(cell, "multiply by 2!"), "a.xlsx"))
    record = read_record(write(commented(cell, "checked by Jana on Monday"), "b.xlsx"))
    np.testing.assert_array_equal(record.channels["force"], FORCE)


def formatted(*formats: str) -> Callable[[Any], None]:
    def change(sheet: Any) -> None:
        for row in sheet.iter_rows(min_row=2):
            for cell, shown in zip(row, formats, strict=True):
                cell.number_format = shown

    return change


def test_the_unit_of_a_number_format_is_that_of_its_column(write: Callable) -> None:
    change = formatted('0.000" s"', '0.0" kN"', "0.00\\ \\m\\m")
    record = read_record(write(book(["Time", "Force", "Position"], change), "a.xlsx"))
    np.testing.assert_allclose(record.channels["force"], 1000.0 * FORCE)
    assert record.channels["position"][0] == pytest.approx(-3e-3)


def test_a_unit_of_a_number_format_that_is_not_that_of_the_heading_is_asked_about(write: Callable) -> None:
    with pytest.raises(DataError, match=r'number format of column 2: "Force = kN" tells another unit'):
        read_record(write(book(HEAD, formatted("General", '0.0" kN"', "General")), "a.xlsx"))
    record = read_record(write(book(HEAD, formatted("0.000", '0.0" N"', '[Red]0.00;"minus"0.00')), "b.xlsx"))
    np.testing.assert_array_equal(record.channels["force"], FORCE)


@pytest.mark.parametrize("columns", [(1,), (1, 2)])
def test_texts_among_numbers_are_refused_by_their_column(columns: tuple[int, ...], write: Callable) -> None:
    def row(i: int) -> list[Any]:
        values = [i / 1000, float(FORCE[i]), -3.0 + 0.01 * i]
        return [f"{v:.3f}".replace(".", ",") if k in columns else v for k, v in enumerate(values)]

    with pytest.raises(DataError, match=r'column "Force \[N\]".*"20,000"'):
        read_record(write(book(HEAD, lambda sheet: None, row), "a.xlsx"))


def test_texts_with_a_comma_throughout_are_read(write: Callable) -> None:
    def row(i: int) -> list[Any]:
        return [f"{v:.4f}".replace(".", ",") for v in (i / 1000, FORCE[i], -3.0 + 0.01 * i)]

    record = read_record(write(book(HEAD, lambda sheet: None, row), "a.xlsx"))
    np.testing.assert_array_equal(record.channels["force"], FORCE)


def built(*rows: list[Any], formats: tuple[str, ...] = ()) -> bytes:
    made, file = openpyxl.Workbook(), io.BytesIO()
    for row in rows:
        made.active.append(row)
    if formats:
        formatted(*formats)(made.active)
    made.save(file)
    return file.getvalue()


TABLE = [[i / 2000, float(FORCE[i]), -3.0 + 0.01 * i] for i in range(N)]


def check(path: Path, **options: Any) -> tuple[str, ...]:
    record = read_record(path, **options)
    np.testing.assert_allclose(record.time, np.arange(N) / 2000, atol=1e-9)
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], [1e-3 * row[2] for row in TABLE], atol=1e-15)
    return record.history


@pytest.mark.parametrize(("shown", "factor"), [("0.00000,", "0.001"), ("0.0%", "100"), ('0.0,,"x"', "1e-06")])
def test_a_format_that_shows_a_multiple_is_asked_about(shown: str, factor: str, write: Callable) -> None:
    path = write(book(HEAD, formatted("General", shown, "General")), "a.xlsx")
    with pytest.raises(DataError, match=rf'column "Force \[N\]": the number format .* shows {factor} times the number'):
        read_record(path)
    record = read_record(path, channels={"force": {"column": "Force [N]", "scale": "1"}})
    np.testing.assert_array_equal(record.channels["force"], FORCE)


def test_other_formats_and_other_columns_are_not_asked_about(write: Callable) -> None:
    kept = read_record(write(book(HEAD, formatted("0.0000", "#,##0.000", "0.00E+00;[Red]-0.00E+00")), "a.xlsx"))
    np.testing.assert_array_equal(kept.channels["force"], FORCE)
    rows = [[*row, 0.45] for row in TABLE]
    check(write(built([*HEAD, "Humidity"], *rows, formats=("General", "General", "General", "0%")), "b.xlsx"))


@pytest.mark.parametrize(
    ("start", "shown"),
    [(45232.4, "yyyy-mm-dd hh:mm:ss.000"), (0.25, "hh:mm:ss.000"), (0.0, "[h]:mm:ss.000"), (1.2, "[h]:mm:ss.000")],
)
def test_stamps_are_read_to_what_their_numbers_tell(start: float, shown: str, write: Callable) -> None:
    rows = [[start + row[0] / 86400, *row[1:]] for row in TABLE]
    check(write(built(["Time", *HEAD[1:]], *rows, formats=(shown, "General", "General")), "a.xlsx"))


@pytest.mark.parametrize("left", [False, True])
def test_a_block_of_cells_beside_the_table_is_no_part_of_it(left: bool, write: Callable) -> None:
    said = [["mass", 3.096, "kg"], ["operator", "Novak", None], ["length", 599, "mm"]]
    blocks = [said[i] if i < len(said) else [None] * 3 for i in range(N + 1)]
    rows = [([*a, None, *b] if left else [*b, None, *a]) for a, b in zip(blocks, [HEAD, *TABLE], strict=True)]
    check(write(built(*rows), "a.xlsx"))
    rows[0][1 if left else 5], rows[0][0 if left else 4] = 2.5, "Calibration factor"
    with pytest.raises(DataError, match=r"beside the table, row 1.*Calibration factor"):
        read_record(write(built(*rows), "b.xlsx"))


def test_a_rate_beside_the_table_is_that_of_the_rows(write: Callable) -> None:
    rows = [row[1:] for row in TABLE]
    check(write(built([*HEAD[1:], None, "Sample rate", 2000, "Hz"], *rows), "a.xlsx"))


def test_headings_over_two_rows_are_read(write: Callable) -> None:
    above = [["Time", "Sensors", None], [None, "Force", "Position"], ["s", "N", "mm"]]
    check(write(built(["Drop 7", "Novak"], *above, *TABLE), "a.xlsx"))


def test_a_sheet_on_its_side_is_turned(write: Callable) -> None:
    lying = [[name, *values] for name, values in zip(HEAD, zip(*TABLE, strict=True), strict=True)]
    told = "The sheet lies on its side: each of its rows is a column here."
    assert told in check(write(built(["Drop 7"], [], *lying), "a.xlsx"))
    rated = [["Sample rate", 2000, "Hz"], *lying[1:]]
    assert told in check(write(built(*rated), "b.xlsx"))
    with pytest.raises(DataError):
        read_record(write(built(["", *range(N)], *lying), "c.xlsx"))


def test_a_table_on_a_hidden_sheet_is_left_out_and_told(write: Callable) -> None:
    def change(sheet: Any) -> None:
        other = sheet.parent.create_sheet("old")
        for row in (HEAD, *TABLE):
            other.append([row[0], row[1], row[1]])
        other.sheet_state = "hidden"

    record = read_record(write(book(HEAD, change), "a.xlsx"))
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    assert 'Tables on hidden sheets are left out: "old".' in record.history


@pytest.mark.parametrize("chunk", [1 << 20, 100])
def test_rows_that_a_filter_hides_are_read_and_told(
    chunk: int, write: Callable, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("fibrefit.records.files.sheets.workbook._CHUNK", chunk)

    def filtered(sheet: Any) -> None:
        sheet.row_dimensions[1].hidden = True  # no row of the table: its headings
        for number in (5, 9, N + 40):
            sheet.row_dimensions[number].hidden = True

    record = read_record(write(book(HEAD, filtered), "a.xlsx"))
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    told = [note for note in record.history if "hides" in note]
    assert told == [
        "2 rows that the sheet hides are read like the others, the first in line 5. "
        "Where a filter took out what is not to count, delete these rows."
    ]
    whole = read_record(write(book(HEAD, lambda sheet: None), "b.xlsx"))
    assert not any("hides" in note for note in whole.history)


def test_a_format_that_changes_its_unit_is_refused(write: Callable) -> None:
    def change(sheet: Any) -> None:
        for i, row in enumerate(sheet.iter_rows(min_row=2)):
            row[1].number_format = '0.000" kN"' if i >= 40 else '0.0" N"'

    where = r'column "Force", line 42: the number format changes from "N" to "kN"; expected one unit for all rows'
    with pytest.raises(DataError, match=where):
        read_record(write(book(["Time [s]", "Force", "Position [mm]"], change), "a.xlsx"))
    same = formatted("General", '0.0" N"', '0.0" mm"')
    kept = read_record(write(book(["Time [s]", "Force", "Position"], same), "b.xlsx"))
    np.testing.assert_array_equal(kept.channels["force"], FORCE)


def test_times_in_days_are_called_that(write: Callable) -> None:
    rows = [[row[0] / 86400, *row[1:]] for row in TABLE]
    path = write(built(["Time", *HEAD[1:]], *rows), "a.xlsx")
    with pytest.raises(DataError, match=r'time = "d" \(2000 Hz\) or "s"'):
        read_record(path)
    check(path, units={"time": "d"})


def test_a_delimiter_changes_nothing_in_a_workbook_and_is_told(write: Callable) -> None:
    record = read_record(write(book(HEAD, lambda sheet: None), "a.xlsx"), delimiter=";", decimal=".")
    assert "What is stated of delimiter changed nothing: the file has a layout of its own." in record.notes
