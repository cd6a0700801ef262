"""What stands around a table of text, and in its columns of words, taken apart for the account of it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence

from fibrefit.records.columns.raw import RawColumn, Told
from fibrefit.records.grammar.header import Header
from fibrefit.records.grammar.rows import Rows
from fibrefit.records.grammar.tokens import kind_of_cell


def told_beside(
    around: Sequence[tuple[int, str]],
    header: Header,
    rows: Rows,
    columns: Sequence[RawColumn],
    aside: Mapping[int, str],
) -> list[Told]:
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
    return [*_lines(around, header, rows.first), *_remarks(rows, aside), *_listed(around, columns)]


def _lines(around: Sequence[tuple[int, str]], header: Header, first: int) -> list[Told]:
    """Lines around a table that are no headings of it, each once."""
    taken = (header.line, header.unit_line)
    lines = {line.strip(): number for number, line in around[::-1] if line.strip() and number not in taken}
    top = header.line or first
    said = sorted(lines.items(), key=lambda one: one[1])
    return [Told(f"line {number}", line, row=top < number < first) for line, number in said]


def _remarks(rows: Rows, aside: Mapping[int, str]) -> list[Told]:
    """Words in columns that hold no numbers, each once, with its line."""
    found = []
    for place in aside:
        first: dict[str, int] = {}
        for cell, number in zip(rows.cells[place - 1], rows.numbers, strict=True):
            if cell.strip():
                first.setdefault(cell.strip(), int(number))
        found += [Told(f"line {number}", cell) for cell, number in first.items()]
    return found


def _listed(around: Sequence[tuple[int, str]], columns: Sequence[RawColumn]) -> list[Told]:
    """What a table of the channels says of each: ``Ch;Name;Unit;Factor`` above ``1;force;N;2.0``."""
    found: list[Told] = []
    labels: list[str] = []
    for number, line in around:
        cells = [cell.strip().strip('"') for cell in re.split(r"[;,\t|]", line)]
        own = next((c for c in columns if c.name and {c.name, c.header} & set(cells)), None)
        if not cells[2:]:
            labels = []
        elif all(kind_of_cell(cell, ".") in ("text", "empty") for cell in cells) and own is None:
            labels = cells
        elif own is not None and len(labels) == len(cells):
            said = zip(labels, cells, strict=True)
            found += [Told(f"line {number}", f"{label} = {cell}", own.header) for label, cell in said if label and cell]
    return found
