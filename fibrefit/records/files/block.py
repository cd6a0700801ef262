"""Long tables of text: the layout from both ends of the file, the numbers between by NumPy's parser.

Only a table that is regular to the last character goes this way: as many cells in every line, nothing in them but
digits and signs. Everything else is read cell by cell.
"""

from __future__ import annotations

import io
import itertools
import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import overload

import numpy as np

from fibrefit.records.columns.raw import Raw
from fibrefit.records.files.decode import Text
from fibrefit.records.files.text import below_note, read_text
from fibrefit.records.grammar.dialect import NAMES
from fibrefit.records.grammar.numbers import CODE, EMPTY_WHOLE, EXPONENT, Numbers
from fibrefit.records.options import ReadOptions

#: Bytes from which a file is long, and bytes at its start and its end that tell its layout.
_LONG, _HEAD, _TAIL = 1 << 20, 1 << 15, 1 << 13

_SEPARATORS = {name: sign for sign, name in NAMES.items()}


@dataclass(frozen=True, slots=True)
class Cells(Sequence[str]):
    """Texts of a column, or lines, cut out of the file when they are needed.

    Parameters
    ----------
    data : bytes
        Of the table.
    starts, ends : (n,) int array
        Where each text begins and ends.
    """

    data: bytes
    starts: np.ndarray
    ends: np.ndarray

    def __len__(self) -> int:
        return int(self.starts.size)

    @overload
    def __getitem__(self, index: int) -> str: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[str]: ...
    def __getitem__(self, index: int | slice) -> str | Sequence[str]:
        if isinstance(index, slice):
            return Cells(self.data, self.starts[index], self.ends[index])
        return self.data[self.starts[index] : self.ends[index]].decode("ascii").strip()


def read_long(data: bytes, where: str, options: ReadOptions) -> Raw | None:
    """Columns of a long, regular table.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        File to name in messages.
    options : ReadOptions
        What the user says.

    Returns
    -------
    Raw or None
        As `read_text`; None where the file is short, or not regular.

    Raises
    ------
    DataError
        As `read_text`.
    """
    if len(data) < _LONG or b"\n" not in data[:_HEAD]:
        return None
    first, last = data.rfind(b"\n", 0, _HEAD) + 1, data.find(b"\n", len(data) - _TAIL) + 1
    head, tail = (_text(part) for part in (data[:first], data[last:]))
    if head is None or tail is None or not data[first:last].isascii():
        return None
    sample = Text([*head.lines, *tail.lines], head.encoding, tail.ended)
    raw = read_text(sample, where, options)
    layout = raw.layout
    begin, end = layout["first_row"] - 1, len(sample.lines) - layout["last_row"]
    whole = len(raw.lines) == layout["last_row"] - layout["first_row"] + 1
    regular = whole and not layout["unreadable_lines"] and not raw.aside and not any(c.clock for c in raw.columns)
    if not regular or begin >= len(head.lines) or end >= len(tail.lines) or not tail.ended:
        return None
    start = _after_lines(data, begin)
    stop = _before_lines(data, end)
    delimiter = _SEPARATORS.get(layout["delimiter"], layout["delimiter"])
    mark = "," if layout["decimal"] == "comma" else "."
    numbers = _columns(data[start:stop], delimiter, mark, len(raw.columns))
    if numbers is None:
        return None
    columns = [
        replace(column, numbers=found, resolution=found.resolution)
        for column, found in zip(raw.columns, numbers[0], strict=True)
    ]
    n = len(numbers[1])
    layout = {**layout, "last_row": begin + n, "rows": n}
    below = [(k, line) for k, line in enumerate(tail.lines[len(tail.lines) - end :], begin + n + 1) if line.strip()]
    notes = [note for note in raw.notes if " below the table " not in note]
    notes += [below_note([k for k, _ in below], below[0][1])] if below else []
    lines = np.arange(begin + 1, begin + n + 1)
    return replace(raw, columns=columns, lines=lines, rows=numbers[1], layout=layout, notes=notes)


def _text(part: bytes) -> Text | None:
    """An end of the file as text; None where it is more than plain UTF-8."""
    if b"\x00" in part or part.startswith((b"\xff\xfe", b"\xfe\xff")):
        return None
    try:
        text = part.decode("utf-8").removeprefix("\ufeff").replace("\r\n", "\n")
    except UnicodeDecodeError:
        return None
    if "\r" in text or '"' in text or "'" in text:
        return None
    lines = text.split("\n")
    return Text(lines[:-1] if lines[-1] == "" else lines, "UTF-8", lines[-1] == "")


def _after_lines(data: bytes, count: int) -> int:
    place = 0
    for _ in range(count):
        place = data.index(b"\n", place) + 1
    return place


def _before_lines(data: bytes, count: int) -> int:
    place = len(data)
    for _ in range(count):
        place = data.rindex(b"\n", 0, place - 1) + 1
    return place


