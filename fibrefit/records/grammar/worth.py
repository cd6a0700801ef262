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
_FACTOR = r"scales?|scalings?|factors?|skalierung|faktor(?:en)?|multipliers?|gains?|slopes?|calibrations?|conversions?"
_SHIFT = r"offsets?|intercepts?|bias"
_STEP = r"lsb|sensitivity|resolution|aufl[o\u00f6]sung"
_WORD = r"(?:^|[\W_\d]){}(?:$|[\W_\d])"
_FACTORS, _SHIFTS, _STEPS = (re.compile(_WORD.format(f"(?:{words})"), re.I) for words in (_FACTOR, _SHIFT, _STEP))

#: The same of several numbers, as of a single one it is as often a date or a number of a certificate.
_CALIBRATIONS = re.compile(_WORD.format("(?:cal|calib)s?"), re.I)

#: What one count is worth, and the numbers of a polynomial.
_PER = re.compile(r"[a-z]_?per_?[a-z]|coeff|polynom|koeff", re.I)
#: Numbers noted beside whole numbers that are no factor of them.
_HARMLESS = re.compile(
    r"rate|freq|hz|filter|range|min|max|bit|serial|id|number|channel|index|sample|count$|size|length|time|date|t0|dt|start|stop"
    r"|version|fill|valid|missing|step|interval|delay|mean|std|rms|level|order|class|type|width",
    re.I,
)
PLACES = re.compile(_WORD.format("(?:decimals?|digits|exponent|power|precision|nachkommastellen)"), re.I)
"""Words for how many decimals are to be counted off."""

#: Words for the side from which numbers are counted: below zero they were turned round. And words that say so.
_SIDES = re.compile(_WORD.format("(?:polarity|sign|direction|polarit[a\u00e4]t|vorzeichen)"), re.I)
_TURNED = re.compile(_WORD.format("(?:inverted|negated|reversed|invertiert|negiert|flipped)"), re.I)

TO_DO = re.compile(
    r"\b(?:multipl(?:y|ied|ier)|divided?|multiplizier\w*|dividier\w*|multiplie[rz]?|divise[rz]?)\b[^\n]{0,60}\d"
    r"|\b(?:force|load|channel|signal|position|polarity|sign|kraft|weg|kanal|vorzeichen)\b[^\n]{0,30}"
    r"\b(?:inverted|reversed|negated|flipped|invertiert|umgekehrt|negiert)\b"
    r"|^\W*(?:(?:scal(?:e|ing)|conversion|calibration)[ _]factor|multiplier|factor|skalierungsfaktor|faktor)\W{1,4}"
    r"(?!1(?:[.,]0*)?\s*$)\d",
    re.I,
)
"""Words that tell what is to be done to numbers, or was: a factor, a turned sign."""

OF_COUNTS = re.compile(
    r"\b(?:resolution|aufl[o\u00f6]sung|lsb|full[ -]?scale|calib\w*|kalibr\w*|sensitivity|gain|slope|quanti[sz]\w*)\b"
    r"|\bper (?:count|digit)\b|\bdigits?\s*=|/\s?count|\bcounts?\s*=|\by\s*=",
    re.I,
)
"""Words of a line above whole numbers after which these may be counts."""

MERE_FACTOR = frozenset(
    ("scale", "factor", "gain", "multiplier", "divisor", "exponent", "faktor", "skalierung", "mult", "sign", "polarity")
)
"""Words of which the name of a column of factors, of all columns beside it, may consist."""


def stated_worth(said: Mapping[str, Any], values: np.ndarray) -> str:
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
    stated = []
    for key, value in said.items():
        number = _number(value)
        idle = 1.0 if _FACTORS.search(key) or (whole and _STEPS.search(key)) else 0.0 if _SHIFTS.search(key) else None
        # Beside whole numbers, which may be counts, any number not known to be of something else may be a factor.
        if idle is None and (_PER.search(key) or (whole and number not in (0.0, -1.0) and not _HARMLESS.search(key))):
            idle = 1.0
        if idle is None and whole and PLACES.search(key):
            idle = 0.0
        several = np.asarray(value).ravel()
        listed = number is None and several.size > 1 and several.dtype.kind in "iuf" and idle is not None
        if listed and (_PER.search(key) or not np.isin(several, (0.0, 1.0) if idle else (0.0,)).all()):
            stated.append(f"{key} = {shown_list(several[:4])}")
        if number is None and idle == 1.0 and isinstance(value, str | bytes) and TO_DO.search(text := _text(value)):
            stated.append(f'{key} = "{text[:40]}"')
        if number is not None and ((number < 0 and _SIDES.search(key)) or (number > 0 and _TURNED.search(key))):
            stated.append(f"{key} = {number:g}")
        if number is not None and idle is not None and number != idle:
            stated.append(f"{key} = {number:g}")
    return ", ".join(stated[:3])


def shown_list(values: np.ndarray) -> str:
    """Numbers as a list that is read as one: ``[0.01, 0.001]``.

    Parameters
    ----------
    values : array
        Any shape.
    """
    return f"[{', '.join(f'{value:.9g}' for value in values.ravel().tolist())}]"


def tells_factor(name: str) -> bool:
    """Whether a name is that of what numbers are to be multiplied by, or moved by."""
    return any(words.search(name) for words in (_FACTORS, _SHIFTS, _PER, _CALIBRATIONS))


def are_whole(values: np.ndarray) -> bool:
    """Whether numbers are whole, and not two neighbours alone, as counts are."""
    present = values[np.isfinite(values)]
    return present.size > 0 and bool((present == np.round(present)).all()) and bool(np.ptp(present) > 1)


def contradicted(stated_units: Iterable[str | None]) -> str:
    """What a file states twice and differently of the unit of one column; empty where it does not.

    Parameters
    ----------
    stated_units : iterable of str or None
        Units as written, from all places that state one.

    Returns
    -------
    str
        Such as ``the unit is "N" in one place and "kN" in another``.
    """
    sizes: dict[tuple[str, float], str] = {}
    for unit in stated_units:
        size = _size(unit) if unit else None
        if unit and size is not None:
            sizes.setdefault(size, unit)
    if len(sizes) < 2:
        return ""
    first, second, *_ = sizes.values()
    return f'the unit is "{first}" in one place and "{second}" in another'


def _size(unit: str) -> tuple[str, float] | None:
    """Kind of a unit and what one of it is in SI, to nine digits; None for what is no unit of a plain quantity."""
    kind = units.kind_of(unit)
    si = units.si_unit(unit) if kind in PLAIN_KINDS else None
    return None if kind is None or si is None else (kind, float(f"{units.to_si(unit, si):.9g}"))


def stated_unit(cells: Sequence[str], lines: Iterable[int], where: str) -> str | None:
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


def _text(value: str | bytes) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else value


def _number(value: Any) -> float | None:
    """Number of an attribute, which may be text or an array of one; None where it is none."""
    try:
        one = np.asarray(value).ravel()
        number = float(one[0]) if one.size == 1 else math.nan
    except (TypeError, ValueError):
        return None
    return number if math.isfinite(number) else None
