"""Sheets of .xlsx files, through openpyxl, read as lines of cells."""

from __future__ import annotations

import datetime
import io
import re
import warnings
import zipfile
from collections.abc import Callable, Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import combinations
from typing import Any, NamedTuple
from xml.etree import ElementTree

from fibrefit.core import limits, units
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Raw
from fibrefit.records.files.decode import Text
from fibrefit.records.files.extras import damage_as_error, require
from fibrefit.records.files.sheets.shape import (
    Cells,
    Decimal,
    is_row,
    upright,
    with_whole_headings,
    without_blocks_beside,
)
from fibrefit.records.files.sheets.stamps import Stamp, exact_stamps, stamp
from fibrefit.records.files.text import read_text
from fibrefit.records.grammar.headings import PLAIN_KINDS, split_heading
from fibrefit.records.grammar.phrases import Aside, are, count
from fibrefit.records.grammar.tokens import NUMBER
from fibrefit.records.grammar.worth import contradicted
from fibrefit.records.options import ReadOptions
from fibrefit.records.thresholds import FEWEST_ROWS, STRAY_ROWS, STRAY_SHARE

#: Comments of cells, and threads of them; what a program writes instead of a thread where it cannot show one.
_COMMENTS = re.compile(r"xl/(?:.*/)?(?:threaded)?comments?\d*\.xml", re.I)
_NO_THREAD = "[threaded comment]"
#: Words that a number format shows beside the number: ``0.0" kN"``.
_SHOWN = re.compile(r'"([^"]*)"|\\(.)')
#: Commas behind the last digit, each of which divides what is shown by a thousand: ``0.0,``.
_IN_THOUSANDS = re.compile(r"[0#?](,+)(?![0#?,])")
#: A row that the sheet does not show, with its number: a filter hides rows, and so can a user.
_HIDDEN = re.compile(rb'<(?:\w+:)?row\b(?=[^>]*\bhidden="(?:1|true)")[^>]*?\br="(\d+)"')
#: Bytes of a sheet that are looked through at a time.
_CHUNK = 1 << 20
#: Where openpyxl keeps which formats are those of dates.
_KNOWN_DATES = ("_date_formats", "_timedelta_formats")


def read_workbook(data: bytes, where: str, options: ReadOptions, laid_out: Callable[[Text, str], Text]) -> Raw:
    """Columns of the sheet that holds the measured values.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        Its name for messages.
    options : ReadOptions
        What the user says.
    laid_out : callable ``(text, where) -> Text``
        Brings cells of a layout of their own to the usual one.

    Returns
    -------
    Raw
        As `read_text` has it: numbers to the last digit, a line for each row.

    Raises
    ------
    DataError
        If openpyxl is not installed, the file is damaged, or several sheets that are shown hold tables of some length;
        and as `read_text`.
    """
    openpyxl = require("openpyxl", "xlsx", where, "a spreadsheet")
    with damage_as_error(where, "the spreadsheet", do="Save it again."), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # styles and extensions it does not know
        book = openpyxl.load_workbook(io.BytesIO(data), read_only=True, data_only=True)
        sheets = {sheet.title: _rows(_all_rows(sheet), where) for sheet in book.worksheets}
        comments = list(_comments(data, where))
        shown = {sheet.title for sheet in book.worksheets if sheet.sheet_state == "visible"}
        chosen, notes = _with_table(sheets, shown, where)
        sheet = next(sheet for sheet in book.worksheets if sheet.title == chosen)
        formats = _formats(sheet, sheets[chosen])
        _refuse_changing_formats(sheet, formats, where)
        rows: Cells = _with_exact_stamps(sheet, sheets[chosen])
        notes += _on_hidden_rows(sheet, rows)
    beside = [
        (f'sheet "{title}", row {i}', "\t".join(filter(None, row)))
        for title, others in sheets.items()
        if title != chosen
        for i, row in enumerate(others, 1)
        if any(row)
    ]
    rows, apart = without_blocks_beside(rows)
    if (turned := upright(rows)) is not None:
        rows, formats, notes = turned, [], (*notes, "The sheet lies on its side: each of its rows is a column here.")
    stated = {f"number format of column {one.column}": f"{one.name} = {one.unit}" for one in formats if one.unit}
    beside += [*comments, *apart, *stated.items()]
    if (mark := _mark(rows)) is not None:
        _refuse_texts(rows, where)
    lines = ["\t".join(row) for row in with_whole_headings(rows)]
    text = Text(lines, "XLSX", True, notes, tuple(beside), tuple(stated.values()), mark)
    raw = read_text(laid_out(text, where), where, replace(options, delimiter="\t"))
    worth = {one.column: one.worth for one in formats}
    return replace(raw, columns=[replace(c, worth=c.worth or worth.get(c.number, "")) for c in raw.columns])


