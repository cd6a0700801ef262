"""Layouts of their own, brought to the usual one: rows that name their values, headers beside rows, other quotes."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from dataclasses import replace
from itertools import pairwise
from typing import Any

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.grammar.header import Header
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.tokens import clean, clock_of, kind_of_cell
from fibrefit.records.grammar.words import tokens
from fibrefit.records.thresholds import FEWEST_ROWS, LAYOUT_LINES, NAMED_ALIKE, WORDS_BESIDE

#: A name of up to so many letters, with or without a unit, its value, and a unit behind that. Longer ones are none: a
#: page of letters would be gone through once for each of them.
_PAIR = re.compile(
    r"([^\W\d][^\s=:,;]{0,80}(?:\s?[\[(][^\])]{0,40}[\])])?)\s*[=:]\s*([+-]?(?:\d[\d.,]*\d|\d|\.\d+)(?:[eE][+-]?\d+)?)"
    r"([^\W\d]{0,4}(?=[\s,;]|$))?"
)

#: Keys of the name and of the unit of a series.
_TITLES = ("name", "label", "Name", "Label")
_UNITS = ("unit", "units", "Unit", "Units", "einheit", "Einheit")


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
        return _from_json(text, where)
    return _from_pairs(text, where)


def _is_json(lines: Sequence[str]) -> bool:
    """Whether lines are JSON objects, or all of them one document."""
    filled = [line.strip() for line in lines if line.strip()]
    objects = sum(line.startswith("{") and ":" in line for line in filled)
    return objects > 0.5 * len(filled) or (filled[0][:2] in ("[{", '{"', "[", "{") and filled[-1][-1:] in "]}")


def _from_json(text: Text, where: str) -> Text:
    beside: tuple[tuple[str, str], ...] = ()
    filled = [(i, line.strip()) for i, line in enumerate(text.lines, 1) if line.strip()]
    if sum(line.startswith("{") for _, line in filled) > max(1, 0.5 * len(filled)):
        rows = [_flat(_object(line, f"{where}, line {i}")) for i, line in filled]
    else:
        document = _object("\n".join(text.lines), where)
        rows, beside = _rows_of(document, where), tuple(_beside(document))
    keys = list(dict.fromkeys(key for row in rows for key in row))
    counted = {key: sum(key in row for row in rows) for key in keys}
    columns = [key for key in keys if counted[key] > 0.5 * len(rows)]
    aside = [f"{key} = {value}" for row in rows for key, value in row.items() if key not in columns]
    if not columns:
        raise DataError(where, "JSON without a table", "objects that name the same values, one a row", "")
    table = [["" if row.get(key) is None else str(row[key]) for key in columns] for row in rows]
    body = ["\t".join(row) for row in table if any(row)]
    lines = [*aside[:100], "\t".join(columns), *body]
    return replace(text, lines=lines, ended=True, beside=(*text.beside, *beside))


def _beside(node: Any, name: str = "") -> Iterator[tuple[str, str]]:
    """Short lists of objects in a document, such as one of its channels: an object a line."""
    for key, value in node.items() if isinstance(node, dict) else ():
        if isinstance(value, dict):
            yield from _beside(value, str(key))
        elif isinstance(value, list) and 0 < len(value) < FEWEST_ROWS and all(isinstance(item, dict) for item in value):
            for item in value:
                yield f'"{key}"', " ".join("; ".join(f"{k} = {v}" for k, v in _flat(item).items()).split())


def _object(line: str, where: str) -> Any:
    try:
        return json.loads(line, parse_float=str, parse_int=str)
    except (json.JSONDecodeError, RecursionError) as error:
        said = error.msg if isinstance(error, json.JSONDecodeError) else "nested too deeply"
        do = "The file may be cut short: export it again, or remove that line."
        raise DataError(where, f'JSON that ends or breaks off: {said} ("{line[-30:]}")', "a whole object", do) from None


def _flat(item: Any) -> dict[str, Any]:
    """Values of an object by their names, those of objects inside it too; what several are called is made distinct."""
    found: dict[str, Any] = {}
    inside = (
        {key: _flat(value) for key, value in item.items() if isinstance(value, dict)} if isinstance(item, dict) else {}
    )
    for key, value in item.items() if isinstance(item, dict) else ():
        name = " ".join(str(key).split())
        if isinstance(value, dict):
            if set(inside[key]) == {"value", "unit"}:
                found[f"{name} [{inside[key]['unit']}]"] = inside[key]["value"]
                continue
            others = {sub for other, inner in inside.items() if other != key for sub in inner} | set(item)
            found |= {(sub if sub not in others else f"{name}.{sub}"): v for sub, v in inside[key].items()}
        elif not isinstance(value, list):
            found[name] = " ".join(value.split()) if isinstance(value, str) else value
    return found


def _rows_of(document: Any, where: str) -> list[dict[str, Any]]:
    """Rows of a document: a list of objects, an object of lists or of series, or the first of these inside it."""
    if isinstance(document, list) and document and all(isinstance(row, dict) for row in document):
        lengths = [len(found[2]) if (found := _series("", row)) else 0 for row in document]
        if min(lengths) <= len(document):
            return [_flat(row) for row in document]
        document = {f"{i}": row for i, row in enumerate(document, 1)}  # a channel each, and more values than channels
    if isinstance(document, dict):
        held = {key: value for key, value in document.items() if _holds_rows(value)}
        lists = {key: value for key, value in held.items() if isinstance(value, list)}
        series = {key: found for key, value in held.items() if (found := _series(key, value))}
        alone = len(series) == len(held) and (len(held) > 1 or any(unit for _, unit, _ in series.values()))
        if (lists and _are_plain(lists)) or alone:
            return _of_lists(document, lists, series, where)
        head = _flat({key: value for key, value in document.items() if key not in held})
        if len(held) == 1:
            return [head, *_rows_of(next(iter(held.values())), where)]
    do = 'Write one object a row, such as {"time [s]": 0.0, "force [N]": 12.5}.'
    raise DataError(where, "JSON without a table", "a list of objects, or lists of one length by name", do)


def _of_lists(
    document: dict[str, Any], lists: dict[str, list[Any]], series: dict[str, tuple[str, str, list[Any]]], where: str
) -> list[dict[str, Any]]:
    """Rows of lists by name and of series, behind what is beside; a series without a unit, and not as long, is none."""
    columns, taken = dict(lists), set(lists)
    said: dict[str, Any] = {}
    for key, (name, unit, values) in series.items():
        if not unit and lists and all(len(values) != len(others) for others in lists.values()):
            continue
        heading = f"{name} [{unit}]" if unit else name
        while heading in columns:
            heading += " "  # called as another one: kept beside it
        columns[heading] = values
        taken.add(key)
        said |= {f"{name}.{sub}": v for sub, v in _flat(document[key]).items() if sub not in (*_UNITS, *_TITLES)}
    size = max(map(len, columns.values()))
    if any(len(values) != size for values in columns.values()):
        sizes = ", ".join(f"{key}: {len(value)}" for key, value in list(columns.items())[:6])
        raise DataError(where, f"lists of different lengths ({sizes})", "one length", "Export it again.")
    head = _flat({key: value for key, value in document.items() if key not in taken}) | said
    return [head, *({key: values[i] for key, values in columns.items()} for i in range(size))]


def _series(key: str, node: Any) -> tuple[str, str, list[Any]] | None:
    """Name, unit and values of an object that holds one list of values, as of a channel: empty where it has no unit."""
    held = [value for value in node.values() if _holds_rows(value)] if isinstance(node, dict) else []
    if len(held) != 1 or not isinstance(held[0], list) or not _are_plain({"": held[0]}):
        return None
    name, unit = (
        next((" ".join(text.split()) for word in words if isinstance(text := node.get(word), str)), "")
        for words in (_TITLES, _UNITS)
    )
    return name or " ".join(key.split()), unit, held[0]


def _are_plain(lists: dict[str, list[Any]]) -> bool:
    return all(not isinstance(one, dict | list) for values in lists.values() for one in values)


def _holds_rows(node: Any) -> bool:
    """Whether there is a list of some length anywhere in a node."""
    if isinstance(node, list):
        return len(node) > 2
    return isinstance(node, dict) and any(_holds_rows(value) for value in node.values())


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
    return gaps <= max(1, sum(falls)) and all(on for fall, on in zip(falls, goes_on, strict=True) if fall)


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
