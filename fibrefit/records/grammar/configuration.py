"""A configuration file beside the data: its statements, and the names and units of the channels it lists."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Sequence
from typing import Any

from fibrefit.records.thresholds import LONGEST_HEADING

_NAME_KEYS = ("name", "label", "channel", "signal", "title", "kanal", "bezeichnung", "channelname")
_UNIT_KEYS = ("unit", "units", "einheit", "jednotka", "unit_string", "dimension")
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