def _comments(data: bytes, where: str) -> Iterator[tuple[str, str]]:
    """What comments say, of whichever sheet, with the cell they stand at."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        parts = [entry for entry in archive.infolist() if _COMMENTS.fullmatch(entry.filename)]
        limits.Allowance(where, DataError).take(sum(entry.file_size for entry in parts))
        for part in parts:
            for one in ElementTree.fromstring(archive.read(part)).iter():
                text = " ".join("".join(one.itertext()).split())
                if one.get("ref") and text and not text.casefold().startswith(_NO_THREAD):
                    yield f"comment on cell {one.get('ref')}", text


class _Format(NamedTuple):
    """What the number format of a column shows of its numbers.

    Parameters
    ----------
    column : int
        Number of the column.
    name : str
        Its heading without the unit.
    unit : str
        What it shows behind each number; empty for nothing that is a unit.
    worth : str
        The format in words, where it shows a multiple of each number; else empty.
    """

    column: int
    name: str
    unit: str
    worth: str


def _formats(sheet: Any, rows: Cells) -> list[_Format]:
    """What the number formats of the first row of the table show."""
    first = next((i for i, row in enumerate(rows, 1) if is_row(row)), 0)
    found = []
    for cell in next(iter(sheet.iter_rows(min_row=first, max_row=first)), ()) if first else ():
        shown = (cell.number_format or "").split(";")[0]
        if isinstance(cell.value, int | float):
            above = (rows[i][cell.column - 1] for i in range(first - 2, -1, -1))
            name = split_heading(next(filter(None, above), ""))[0]
            found.append(_Format(cell.column, name, _unit_shown(shown), _multiple(shown)))
    return found


def _unit_shown(shown: str) -> str:
    """Unit that a number format shows behind the number; empty where it shows none."""
    unit = "".join(map("".join, _SHOWN.findall(shown))).strip(" []()")
    return unit if units.kind_of(unit) in PLAIN_KINDS else ""


def _refuse_changing_formats(sheet: Any, formats: Sequence[_Format], where: str) -> None:
    """Refuse a column whose number format shows another unit from some row on, as of a meter that chooses its range.

    The cells are gone through only where the formats of the workbook show two units of one quantity.
    """
    stated = [unit for one in getattr(sheet.parent, "_number_formats", ()) if (unit := _unit_shown(one.split(";")[0]))]
    if not any(contradicted(pair) for pair in combinations(dict.fromkeys(stated), 2)):
        return
    first = {one.column: one.unit for one in formats if one.unit}
    for number, row in enumerate(sheet.iter_rows(), 1):
        for cell in row:
            before = first.get(getattr(cell, "column", 0))
            if before and isinstance(cell.value, int | float):
                unit = _unit_shown((cell.number_format or "").split(";")[0])
                if unit and contradicted([before, unit]):
                    got = f'the number format changes from "{before}" to "{unit}"'
                    name = next(one.name for one in formats if one.column == cell.column)
                    do = "Fix the range of the meter, or convert the values to one unit."
                    raise DataError(f'{where}, column "{name}", line {number}', got, "one unit for all rows", do)


def _multiple(shown: str) -> str:
    """A number format in words, where what it shows is a multiple of the number: a share in percent, or thousands."""
    bare = _SHOWN.sub("", shown)
    thousands = _IN_THOUSANDS.search(bare)
    if thousands is None and "%" not in bare:
        return ""
    factor = 100.0 if "%" in bare else 1e-3 ** len(thousands[1]) if thousands else 1.0
    return f'the number format "{shown}", which shows {factor:g} times the number in the cell,'


def _with_exact_stamps(sheet: Any, rows: Cells) -> Cells:
    """Rows with dates and times of day to the microsecond, as far as the numbers behind them tell.

    Openpyxl rounds them to milliseconds where it knows their formats, and gives the numbers where it does not.
    """
    found = [list(row) for row in rows]
    known = [formats for key in _KNOWN_DATES if isinstance(formats := getattr(sheet.parent, key, None), set)]
    if not known or not any(isinstance(cell, Stamp) for row in rows for cell in row):
        return found
    for formats in known:
        formats.clear()
    numbers = list(_all_rows(sheet))
    for j in range(len(found[0])):
        column = [
            (i, float(row[j]))
            for i, row in enumerate(numbers)
            if j < len(row) and isinstance(found[i][j], Stamp) and isinstance(row[j], int | float)
        ]
        exact = exact_stamps([number for _, number in column], [found[i][j] for i, _ in column], sheet.parent.epoch)
        for (i, _), one in zip(column, exact, strict=True):
            found[i][j] = one
    return found


def _on_hidden_rows(sheet: Any, rows: Cells) -> tuple[str, ...]:
    """A note where rows of the table are hidden: whether their numbers were to count is not written in the file."""
    opened = getattr(sheet, "_get_source", None)
    if opened is None:
        return ()
    found, rest = [], b""
    with opened() as source:
        while chunk := source.read(_CHUNK):
            parts = (rest + chunk).rpartition(b"<")
            found += [int(number) for number in _HIDDEN.findall(parts[0])]
            rest = parts[1] + parts[2]
    found += [int(number) for number in _HIDDEN.findall(rest)]
    hidden = [number for number in found if number <= len(rows) and is_row(rows[number - 1])]
    if not hidden:
        return ()
    told = (
        f"{count(len(hidden), 'row')} that the sheet hides {are(len(hidden))} read like the others, the first in line"
    )
    return (f"{told} {hidden[0]}. Where a filter took out what is not to count, delete these rows.",)


def _mark(rows: Cells) -> str | None:
    """Decimal mark of a sheet: a point where rows have numbers, as they are written out; None where all are texts."""
    table = [row for row in rows if is_row(row)]
    decimals = sum(any(isinstance(cell, Decimal) for cell in row) for row in table)
    return "." if 2 * decimals > len(table) else None


def _refuse_texts(rows: Cells, where: str) -> None:
    """Refuse a sheet with numbers in some columns, and in more of them texts with a decimal comma.

    Of fewer such columns the reader of texts tells which they are.
    """
    found = []
    for number, row in enumerate(rows, 1):
        texts = [i for i, cell in enumerate(row) if "," in cell and NUMBER[","].fullmatch(cell)]
        if texts and 0 < sum(NUMBER["."].fullmatch(cell) is not None for cell in row) <= len(texts):
            found.append((number, texts[0]))
    if 2 * len(found) > sum(map(is_row, rows)):
        number, place = found[0]
        above = next((rows[i][place] for i in range(number - 2, -1, -1) if rows[i][place]), f"column {place + 1}")
        got = f'the text "{rows[number - 1][place]}" beside columns of numbers'
        do = (
            "Convert the texts to numbers (in Excel: Data, Text to Columns), or save all columns with one decimal mark."
        )
        raise DataError(f'{where}, column "{above}", line {number}', got, "numbers", do)


def _with_table(sheets: Mapping[str, Cells], shown: Collection[str], where: str) -> tuple[str, tuple[str, ...]]:
    """The sheet with the table, and notes.

    Beside a long table a few rows of results are none, as in a text; nor is one on a hidden sheet beside one on a sheet
    that is shown.
    """
    rows_of = {title: _count_rows(rows) for title, rows in sheets.items()}
    longest = max(rows_of.values(), default=0)
    if longest < FEWEST_ROWS:
        listed = ", ".join(f'"{title}"' for title in list(sheets)[:5])
        raise DataError(where, f"no rows of numbers on any sheet ({listed})", "a table of measured values", "")
    few = max(STRAY_ROWS, STRAY_SHARE * longest)
    tables = [title for title, rows in rows_of.items() if rows > few]
    seen = [title for title in tables if title in shown] or tables
    if len(seen) > 1:
        listed = ", ".join(f'"{title}"' for title in seen[:5])
        raise DataError(where, f"tables on {len(seen)} sheets ({listed})", "one", _sheets_apart(where, seen))
    notes: list[str] = [Aside(f'Read from the sheet "{seen[0]}".')] if len(sheets) > 1 else []
    stray = [f'"{title}" ({count(rows, "row")})' for title, rows in rows_of.items() if FEWEST_ROWS <= rows <= few]
    if stray:
        notes.append(f"Rows of numbers on other sheets are left out: {', '.join(stray[:5])}.")
    if hidden := [f'"{title}"' for title in tables if title not in seen]:
        notes.append(f"Tables on hidden sheets are left out: {', '.join(hidden[:5])}.")
    return seen[0], tuple(notes)


def _count_rows(rows: Cells) -> int:
    """Rows of numbers of a sheet, also of one that lies on its side."""
    turned = upright(rows)
    return sum(map(is_row, rows if turned is None else turned))


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
    rows, left, width = [], limits.MOST_CELLS, 0
    for value in values:
        left -= len(value) + 1
        row = [_cell(one) for one in value]
        while row and not row[-1]:
            row.pop()
        rows.append(row)
        width = max(width, len(row))
        if left < 0 or width * len(rows) > limits.MOST_CELLS:
            raise limits.too_many_cells(where, DataError)
    return [row + [""] * (width - len(row)) for row in rows]


def _cell(value: Any) -> str:
    """Cell as text: numbers to the last digit, dates in ISO, everything else on one line."""
    if value is None:
        return ""
    if isinstance(value, datetime.datetime | datetime.time | datetime.timedelta):
        return stamp(value)
    return Decimal(repr(value)) if isinstance(value, float) else " ".join(str(value).split())
