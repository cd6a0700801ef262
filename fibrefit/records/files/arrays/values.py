"""What arrays hold besides numbers: stamps in words, vectors in cells, structures in lists, room never filled."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fibrefit.records.clock.times import EPOCH
from fibrefit.records.clock.wall_clock import parse_clock
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.grammar.numbers import Numbers
from fibrefit.records.grammar.tokens import kind_of_cell
from fibrefit.records.thresholds import FEWEST_ROWS, MOST_LOST

_NANOSECOND = np.timedelta64(1, "ns")
_PER_SECOND = 1e9
_DAY = 86400.0


def stamps_in(texts: Sequence[Any], where: str) -> np.ndarray | None:
    """Stamps that texts spell out, ``2023-11-02T10:15:00.0005``; None where they are anything else.

    Parameters
    ----------
    texts : sequence of object
        All of an array.
    where : str
        File and array to name in messages.

    Returns
    -------
    (n,) array of datetime64 or None
        To the nanosecond; times of day without a date are on the first of January 1970.
    """
    first = texts[0] if len(texts) >= FEWEST_ROWS else None
    if not isinstance(first, str) or kind_of_cell(first, ".") != "clock" or ":" not in first:
        return None
    if not all(isinstance(text, str) for text in texts):
        return None
    clock = parse_clock(texts, where)
    if np.isnan(clock.seconds).mean() > MOST_LOST:
        return None
    dated = clock.origin >= _DAY
    start = np.datetime64(0, "ns") + round((clock.origin - (EPOCH if dated else 0.0)) * _PER_SECOND)
    since = np.array(
        [np.timedelta64("NaT") if np.isnan(s) else round(s * _PER_SECOND) for s in clock.seconds], "m8[ns]"
    )
    found: np.ndarray = start + since
    return found


def stamp_column(header: str, name: str, stamps: np.ndarray) -> RawColumn | None:
    """Column of stamps, in s since the first that is there; None where they are days.

    Parameters
    ----------
    header, name : str
        As in the file, with and without unit.
    stamps : (n,) array of datetime64
        Any unit.
    """
    present = stamps[~np.isnat(stamps)]
    if not present.size or np.datetime_data(stamps.dtype)[0] in ("D", "W", "M", "Y"):
        return None
    seconds = (stamps - present[0]) / _NANOSECOND / _PER_SECOND
    began = float((present[0] - np.datetime64(0, "s")) / _NANOSECOND / _PER_SECOND)
    # On the first of January 1970 it is a time of day, or the clock of a logger that nobody has set.
    start = began if abs(began) < _DAY else EPOCH + began
    first, second = np.array([0, 1]).astype(stamps.dtype)
    resolution = float((second - first) / _NANOSECOND / _PER_SECOND)
    return RawColumn(header, name, None, Numbers.of_array(seconds), clock=True, start=start, resolution=resolution)


def items_as_one(items: list[Any]) -> Any:
    """Items of a list as one: vectors of one length as columns of a matrix, others and structures by their number.

    A list of structures of single numbers, such as of the rows of a table, is one of vectors.

    Parameters
    ----------
    items : list
        Of cells of MATLAB, of an array of structures, or of objects.
    """
    if items and all(isinstance(item, dict) for item in items):
        keys = list(items[0])
        rows = len(items) >= FEWEST_ROWS and all(list(item) == keys for item in items)
        if rows and keys and all(_is_single(item[key]) for item in items for key in keys):
            return {key: np.array([float(item[key]) for item in items]) for key in keys}
        return {f"{i}": item for i, item in enumerate(items, 1)}
    sizes = {item.size for item in items if isinstance(item, np.ndarray) and item.ndim == 1}
    if len(items) < 2 or not all(isinstance(item, np.ndarray) and item.ndim == 1 and item.size > 1 for item in items):
        return items
    return np.stack(items, axis=1) if len(sizes) == 1 else {f"{i}": item for i, item in enumerate(items, 1)}


def _is_single(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "biuf"


def without_unfilled(columns: Sequence[RawColumn]) -> list[RawColumn]:
    """Columns without rows at the end in which all of them are zero, the times among them: room that was never filled.

    Parameters
    ----------
    columns : sequence of RawColumn
        All as long.
    """
    values = [column.numbers.values for column in columns]
    filled = np.flatnonzero(np.logical_or.reduce([value != 0.0 for value in values]))
    rows = int(filled[-1]) + 1 if filled.size else 0
    timed = rows >= FEWEST_ROWS and any(
        (np.diff(value[:rows]) > 0.0).all() and value[rows - 1] > 0.0 for value in values
    )
    if not timed or rows == values[0].size:
        return list(columns)
    cut = slice(rows)
    numbers = [Numbers(n.values[cut], n.reasons[cut], n.shapes[cut], (), n.mark) for n in (c.numbers for c in columns)]
    return [replace(column, numbers=one) for column, one in zip(columns, numbers, strict=True)]


def deep_arrays(tree: Mapping[str, Any], prefix: str = "") -> list[str]:
    """Arrays of more than two dimensions in a file, with their sizes.

    Parameters
    ----------
    tree : mapping
        Its variables, groups and structures.
    prefix : str
        Place of the tree in the file.
    """
    found = []
    for key, value in tree.items():
        if isinstance(value, dict):
            found += deep_arrays(value, f"{prefix}{key}.")
        elif isinstance(value, np.ndarray) and value.ndim > 2:
            found.append(f'"{prefix}{key}" of {" x ".join(map(str, value.shape))} numbers')
    return found


def complex_numbers(name: str) -> str:
    """What an array of complex numbers is, in words: which part of them was meant is not for a program to say.

    Parameters
    ----------
    name : str
        Of the array, as messages have it.
    """
    return f'"{name}" holds complex numbers, where readings are real'
