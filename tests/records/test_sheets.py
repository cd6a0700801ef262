"""What a spreadsheet says beside its cells: comments, units in number formats, numbers that are texts."""

from __future__ import annotations

import io
from collections.abc import Callable
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
