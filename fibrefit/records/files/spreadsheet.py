"""Sheets of .xlsx files, through openpyxl, as lines of cells."""

from __future__ import annotations

import datetime
import io
import warnings
from collections.abc import Iterable
from typing import Any

from fibrefit.core import allowance
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.files.extras import damage_as_error, require
from fibrefit.records.thresholds import FEWEST_ROWS


def sheet_text(data: bytes, where: str) -> Text:
    """The sheet that holds the measured values, as text with tabs between the cells.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        Its name for messages.

    Returns
    -------
    Text
        A line for each row, numbers to the last digit.

    Raises
    ------
    DataError
        If openpyxl is not installed, the file is damaged, or several sheets hold tables.
    """
    openpyxl = require("openpyxl", "xlsx", where, "a spreadsheet")
    with damage_as_error(where, "the spreadsheet", do="Save it again."), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # styles and extensions it does not know
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: _rows(sheet.iter_rows(values_only=True), where) for sheet in book.worksheets}
    rows_of = {title: sum(_is_row(row) for row in rows) for title, rows in sheets.items()}
    tables = [title for title, rows in rows_of.items() if rows >= FEWEST_ROWS]
    if len(tables) > 1:
        shown = ", ".join(f'"{title}"' for title in tables[:5])
        raise DataError(where, f"tables on {len(tables)} sheets ({shown})", "one", "Save the one that is meant as CSV.")
    if not tables:
        shown = ", ".join(f'"{title}"' for title in list(sheets)[:5])
        raise DataError(where, f"no rows of numbers on any sheet ({shown})", "a table of measured values", "")
    notes = (f'Read from the sheet "{tables[0]}".',) if len(sheets) > 1 else ()
    others = [(title, rows) for title, rows in sheets.items() if title != tables[0]]
    beside = [
        (f'sheet "{title}", row {i}', "\t".join(filter(None, row)))
        for title, rows in others
        for i, row in enumerate(rows, 1)
        if any(row)
    ]
    return Text(["\t".join(row) for row in sheets[tables[0]]], "XLSX", True, notes, tuple(beside))


def _rows(values: Iterable[tuple[Any, ...]], where: str) -> list[list[str]]:
    """Cells of a sheet. One that names a cell far away has all the empty ones before it too."""
    rows, left = [], allowance.MOST_CELLS
    for row in values:
        left -= len(row) + 1
        if left < 0:
            raise allowance.too_many_cells(where, DataError)
        rows.append([_cell(value) for value in row])
    return rows


def _cell(value: Any) -> str:
    """Cell as text: numbers to the last digit, dates in ISO, everything else on one line."""
    if value is None:
        return ""
    if isinstance(value, datetime.datetime | datetime.time):
        return value.isoformat(" ") if isinstance(value, datetime.datetime) else value.isoformat()
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())


def _is_row(row: list[str]) -> bool:
    return sum(cell[:1].isdigit() or cell[:1] in ("-", "+", ".") for cell in row) >= min(2, len(row))