def _columns(block: bytes, delimiter: str, mark: str, width: int) -> tuple[list[Numbers], Cells] | None:
    """Numbers of each column, and the lines; None where the block is not regular."""
    if len(delimiter) != 1 or delimiter == " " or delimiter == mark or len(block) >= 1 << 31:
        return None
    if block.translate(None, f"0123456789+-eE{mark}{delimiter}\r\n ".encode()):
        return None
    signs = np.frombuffer(block, np.uint8)
    ends = np.flatnonzero(signs == ord("\n")).astype(np.int32)
    between = np.flatnonzero(signs == ord(delimiter)).astype(np.int32)
    n, spare = ends.size, 0
    if n and between.size == n * width:  # lines end in a delimiter
        spare = 1
    if not n or between.size != n * (width - 1 + spare):
        return None
    table = between.reshape(n, width - 1 + spare)
    starts = np.empty_like(ends)
    starts[0], starts[1:] = 0, ends[:-1] + 1
    inside = table.shape[1] == 0 or ((table[:, 0] >= starts).all() and (table[:, -1] <= ends).all())
    values = _parsed(block, delimiter, mark, width) if inside else None
    if values is None or len(values[0]) != n:
        return None
    lines = Cells(block, starts, ends)
    edges = [starts - 1, *(table[:, i] for i in range(width - 1)), table[:, -1] if spare else ends]
    if b"\r" in block:
        edges[-1] = edges[-1] if spare else edges[-1] - (signs[edges[-1] - 1] == ord("\r"))
    marks = _within(np.flatnonzero(signs == ord(mark)).astype(np.int32), edges)
    powers = _within(np.flatnonzero((signs | 32) == ord("e")).astype(np.int32), edges)
    if marks is None or powers is None:
        return None
    return [
        _numbers(values[i], Cells(block, edges[i] + 1, edges[i + 1]), marks[i], powers[i], mark) for i in range(width)
    ], lines


def _parsed(block: bytes, delimiter: str, mark: str, width: int) -> list[np.ndarray] | None:
    """Values of each column, exact to the last bit; what an empty cell holds is no number.

    Pandas' parser is as fast, and took 60 MB and half a second to be loaded, once a record had some 40 000 samples.
    """
    plain, sign = block if mark == "." else block.replace(mark.encode(), b"."), delimiter.encode()
    table = _table(plain, delimiter, width)
    if table is None:
        table = _table(re.sub(_EMPTY % (sign, sign), b"nan", plain), delimiter, width)
    return None if table is None else [np.ascontiguousarray(column) for column in table.T]


def _table(plain: bytes, delimiter: str, width: int) -> np.ndarray | None:
    """Numbers ``(n_line, width)``; None where a cell is none."""
    try:
        lines = io.TextIOWrapper(io.BytesIO(plain), "ascii")
        return np.loadtxt(lines, delimiter=delimiter, usecols=range(width), comments=None, ndmin=2)
    except ValueError:
        return None


_EMPTY = rb"(?<![^%b\n])(?=[%b\r\n])"
"""Where a cell has nothing in it, by the sign between cells."""


def _within(places: np.ndarray, edges: list[np.ndarray]) -> list[np.ndarray | None] | None:
    """Place of a sign in each cell of a column, or None for a column without; None if a column has it in some cells."""
    n, width = edges[0].size, len(edges) - 1
    found: list[np.ndarray | None] = [None] * width
    row = places[: int(np.searchsorted(places, edges[-1][0]))]
    holders = [i for i in range(width) if ((row > edges[i][0]) & (row < edges[i + 1][0])).any()]
    if places.size != n * len(holders) or row.size != len(holders):
        return _within_some(places, edges)
    table = places.reshape(n, len(holders)) if holders else places
    for k, i in enumerate(holders):
        if not ((table[:, k] > edges[i]).all() and (table[:, k] < edges[i + 1]).all()):
            return _within_some(places, edges)
        found[i] = table[:, k]
    return found


def _within_some(places: np.ndarray, edges: list[np.ndarray]) -> list[np.ndarray | None] | None:
    """The same where some cells of a column lack the sign: -1 stands for none; None for two in one cell."""
    found: list[np.ndarray | None] = []
    rows = np.searchsorted(edges[-1], places)
    for left, right in itertools.pairwise(edges):
        mine = (places > left[rows]) & (places < right[rows])
        column = np.full(left.size, -1, np.int32)
        column[rows[mine]] = places[mine]
        if int(mine.sum()) != int((column >= 0).sum()):
            return None
        found.append(column if mine.any() else None)
    return found


def _numbers(
    values: np.ndarray, texts: Cells, marks: np.ndarray | None, powers: np.ndarray | None, mark: str
) -> Numbers:
    """Numbers of a column with how each is written, as `numbers.parse_column` finds it."""
    n = values.size
    stops = texts.ends if powers is None else np.where(powers >= 0, powers, texts.ends)
    shapes = np.zeros(n, np.int16)
    if marks is not None:
        there = marks >= 0
        shapes = np.where(there, stops - marks - 1, 0).astype(np.int16)
        signs = np.frombuffer(texts.data, np.uint8)
        early = np.flatnonzero(there & (marks - texts.starts <= 1))
        bare = (marks[early] == texts.starts[early]) | ~_is_digit(signs[texts.starts[early]])
        shapes[early[bare]] += EMPTY_WHOLE
    if powers is not None:
        shapes += (EXPONENT * (texts.ends - stops)).astype(np.int16)
    reasons = np.zeros(n, np.uint8)
    finite = np.isfinite(values)
    if not finite.all():
        reasons[np.isnan(values)] = CODE["empty"]
        reasons[np.isinf(values)] = CODE["overflow"]
        values = np.where(finite, values, np.nan)
        shapes[~finite] = -1
    return Numbers(values, reasons, shapes, texts, mark)


def _is_digit(signs: np.ndarray) -> np.ndarray:
    return (signs >= ord("0")) & (signs <= ord("9"))
