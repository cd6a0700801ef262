"""What vectors and the columns of a matrix are called: by their own names, or by lists of names around them."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fibrefit.core import units
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.words import kinds_named
from fibrefit.records.thresholds import HEADER_DEPTH

#: Keys of a unit, or of a list of them.
UNIT_KEYS = ("units", "unit", "einheit", "einheiten", "columnunits", "channelunits", "yunit")
#: Keys of a list of names, some of them a single text.
NAME_KEYS = (
    "colheaders",
    "columnnames",
    "columns",
    "names",
    "channelnames",
    "channels",
    "labels",
    "label",
    "variablenames",
    "signals",
    "headers",
    "header",
)
#: Names of a vector, or last words of them, that say nothing.
BARE = ("data", "values", "value", "y")
#: Where a group keeps what attributes say of the numbers of its members; no name in a file is it.
WORTH = "\0worth"
#: The same for all that is said of their units.
STATED = "\0stated"
#: What arrays are called by attributes, whose own names name no quantity.
TITLED = "\0titled"
#: Which of its members are what attributes say.
ATTRIBUTES = "\0attributes"
_BETWEEN = re.compile(r"\s*[,;|\t\n]\s*")


def plain(key: str) -> str:
    """A key in small letters, without underscores."""
    return key.casefold().replace("_", "")


def stem(key: str) -> str:
    """What stands before a last word that says nothing, in small letters: `channel_1` of `Channel_1_Data`."""
    name = key.casefold()
    return next((name.removesuffix(word).rstrip("_. ") for word in BARE if name.endswith(word)), "")


def named(header: str) -> tuple[str, str | None]:
    """Name and unit of a vector, by its own name.

    Parameters
    ----------
    header : str
        Its place in the file, such as ``rec.force_N``, or ``data(:,2)``.
    """
    header, sign, place = header.rpartition("(:,")  # which column of a matrix
    header, behind = (header, sign + place) if sign else (place, "")
    name, found = split_heading(header.rpartition(".")[2] if "." in header else header)
    if found is None and units.expression(name.rpartition("_")[2] or "?") is not None and "_" in name:
        name, _, found = name.rpartition("_")
    return name + behind, found


def listed_texts(key: str, value: Any) -> list[str]:
    """Texts of a list, or of a single text under a key of names: ``"time [s], force [N]"``; none of anything else.

    Parameters
    ----------
    key : str
        Of the value.
    value : object
        A variable, a field or an attribute.
    """
    if isinstance(value, list):
        return [str(text) for text in value]
    listed = isinstance(value, str) and plain(key) in (*NAME_KEYS, *UNIT_KEYS)
    parts = _BETWEEN.split(value.strip()) if listed else []
    return parts if len(parts) > 1 and all(parts) else []


def titles_near(around: Sequence[Mapping[str, Any]], key: str, count: int) -> tuple[list[str], list[str]]:
    """Names and units of the columns of a matrix: lists of as many texts in its node, or else further out.

    Parameters
    ----------
    around : sequence of mapping
        The node that holds the matrix, and those around it, the nearest first.
    key : str
        Name of the matrix.
    count : int
        Number of its columns.

    Returns
    -------
    tuple of list of str and list of str
        Either is empty where there is none.
    """
    levels = [level for node in around for level in (node, *notes_in(node))]
    names = next((found for level in levels if (found := _names_beside(level, key, count))), [])
    stated = next((found for level in levels if (found := _units_beside(level, count))), [])
    return names, stated if names else []


def notes_in(node: Mapping[str, Any]) -> Iterator[Mapping[str, Any]]:
    """Structures of a node that hold no arrays, and tell of those beside them.

    Parameters
    ----------
    node : mapping
        A group or a structure.
    """
    for value in node.values():
        arrays = [one for one in value.values() if isinstance(one, np.ndarray)] if isinstance(value, dict) else []
        if isinstance(value, dict) and all(one.size == 1 for one in arrays):
            yield value


def _units_beside(node: Mapping[str, Any], count: int) -> list[str]:
    lists = (listed_texts(name, value) for name, value in node.items() if plain(name) in UNIT_KEYS)
    return next((texts for texts in lists if len(texts) == count), [])


def _names_beside(tree: Mapping[str, Any], key: str, count: int) -> list[str]:
    """Names of the columns of a matrix: a list of as many texts beside it; empty where there is none, or several.

    One that is called a list of names comes before others, and one that is called as the matrix is before all others:
    ``block0_items`` of ``block0_values``.
    """
    lists = {plain(name): texts for name, value in tree.items() if (texts := listed_texts(name, value))}
    lists = {name: texts for name, texts in lists.items() if len(texts) == count}
    called = next((lists[name] for name in NAME_KEYS if name in lists), [])
    if called:
        return called
    others = {*UNIT_KEYS, *map(plain, tree.get(ATTRIBUTES, ()))}
    names = {name: texts for name, texts in lists.items() if name not in others and _are_names(texts)}
    start = plain(stem(key))
    near = {name: texts for name, texts in names.items() if start and name.startswith(start)} or names
    found = list(near.values())
    return found[0] if found and all(texts == found[0] for texts in found) else []


def _are_names(texts: Sequence[str]) -> bool:
    """Whether texts name columns: they differ, some name a quantity or tell a unit, and they are not units alone."""
    tell = any(kinds_named(name) or unit for name, unit in map(named, texts))
    return tell and len(set(texts)) == len(texts) and any(units.expression(text) is None for text in texts)


def place_beside(tree: Mapping[str, Any], key: str, value: Any) -> str | None:
    """Key under which an attribute is kept beside those of other arrays that are called the same, and are not equal.

    None where as many are kept as are looked at: to go on would take the square of their number.

    Parameters
    ----------
    tree : mapping
        A group.
    key : str
        Name of the attribute.
    value : object
        What it says.
    """
    places = [key + " " * i for i in range(HEADER_DEPTH)]
    if places[-1] in tree:
        return None
    return next(place for place in places if place not in tree or np.array_equal(tree[place], value))


def told_apart(placed: Sequence[tuple[str, RawColumn]]) -> list[tuple[str, RawColumn]]:
    """Columns with their places, of which those that are called alike have where they stand before their heading.

    Parameters
    ----------
    placed : sequence of (str, RawColumn)
        As a file holds them.
    """
    called = Counter(column.header for _, column in placed)
    return [
        (at, column if called[column.header] < 2 else replace(column, header=f"{_owner(at)}{column.header}"))
        for at, column in placed
    ]


def _owner(place: str) -> str:
    """Where the matrix or the structure of a column stands, with the sign that ends it; empty at the top."""
    matrix, sign, _ = place.partition("(:,")
    return f"{matrix if sign else place.rpartition('.')[0]}.".removeprefix(".")
