"""``records = "series.csv"``: a table with one row a record and the units in its header."""

from __future__ import annotations

import csv
import io
import re
from contextlib import suppress
from pathlib import Path

from fibrefit.core.errors import StudyError
from fibrefit.core.limits import LARGEST_STUDY
from fibrefit.core.paths import read_plain_file

_HEADER = re.compile(r"\s*(?P<key>[^\[(]+?)\s*(?:[\[(](?P<unit>[^\])]*)[\])])?\s*")
_DECIMAL = re.compile(r"[+-]?\d*[.,]\d+(?:[eE][+-]?\d+)?")
_THOUSANDS = re.compile(r"[+-]?[1-9]\d{0,2},\d{3}")
_NAMES = ("file", "name")
DIMENSIONLESS = ("gain",)
"""What is stated of records and has no unit: a study writes it without quotes."""


def read_series(path: Path) -> list[dict[str, str | float]]:
    """Records of a table, as ``[[records]]`` would give them.

    Parameters
    ----------
    path : pathlib.Path
        File with a header such as ``file,lift [mm],inclination [deg]``, separated by comma, semicolon or tab.

    Returns
    -------
    list of dict
        Key to text with its unit, one for each row, and to a number where it has none by nature; empty cells are left
        out.

    Raises
    ------
    StudyError
        If it cannot be read, has no column ``file`` or ``name``, names a column twice, or a row has another length.
    """
    rows = _rows(path)
    (line, header), body = rows[0], rows[1:]
    columns = []
    for cell in header:
        if (match := _HEADER.fullmatch(cell)) is None:
            raise StudyError(str(path), f'column "{cell}"', 'a name and its unit, such as "lift [mm]"', "")
        columns.append((match["key"], match["unit"] or ""))
    names = [key for key, _ in columns]
    if len(set(names)) < len(names):
        twice = next(name for name in names if names.count(name) > 1)
        raise StudyError(f"{path}, line {line}", f'column "{twice}" twice', "each column once", "")
    if not set(_NAMES) & set(names):
        raise StudyError(f"{path}, line {line}", 'no column "file"', "file, and conditions with their unit", "")
    if not body:
        raise StudyError(str(path), "no rows", "one row a record", "")
    records: list[dict[str, str | float]] = []
    for line, row in body:
        if len(row) != len(columns):
            raise StudyError(f"{path}, line {line}", f"{len(row)} cells", f"{len(columns)}, as in the header", "")
        records.append({key: f"{cell} {unit}".strip() for (key, unit), cell in zip(columns, row, strict=True) if cell})
        # What is a pure number a study writes without quotes.
        for (key, unit), cell in zip(columns, row, strict=True):
            if cell and key in DIMENSIONLESS and unit in ("", "-", "1"):
                with suppress(ValueError):
                    records[-1][key] = float(cell)
    return records


def _rows(path: Path) -> list[tuple[int, list[str]]]:
    """Line number and cells of every line that is not empty, with decimal points."""
    try:
        text = read_plain_file(path, "a table of records", StudyError, most=LARGEST_STUDY).decode("utf-8-sig")
    except UnicodeDecodeError:
        raise StudyError(str(path), "not UTF-8", "text in UTF-8", "Save it with that encoding.") from None
    first = next((line for line in text.splitlines() if line.strip()), "")
    if not first:
        raise StudyError(str(path), "empty", "a header and one row a record", "")
    delimiter = max("\t;,", key=first.count)
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=delimiter, strict=True)
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader if any(map(str.strip, row))]
    except csv.Error as error:
        raise StudyError(f"{path}, line {reader.line_num}", str(error), "a table of cells", "") from None
    # Commas are decimal ones where none stands between cells, no number has a point, and not all may part thousands.
    names = {i for i, cell in enumerate(rows[0][1]) if cell in _NAMES}
    cells = {cell for _, row in rows[1:] for i, cell in enumerate(row) if i not in names}
    numbers = {cell for cell in cells if _DECIMAL.fullmatch(cell)}
    if delimiter == "," or all(map(_THOUSANDS.fullmatch, numbers)) or any("." in number for number in numbers):
        return rows
    return [
        (line, [cell.replace(",", ".") if cell in numbers and i not in names else cell for i, cell in enumerate(row)])
        for line, row in rows
    ]
