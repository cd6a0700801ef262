"""Names and units above a table, in a header block of any length."""

from __future__ import annotations

import itertools
import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

from fibrefit.core import units
from fibrefit.records.grammar.configuration import channels_of, told_of_channels
from fibrefit.records.grammar.dialect import NAMES, WHITESPACE, Dialect
from fibrefit.records.grammar.headings import known_unit, split_heading, unit_by_key
from fibrefit.records.grammar.rows import REMARK
from fibrefit.records.grammar.tokens import kind_of_cell
from fibrefit.records.grammar.words import counts_rows, is_remark, kinds_named, score
from fibrefit.records.thresholds import HEADER_DEPTH, NEAR_HEADINGS

#: First cell of a line that names what the line holds.
_NAME_LABELS = {
    "name",
    "names",
    "channel name",
    "channel",
    "signal",
    "kanal",
    "kanalname",
    "nazev",
    "název",
    "label",
    "title",
    "header",
    "headers",
    "heading",
    "headings",
    "columns",
    "fields",
}
_UNIT_LABELS = {"unit", "units", "einheit", "einheiten", "jednotka", "jednotky", "y_unit_label", "dimension"}
#: The same for what the values were taken over: these units are not those of the columns.
_OF_ABSCISSA = re.compile(r"x[-_ ]?(?:axis[-_ ]?)?(?:unit|einheit|jednotk|dimension)", re.I)
#: The same in front of each unit: "Unit: N".
_UNIT_WORD = re.compile(r"(?:units?|einheit)\s*:\s*", re.I)
#: What says something by itself among headings: "tInc = 1e-4", "2 kHz".
STATEMENT = re.compile(r"[^=]+=\s*[+-]?[\d.,]+(?:[eE][+-]?\d+)?\s*\w*|\W*[\d.,]+\s*[kM]?Hz")
#: A key, and what it lists.
_KEYED = re.compile(r"[^\W\d][^=:,;\t]{0,40}[=:]([^=:]*)")
#: What a heading tells of its sensor in brackets: "Force [N] (S/N: 123)".
_OF_SENSOR = re.compile(r"(?<=\S)\s*[\[(][^\[\]()]*[\])]")
#: What stands among the units of a logger for its stamps and its count of rows (TOA5).
_UNIT_MARKS = {"ts", "rn"}


@dataclass(frozen=True, slots=True)
class Header:
    """Headings of the columns.

    Parameters
    ----------
    names : tuple of str
        Heading of each column, as in the file.
    units : tuple of (str or None)
        Unit of each column from a line of its own; None where that line says nothing.
    line, unit_line : int or None
        Lines they stand in, counted from 1.
    told : mapping of int to str
        Names of columns, by their place, that a list of channels has.
    listed : tuple of int
        Lines that name a column or number the signals, where no line names all columns.
    """

    names: tuple[str, ...]
    units: tuple[str | None, ...]
    line: int | None
    unit_line: int | None
    told: Mapping[int, str] = field(default_factory=dict)
    listed: tuple[int, ...] = ()


