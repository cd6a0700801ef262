"""A configuration file beside the data: its statements, and the names and units of the channels it lists."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from typing import Any

from fibrefit.core import units
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.words import counts_rows
from fibrefit.records.thresholds import LONGEST_HEADING

_NAME_KEYS = ("name", "label", "channel", "signal", "title", "kanal", "bezeichnung", "channelname")
_UNIT_KEYS = ("unit", "units", "einheit", "jednotka", "unit_string", "dimension")
#: The same at the head of a column or of a row of a list of channels.
_OF_NAMES = {*_NAME_KEYS, "signal name", "channel name", "comment", "kommentar", "コメント", "信号名", "名称", "备注"}
_OF_UNITS = {
    *_UNIT_KEYS,
    "unité",
    "unidad",
    "unità",
    "jednostka",
    "jednotky",
    "einheiten",
    "単位",
    "单位",
    "單位",
    "단위",
}
_SO_MANY = re.compile(r"\W*(\d{1,2}) (?:channels?|kan[aä]le|canaux|canales|canali)\W*", re.IGNORECASE)
_NUMBERED = re.compile(r"(?:ch(?:annel)?|kanal|signal|col(?:umn)?)?[_ .]*(\d+)[_ .]*(\w+)", re.IGNORECASE)


def statements(lines: Sequence[str], delimiter: str) -> list[str]:
    """Lines of a configuration as a header has them: statements, and one line with the headings of the columns.

    Parameters
    ----------
    lines : sequence of str
        ``key = value`` in sections (INI), or JSON; any other header stays as it is.
    delimiter : str
        Between the headings.

    Returns
    -------
    list of str
        For `facts.find_facts` and `header.find_header`.
    """
    document = _document("\n".join(lines))
    if document is not None:
        said, channels = list(_scalars(document)), list(_channels(document))
    else:
        said, channels = list(lines), channels_of(lines)
    separator = "\t" if delimiter == " " else delimiter
    heading = separator.join(f"{name} [{unit}]" if unit else name for name, unit in channels)
    return [*said, heading] if len(channels) > 1 else said


def _document(text: str) -> Any:
    """What a text is in JSON; None where it is something else, such as the first section of an INI file."""
    try:
        found = json.loads(text)
    except (json.JSONDecodeError, RecursionError):
        return None
    return found if isinstance(found, dict | list) else None


def _scalars(node: Any, name: str = "") -> Iterator[str]:
    if isinstance(node, dict):
        for key, value in node.items():
            yield from _scalars(value, str(key))
    elif name and isinstance(node, str | int | float):
        yield f"{name} = {node}"


def _channels(node: Any) -> Iterator[tuple[str, str | None]]:
    """Names and units of the first list of objects that have names."""
    if isinstance(node, dict):
        for value in node.values():
            yield from _channels(value)
    elif isinstance(node, list):
        for item in node:
            if isinstance(item, dict):
                keys = {str(key).casefold(): value for key, value in item.items()}
                name = next((str(keys[key]) for key in _NAME_KEYS if keys.get(key)), "")
                unit = next((str(keys[key]) for key in _UNIT_KEYS if keys.get(key)), "")
                if name:
                    yield name, unit


def _pair(line: str) -> tuple[str, str]:
    """Key and value of ``key = value`` or ``"key": "value",``; nothing and nothing of other lines."""
    place = min((i for i in (line.find("="), line.find(":")) if i >= 0), default=-1)
    key = line[: max(place, 0)].strip().removeprefix('"').removesuffix('"').strip()
    value = line[place + 1 :].strip().removesuffix(",").strip().removeprefix('"').removesuffix('"').strip()
    return (key.casefold(), value) if key and len(key) <= LONGEST_HEADING and '"' not in key + value else ("", "")


def channels_of(lines: Sequence[str]) -> list[tuple[str, str | None]]:
    """Names and units from ``name = ...`` and ``unit = ...`` in sections, or from ``ch1_name = ...``."""
    names: dict[str, str] = {}
    units: dict[str, str] = {}
    section = ""
    for line in lines:
        if re.fullmatch(r"\s*\[[^\]]+\]\s*", line):
            section = line.strip()
            continue
        key, value = _pair(line)
        numbered = _NUMBERED.fullmatch(key)
        place, word = (numbered[1], numbered[2]) if numbered else (section, key)
        if place and word in _NAME_KEYS:
            names[place] = value
        elif place and word in _UNIT_KEYS:
            units[place] = value
    return [(name, units.get(place)) for place, name in names.items()]


def told_of_channels(above: Sequence[str], headings: Sequence[str]) -> dict[int, tuple[str, str]]:
    """Name and unit of columns, by their place, that a list of channels above a table has; empty where it has none.

    The list is a row for each channel with the column's heading in it, a row of names and one of units behind a label,
    or so many names, each above its unit.

    Parameters
    ----------
    above : sequence of str
        Lines above the headings.
    headings : sequence of str
        Of the columns; empty for those whose unit is known.
    """
    rows = [[cell.strip().strip('"').strip() for cell in re.split(r"[;,\t|]", line)] for line in above]
    open_ones = [i for i, heading in enumerate(headings) if _is_open(heading)]
    found = _by_row(rows, headings, open_ones)
    for names, given in () if found else (_by_label(rows, len(open_ones)), _in_turn(above, len(open_ones))):
        if given and all(map(units.expression, given)):
            found = found or dict(zip(open_ones, zip(names, given, strict=True), strict=True))
    return found


def _is_open(heading: str) -> bool:
    """Whether a heading has no unit, and is none: that of a channel, and neither of a time nor of a count."""
    name, unit = split_heading(heading)
    return bool(name) and unit is None and units.kind_of(name) is None and not counts_rows(name)


def _by_row(
    rows: Sequence[Sequence[str]], headings: Sequence[str], open_ones: Sequence[int]
) -> dict[int, tuple[str, str]]:
    found: dict[int, tuple[str, str]] = {}
    name = unit = -1
    width = 0
    for row in rows:
        words = [cell.casefold() for cell in row]
        if len(row) > 2 and not _OF_UNITS.isdisjoint(words):
            width, unit = len(row), next(i for i, word in enumerate(words) if word in _OF_UNITS)
            name = next((i for i, word in enumerate(words) if word in _OF_NAMES and i > 0), -1)
        elif len(row) == width and units.expression(row[unit]):
            place = next((i for i in open_ones if headings[i] in row), None)
            if place is not None:
                found[place] = (row[name] if name >= 0 else "", row[unit])
    return found


def _by_label(rows: Sequence[Sequence[str]], number: int) -> tuple[Sequence[str], Sequence[str]]:
    labelled = {row[0].casefold(): row[1:] for row in rows if len(row) == number + 1 and number > 1}
    given = next((labelled[key] for key in labelled if key in _OF_UNITS), [])
    return next((labelled[key] for key in labelled if key in _OF_NAMES), [""] * len(given)), given


def _in_turn(above: Sequence[str], number: int) -> tuple[Sequence[str], Sequence[str]]:
    for i, line in enumerate(above):
        said = _SO_MANY.fullmatch(line)
        if said is not None and int(said[1]) == number > 1:
            listed = [line.strip() for line in above[i + 1 : i + 1 + 2 * number]]
            return listed[::2], listed[1::2]
    return [], []
