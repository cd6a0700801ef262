"""Where the table of a sheet lies: beside blocks of other cells, on its side, below headings of two rows."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from itertools import groupby

from fibrefit.records.grammar.header import is_unit_row
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.words import kinds_named
from fibrefit.records.thresholds import STRAY_ROWS, STRAY_SHARE

Cells = Sequence[Sequence[str]]


class Decimal(str):
    """A number with decimals, as it is written out: no text of the sheet."""

    __slots__ = ()


def is_row(row: Sequence[str]) -> bool:
    """Whether a row of a sheet is one of numbers.

    Parameters
    ----------
    row : sequence of str
        Its cells.
    """
    return any(row) and sum(_is_number(cell) for cell in row) >= min(2, len(row))


def _is_number(cell: str) -> bool:
    return cell[:1].isdigit() or cell[:1] in ("-", "+", ".")


def upright(rows: Cells) -> list[Sequence[str]] | None:
    """Rows of a sheet that has a channel a row, each below its name; None where a sheet does not lie on its side.

    It does where each row of numbers begins with the name of a quantity, no two with the same, and has more numbers
    than there are rows.

    Parameters
    ----------
    rows : sequence of sequence of str
        Of a sheet, all as long.
    """
    if not rows or len(rows[0]) <= len(rows):
        return None
    lying = [list(row) for row in rows if is_row(row)]
    if len(lying) < 2:
        return None
    first = next((i for i, cells in enumerate(zip(*lying, strict=True)) if all(map(_is_number, cells))), 0)
    names = [" ".join(filter(None, row[:first])) for row in lying]
    kinds = [frozenset(kinds_named(split_heading(name)[0])) for name in names]
    if not all(kinds) or len(set(kinds)) < len(kinds):
        return None
    above = [[cell for cell in row if cell] for row in rows if any(row) and not is_row(row)]
    width = max(len(lying), *map(len, above), 0)
    if width > len(rows):
        return None  # a row of headings over the numbers
    return [[*row, *[""] * (width - len(row))] for row in (*above, *zip(*lying, strict=True))]


def with_whole_headings(rows: Cells) -> list[Sequence[str]]:
    """Rows of a sheet whose headings stand in two rows, some of them over both: each in the row above the numbers.

    Parameters
    ----------
    rows : sequence of sequence of str
        Of a sheet, all as long.
    """
    found = list(rows)
    filled = [i for i in range(next((i for i, row in enumerate(rows) if is_row(row)), 0)) if any(rows[i])]
    while filled and is_unit_row(rows[filled[-1]]):
        filled.pop()
    if len(filled) < 2 or sum(map(bool, rows[filled[-2]])) < 2:
        return found
    upper, lower = (rows[i] for i in filled[-2:])
    if is_unit_row(upper) or sum(map(_names_quantity, lower)) < 1:
        return found
    found[filled[-1]] = [b or (a if _names_quantity(a) else "") for a, b in zip(upper, lower, strict=True)]
    return found


def _names_quantity(cell: str) -> bool:
    return bool(kinds_named(split_heading(cell)[0])) and not _is_number(cell)


def without_blocks_beside(rows: Cells) -> tuple[list[Sequence[str]], list[tuple[str, str]]]:
    """Rows of a sheet without the blocks of cells beside its table, and what these say: where, and what.

    A block is of several columns, apart from the table by an empty one, shorter than half of it, and has no rows of
    numbers but a few, as they stand above a table.

    Parameters
    ----------
    rows : sequence of sequence of str
        Of a sheet, all as long.
    """
    blocks = list(_blocks(rows))
    if len(blocks) < 2:
        return list(rows), []
    numbers = [sum(is_row(row[block]) for row in rows) for block in blocks]
    longest = max(numbers, default=0)
    few = max(STRAY_ROWS, STRAY_SHARE * longest)
    aside = [
        block
        for block, count in zip(blocks, numbers, strict=True)
        if count <= few and block.stop - block.start > 1 and 2 * sum(any(row[block]) for row in rows) < longest
    ]
    found, beside = [list(row) for row in rows], []
    for block in aside:
        for i, row in enumerate(found, 1):
            if any(row[block]):
                beside.append((f"beside the table, row {i}", "\t".join(filter(None, row[block]))))
            row[block] = [""] * (block.stop - block.start)
    return list(found), beside


def _blocks(rows: Cells) -> Iterator[slice]:
    """Columns that hold anything, as far as they stand side by side."""
    held = [any(column) for column in zip(*rows, strict=True)]
    place = 0
    for filled, cells in groupby(held):
        size = len(list(cells))
        if filled:
            yield slice(place, place + size)
        place += size