def find_header(
    above: Sequence[str], dialect: Dialect, empty: Sequence[bool], wanted: Collection[str]
) -> Header | None:
    """Header of a table.

    Parameters
    ----------
    above : sequence of str
        Lines above the table.
    dialect : Dialect
        Of the table.
    empty : sequence of bool
        For each column, whether it holds nothing at all.
    wanted : collection of str
        Headings the user named.

    Returns
    -------
    Header or None
        None where no line above the table can be its header.
    """
    start = max(0, len(above) - HEADER_DEPTH)
    rows = {}
    for i in range(start, len(above)):
        cells = header_cells(above[i], dialect, empty)
        if cells is not None:
            rows[i] = cells
    unit_rows = {i for i, cells in rows.items() if is_unit_row(cells)}
    last = max((i for i, line in enumerate(above) if line.strip() and i not in unit_rows), default=-1)
    ranked = sorted(
        (_points(cells, wanted) + (len(cells) if i == last and _all_named(cells) else 0), i)
        for i, cells in rows.items()
        if i not in unit_rows and (i == last or not _is_prose(above[i], cells, wanted))
    )
    best, line = ranked[-1] if ranked else (0.0, 0)
    width = dialect.width - 1 if dialect.width > 1 and empty[-1] else dialect.width
    numbered, first = _listed(above, width)
    for listed in (numbered, channels_of(above)):
        if (
            len(listed) == width
            and _points([f"{name} [{unit}]" if unit else name for name, unit in listed], wanted) > best
        ):
            names, given = zip(*(listed + [("", None)] * (dialect.width - width)), strict=True)
            lines = tuple(range(first, first + width)) if listed is numbered else ()
            return Header(names, given, None, None, listed=lines)
    if best > 0:
        unit_line = min(unit_rows, key=lambda i: (abs(i - line), -i), default=None)
        return _header(rows, line, unit_line)
    if unit_rows:
        return _header(rows, max(unit_rows), max(unit_rows))
    return None


def with_keyed_units(header: Header, said: Sequence[str]) -> Header:
    """Header with units of keys of its names, ``units: {force: N, position: mm}``, and what a list of channels tells.

    Parameters
    ----------
    header : Header
        As it stands above the table.
    said : sequence of str
        Lines beside the table.
    """
    bare = ["" if unit else name for name, unit in zip(header.names, header.units, strict=True)]
    told = told_of_channels(said, bare)
    pairs = [(split_heading(name), unit) for name, unit in zip(header.names, header.units, strict=True)]
    given = [unit or (None if own else unit_by_key(name, said)) for (name, own), unit in pairs]
    return replace(
        header,
        units=tuple(unit or told.get(i, ("", None))[1] for i, unit in enumerate(given)),
        # What a heading says itself, such as that it is a wanted value, comes before what a list says.
        told={i: name for i, (name, _) in told.items() if name and not kinds_named(split_heading(header.names[i])[0])},
    )


def _all_named(cells: Sequence[str]) -> bool:
    """Whether every cell is the name of a quantity, each of another one: in the line above the table, its headings."""
    kinds = [frozenset(kinds_named(cell)) for cell in cells]
    return all(kinds) and len(set(kinds)) == len(kinds)


def _is_prose(line: str, cells: Sequence[str], wanted: Collection[str]) -> bool:
    """Whether a line further up was cut into its words, and hardly one of these is the heading of a column."""
    if list(cells) != REMARK.sub("", line, count=1).lstrip("; ").split() or set(cells) & set(wanted):
        return False
    named = [split_heading(cell) for cell in cells]
    said = sum(unit is not None or bool(kinds_named(name)) or counts_rows(name) for name, unit in named)
    return 2 * said < len(cells)


def _header(rows: dict[int, list[str]], line: int, unit_line: int | None) -> Header:
    found = {i: _named_beside(rows, line, i) for i, cell in enumerate(rows[line]) if not cell}
    beside = {i: j for i, j in found.items() if j is not None}
    names = tuple(rows[beside[i]][i] if i in beside else cell for i, cell in enumerate(rows[line]))
    # Where the others of such a line are numbers of signals, without a word, nothing else is said there.
    others = {j: "".join(cell for k, cell in enumerate(rows[j]) if k != i) for i, j in beside.items()}
    used = [j for j, text in others.items() if not re.search(r"[^\W\d_]", text)]
    given: list[str | None] = [None] * len(names)
    if unit_line is not None:
        given = [_bare(cell) or None for cell in rows[unit_line]]
        none = _UNIT_LABELS | _UNIT_MARKS
        given = [None if unit is not None and unit.casefold() in none else unit for unit in given]
        given[0] = None if _labels_units(names[0], given) else given[0]
    listed = tuple(j + 1 for j in sorted(used))
    return Header(names, tuple(given), line + 1, None if unit_line is None else unit_line + 1, listed=listed)


