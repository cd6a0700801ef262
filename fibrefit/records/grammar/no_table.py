"""Why a file holds no table of numbers: no digits, one row only, rows of all lengths, or cells that are no numbers."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence

from fibrefit.core.errors import DataError
from fibrefit.records.grammar.dialect import NAMES, WHITESPACE, Dialect
from fibrefit.records.grammar.phrases import are
from fibrefit.records.grammar.tokens import kind_of_cell

#: Lines that are looked at.
_LOOKED_AT = 400

#: How a page begins that programs save under the name of a spreadsheet.
_WORKBOOK = re.compile(r"<\?mso-application\b|<workbook\b", re.I)
_MARKUP = re.compile(rf"\s*<(?:!doctype\s+html|html|head|body|table)\b|.*(?:{_WORKBOOK.pattern})", re.I)

_NUMBERS = ("number", "clock", "thousands")


def no_table(lines: Sequence[str], where: str) -> DataError:
    """Refusal of a text in which no dialect gives a table.

    Parameters
    ----------
    lines : sequence of str
        All lines.
    where : str
        File to name in the message.

    Returns
    -------
    DataError
        With the cause, the heading line and the first bad cell, as far as there are any.
    """
    filled = [(i, line) for i, line in enumerate(lines, 1) if line.strip()]
    looked_at = filled[:_LOOKED_AT]
    export = "Export the measured values as a table, one row a sample."
    page = next((line for _, line in looked_at[:2] if _MARKUP.match(line)), "")
    if page:
        do = "Open it in a spreadsheet, and save it as .xlsx or CSV."
        what = "a workbook in XML" if _WORKBOOK.search(page) else "a page of HTML"
        return DataError(where, f"{what}, no table of text", "rows of numbers", do)
    with_digits = [(i, line) for i, line in looked_at if any(char.isdigit() for char in line)]
    if not with_digits:
        shown = looked_at[0][1].strip()[:40] if looked_at else ""
        return DataError(
            where, f'no table of numbers found: no digit in its lines ("{shown}")', "rows of numbers", export
        )
    delimiter, width = _separator([line for _, line in with_digits])
    rows = [(i, Dialect(delimiter, ".").split(line) or []) for i, line in with_digits]
    good = [(i, cells) for i, cells in rows if _numbers(cells)]
    if len(good) == 1:
        i, cells = good[0]
        got = f'no table of numbers found: line {i} alone holds numbers ("{" ".join(cells)[:40]}")'
        return DataError(where, got, "at least 3 rows", export)
    if width > 1 or delimiter == WHITESPACE:
        bad = _first_bad(rows, width)
        if bad is not None:
            return _bad_cell(bad, looked_at, delimiter, where)
    widths = Counter(len(cells) for _, cells in rows)
    words = [cell.strip() for cell in rows[-1][1] if cell.strip() and not _numbers([cell])]
    if len(widths) == 1 and width > 1 and words:
        numbers = _numbers(rows[-1][1])
        got = f"no table of numbers found: of the {width} cells of its lines {numbers} {are(numbers)} numbers, and "
        got += ", ".join(f'"{word[:20]}"' for word in words[:3]) + f" {are(len(words))} not"
        return DataError(f"{where}, line {rows[-1][0]}", got, "rows of numbers, hardly any words among them", export)
    got = "no table of numbers found: its lines have " + ", ".join(
        f"{n} cells {k} times" for n, k in widths.most_common(3)
    )
    return DataError(where, got, "rows of numbers with the same number of cells", export)


def _separator(lines: Sequence[str]) -> tuple[str, int]:
    """Delimiter that splits most lines into the same number of cells, and that number."""
    best: tuple[int, bool, int, str] = (0, False, 1, WHITESPACE)
    for delimiter in NAMES:
        counts = Counter(len(Dialect(delimiter, ".").split(line) or []) for line in lines)
        width, times = counts.most_common(1)[0]
        best = max(best, (times if width > 1 else 0, delimiter != WHITESPACE, width, delimiter))
    return best[3], best[2]


def _numbers(cells: Sequence[str]) -> int:
    return sum(kind_of_cell(cell, mark) in _NUMBERS for cell in cells for mark in ".")


def _first_bad(rows: Sequence[tuple[int, list[str]]], width: int) -> tuple[int, int, str] | None:
    """Line, place and text of the first cell with a digit that is no number, in the rows below the heading."""
    for i, cells in rows:
        if len(cells) != width:
            continue
        for place, cell in enumerate(cells):
            kinds = {kind_of_cell(cell, mark) for mark in ".,"}
            if cell.strip()[:1].isdigit() and kinds == {"text"}:
                return i, place, cell.strip()
    return None


def _bad_cell(bad: tuple[int, int, str], filled: Sequence[tuple[int, str]], delimiter: str, where: str) -> DataError:
    line, place, cell = bad
    heading = next((text.strip() for i, text in reversed(list(filled)) if i < line), "")
    titles = Dialect(delimiter, ".").split(heading) or []
    column = f'column "{titles[place].strip()}"' if place < len(titles) else f"cell {place + 1}"
    got = f'no table of numbers found: "{cell[:30]}" in {column} is no number'
    got += f' (heading: "{heading[:60]}")' if heading else ""
    do = "Export plain numbers, their units in the heading."
    return DataError(f"{where}, line {line}", got, "digits with one decimal mark", do)
