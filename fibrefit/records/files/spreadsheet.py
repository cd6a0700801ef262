"""Sheets of .xlsx files, through openpyxl, as lines of cells."""

from __future__ import annotations

import datetime
import io
import re
import warnings
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any
from xml.etree import ElementTree

from fibrefit.core import allowance, units
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.files.extras import damage_as_error, require
from fibrefit.records.grammar.headings import PLAIN_KINDS, split_heading
from fibrefit.records.grammar.phrases import count
from fibrefit.records.grammar.tokens import NUMBER
from fibrefit.records.thresholds import FEWEST_ROWS, STRAY_ROWS, STRAY_SHARE

#: Comments of cells, and threads of them; what a program writes instead of a thread where it cannot show one.
_COMMENTS = re.compile(r"xl/(?:.*/)?(?:threaded)?comments?\d*\.xml", re.I)
_NO_THREAD = "[threaded comment]"
#: Words that a number format shows beside the number: ``0.0" kN"``.
_SHOWN = re.compile(r'"([^"]*)"|\\(.)')


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
        comments = list(_comments(data, where))
        chosen, notes = _with_table(sheets, where)
        formats = _formats(next(sheet for sheet in book.worksheets if sheet.title == chosen), sheets[chosen])
    others = [(title, rows) for title, rows in sheets.items() if title != chosen]
    beside = [
        (f'sheet "{title}", row {i}', "\t".join(filter(None, row)))
        for title, rows in others
        for i, row in enumerate(rows, 1)
        if any(row)
    ]
    beside += [*comments, *((f"number format of column {i}", stated) for i, stated in formats.items())]
    if (mark := _mark(sheets[chosen])) is not None:
        _refuse_texts(sheets[chosen], where)
    lines = ["\t".join(row) for row in sheets[chosen]]
    return Text(lines, "XLSX", True, notes, tuple(beside), tuple(formats.values()), mark)


def _comments(data: bytes, where: str) -> Iterator[tuple[str, str]]:
    """What comments say, of whichever sheet, with the cell they stand at."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = [entry for entry in archive.infolist() if _COMMENTS.fullmatch(entry.filename)]
        allowance.Allowance(where, DataError).take(sum(entry.file_size for entry in parts))
        for part in parts:
            for one in ElementTree.fromstring(archive.read(part)).iter():
                text = " ".join("".join(one.itertext()).split())
                if one.get("ref") and text and not text.casefold().startswith(_NO_THREAD):
                    yield f"comment on cell {one.get('ref')}", text


def _formats(sheet: Any, rows: Sequence[Sequence[str]]) -> dict[int, str]:
    """Units that number formats of the first row of the table show, by the number of the column: ``force = kN``."""
    first = next((i for i, row in enumerate(rows, 1) if _is_row(row)), 0)
    found = {}
    for cell in next(iter(sheet.iter_rows(min_row=first, max_row=first)), ()) if first else ():
        shown = "".join(map("".join, _SHOWN.findall((cell.number_format or "").split(";")[0]))).strip(" []()")
        if isinstance(cell.value, int | float) and units.kind_of(shown) in PLAIN_KINDS:
            above = (rows[i][cell.column - 1] for i in range(first - 2, -1, -1))
            name = split_heading(next(filter(None, above), ""))[0]
            found[cell.column] = f"{name} = {shown}"
    return found


def _mark(rows: Sequence[Sequence[str]]) -> str | None:
    """Decimal mark of a sheet: a point where rows have numbers, as they are written out; None where all are texts."""
    table = [row for row in rows if _is_row(row)]
    decimals = sum(any(isinstance(cell, _Number) for cell in row) for row in table)
    return "." if 2 * decimals > len(table) else None


def _refuse_texts(rows: Sequence[Sequence[str]], where: str) -> None:
    """Refuse a sheet with numbers in some columns, and in more of them texts with a decimal comma.

    Of fewer such columns the reader of texts tells which they are.
    """
    found = []
    for number, row in enumerate(rows, 1):
        texts = [i for i, cell in enumerate(row) if "," in cell and NUMBER[","].fullmatch(cell)]
        if texts and 0 < sum(NUMBER["."].fullmatch(cell) is not None for cell in row) <= len(texts):
            found.append((number, texts[0]))
    if 2 * len(found) > sum(map(_is_row, rows)):
        number, place = found[0]
        above = next((rows[i][place] for i in range(number - 2, -1, -1) if rows[i][place]), f"column {place + 1}")
        got = f'the text "{rows[number - 1][place]}" beside columns of numbers'
        do = (
            "Convert the texts to numbers (in Excel: Data, Text to Columns), or save all columns with one decimal mark."
        )
        raise DataError(f'{where}, column "{above}", line {number}', got, "numbers", do)


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
    return _Number(repr(value)) if isinstance(value, float) else " ".join(str(value).split())


class _Number(str):
    """A number with decimals, as it is written out: no text of the sheet."""

    __slots__ = ()


def _is_row(row: Sequence[str]) -> bool:
    return any(row) and sum(cell[:1].isdigit() or cell[:1] in ("-", "+", ".") for cell in row) >= min(2, len(row))