def _named_beside(rows: Mapping[int, Sequence[str]], line: int, i: int) -> int | None:
    """Line that names the times where a line of headings has no name, as above signals; None for none.

    It has a text for each of the signals, where a key and its value, such as of the time of a test, are two.
    """
    for j in sorted((j for j in rows if abs(j - line) <= NEAR_HEADINGS), key=lambda j: abs(j - line)):
        texts = all(kind_of_cell(cell, ".") in ("text", "empty") for cell in rows[j])
        whole = all(cell for cell, name in zip(rows[j], rows[line], strict=True) if name)
        if texts and whole and kinds_named(rows[j][i]) == {"time"} and not is_unit_row(rows[j]):
            return j
    return None


def _labels_units(name: str, given: Sequence[str | None]) -> bool:
    """Whether the first of a line of units calls it that, in any language: it alone is none, and not that of a time."""
    first, others = given[0], [unit for unit in given[1:] if unit]
    if first is None or not others or known_unit(name, first) is not None or score(name, "time"):
        return False
    if not re.fullmatch(r"[^\W\d_]+[.:]?", first):
        return False
    return all(units.expression(unit) is not None for unit in others)


def header_cells(line: str, dialect: Dialect, empty: Sequence[bool]) -> list[str] | None:
    """Cells of a header line, one a column; None where they are not as many as the columns.

    Parameters
    ----------
    line : str
        A line above the table.
    dialect : Dialect
        Of the table.
    empty : sequence of bool
        For each column, whether it holds nothing at all.

    Returns
    -------
    list of str or None
        Cells without quotes and blanks.
    """
    remark = REMARK.match(line)
    text = line[remark.end() :] if remark else line
    if dialect.delimiter != ";":  # which begins a remark, too
        text = text.lstrip("; ")
    if dialect.width == 1:
        return [text.strip(f' "{dialect.delimiter}')]
    listed = _KEYED.fullmatch(text)  # "Units = N, mm"
    if listed and len(cells := (Dialect(",", ".").split(listed[1]) or [])) == dialect.width and dialect.width > 1:
        return [cell.strip() for cell in cells]
    # A header may separate its cells otherwise than the table, but then it does so throughout.
    own = dialect.delimiter
    others = [d for d in NAMES if d != own] if own == WHITESPACE or own not in text else []
    for separator in (own, *others):
        for cells in _ways_to_split(text, separator):
            fitted = _fitted([cell.strip().strip('"').strip() for cell in cells], dialect.width, empty)
            if fitted is not None and (separator == own or all(fitted)):
                return fitted
    return None


def _ways_to_split(text: str, separator: str) -> list[list[str]]:
    if separator != WHITESPACE:
        cells = Dialect(separator, ".").split(text)
        return [] if cells is None else [cells]
    if any(sign in text for sign in ";|") or re.search(r",(?! )", text):
        return []
    wide = re.split(r"\s{2,}|\t", text.strip())
    # "Time [s] Force [N]": a unit belongs to the word before it.
    joined = re.findall(r"[^\s\[(]+(?:\s*[\[(][^\])]*[\])])?", text)
    return [
        cells
        for cells in (wide, text.split(), joined)
        if not any(cell[:1] in "[(" for cell in cells) or is_unit_row(cells)
    ]


def _fitted(cells: list[str], width: int, empty: Sequence[bool]) -> list[str] | None:
    """Cells brought to the width of the table where that can be done in one way only."""
    if len(cells) == width + 1 and cells[0].casefold().rstrip(":") in _NAME_LABELS | _UNIT_LABELS:
        return cells[1:]
    if len(cells) > width and not any(cells[width:]):
        return cells[:width]
    if len(cells) > width and any(map(STATEMENT.fullmatch, cells)):
        return _fitted([cell for cell in cells if not STATEMENT.fullmatch(cell)], width, empty)
    if len(cells) == width + 1 and is_remark(cells[-1]):
        return cells[:width]
    # Data rows end with a delimiter and the header does not: the last column is empty. A column of remarks is
    # empty too, and then a heading is missing in between.
    if len(cells) == width - 1 and width > 1 and empty[-1] and not is_remark(cells[-1]):
        return [*cells, ""]
    return cells if len(cells) == width else None


