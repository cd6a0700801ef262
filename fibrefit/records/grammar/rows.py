"""Which lines of a file are samples, and which are headings, remarks, summaries or damage."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.records.grammar.dialect import WHITESPACE, Dialect
from fibrefit.records.grammar.phrases import count
from fibrefit.records.grammar.tokens import kind_of_cell, shapes_of
from fibrefit.records.thresholds import COUNTED_ROWS, DIGITS_OF_A_ROW, STRAY_ROWS, STRAY_SHARE

#: Marks of a remark at the start of a line.
REMARK = re.compile(r"\s*(#|%|//|!|\*(?!\*))+\s*")

FULL, PARTIAL, HOLLOW, HEADING, BLANK, OTHER = "full", "partial", "hollow", "heading", "blank", "other"

_WITH_CELLS = frozenset((FULL, PARTIAL, HOLLOW))

#: How a line speaks for or against being inside the table. Words alone end a table sooner than a broken row does.
_WEIGHT = {FULL: 1.0, PARTIAL: -0.5, BLANK: 0.0, HOLLOW: 0.0, OTHER: -1.0, HEADING: -3.0}


#: Words that begin a line of statistics below a table.
_SUMMARY = re.compile(
    r"\W*(max|min|mean|avg|average|massim|m[a\u00e1]xim|m[i\u00ed]nim|media|moyenne|promedio|deviazione|desviaci[o\u00f3]n|[e\u00e9]cart|mittel\w*|summe|sum|std|stdev|rms|count|end|ende|konec|total|pr[uů]m[eě]r)\w*\b",
    re.I,
)


@dataclass(frozen=True, slots=True)
class Rows:
    """The table of a file, cell by cell.

    Parameters
    ----------
    cells : list of tuple of str
        The columns, each with one cell a row.
    numbers : (n_rows,) int array
        Line of each row, counted from 1.
    first, last : int
        Lines between which the table lies, counted from 1.
    unplaced : tuple of int
        Lines inside the table that are no row: too many or too few cells, or something else.
    skipped : tuple of int
        Lines inside the table that say nothing about samples: remarks, repeated headings.
    blank : tuple of int
        Empty lines inside the table.
    stray : tuple of int
        Lines of numbers above the table that are left out.
    below : tuple of int
        Lines after the table.
    remarks : tuple of (int, str)
        Words behind rows, with their lines.
    cut : bool
        Whether the very last cell may have lost characters, because the file ends in the middle of a line.
    """

    cells: list[tuple[str, ...]]
    numbers: np.ndarray
    first: int
    last: int
    unplaced: tuple[int, ...] = ()
    skipped: tuple[int, ...] = ()
    blank: tuple[int, ...] = ()
    stray: tuple[int, ...] = ()
    below: tuple[int, ...] = ()
    remarks: tuple[tuple[int, str], ...] = ()
    cut: bool = False
    dialect: Dialect = field(default_factory=lambda: Dialect(",", "."))


def find_rows(lines: Sequence[str], dialect: Dialect, kinds: Sequence[str], where: str, *, ended: bool) -> Rows:
    """Rows of the table in a file.

    Parameters
    ----------
    lines : sequence of str
        All lines.
    dialect : Dialect
        As voted.
    kinds : sequence of str
        Kind of each column: ``"number"``, ``"clock"``, ``"text"`` or ``"empty"``.
    where : str
        File to name in messages.
    ended : bool
        Whether the last line had an end.

    Returns
    -------
    Rows
        The table.

    Raises
    ------
    DataError
        If the file holds more than one table.
    """
    classes = classify(lines, dialect, kinds)
    first, last = _block(lines, classes)
    stray = tuple(i + 1 for i in range(first) if classes[i] == FULL)
    _refuse_second_table(lines, classes, (first, last), dialect, where)
    while first > 0 and classes[first - 1] in (PARTIAL, OTHER) and _may_be_damaged(lines[first - 1], dialect, kinds):
        first -= 1
    block = range(first, last + 1)
    cells, numbers, unplaced, skipped = _regular(lines, classes, block, dialect) or _collect(
        lines, classes, block, partial(_row, dialect=dialect, kinds=kinds), where
    )
    if not cells:
        raise DataError(where, "no rows of numbers", "a table of measured values")
    return Rows(
        cells=cells,
        numbers=np.array(numbers),
        first=first + 1,
        last=last + 1,
        unplaced=tuple(unplaced),
        skipped=tuple(i for i in skipped if lines[i - 1].strip()),
        blank=tuple(i for i in skipped if not lines[i - 1].strip()),
        stray=stray,
        below=tuple(i + 1 for i in range(last + 1, len(lines)) if lines[i].strip()),
        remarks=tuple(_behind(lines, numbers, dialect)),
        cut=not ended and last == len(lines) - 1,
        dialect=dialect,
    )


def _refuse_second_table(
    lines: Sequence[str], classes: Sequence[str], block: tuple[int, int], dialect: Dialect, where: str
) -> None:
    """Refuse a file with more lines of numbers outside the table than a header may hold."""
    first, last = block
    others = (*range(first), *range(last + 1, len(lines)))
    alike = {i for i in others if _looks_like_a_row(lines[i])}
    outside = sorted(i + 1 for i in alike if alike & {i - 1, i + 1})  # one by itself is a value below its name
    if len(outside) > max(STRAY_ROWS, STRAY_SHARE * (last - first)):
        _refuse_odd_row(lines, classes, [i - 1 for i in outside], block, dialect, where)
        got = (
            f"more than one table of numbers (lines {outside[0]} to {outside[-1]}, and lines {first + 1} to {last + 1})"
        )
        raise DataError(where, got, "one table", "Split the file.")


def _refuse_odd_row(
    lines: Sequence[str],
    classes: Sequence[str],
    outside: Sequence[int],
    block: tuple[int, int],
    dialect: Dialect,
    where: str,
) -> None:
    """Refuse lines beside the table, with no heading and no blank between, for the first of them that is no row."""
    last = max((i for i in outside if i < block[0]), default=block[0])
    next_one = min((i for i in outside if i > block[1]), default=block[1])
    between = [*range(last, block[0]), *range(block[1] + 1, next_one)]
    odd = next((i for i in outside if classes[i] in (PARTIAL, OTHER)), None)
    if odd is None or any(not lines[i].strip() or re.search(r"[^\W\d_]{2}", lines[i]) for i in between):
        return
    cells = dialect.split(lines[odd]) or []
    text = next((cell.strip() for cell in cells if kind_of_cell(cell, dialect.mark) == "text"), "")
    got = f'"{lines[odd].strip()[:60]}" has {count(len(cells), "cell")} where the table has {dialect.width}'
    if len(cells) == dialect.width and text:
        got = f'"{text[:30]}" is no number'
    do = "Export plain numbers, with one and the same separator between all of them."
    raise DataError(f"{where}, line {odd + 1}", got, f"rows of {dialect.width} numbers", do)


_Found = tuple[list[tuple[str, ...]], list[int], list[int], list[int]]


def _regular(lines: Sequence[str], classes: list[str], block: range, dialect: Dialect) -> _Found | None:
    """As `_collect`, all lines at once; None where they are not all alike."""
    stretch = lines[block.start : block.stop]
    if len(stretch) <= COUNTED_ROWS or any(kind != FULL for kind in classes[block.start : block.stop]):
        return None
    # A row of fewer cells has fewer separators, and one of more is no row.
    joined, delimiter = "\n".join(stretch), dialect.delimiter
    if '"' in joined or delimiter == WHITESPACE or joined.count(delimiter) != (dialect.width - 1) * len(stretch):
        return None
    cells = joined.replace(delimiter, "\n").split("\n")
    columns = [tuple(cells[place :: dialect.width]) for place in range(dialect.width)]
    if {column[0] for column in columns} <= {str(len(stretch) - 1), ""}:
        return None
    return columns, [line + 1 for line in block], [], []


def _collect(
    lines: Sequence[str], classes: list[str], block: range, row_of: Callable[[str], list[str] | None], where: str
) -> _Found:
    """Columns of a block with the lines of its rows, and the lines in it that are none."""
    heading = {line.strip() for line in lines[: block.start]} - {""}
    rows: list[list[str]] = []
    numbers: list[int] = []
    unplaced: list[int] = []
    skipped: list[int] = []
    for i in block:
        known = classes[i] != FULL and lines[i].strip() in heading
        row = row_of(lines[i]) if classes[i] in _WITH_CELLS and not known else None
        if row is not None:
            rows.append(row)
            numbers.append(i + 1)
        elif classes[i] == BLANK or known or REMARK.match(lines[i]):
            skipped.append(i + 1)
        elif classes[i] == HEADING:
            got = f'a second heading inside the table ("{lines[i].strip()[:40]}")'
            raise DataError(f"{where}, line {i + 1}", got, "one table", "Split the file.")
        else:
            unplaced.append(i + 1)
    if len(rows) > COUNTED_ROWS and set(rows[0]) <= {str(len(rows) - 1), ""}:  # how many rows follow
        skipped.insert(0, numbers.pop(0))
        rows.pop(0)
    return list(zip(*rows, strict=True)), numbers, unplaced, skipped


def _behind(lines: Sequence[str], numbers: Sequence[int], dialect: Dialect) -> Iterator[tuple[int, str]]:
    """Words behind rows, beyond the last column."""
    for number in numbers if dialect.delimiter != WHITESPACE else ():
        if lines[number - 1].count(dialect.delimiter) >= dialect.width:
            words = " ".join((dialect.split(lines[number - 1]) or [])[dialect.width :]).strip()
            if words:
                yield number, words


def _may_be_damaged(line: str, dialect: Dialect, kinds: Sequence[str]) -> bool:
    """Whether a line above the table is a row of it that is damaged: it has a readable number where numbers stand."""
    cells = dialect.split(line) or []
    whole = len(cells) == dialect.width
    measured = [cell for i, cell in enumerate(cells) if not whole or kinds[i] in ("number", "clock")]
    readable = any(kind_of_cell(cell, dialect.mark) in ("number", "clock", "thousands") for cell in measured)
    return readable and _looks_like_a_row(line)


def _looks_like_a_row(line: str) -> bool:
    """Whether a line that is no row may be a damaged one: digits, and no word."""
    digits = sum(char.isdigit() for char in line)
    longest = max((len(run) for run in re.findall(r"[^\W\d_]+", line)), default=0)
    return digits > DIGITS_OF_A_ROW * len(line.replace(" ", "")) and longest <= 1


def classify(lines: Sequence[str], dialect: Dialect, kinds: Sequence[str]) -> list[str]:
    """Class of each line.

    Parameters
    ----------
    lines : sequence of str
        Lines of the file.
    dialect : Dialect
        As voted.
    kinds : sequence of str
        Kind of each column.

    Returns
    -------
    list of str
        ``"full"`` for a row, ``"partial"`` for one with text where a number belongs, ``"hollow"`` for one of empty
        cells, ``"heading"`` for words in as many cells as the table has columns, ``"blank"``, or ``"other"``.
    """
    delimiter, separators, blanks = dialect.delimiter, dialect.width - 1, dialect.delimiter == WHITESPACE
    signs = re.escape(dialect.mark + ("" if blanks else delimiter)) + (r":./TZAPMapm" if "clock" in kinds else "")
    signs += r'+\-eE" \t'
    # Most shapes hold digits and signs only, and need no look at every cell.
    plain = re.compile(rf"[{signs}]*\d[\d{signs}]*").fullmatch if delimiter != dialect.mark else None
    known: dict[str, str] = {}
    shapes = shapes_of(lines)
    for shape in dict.fromkeys(shapes):
        simple = plain is not None and plain(shape)
        if simple and (len(shape.split()) - 1 if blanks else shape.count(delimiter)) == separators:
            known[shape] = FULL
        else:
            known[shape] = _class_of(shape, dialect, kinds)
    return [known[shape] for shape in shapes]


def _class_of(line: str, dialect: Dialect, kinds: Sequence[str]) -> str:
    if not line.strip():
        return BLANK
    cells = _row(line, dialect, kinds)
    if cells is None:
        return OTHER
    found = [kind_of_cell(cell, dialect.mark) for cell in cells]
    # Words in a column that is empty otherwise are remarks, but at the start of a line they are labels.
    columns = ["number" if i == 0 and kind == "empty" else kind for i, kind in enumerate(kinds)]
    wrong = [kind == "text" for kind, column in zip(found, columns, strict=True) if column in ("number", "clock")]
    if set(found) <= {"empty"}:
        return HOLLOW
    if not any(wrong):
        return FULL if set(found) - {"empty", "text"} else OTHER
    numbers = {"number", "clock", "thousands", "not a number", "overflow"} & set(found)
    words = [
        cell for cell, kind in zip(cells, found, strict=True) if kind == "text" and cell.strip(' "([')[:1].isalpha()
    ]
    return PARTIAL if numbers or len(words) < min(2, len(cells)) else HEADING


def _row(line: str, dialect: Dialect, kinds: Sequence[str]) -> list[str] | None:
    """Cells of a row; None where their number is not that of the table."""
    cells = dialect.split(line)
    if cells is None or len(cells) == dialect.width:
        return cells
    beyond = cells[dialect.width :]
    if dialect.delimiter != WHITESPACE and beyond and re.search(r"[^\W\d_]{2}", "".join(beyond)):
        known = {kind_of_cell(cell, dialect.mark) for cell in cells[: dialect.width]}
        if known <= {"number", "clock"} and {kind_of_cell(cell, dialect.mark) for cell in beyond} <= {"text", "empty"}:
            return cells[: dialect.width]  # a remark behind the row
    # Only the delimiter at the end of the line is missing, which says nothing.
    if len(cells) == dialect.width - 1 and kinds[-1] == "empty" and cells[-1].strip():
        return [*cells, ""]
    return None


def _block(lines: Sequence[str], classes: list[str]) -> tuple[int, int]:
    """First and last line of the stretch in which rows outweigh other lines most."""
    best, first, last = 0.0, 0, -1
    total, start = 0.0, 0
    seen: set[str] = set()
    for i, kind in enumerate(classes):
        if total <= 0:
            total, start = 0.0, i
        if kind in (HEADING, OTHER, PARTIAL):
            text = lines[i].strip()
            # A heading that comes again, as on every page of a print, does not end the table.
            total += 0.0 if text in seen else _WEIGHT[kind]
            seen.add(text)
        else:
            total += _WEIGHT[kind]
        if total > best:
            best, first, last = total, start, i
    while first < last and classes[first] != FULL:
        first += 1
    ends = [i for i in range(max(last, 0), len(classes)) if classes[i] == FULL and not _SUMMARY.match(lines[i])]
    return first, ends[-1] if ends else last
