"""The common ground of all readers: columns as a file holds them, before units, roles and times."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from fibrefit.records.grammar.facts import Facts
from fibrefit.records.grammar.numbers import Numbers


@dataclass(frozen=True, slots=True)
class Annotation:
    """Something a file says beside its numbers.

    Parameters
    ----------
    place : str
        Where: ``line 3``, ``attribute "gain"``, ``sheet "Info", row 2``; for messages.
    text : str
        What it says, one line.
    of : str
        Header of the one column it is said of; empty where it may be said of all.
    row : bool
        Whether it stands between the headings and the first row of numbers.
    """

    place: str
    text: str
    of: str = ""
    row: bool = False


@dataclass(frozen=True, slots=True, eq=False)
class RawColumn:
    """A column as a file holds it.

    Parameters
    ----------
    header : str
        As in the file; empty where it has none.
    name : str
        Header without its unit.
    unit : str or None
        As written.
    numbers : Numbers
        Values in that unit, and what is wrong with them.
    clock : bool
        Whether the values are seconds since the first clock reading.
    rate : float or None
        Rate in Hz that belongs to this column alone.
    start : float
        Time of its first sample in s, where `rate` is given; for a clock, its first reading.
    resolution : float
        Step of the last printed digit; 0 for binary files.
    number : int
        Which of the file's columns it is, counted from 1; 0 where a file has no order of columns.
    worth : str
        What the file says of the numbers that may still have to be applied to them, such as ``gain = 0.001``.
    contradicted : str
        Units of which the file states more than one, in words.
    zero : float
        Number that stands for nothing, as the user says; it answers what is said of an offset.
    """

    header: str
    name: str
    unit: str | None
    numbers: Numbers
    clock: bool = False
    rate: float | None = None
    start: float = 0.0
    resolution: float = 0.0
    number: int = 0
    worth: str = ""
    contradicted: str = ""
    zero: float = 0.0


@dataclass(frozen=True, slots=True, eq=False)
class Raw:
    """A file as read.

    Parameters
    ----------
    columns : list of RawColumn
        In the order of the file; columns of text are left out.
    facts : Facts
        What its header says.
    lines : (n_rows,) int array
        Line, or number, of each row.
    rows : sequence of str
        Text that tells rows apart; empty for binary files.
    placed : bool
        Whether all lines between the first and the last row are rows.
    layout : dict
        Encoding, delimiter and so on, for people and programs.
    notes : list of str
        Sentences.
    aside : dict of int to str
        Columns that hold no numbers, by their number, and what they hold.
    annotations : sequence of Annotation
        All that is said beside the numbers and is no heading: to be accounted for once it is known which columns are
        read.
    """

    columns: list[RawColumn]
    facts: Facts
    lines: np.ndarray
    rows: Sequence[str] = ()
    placed: bool = True
    layout: dict[str, Any] = field(default_factory=dict)
    notes: list[str] = field(default_factory=list)
    aside: dict[int, str] = field(default_factory=dict)
    annotations: Sequence[Annotation] = ()


def binary_column(
    header: str, name: str, unit: str | None, values: np.ndarray, *, rate: float | None = None, start: float = 0.0
) -> RawColumn:
    """Column of a binary file, in which only NaN and infinity can be wrong.

    Parameters
    ----------
    header, name : str
        As in the file, with and without unit.
    unit : str or None
        As written.
    values : (n,) array
        Any real type.
    rate : float or None
        Rate in Hz that belongs to this column alone.
    start : float
        Time of its first sample in s.

    Returns
    -------
    RawColumn
        With masks.
    """
    coarse = values.dtype.kind == "f" and values.dtype.itemsize < 8
    spacing = float(np.spacing(np.nanmax(np.abs(values)))) if coarse and np.isfinite(values).any() else 0.0
    return RawColumn(header, name, unit, Numbers.of_array(values), rate=rate, start=start, resolution=spacing)