def is_unit_row(cells: Sequence[str]) -> bool:
    """Whether a line holds units and nothing else.

    Parameters
    ----------
    cells : sequence of str
        Its cells.

    Returns
    -------
    bool
        True where nearly all cells that hold anything are units and one at least is more than a dash.
    """
    filled = [_bare(cell) for cell in cells if cell]
    if filled and _OF_ABSCISSA.match(filled[0]):
        return False
    if filled and filled[0].casefold() in _UNIT_LABELS:
        filled = filled[1:]
    filled = [cell for cell in filled if cell.casefold() not in _UNIT_MARKS]
    if len([cell for cell in filled if units.expression(cell) not in (None, "1")]) > 2:
        filled = [
            cell for cell in filled if cell.casefold() not in ("no.", "time", "date")
        ]  # above the counter and the clock
    known = [cell for cell in filled if units.expression(cell) is not None or cell in ("S", "MM", "SEC")]
    if any(cell not in known and kinds_named(cell) for cell in filled):
        return False  # "Time,s,1": a row of a list of channels
    if any(first not in known and second == "in" for first, second in itertools.pairwise(filled)):
        return False  # "Anzeige in kp"
    physical = [cell for cell in known if units.expression(cell) != "1"]
    return len(physical) > 0 and len(known) >= max(2 / 3 * len(filled), min(2, len(cells)))


def _bare(cell: str) -> str:
    cell = _UNIT_WORD.sub("", cell.strip())
    cell = cell[1:-1].strip() if len(cell) > 2 and cell[0] + cell[-1] in ("[]", "()", "<>", "{}") else cell
    return cell[3:] if cell[:3] == "in " else cell


def _points(cells: Sequence[str], wanted: Collection[str]) -> float:
    """How much a line looks like the names of columns."""
    points = 0.0
    for cell in cells:
        name, unit = split_heading(cell)
        if not cell:
            continue
        if cell in wanted or name in wanted:
            points += 10
        if counts_rows(cell):
            points += 0.5
        elif (
            re.search(r"=|:\s*[\d+-]|^\W*$", _OF_SENSOR.sub("", cell))
            or kind_of_cell(cell, ".") != "text"
            or kind_of_cell(cell, ",") != "text"
        ):
            points -= 3
        elif unit is not None and known_unit(name, unit) is not None:
            points += 3
        else:
            points += 2 if kinds_named(name) else 1 if cell.casefold() in _NAME_LABELS else 0.5
    filled = [cell for cell in cells if cell]
    points -= 1.0 * (len(filled) - len(set(filled)))
    return points if len(filled) > len(cells) / 2 or len(cells) <= 2 else points - 3


_LISTED = re.compile(
    r"\W*(?:(?:channel|kanal|kan[aá]l|column|spalte|sloupec|signal|name|label|title|ch|col|sp)\W*)?"
    r"(\d{1,3})\s*[:;,.\t=)|-]\s*(\S.*)",
    re.IGNORECASE,
)


def _listed(above: Sequence[str], width: int) -> tuple[list[tuple[str, str | None]], int]:
    """Names and units of columns that are listed line by line, ``1; Force; N``, and the first of these lines."""
    for start in range(len(above) - width, -1, -1):
        matches = [_LISTED.fullmatch(line.strip()) for line in above[start : start + width]]
        numbers = [int(match.group(1)) for match in matches if match]
        if numbers in (list(range(width)), list(range(1, width + 1))):
            return [_name_then_unit(match.group(2)) for match in matches if match], start + 1
    return [], 0


def _name_then_unit(text: str) -> tuple[str, str | None]:
    parts = [part.strip().strip('"') for part in re.split(r"[;\t|]|,\s", text) if part.strip()]
    if len(parts) > 1 and units.expression(_bare(parts[1])) is not None:
        return parts[0], _bare(parts[1])
    return parts[0], None
