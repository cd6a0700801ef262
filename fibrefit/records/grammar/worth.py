"""What a file says of one number of a column: a gain, a slope, a step, which may still have to be applied to it."""

from __future__ import annotations

import math
import re
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.grammar.headings import PLAIN_KINDS
from fibrefit.records.thresholds import UNITS_OF_ROWS

#: Words for what numbers are multiplied by, or moved by; and for what one step of them is, which is as often a mere
#: remark on numbers that are in their unit already.
_FACTOR = r"scales?|scaling|factor|skalierung|faktor|multiplier|gain|slope|calibration|conversion"
_SHIFT = r"offset|intercept|bias"
_STEP = r"lsb|sensitivity|resolution|aufl[o\u00f6]sung"
_WORD = r"(?:^|[\W_\d]){}(?:$|[\W_\d])"
_FACTORS, _SHIFTS, _STEPS = (re.compile(_WORD.format(f"(?:{words})"), re.I) for words in (_FACTOR, _SHIFT, _STEP))

SCALE_LABEL = re.compile(rf"(?:{_FACTOR}|{_STEP})\b.*", re.I)
"""First cell of a line that tells what one count is worth."""

#: Such a line above numbers of any kind: gains and sensitivities are noted of amplifiers and sensors too.
_ALWAYS = re.compile(r"(?:scales?|scaling|factor|skalierung|faktor|multiplier)\b.*", re.I)


def may_apply(label: str, *, whole: bool) -> bool:
    """Whether what a line says may still have to be applied to the numbers below it.

    Parameters
    ----------
    label : str
        First cell of the line.
    whole : bool
        Whether the numbers are whole, as counts are.
    """
    return SCALE_LABEL.fullmatch(label) is not None and (whole or _ALWAYS.fullmatch(label) is not None)


def worth_told(said: Mapping[str, Any], values: np.ndarray) -> str:
    """What attributes say of the numbers beside them that changes these; empty where nothing does.

    Parameters
    ----------
    said : mapping of str to object
        Attributes, some of them numbers.
    values : (n,) array
        The numbers.

    Returns
    -------
    str
        Such as ``gain = 0.001``.
    """
    whole = values.dtype.kind in "iub"
    told = []
    for key, value in said.items():
        number = _number(value)
        idle = 1.0 if _FACTORS.search(key) or (whole and _STEPS.search(key)) else 0.0 if _SHIFTS.search(key) else None
        if number is not None and idle is not None and number != idle:
            told.append(f"{key} = {number:g}")
    return ", ".join(told[:3])


def unit_told(cells: Sequence[str], lines: Iterable[int], where: str) -> str | None:
    """Unit that a column of text states of the numbers to its left, row by row; None where it states none.

    Parameters
    ----------
    cells : sequence of str
        The column.
    lines : iterable of int
        Lines its cells stand in, counted from 1.
    where : str
        File and column to name in the message.

    Raises
    ------
    DataError
        If the unit changes, as that of a meter that chooses its range: no one unit is that of the column.
    """
    found: dict[str, int] = {}
    for cell, line in zip(cells, lines, strict=True):
        if cell.strip():
            found.setdefault(cell.strip().strip("[]()"), line)
            if len(found) > UNITS_OF_ROWS:
                return None
    kinds = {units.kind_of(unit) for unit in found}
    if len(kinds) != 1 or not kinds <= set(PLAIN_KINDS):
        return None
    if len(found) > 1:
        (first, _), (second, line) = list(found.items())[:2]
        do = "Fix the range of the meter, or convert the values to one unit."
        got = f'line {line}: the unit changes from "{first}" to "{second}"'
        raise DataError(where, got, "one unit for all rows", do)
    return next(iter(found))


def _number(value: Any) -> float | None:
    """Number of an attribute, which may be text or an array of one; None where it is none."""
    try:
        one = np.asarray(value).ravel()
        number = float(one[0]) if one.size == 1 else math.nan
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None
