"""Tables in JSON: rows by name, lists by name, series with their units, rows of lists below a list of names."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Collection, Iterator, Mapping
from dataclasses import replace
from typing import Any

from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.phrases import Aside, count
from fibrefit.records.grammar.tokens import kind_of_cell
from fibrefit.records.thresholds import FEWEST_ROWS, HEADER_DEPTH, STRAY_ROWS, STRAY_SHARE

#: Keys of the name and of the unit of a series.
_TITLES = ("name", "label", "Name", "Label")
_UNITS = ("unit", "units", "Unit", "Units", "einheit", "Einheit")
#: Members that are shown of a document without a table.
_MOST_SHOWN = 5
_ONE_A_ROW = 'Write one object a row, such as {"time [s]": 0.0, "force [N]": 12.5}.'


def json_text(text: Text, where: str) -> Text:
    """Text of JSON as a table with a heading.

    Parameters
    ----------
    text : Text
        A file: one document, or an object a line.
    where : str
        File to name in messages.

    Returns
    -------
    Text
        Cells with tabs between them, to the last digit; above them what stands beside the rows.

    Raises
    ------
    DataError
        If it is cut short, or holds no table, or several.
    """
    try:
        return _as_table(text, where)
    except RecursionError:
        raise DataError(where, "JSON that is nested too deeply", "a table of measured values", _ONE_A_ROW) from None


def _as_table(text: Text, where: str) -> Text:
    lists: list[tuple[str, list[Any]]] = []
    filled = [(i, line.strip()) for i, line in enumerate(text.lines, 1) if line.strip()]
    objects = sum(line.startswith("{") for _, line in filled)
    if objects > max(1, 0.5 * len(filled)) and not filled[0][1].startswith("["):
        rows = [_row(_object(line, f"{where}, line {i}")) for i, line in filled]
    else:
        document = _usual(_object("\n".join(text.lines), where))
        rows = _rows_of(document, where)
        lists = list(_beside(document, len(rows) - 1))
    rows = _spread(rows, where)
    counted = Counter(key for row in rows for key in row)
    columns = {key: None for key, number in counted.items() if number >= min(FEWEST_ROWS, len(rows))}
    aside = [f"{key} = {_shown(value)}" for row in rows for key, value in row.items() if key not in columns]
    if not columns:
        raise DataError(where, "JSON without a table", "objects that name the same values, one a row", "")
    table = [["" if row.get(key) is None else " ".join(str(row[key]).split()) for key in columns] for row in rows]
    body = ["\t".join(row) for row in table if any(row)]
    nameless = list(columns) == [_numbered(i) for i in range(len(columns))]
    made = [*aside[:HEADER_DEPTH], *([] if nameless else ["\t".join(columns)]), *body]
    told = ((f'"{key}"', one) for key, objects in lists if _is_told(objects) for one in objects)
    beside = [(place, " ".join("; ".join(f"{k} = {v}" for k, v in _flat(one).items()).split())) for place, one in told]
    left = [f'"{key}" ({count(len(objects), "object")})' for key, objects in lists if not _is_told(objects)]
    notes = [Aside(f"Other lists of objects are left out: {', '.join(left[:_MOST_SHOWN])}.")] if left else []
    return replace(text, lines=made, ended=True, beside=(*text.beside, *beside), notes=(*text.notes, *notes))


def _beside(node: Any, rows: int) -> Iterator[tuple[str, list[Any]]]:
    """Lists of objects in a document but that of its rows, with their keys."""
    for key, value in node.items() if isinstance(node, dict) else ():
        if isinstance(value, dict):
            yield from _beside(value, rows)
        elif isinstance(value, list) and len(value) != rows and value and all(isinstance(one, dict) for one in value):
            yield key, value[:HEADER_DEPTH]


def _is_told(objects: list[Any]) -> bool:
    """Whether objects beside a table tell of something, as of its channels, and are no table themselves."""
    return len(objects) < FEWEST_ROWS or any(_first_text(one, (*_TITLES, *_UNITS)) for one in objects)


def _object(line: str, where: str) -> Any:
    try:
        return json.loads(line, parse_float=str, parse_int=str)
    except (json.JSONDecodeError, RecursionError) as error:
        said = error.msg if isinstance(error, json.JSONDecodeError) else "nested too deeply"
        do = "The file may be cut short: export it again, or remove that line."
        raise DataError(where, f'JSON that ends or breaks off: {said} ("{line[-30:]}")', "a whole object", do) from None


def _usual(node: Any) -> Any:
    """A document with its rows as objects: also those by their number, and those of lists below a list of names.

    Channels in a list become members, and what is alone in a list stands for itself.
    """
    if isinstance(node, list):
        if not any(isinstance(one, dict | list) for one in node):
            return node
        inside = [_usual(one) for one in node]
        if len(inside) == 1 and isinstance(inside[0], dict) and (_longest(inside) or _rows_in(inside[0])):
            return inside[0]
        series = [_series("", one) for one in inside]
        if all(one and len(one[2]) > len(inside) for one in series):
            return {f"{i}": one for i, one in enumerate(inside, 1)}  # a channel each, and more values than channels
        return inside
    if not isinstance(node, dict):
        return node
    members = {key: _usual(value) for key, value in node.items()}
    counted = [str(i) for i in range(len(members) + 1)]
    numbered = len(members) >= FEWEST_ROWS and list(members) in (counted[:-1], counted[1:])
    if numbered and not all(isinstance(value, dict) and _series("", value) for value in members.values()):
        return list(members.values())
    return _with_named_rows(members)


def _with_named_rows(node: dict[str, Any]) -> dict[str, Any]:
    """An object in which rows that are lists have the names, and the units, of a list of as many beside them."""
    for key, rows in node.items():
        width = _width(rows)
        lists = {k: v for k, v in node.items() if width and isinstance(v, list) and len(v) == width and k != key}
        titled = {k: titles for k, v in lists.items() if k not in _UNITS and (titles := _titles(v))}
        if not titled:
            continue
        place, headings = next(iter(titled.items()))
        stated = next((lists[k] for k in _UNITS if k in lists), [None] * width)
        names = [
            f"{name} [{own or unit}]" if own or unit else name
            for (name, own), unit in zip(headings, stated, strict=True)
        ]
        along = [
            k for k, v in node.items() if k != key and isinstance(v, list) and len(v) == len(rows) and _are_plain(v)
        ]
        named = [{**{k: node[k][i] for k in along}, **dict(zip(names, row, strict=True))} for i, row in enumerate(rows)]
        used = {place, *along, *(k for k in _UNITS if k in lists)}
        told = {f"{name}.{k}": v for (name, _), one in zip(headings, lists[place], strict=True) for k, v in _rest(one)}
        return {**{k: named if k == key else v for k, v in node.items() if k not in used}, **told}
    return node


def _rest(one: Any) -> list[tuple[str, Any]]:
    """What an object tells of a column besides its name and its unit."""
    return [(k, v) for k, v in _flat(one).items() if k not in (*_TITLES, *_UNITS)]


def _width(node: Any) -> int:
    """How many values rows have that are lists, all as long; 0 where a node is no list of such rows."""
    if not isinstance(node, list) or len(node) < FEWEST_ROWS or not all(isinstance(row, list) for row in node):
        return 0
    width = len(node[0])
    return width if width > 1 and all(len(row) == width and _are_plain(row) for row in node) else 0


def _titles(node: list[Any]) -> list[tuple[str, str]]:
    """Names of columns and their units, from a list of texts or of objects; none where it is neither."""
    if all(isinstance(one, dict) for one in node):
        found = [tuple(_first_text(one, words) for words in (_TITLES, _UNITS)) for one in node]
    else:
        found = [(one if isinstance(one, str) and kind_of_cell(one, ".") == "text" else "", "") for one in node]
    return [(name, unit) for name, unit in found] if all(name for name, _ in found) else []


def _first_text(node: Mapping[str, Any], words: tuple[str, ...]) -> str:
    return next((" ".join(text.split()) for word in words if isinstance(text := node.get(word), str)), "")


def _row(item: Any) -> dict[str, Any]:
    """Values of a row by their names, lists of values among them."""
    lists = {" ".join(k.split()): v for k, v in item.items() if isinstance(v, list)} if isinstance(item, dict) else {}
    return {**_flat(item), **lists}


def _spread(rows: list[dict[str, Any]], where: str) -> list[dict[str, Any]]:
    """Rows in which a list, such as the three parts of an acceleration, is a column for each of its values.

    Of several lists of one length the values are samples one after the other: these are refused.
    """
    held = {key: value for row in rows[1:] for key, value in row.items() if _measures(value)}
    sizes = {len(value) for value in held.values()}
    if len(held) > 1 and len(sizes) == 1:
        listed = ", ".join(f'"{key}"' for key in list(held)[:_MOST_SHOWN])
        got = f"rows that hold {sizes.pop()} values each of {listed}"
        raise DataError(where, got, "one value a row", _ONE_A_ROW)
    return [_parted(row, held) for row in rows] if held else rows


def _parted(row: Mapping[str, Any], keys: Collection[str]) -> dict[str, Any]:
    """A row with each value of some lists under a name of its own."""
    found: dict[str, Any] = {}
    for key, value in row.items():
        if key not in keys or not isinstance(value, list):
            found[key] = value
            continue
        name, unit = split_heading(key)
        behind = f" [{unit}]" if unit else ""
        found |= {f"{name if unit else key}.{i}{behind}": part for i, part in enumerate(value, 1)}
    return found


def _measures(value: Any) -> bool:
    """Whether a value of a row is a list of numbers."""
    return isinstance(value, list) and len(value) > 1 and _are_plain(value) and _are_numbers(value)


def _shown(value: Any) -> str:
    """A value as a statement has it, a short list of values too."""
    if isinstance(value, list):
        return f"[{', '.join(map(str, value))}]" if len(value) <= HEADER_DEPTH and _are_plain(value) else "[..]"
    return str(value)


def _flat(item: Any) -> dict[str, Any]:
    """Values of an object by their names, those of objects inside it too; what several are called is made distinct."""
    found: dict[str, Any] = {}
    inside = (
        {key: _flat(value) for key, value in item.items() if isinstance(value, dict)} if isinstance(item, dict) else {}
    )
    called = Counter(sub for inner in inside.values() for sub in inner)
    for key, value in item.items() if isinstance(item, dict) else ():
        name = " ".join(str(key).split())
        if isinstance(value, dict):
            if set(inside[key]) == {"value", "unit"}:
                found[f"{name} [{inside[key]['unit']}]"] = inside[key]["value"]
                continue
            own = {sub for sub in inside[key] if called[sub] == 1 and sub not in item}
            found |= {(sub if sub in own else f"{name}.{sub}"): v for sub, v in inside[key].items()}
        elif not isinstance(value, list):
            found[name] = " ".join(value.split()) if isinstance(value, str) else value
        elif value and len(value) <= HEADER_DEPTH and _are_plain(value):
            found[name] = _shown(value)
    return found


def _rows_of(document: Any, where: str) -> list[dict[str, Any]]:
    """Rows of a document: a list of objects, or an object of lists or of series, or either of these inside it."""
    if isinstance(document, list) and document and all(isinstance(row, dict) for row in document):
        return [_row(row) for row in document]
    if isinstance(document, list) and (width := _width(document)):
        return [{_numbered(i): row[i] for i in range(width)} for row in document]
    if isinstance(document, dict):
        tables = {key: rows for key, value in document.items() if (rows := _rows_in(value))}
        measured = max(map(_longest, document.values()), default=0)
        if tables and max(tables.values()) >= measured:
            _refuse_several(tables, where)
            key = max(tables, key=lambda one: tables[one])
            head = _flat({name: value for name, value in document.items() if name != key})
            return [head, *_rows_of(document[key], where)]
        if measured:
            return _of_lists(_opened(document, where), where)
    raise _no_table(document, where)


def _numbered(place: int) -> str:
    """Name of a column of lists without names."""
    return f"column {place + 1}"


def _refuse_several(tables: Mapping[str, int], where: str) -> None:
    """Refuse lists of rows beside the longest one, but for a few rows, as of fields or of events."""
    few = max(STRAY_ROWS, STRAY_SHARE * max(tables.values()), FEWEST_ROWS)
    several = [f'"{key}" ({rows} rows)' for key, rows in tables.items() if rows > few]
    if len(several) > 1:
        raise DataError(
            where, f"several tables: {', '.join(several[:_MOST_SHOWN])}", "one", "Write each to a file of its own."
        )


def _no_table(document: Any, where: str) -> DataError:
    """Refusal of a document by what it holds."""
    held = f"a list of {len(document)}" if isinstance(document, list) else ""
    if isinstance(document, dict):
        held = ", ".join(f'"{key}"' for key in list(document)[:_MOST_SHOWN])
    got = f"JSON without a table{f' ({held[:80]})' if held else ''}"
    return DataError(where, got, "a list of objects, or lists of one length by name", _ONE_A_ROW)


def _opened(document: dict[str, Any], where: str) -> dict[str, Any]:
    """An object with all lists of numbers and all series as its members, those of objects inside it too.

    Raises
    ------
    DataError
        If several are called alike, as those of several recordings are, or a list of them is no table.
    """
    found: dict[str, Any] = {}
    owners: dict[str, str] = {}
    for key, value in document.items():
        if not _longest(value) or _series(key, value) or (isinstance(value, list) and _are_plain(value)):
            found[key] = value
            continue
        if not isinstance(value, dict):
            raise _no_table({key: value}, where)
        for name, member in _opened(value, where).items():
            if not _longest(member):
                found[f"{key}.{name}"] = member
                continue
            if name in owners or _longest(document.get(name)):
                got = f'"{name}" in "{owners.get(name, name)}" and in "{key}"'
                raise DataError(where, got, "one recording", "Write each recording to a file of its own.")
            found[name], owners[name] = member, key
    return found


def _of_lists(document: dict[str, Any], where: str) -> list[dict[str, Any]]:
    """Rows of lists by name and of series, behind what is beside; a series without a unit, and not as long, is none."""
    series = {key: one for key, value in document.items() if (one := _series(key, value))}
    lists = {key: value for key, value in document.items() if isinstance(value, list) and _are_plain(value)}
    size = max(_longest([*lists.values()]), max((len(values) for *_, values in series.values()), default=0))
    lists = {key: value for key, value in lists.items() if len(value) == size or _longest(value)}
    alike = sum(len(value) == size for value in lists.values()) + len(series)
    columns = {key: value for key, value in lists.items() if len(value) > alike or len(value) == size}
    taken = set(columns)
    said: dict[str, Any] = {}
    for key, (name, unit, values) in series.items():
        if not unit and columns and all(len(values) != len(others) for others in columns.values()):
            continue
        heading = f"{name} [{unit}]" if unit else name
        while heading in columns:
            heading += " "  # called as another one: kept beside it
        columns[heading] = values
        taken.add(key)
        others = _flat({sub: value for sub, value in document[key].items() if value is not values})
        said |= {f"{name}.{sub}": value for sub, value in others.items() if sub not in (*_UNITS, *_TITLES)}
    if any(len(values) != size for values in columns.values()):
        sizes = ", ".join(f"{key}: {len(value)}" for key, value in list(columns.items())[:6])
        raise DataError(where, f"lists of different lengths ({sizes})", "one length", "Export it again.")
    head = _flat({key: value for key, value in document.items() if key not in taken}) | said
    return [head, *({key: values[i] for key, values in columns.items()} for i in range(size))]


def _series(key: str, node: Any) -> tuple[str, str, list[Any]] | None:
    """Name, unit and values of an object that holds one list of values, as of a channel: empty where it has no unit."""
    held = [value for value in node.values() if _longest(value)] if isinstance(node, dict) else []
    if len(held) != 1 or not isinstance(held[0], list) or not _are_plain(held[0]):
        return None
    return _first_text(node, _TITLES) or " ".join(key.split()), _first_text(node, _UNITS), held[0]


def _are_plain(values: list[Any]) -> bool:
    return all(not isinstance(one, dict | list) for one in values)


def _are_numbers(values: list[Any]) -> bool:
    """Whether the first values that are there are numbers, or readings of a clock."""
    first = [str(one) for one in values if one is not None][:FEWEST_ROWS]
    return bool(first) and all(
        kind_of_cell(one, ".") in ("number", "clock", "not a number", "overflow") for one in first
    )


def _longest(node: Any) -> int:
    """Length of the longest list of numbers, or of readings of a clock, in a node: of more than two."""
    if isinstance(node, list) and _are_plain(node):
        return len(node) if len(node) >= FEWEST_ROWS and _are_numbers(node) else 0
    inside = node.values() if isinstance(node, dict) else node if isinstance(node, list) else ()
    return max(map(_longest, inside), default=0)


def _rows_in(node: Any) -> int:
    """Number of rows of the longest list of objects in a node: of more than two."""
    if isinstance(node, list):
        return len(node) if _is_table(node) else 0
    return max(map(_rows_in, node.values()), default=0) if isinstance(node, dict) else 0


def _is_table(node: list[Any]) -> bool:
    return len(node) >= FEWEST_ROWS and (all(isinstance(row, dict) for row in node) or _width(node) > 0)
