"""Text files of any logger: layout by vote, header by score, columns by what their cells are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.records.clock.wall_clock import parse_clock
from fibrefit.records.columns.raw import Raw, RawColumn
from fibrefit.records.files.decode import Text
from fibrefit.records.grammar.dialect import NAMES, Dialect, vote
from fibrefit.records.grammar.digits import cut_short, masked_with
from fibrefit.records.grammar.facts import find_facts
from fibrefit.records.grammar.header import Header, find_header
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.numbers import Numbers, parse_column
from fibrefit.records.grammar.phrases import are, count, line_numbers
from fibrefit.records.grammar.rows import Rows, find_rows
from fibrefit.records.grammar.tokens import CLOCK, clean, kind_of_cell
from fibrefit.records.options import ReadOptions

#: Fewer samples tell neither a rate nor a layout.
FEWEST_ROWS = 3

_SEP_LINE = re.compile(r'"?sep=(.)"?;*,*\s*', re.IGNORECASE)


def read_text(text: Text, where: str, options: ReadOptions) -> Raw:
    """Columns of a text file.

    Parameters
    ----------
    text : Text
        Its lines.
    where : str
        File to name in messages.
    options : ReadOptions
        What the user says.

    Returns
    -------
    Raw
        Its columns of numbers.

    Raises
    ------
    DataError
        If the layout is not understood, or can be read in two ways.
    """
    lines = list(text.lines)
    delimiter = options.delimiter
    for i in range(min(3, len(lines))):
        match = _SEP_LINE.fullmatch(lines[i])
        if match is not None:
            delimiter, lines[i] = delimiter or match.group(1), ""
    dialect, kinds = vote(lines, where, delimiter=delimiter, mark=options.decimal)
    rows = find_rows(lines, dialect, kinds, where, ended=text.ended)
    above = _unbroken(lines[: rows.first - 1])
    empty = [not any(cell.strip() for cell in cells) for cells in rows.cells]
    header = _header(above, dialect, empty, options, where, lines[rows.first - 1])
    columns, notes = _columns(rows, kinds, header, where)
    if len(rows.numbers) < FEWEST_ROWS:
        raise DataError(where, f"only {count(len(rows.numbers), 'row')} of numbers", f"at least {FEWEST_ROWS} samples")
    return Raw(
        columns=columns,
        facts=find_facts(above),
        lines=rows.numbers,
        rows=[lines[i - 1] for i in rows.numbers],
        placed=not rows.unplaced and _blanks_are_regular(rows),
        layout=_layout(text, rows, header),
        notes=[*text.notes, *notes, *_line_notes(rows, lines)],
    )


def _unbroken(above: Sequence[str]) -> list[str]:
    """Lines above a table, with line ends inside quotes taken out; the lines that joined one are left empty."""
    joined = list(above)
    start = -1
    for i, line in enumerate(above):
        if start >= 0:
            joined[start] += " " + line
            joined[i] = ""
        if line.count('"') % 2:
            start = i if start < 0 else -1
    # A quote that never closes is a stray sign, not a frame.
    return joined if start < 0 else list(above)


def _header(
    above: Sequence[str], dialect: Dialect, empty: Sequence[bool], options: ReadOptions, where: str, sample: str
) -> Header:
    """Header of the table, or names the user gave; refused where there are neither."""
    width = dialect.width
    used = width - 1 if width > 1 and empty[-1] else width
    if options.columns:
        if len(options.columns) not in (used, width):
            _refuse_two_readings(sample, dialect, len(options.columns), where)
            got = f"{count(used, 'column')}, and {len(options.columns)} {are(len(options.columns))} named"
            raise DataError(where, got, "one name for each column", "")
        names = (*options.columns, *[""] * (width - len(options.columns)))
        return Header(names, (None,) * width, None, None)
    header = find_header(above, dialect, empty, options.wanted)
    if header is not None:
        return header
    counts = [n for line in above if (n := _count_words(line, dialect)) > 1 or (n == 1 and width == 2)]
    for words in counts[::-1]:
        _refuse_two_readings(sample, dialect, words, where)
    if dialect.delimiter == "," and dialect.mark == "." and "." not in sample:
        _refuse_two_readings(sample, dialect, width // 2, where)
    if any(re.fullmatch(r"column \d+", name, re.IGNORECASE) for name in options.wanted):
        return Header(tuple(f"column {i + 1}" for i in range(width)), (None,) * width, None, None)
    if counts:
        got = f"{count(used, 'column')} of numbers, and no line above has {count(used, 'heading')}"
        raise DataError(where, got, "a heading for each column", "Correct the header, or name the columns in order.")
    do = 'Name the columns in order, such as "time [s]", "force [N]", "position [mm]".'
    raise DataError(where, f"{count(used, 'column')} without headings", "a line with a heading for each column", do)


def _count_words(line: str, dialect: Dialect) -> int:
    """Cells of a line, if they are words throughout."""
    cells = [cell for cell in dialect.split(line) or [] if cell.strip()]
    return len(cells) if all(kind_of_cell(cell, ".") == "text" for cell in cells) else 0


def _refuse_two_readings(sample: str, dialect: Dialect, names: int, where: str) -> None:
    """Refuse a comma that may separate columns or decimals."""
    cells = [cell.strip() for cell in sample.split(",")]
    if (
        dialect.delimiter != ","
        or names < 1
        or len(cells) <= names
        or not all(re.fullmatch(r"[+-]?\d+", c) for c in cells)
    ):
        return
    reading = f"as {len(cells)} whole numbers ({'  '.join(cells)})"
    if len(cells) == 2 * names:
        pairs = "  ".join(f"{a},{b}" for a, b in zip(cells[::2], cells[1::2], strict=True))
        reading += f" or as {names} with a decimal comma ({pairs})"
    else:
        reading += f", or as {names} with decimal commas in some of them"
    do = "Export it again with semicolons or tabs between the columns, or with decimal points."
    raise DataError(where, f'"{sample.strip()}" can be read {reading}', "one reading", do)


def _columns(rows: Rows, kinds: Sequence[str], header: Header, where: str) -> tuple[list[RawColumn], list[str]]:
    columns: list[RawColumn] = []
    notes: list[str] = []
    last = len(rows.cells) - 1
    for i, cells in enumerate(rows.cells):
        title = header.names[i]
        name, unit = split_heading(title)
        unit = unit or header.units[i]
        shown = title or f"column {i + 1}"
        kind = kinds[i] if kinds[i] != "empty" else _kind_of_sparse(cells, rows.dialect.mark)
        place = f'{where}, column "{shown}"'
        if kind == "clock" and any(_has_time(cell) for cell in cells[:20]):
            columns.append(_clock_column(title, name, cells, place, notes))
        elif kind == "number":
            numbers = parse_column(cells, rows.dialect.mark, rows.numbers, place)
            if rows.cut and i == last and cut_short(numbers):
                end = np.arange(len(cells)) == len(cells) - 1
                numbers = masked_with(numbers, end, "cut short")
            columns.append(RawColumn(title, name, unit, numbers, resolution=numbers.resolution))
        elif title or kind != "empty":
            what = {"empty": "is empty", "clock": "holds dates only", "text": "holds text"}[kind]
            notes.append(f'Column "{shown}" {what} and is left out.')
    return columns, notes


def _kind_of_sparse(cells: Sequence[str], mark: str) -> str:
    """Kind of a column that is empty at the end of the table."""
    found = [kind_of_cell(cell, mark) for cell in cells if cell.strip()]
    if not found:
        return "empty"
    return max(("number", "clock", "text"), key=found.count)


def _has_time(cell: str) -> bool:
    match = CLOCK.fullmatch(clean(cell))
    return match is not None and match.group("time") is not None


def _clock_column(title: str, name: str, cells: Sequence[str], where: str, notes: list[str]) -> RawColumn:
    clock = parse_clock(cells, where)
    notes.extend(clock.notes)
    notes.append(f"The first sample was taken at {clock.start}.")
    numbers = Numbers.of_array(clock.seconds)
    return RawColumn(title, name, None, numbers, clock=True, resolution=clock.resolution)


def _blanks_are_regular(rows: Rows) -> bool:
    """Whether empty lines say nothing about missing rows: there are none, or as many after every row."""
    return not rows.blank or int(np.ptp(np.diff(rows.numbers))) == 0


def _layout(text: Text, rows: Rows, header: Header) -> dict[str, Any]:
    return {
        "format": "text",
        "encoding": text.encoding,
        "delimiter": NAMES.get(rows.dialect.delimiter, rows.dialect.delimiter),
        "decimal": "comma" if rows.dialect.mark == "," else "point",
        "header_line": header.line,
        "unit_line": header.unit_line,
        "first_row": rows.first,
        "last_row": rows.last,
        "rows": len(rows.numbers),
        "unreadable_lines": list(rows.unplaced),
    }


def _line_notes(rows: Rows, lines: Sequence[str]) -> list[str]:
    notes = []
    if rows.unplaced:
        left_out = f"and {are(len(rows.unplaced))} left out"
        notes.append(f"{line_numbers(rows.unplaced)} cannot be split into {rows.dialect.width} cells {left_out}.")
    if rows.stray:
        notes.append(f"{line_numbers(rows.stray)} above the table: numbers, taken for part of the header.")
    if rows.below:
        shown = lines[rows.below[0] - 1].strip()[:30]
        notes.append(f'{line_numbers(rows.below)} below the table {are(len(rows.below))} left out ("{shown}").')
    if rows.cut:
        notes.append("The file ends without an end of line: its last value may be cut short.")
    return notes
