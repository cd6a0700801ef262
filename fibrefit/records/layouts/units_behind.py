"""Numbers with their unit in each cell, as meters, dashboards and tables of durations write them: 27.198 N."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from dataclasses import replace

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.grammar.dialect import BETWEEN_CELLS, Dialect
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.phrases import Aside
from fibrefit.records.grammar.tokens import clean, kind_of_cell
from fibrefit.records.thresholds import FEWEST_ROWS, LAYOUT_LINES, NAMED_ALIKE, UNITS_OF_ROWS

_WITH_UNIT = re.compile(
    r"([+-]?(?:\d[\d.,]{0,30}|[.,]\d{1,20})(?:[eE][+-]?\d{1,3})?)\s{0,3}([^\W\d_][^\s\d,;]{0,9}|\"|°)"
)
#: A voltage or a current as meters name it.
_DIRECT = re.compile(r"(?<=[VA])DC$")


def with_unit(cell: str) -> tuple[str, str] | None:
    """Number and unit of a cell that holds both; None for any other.

    Parameters
    ----------
    cell : str
        As in the file.
    """
    found = _WITH_UNIT.fullmatch(clean(cell))
    unit = _DIRECT.sub("", found[2]) if found else ""
    return (found[1], unit) if found and units.kind_of(unit) not in (None, "number") else None


def places_of_units(lines: Sequence[str]) -> tuple[Dialect, list[int]] | None:
    """How the cells of lines are separated, and in which columns numbers have their unit behind them; None for none.

    Parameters
    ----------
    lines : sequence of str
        The last ones of a file.
    """
    filled = [line for line in lines[-LAYOUT_LINES:] if line.strip()]
    for separator in BETWEEN_CELLS:
        split = [Dialect(separator, ".").split(line) or [] for line in filled]
        width, number = Counter(map(len, split)).most_common(1)[0] if split else (0, 0)
        rows = [cells for cells in split if len(cells) == width]
        least = max(FEWEST_ROWS, NAMED_ALIKE * (number - 1))  # a line of headings may be among them
        found = [i for i in range(width) if sum(with_unit(cells[i]) is not None for cells in rows) >= least]
        if width > 1 and found:
            return Dialect(separator, ".", width), found
    return None


def with_units_apart(text: Text, where: str) -> Text:
    """Text with the units of its cells in the headings.

    Parameters
    ----------
    text : Text
        A file.
    where : str
        File to name in messages.

    Returns
    -------
    Text
        The same where cells have no units, or no line of headings stands above them.

    Raises
    ------
    DataError
        If the unit of a column changes from row to row, as that of a meter that chooses its range.
    """
    found = places_of_units(text.lines)
    if found is None:
        return text
    dialect, places = found
    lines = list(text.lines)
    split = [dialect.split(line) or [] for line in lines]
    first = next(i for i, cells in enumerate(split) if len(cells) == dialect.width and _is_row(cells, places))
    above = [i for i in range(first - 1, -1, -1) if lines[i].strip()]
    plain = next((k for k, i in enumerate(above) if len(split[i]) != dialect.width or _is_head(split[i])), len(above))
    top = above[plain] if plain < len(above) else -1  # rows above it may lack their units
    if top < 0 or not _is_head(split[top]) or len(split[top]) != dialect.width:
        return text
    rows = [(i, split[i]) for i in range(top + 1, len(lines)) if len(split[i]) == dialect.width]
    places = [place for place in places if _may_be_of(split[top][place], split[first][place])]
    seen = {place: _units_seen(rows, place) for place in places}
    places = [place for place in places if len(seen[place]) == 1 or not _are_ranges(rows, place)]
    if not places:
        return text
    for i, row in rows:
        cells = [(with_unit(cell) or (cell,))[0] if place in places else cell for place, cell in enumerate(row)]
        lines[i] = _joined(cells, lines[i], dialect)
    headings = list(split[top])
    for place in places:
        unit = _one_unit(headings[place].strip(), seen[place], where)
        if units.expression(split_heading(headings[place])[1] or "") != units.expression(unit):
            headings[place] = f"{headings[place].strip()} [{unit}]"
    lines[top] = _joined(headings, lines[top], dialect)
    shown = ", ".join(f'"{headings[place].strip()}"' for place in places)
    return replace(text, lines=lines, notes=(*text.notes, Aside(f"Units stand behind the numbers of {shown}.")))


def _units_seen(rows: Sequence[tuple[int, Sequence[str]]], place: int) -> dict[str, int]:
    """Units behind the numbers of a column, each with the line it is first seen in; empty for none behind a number."""
    seen: dict[str, int] = {}
    for i, cells in rows:
        number, unit = with_unit(cells[place]) or (cells[place], None)
        if unit is not None:
            seen.setdefault(unit, i + 1)
        elif kind_of_cell(number, ".") == "number" and number.strip(" +-0.,"):
            seen.setdefault("", i + 1)  # not nil
    return seen


def _are_ranges(rows: Sequence[tuple[int, Sequence[str]]], place: int) -> bool:
    """Whether a column has a few texts only, as that of the ranges of a meter beside its readings: 100 mV, then 1 V."""
    return len({cells[place].strip() for _, cells in rows}) <= UNITS_OF_ROWS


def _is_head(cells: Sequence[str]) -> bool:
    return all(kind_of_cell(cell, ".") == "text" and with_unit(cell) is None for cell in cells)


def _may_be_of(heading: str, cell: str) -> bool:
    """Whether a cell has a unit of the kind that its heading has, if that has one: 0.5m below "Time (s)" has none."""
    own = units.kind_of(split_heading(heading)[1] or "")
    return own is None or own == units.kind_of((with_unit(cell) or ("", ""))[1])


def _is_row(cells: Sequence[str], places: Sequence[int]) -> bool:
    return any(with_unit(cells[place]) is not None for place in places)


def _one_unit(heading: str, seen: dict[str, int], where: str) -> str:
    """The unit of a column; refused where there are several."""
    (first, line), *others = seen.items()
    for other, at in others:
        if units.expression(other) != units.expression(first):
            got = f'the unit of "{heading}" changes from "{first}" (line {line}) to "{other}"'
            do = "Fix the range of the meter, or convert the values to one unit."
            raise DataError(f"{where}, line {at}", got, "one unit for all rows", do)
    return first


def _joined(cells: Sequence[str], line: str, dialect: Dialect) -> str:
    """Cells as a line, in quotes where those of the line were."""
    if '"' in line:
        cells = ['"{}"'.format(cell.replace('"', '""')) for cell in cells]
    return dialect.delimiter.join(cells)
