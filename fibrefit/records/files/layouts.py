"""Layouts of older programs, brought to the usual one before the table is looked for."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fibrefit.records.grammar.header import Header
from fibrefit.records.grammar.tokens import kind_of_cell
from fibrefit.records.thresholds import LAYOUT_LINES

#: A cell in single quotes.
_SINGLE_QUOTED = re.compile(r"((?:^|[,;\t|])\s{0,40})'([^']*)'(?=\s{0,40}(?:[,;\t|]|$))")

#: Columns of a header that stands beside the first rows: what, its value, its unit.
BESIDE = 3

_SEP_LINE = re.compile(r'"?sep=(.)"?;*,*\s*', re.IGNORECASE)


def with_thousandths(columns: Sequence[tuple[str, ...]], kinds: Sequence[str], header: Header) -> list[tuple[str, ...]]:
    """Columns of cells, in which thousandths of a second that stand beside clock times are put behind these.

    Parameters
    ----------
    columns : sequence of tuple of str
        One cell a row.
    kinds : sequence of str
        Of each.
    header : Header
        Of the table.
    """
    found = list(columns)
    for i in (
        i for i, kind in enumerate(kinds[:-1]) if kind == "clock" and "ms" in (header.names[i + 1], header.units[i + 1])
    ):
        whole = all(re.fullmatch(r"[^.,]*:\d\d", cell.strip()) for cell in columns[i])
        if whole and all(re.fullmatch(r"\d{1,3}", cell.strip()) for cell in columns[i + 1]):
            found[i] = tuple(f"{a.strip()}.{int(b):03d}" for a, b in zip(*columns[i : i + 2], strict=True))
            found[i + 1] = ("",) * len(found[i])
    return found


def separator_told(lines: Sequence[str], delimiter: str | None) -> tuple[list[str], str | None]:
    """Lines without the one that tells spreadsheets the separator, and that separator."""
    found = list(lines)
    for i in range(min(3, len(found))):
        match = _SEP_LINE.fullmatch(found[i])
        if match is not None:
            delimiter, found[i] = delimiter or match.group(1), ""
    return found, delimiter


def requoted(lines: list[str]) -> list[str]:
    """Lines with double quotes where the file puts its cells in single ones."""
    framed = sum(_SINGLE_QUOTED.search(line) is not None for line in lines[-LAYOUT_LINES:])
    if framed <= 0.5 * min(len(lines), LAYOUT_LINES):
        return lines
    return [_SINGLE_QUOTED.sub(r'\1"\2"', line) for line in lines]


def step_beside(lines: list[str]) -> tuple[list[str], list[str]]:
    """Lines without a start and a step that stand beside the headings alone, rows being shorter; and what they say."""
    rows = [[cell.strip() for cell in line.rstrip(", ").split(",")] for line in lines[:3]]
    if (
        len(rows) < 3
        or len(rows[0]) != len(rows[1])
        or tuple(map(str.casefold, rows[0][-2:])) != ("start", "increment")
    ):
        return lines, []
    if len(rows[2]) >= len(rows[0]) or any(kind_of_cell(cell, ".") != "number" for cell in rows[1][-2:]):
        return lines, []
    told = [f"{name} = {cell}" for name, cell in zip(rows[0][-2:], rows[1][-2:], strict=True)]
    behind = "," * (len(lines[2]) - len(lines[2].rstrip(",")))
    return [",".join(rows[0][:-2]), ",".join(rows[1][:-2]), *(line.removesuffix(behind) for line in lines[2:])], told


def header_beside(lines: list[str]) -> tuple[list[str], list[str]]:
    """Lines without the header that older scopes write to the left of the first rows, and what that header says."""
    rows = [line.split(",") for line in lines[:LAYOUT_LINES]]
    told = [",".join(cells[:BESIDE]) for cells in rows]
    number = next((i for i, text in enumerate(told) if not text.strip(" ,")), 0)
    measured = all(
        cells[BESIDE + 1 :] and all(kind_of_cell(cell.strip(), ".") == "number" for cell in cells[BESIDE:][:2])
        for cells in rows
    )
    if not (number and measured and all(kind_of_cell(cells[0], ".") == "text" for cells in rows[:number])):
        return lines, []
    empty = "," * BESIDE
    return [*(empty + ",".join(cells[BESIDE:]) for cells in rows[:number]), *lines[number:]], told[:number]
