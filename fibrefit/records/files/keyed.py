"""Layouts of their own, brought to the usual one: rows that name their values, headers beside rows, other quotes."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.files.json_tables import json_text
from fibrefit.records.grammar.header import Header
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.tokens import clean, clock_of, kind_of_cell
from fibrefit.records.grammar.words import tokens
from fibrefit.records.thresholds import LAYOUT_LINES, NAMED_ALIKE, WORDS_BESIDE

#: A name of up to so many letters, with or without a unit, its value, and a unit behind that. Longer ones are none: a
#: page of letters would be gone through once for each of them.
_PAIR = re.compile(
    r"([^\W\d][^\s=:,;]{0,80}(?:\s?[\[(][^\])]{0,40}[\])])?)\s*[=:]\s*([+-]?(?:\d[\d.,]*\d|\d|\.\d+)(?:[eE][+-]?\d+)?)"
    r"([^\W\d]{0,4}(?=[\s,;]|$))?"
)


def without_keys(text: Text, where: str) -> Text:
    """Text as a table with a heading, where its rows name their values; else as it is.

    Parameters
    ----------
    text : Text
        A file.
    where : str
        File to name in messages.

    Returns
    -------
    Text
        Cells with tabs between them.

    Raises
    ------
    DataError
        If JSON is cut short, or holds no table.
    """
    first = next((line.strip() for line in text.lines[:50] if line.strip()), "")
    if first[:1] in "{[" and first[:2] not in ("[s", "[S") and _is_json(text.lines):
        return json_text(text, where)
    return _from_pairs(text, where)


def _is_json(lines: Sequence[str]) -> bool:
    """Whether lines are JSON objects, or all of them one document."""
    filled = [line.strip() for line in lines if line.strip()]
    objects = sum(line.startswith("{") and ":" in line for line in filled)
    return objects > 0.5 * len(filled) or (filled[0][:2] in ("[{", "[[", '{"', "[", "{") and filled[-1][-1:] in "]}")


def _from_pairs(text: Text, where: str) -> Text:
    """Text whose rows are ``t=0.1 F=12.5`` or ``t=0.1s F=12.5N``, as a table."""
    lines = text.lines
    tail = [line for line in lines[-200:] if line.strip()]
    keys = [_keys(line) for line in tail]
    names = [tuple(key for key, _, _ in _PAIR.findall(line)) for line in tail]
    called = max(set(names), key=names.count, default=())
    if len(called) > 1 and names.count(called) >= max(3, NAMED_ALIKE * len(tail)):
        _refuse_ranges(lines, called, where)
    usual = max(set(keys), key=keys.count, default=())
    if len(usual) < 2 or len(set(usual)) < len(usual) or keys.count(usual) < max(3, NAMED_ALIKE * len(tail)):
        return text
    if any(len(_PAIR.sub("", line).strip(" ,;\t")) > WORDS_BESIDE * len(line) for line in tail[:20]):
        return text
    body, above, first = [], [], True
    for line in lines:
        if _keys(line) == usual:
            body.append("\t".join(value.rstrip(",") for _, value, _ in _PAIR.findall(line)))
            first = False
        elif first:
            above.append(line)
        else:
            body.append(line)
    return replace(text, lines=[*above, "\t".join(usual), *body])


def _refuse_ranges(lines: Sequence[str], names: tuple[str, ...], where: str) -> None:
    """Refuse values whose unit changes from row to row, as that of a meter that chooses its range."""
    seen: dict[str, tuple[str, int]] = {}
    for number, line in enumerate(lines, 1):
        pairs = _PAIR.findall(line)
        for key, _, unit in pairs if tuple(key for key, _, _ in pairs) == names else ():
            first, at = seen.setdefault(key, (unit, number))
            kinds = {units.kind_of(one) if one else None for one in (first, unit)}
            if first != unit and len(kinds) == 1 and None not in kinds:
                got = f'the unit of "{key}" changes from "{first}" (line {at}) to "{unit}"'
                do = "Fix the range of the meter, or convert the values to one unit."
                raise DataError(f"{where}, line {number}", got, "one unit for all rows", do)


def _keys(line: str) -> tuple[str, ...]:
    """Names of the values of a line, with the units that stand behind them."""
    return tuple(f"{key} [{unit}]" if unit else key for key, _, unit in _PAIR.findall(line))


#: A cell in single quotes.
_SINGLE_QUOTED = re.compile(r"((?:^|[,;\t|])\s{0,40})'([^']*)'(?=\s{0,40}(?:[,;\t|]|$))")

#: Columns of a header that stands beside the first rows: what, its value, its unit.
BESIDE = 3

_TIME_OF_DAY = re.compile(r"\s*\d{1,2}:\d{2}:")
_ARROW = re.compile(r"\s*(\d{1,2}:\d{2}:\d{2}(?:[.,]\d+)?)\s*->\s?(.*)")

_SEP_LINE = re.compile(r'"?sep=(.)"?;*,*\s*', re.IGNORECASE)


def _begins_anew(clock: Sequence[str], parts: Sequence[int]) -> bool:
    """Whether numbers fall where a clock goes on, gaps aside, and nowhere else: parts of its seconds, no own time."""
    falls = [after < before for before, after in pairwise(parts)]
    goes_on = [after != before for before, after in pairwise(clock)]
    gaps = sum(goes_on) - sum(falls)
    return gaps <= sum(falls) and all(on for fall, on in zip(falls, goes_on, strict=True) if fall)


#: Decimals of a second that a number of this unit stands for.
_PLACES = {"ms": 3, "us": 6, "ns": 9}


def _time_unit(header: Header, i: int) -> str:
    """Unit of time that a column has by its heading, or by the last word of it: ``tv_usec``; empty for none."""
    name, unit = split_heading(header.names[i])
    last = "" if unit or not (words := tokens(name)) else words[-1]
    found = next((one for one in (header.units[i], unit, last) if one and units.kind_of(one) == "time"), "")
    return (units.expression(found) or "").strip("()")


def with_thousandths(
    columns: Sequence[tuple[str, ...]], kinds: Sequence[str], header: Header, mark: str
) -> list[tuple[str, ...]]:
    """Columns of cells, in which parts of a second that stand beside clock times are put behind these, by their unit.

    The same is done beside whole seconds, as computers count them: ``secs`` and ``nsecs``.

    Parameters
    ----------
    columns : sequence of tuple of str
        One cell a row.
    kinds : sequence of str
        Of each.
    header : Header
        Of the table.
    mark : str
        Decimal mark.
    """
    found = list(columns)
    for i, kind in enumerate(kinds[:-1]):
        places = _PLACES.get(_time_unit(header, i + 1), 0) if kind in ("clock", "number") else 0
        full = r"[^.,]*:\d\d" if kind == "clock" else r"\d+"
        whole = places and (kind == "clock" or _time_unit(header, i) == "s")
        whole = whole and all(re.fullmatch(full, cell.strip()) for cell in columns[i])
        parts = whole and all(re.fullmatch(rf"\d{{1,{places}}}", cell.strip()) for cell in columns[i + 1])
        if parts and _begins_anew(columns[i], [int(cell) for cell in columns[i + 1]]):
            both = zip(*columns[i : i + 2], strict=True)
            found[i] = tuple(f"{a.strip()}{mark}{int(b):0{places}d}" for a, b in both)
            found[i + 1] = ("",) * len(found[i])
    return found


def with_dates(columns: Sequence[tuple[str, ...]], kinds: Sequence[str]) -> list[tuple[str, ...]]:
    """Columns of cells, in which a date that stands beside a time of day is put before it."""
    found = list(columns)
    for i in (i for i, pair in enumerate(pairwise(kinds)) if pair == ("clock", "clock")):
        if not has_time(columns[i]) and all(map(_TIME_OF_DAY.match, columns[i + 1])):
            found[i + 1] = tuple(
                f"{date.strip()} {time.strip()}" for date, time in zip(*columns[i : i + 2], strict=True)
            )
    return found


def has_time(cells: Sequence[str]) -> bool:
    """Whether clock readings hold more than a date."""
    return any(match is not None and match["time"] is not None for match in map(clock_of, map(clean, cells[:20])))


def without_arrows(lines: list[str]) -> list[str]:
    """Lines with a cell of its own for the clock that a terminal writes before each, behind which an arrow stands."""
    pairs = [_ARROW.fullmatch(line) for line in lines if line.strip()]
    behind = [pair[2] for pair in pairs if pair]
    if not behind or len(behind) < NAMED_ALIKE * len(pairs):
        return lines
    sign = next((sign for sign in ";\t," if sign in behind[-1]), " ")
    return [_ARROW.sub(rf"\1{sign}\2", line) for line in lines]


def stated_separator(lines: Sequence[str], delimiter: str | None) -> tuple[list[str], str | None]:
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
    beside = [f"{name} = {cell}" for name, cell in zip(rows[0][-2:], rows[1][-2:], strict=True)]
    behind = "," * (len(lines[2]) - len(lines[2].rstrip(",")))
    return [",".join(rows[0][:-2]), ",".join(rows[1][:-2]), *(line.removesuffix(behind) for line in lines[2:])], beside


def header_beside(lines: list[str]) -> tuple[list[str], list[str]]:
    """Lines without the header that older scopes write to the left of the first rows, and what that header says."""
    rows = [line.split(",") for line in lines[:LAYOUT_LINES]]
    beside = [",".join(cells[:BESIDE]) for cells in rows]
    number = next((i for i, text in enumerate(beside) if not text.strip(" ,")), 0)
    measured = all(
        cells[BESIDE + 1 :] and all(kind_of_cell(cell.strip(), ".") == "number" for cell in cells[BESIDE:][:2])
        for cells in rows
    )
    if not (number and measured and all(kind_of_cell(cells[0], ".") == "text" for cells in rows[:number])):
        return lines, []
    empty = "," * BESIDE
    return [*(empty + ",".join(cells[BESIDE:]) for cells in rows[:number]), *lines[number:]], beside[:number]
