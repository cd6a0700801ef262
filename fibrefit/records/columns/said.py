"""What stands around a table of text, and in its columns of words, taken apart for the account of it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

import numpy as np

from fibrefit.core import units
from fibrefit.records.columns.raw import Annotation, RawColumn
from fibrefit.records.grammar.dialect import WHITESPACE
from fibrefit.records.grammar.header import Header
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.numbers import CODE
from fibrefit.records.grammar.rows import Rows
from fibrefit.records.grammar.tokens import kind_of_cell

#: What says something in a cell that holds no number: a word, or the sign of a factor before a number.
_SAYS = re.compile(r"[^\W\d_]{3}|^\W*[x*/\u00d7\u00b7]\s?\d", re.I)


def annotations_beside(
    around: Sequence[tuple[int, str]],
    header: Header,
    rows: Rows,
    columns: Sequence[RawColumn],
    aside: Mapping[int, str],
) -> list[Annotation]:
    """All that a text says beside its numbers and is no heading.

    Parameters
    ----------
    around : sequence of (int, str)
        Lines above, below and inside the table that are no rows, with their numbers.
    header : Header
        Its headings.
    rows : Rows
        The table.
    columns : sequence of RawColumn
        Those of numbers.
    aside : mapping of int to str
        The others, by their number.
    """
    headings = (header.line, header.unit_line, *header.listed)
    lines = [(number, line) for number, line in around if number not in headings]
    placed = [(f"line {number}", line) for number, line in around if number != header.line]
    found = [*_lines(around, header, rows.first), *listed_channels(placed, columns)]
    found += _in_columns(lines, rows, columns)
    titles = [Annotation(f"column {place}", header.names[place - 1]) for place in aside if header.names[place - 1]]
    return [*found, *_of_unit_row(header, columns), *titles, *_remarks(rows, header, aside)]


def unread_cells(
    columns: Sequence[RawColumn], lines: np.ndarray, clocks: Mapping[int, Sequence[str]]
) -> tuple[list[Annotation], list[str]]:
    """What cells of columns of numbers say that are none, each once; and a note on each column that quotes the first.

    It may be said of all columns, whichever it stands in.

    Parameters
    ----------
    columns : sequence of RawColumn
        Of the file.
    lines : (n_rows,) int array
        Line of each row.
    clocks : mapping of int to sequence of str
        Cells of those columns that hold clock times, by their number.
    """
    found: list[Annotation] = []
    notes: list[str] = []
    for column in columns:
        numbers = column.numbers
        cells = clocks.get(column.number, ()) if column.clock else numbers.texts
        unread = np.isnan(numbers.values) if column.clock else numbers.reasons == CODE["unreadable"]
        odd = ((cells[i].strip(), int(lines[i])) for i in np.flatnonzero(unread).tolist() if len(cells))
        first: dict[str, int] = {}
        for cell, line in odd:
            if kind_of_cell(cell, numbers.mark) in ("text", "thousands", "number" if column.clock else "clock"):
                first.setdefault(cell, line)
        place = f'column "{column.header or column.number}"'
        found += [Annotation(f"line {line}, {place}", cell) for cell, line in first.items() if _SAYS.search(cell)]
        for cell, line in [*first.items()][:1]:
            notes.append(f'Cells of {place} that hold no number are left out, such as "{cell[:30]}" in line {line}.')
    return found, notes


def _of_unit_row(header: Header, columns: Sequence[RawColumn]) -> list[Annotation]:
    """Cells of a line of units below headings that have units of their own, and say something else than these."""
    found = []
    for column in columns:
        own, cell = split_heading(column.header)[1], header.units[column.number - 1]
        if own and cell and cell != own and (units.expression(cell) is None or units.expression(own) is None):
            found.append(Annotation(f"line {header.unit_line}", f"unit = {cell}", column.header))
    return found


def _in_columns(around: Sequence[tuple[int, str]], rows: Rows, columns: Sequence[RawColumn]) -> list[Annotation]:
    """Cells of lines that have as many of them as the table: each is said of its column, with the label before all."""
    found, named = [], {name for c in columns for name in (c.name, c.header) if name}
    for number, line in around if rows.dialect.delimiter != WHITESPACE else ():
        cells = [cell.strip() for cell in rows.dialect.split(line) or []]
        if len(cells) != len(rows.cells) or f"{rows.dialect.delimiter} " in line.strip():
            continue
        if re.match(r"[\W\d_]*[^\W\d_][^:=]*[:=].*\d", cells[0]):
            continue  # a statement of its own: "Fs: 10,000 S/s"
        if named & set(cells):
            continue  # a row of a list of channels
        labelled = re.search(r"[^\W\d_]", cells[0]) and cells[0] not in cells[1:] and any(cells[1:])
        label = cells[0] if labelled else ""
        mine = [(c, cells[c.number - 1]) for c in columns if c.number > bool(label)]
        found += [Annotation(f"line {number}", f"{label}: {cell}".strip(": "), c.header) for c, cell in mine if cell]
    return found


def _lines(around: Sequence[tuple[int, str]], header: Header, first: int) -> list[Annotation]:
    """Lines around a table that are no headings of it, each once."""
    taken = (header.line, header.unit_line, *header.listed)
    lines = {line.strip(): number for number, line in around[::-1] if line.strip() and number not in taken}
    top = header.line or first
    said = sorted(lines.items(), key=lambda one: one[1])
    return [Annotation(f"line {number}", line, row=top < number < first) for line, number in said]


def _remarks(rows: Rows, header: Header, aside: Mapping[int, str]) -> list[Annotation]:
    """Words in columns that hold no numbers, each once, with its line."""
    found = []
    for place in aside:
        first: dict[str, int] = {}
        for cell, number in zip(rows.cells[place - 1], rows.numbers, strict=True):
            if cell.strip():
                first.setdefault(cell.strip(), int(number))
        title = header.names[place - 1]
        found += [
            Annotation(f"line {number}", f"{title} = {cell}" if title else cell) for cell, number in first.items()
        ]
    return found


def listed_channels(around: Sequence[tuple[str, str]], columns: Sequence[RawColumn]) -> list[Annotation]:
    """What a table of the channels says of each: ``Ch;Name;Unit;Factor`` above ``1;force;N;2.0``.

    Parameters
    ----------
    around : sequence of (str, str)
        Lines with where they stand.
    columns : sequence of RawColumn
        Those of numbers.
    """
    found: list[Annotation] = []
    labels: list[str] = []
    for place, line in around:
        cells = [cell.strip().strip('"') for cell in re.split(r"[;,\t|]", line)]
        own = next((c for c in columns if c.name and {c.name, c.header} & set(cells)), None)
        if not cells[2:]:
            labels = []
        elif all(kind_of_cell(cell, ".") in ("text", "empty") for cell in cells) and own is None:
            labels = cells
        elif own is not None and len(labels) == len(cells):
            said = zip(labels, cells, strict=True)
            found += [Annotation(place, f"{label} = {cell}", own.header) for label, cell in said if label and cell]
    return found
