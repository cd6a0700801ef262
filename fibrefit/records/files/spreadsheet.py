"""Sheets of .xlsx files, through openpyxl, as lines of cells."""

from __future__ import annotations

import datetime
import io
import re
import warnings
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from fibrefit.core import allowance
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.files.extras import damage_as_error, require
from fibrefit.records.grammar.phrases import count
from fibrefit.records.thresholds import FEWEST_ROWS, STRAY_ROWS, STRAY_SHARE


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
        If openpyxl is not installed, the file is damaged, or several sheets hold tables of some length.
    """
    openpyxl = require("openpyxl", "xlsx", where, "a spreadsheet")
    with damage_as_error(where, "the spreadsheet", do="Save it again."), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # styles and extensions it does not know
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: _rows(_all_rows(sheet), where) for sheet in book.worksheets}
    chosen, notes = _with_table(sheets, where)
    others = [(title, rows) for title, rows in sheets.items() if title != chosen]
    beside = [
        (f'sheet "{title}", row {i}', "\t".join(filter(None, row)))
        for title, rows in others
        for i, row in enumerate(rows, 1)
        if any(row)
    ]
    return Text(["\t".join(row) for row in sheets[chosen]], "XLSX", True, notes, tuple(beside))


def _with_table(sheets: Mapping[str, Sequence[Sequence[str]]], where: str) -> tuple[str, tuple[str, ...]]:
    """The sheet with the table, and notes; beside a long table a few rows of results are none, as in a text."""
    rows_of = {title: sum(map(_is_row, rows)) for title, rows in sheets.items()}
    longest = max(rows_of.values(), default=0)
    if longest < FEWEST_ROWS:
        shown = ", ".join(f'"{title}"' for title in list(sheets)[:5])
        raise DataError(where, f"no rows of numbers on any sheet ({shown})", "a table of measured values", "")
    few = max(STRAY_ROWS, STRAY_SHARE * longest)
    tables = [title for title, rows in rows_of.items() if rows > few]
    if len(tables) > 1:
        shown = ", ".join(f'"{title}"' for title in tables[:5])
        raise DataError(where, f"tables on {len(tables)} sheets ({shown})", "one", _sheets_apart(where, tables))
    notes = [f'Read from the sheet "{tables[0]}".'] if len(sheets) > 1 else []
    stray = [f'"{title}" ({count(rows, "row")})' for title, rows in rows_of.items() if FEWEST_ROWS <= rows <= few]
    if stray:
        notes.append(f"Rows of numbers on other sheets are left out: {', '.join(stray[:5])}.")
    return tables[0], tuple(notes)


def _sheets_apart(where: str, tables: Sequence[str]) -> str:
    """How the sheets of a workbook become files of their own, with a command that does it."""
    stem = re.sub(r"[^\w.-]", "_", where.rpartition(".")[0])
    plain = all(re.fullmatch(r"[\w.-]+", title) for title in tables)
    listed = "[" + ", ".join(f"'{title}'" for title in tables) + "]" if plain else "None"
    name = where if re.fullmatch(r"[\w.-]+", where) else "FILE.xlsx"
    do = "Save each sheet that holds a record as CSV, a file for each, and name each file in a [[records]] of its own: "
    # All within brackets: it stays one command where a terminal breaks it into lines.
    command = f"[t.to_csv(f'{stem}_{{i}}.csv', index=False, header=False) for p in [__import__('pandas')] for i, t in "
    command += f"enumerate(p.read_excel('{name}', {listed}, header=None).values(), 1)]"
    return f'{do}file = "{stem}_1.csv". At once: python -c "{command}"'


def _all_rows(sheet: Any) -> Iterable[tuple[Any, ...]]:
    """Rows as they stand: the size that a sheet declares is a guess of the program that wrote it."""
    sheet.reset_dimensions()
    rows: Iterable[tuple[Any, ...]] = sheet.iter_rows(values_only=True)
    return rows


def _rows(values: Iterable[tuple[Any, ...]], where: str) -> list[list[str]]:
    """Cells of a sheet, as many in every row. One far away has all the empty ones before it and above it too."""
    rows, left, width = [], allowance.MOST_CELLS, 0
    for value in values:
        left -= len(value) + 1
        row = [_cell(one) for one in value]
        while row and not row[-1]:
            row.pop()
        rows.append(row)
        width = max(width, len(row))
        if left < 0 or width * len(rows) > allowance.MOST_CELLS:
            raise allowance.too_many_cells(where, DataError)
    return [row + [""] * (width - len(row)) for row in rows]


def _cell(value: Any) -> str:
    """Cell as text: numbers to the last digit, dates in ISO, everything else on one line."""
    if value is None:
        return ""
    if isinstance(value, datetime.datetime | datetime.time):
        return value.isoformat(" ") if isinstance(value, datetime.datetime) else value.isoformat()
    return repr(value) if isinstance(value, float) else " ".join(str(value).split())


def _is_row(row: Sequence[str]) -> bool:
    return any(row) and sum(cell[:1].isdigit() or cell[:1] in ("-", "+", ".") for cell in row) >= min(2, len(row))
