"""Universal files: data sets 58 of vibration measurement, a channel each, as a table."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace
from decimal import Decimal, InvalidOperation

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.files.decode import Text

#: What begins and ends a data set.
_FENCE = "    -1"
#: Lines of a data set before its values, the number of its kind among them.
_HEAD = 12
_TIME_AXIS = 17
#: A number of the head that times are made of, of no more digits than these have.
_AMOUNT = re.compile(r"[+-]?\d{0,12}(?:\.\d{0,12})?(?:[eE][+-]?0?\d{1,2})?")
#: Ordinates: real of six and of twelve digits; of each the width of a value, alone and behind its abscissa.
_REAL = {2: ((13,), (13, 13)), 4: ((20,), (13, 20))}
_DO = "Export the time records as CSV, a column each, or as MATLAB or HDF5."


@dataclass(frozen=True, slots=True)
class _Channel:
    """One function of time: its heading, the unit of its times, and these and its values as printed."""

    heading: str
    unit: str
    times: tuple[str, ...]
    values: tuple[str, ...]


def is_universal(lines: Sequence[str]) -> bool:
    """Whether lines are those of a universal file.

    Parameters
    ----------
    lines : sequence of str
        Of a file, the first ones at least.
    """
    filled = [line for line in lines[:3] if line.strip()]
    return len(filled) > 1 and filled[0].rstrip() == _FENCE and re.fullmatch(r"\s*\d+b?.*", filled[1]) is not None


def from_universal(text: Text, where: str) -> Text:
    """Text as a table with a heading.

    Parameters
    ----------
    text : Text
        A universal file.
    where : str
        File to name in messages.

    Returns
    -------
    Text
        A column of times, and one for each data set 58 of a function of time; other data sets are left out.

    Raises
    ------
    DataError
        If there is no such data set, or they were not sampled at the same times.
    """
    channels = [_channel(body, f"{where}, line {number}") for number, body in _sets(text.lines, where)]
    if not channels:
        raise DataError(where, "a universal file without a data set 58", "records in time", _DO)
    first, *others = channels
    other = next((one for one in others if (one.times, one.unit) != (first.times, first.unit)), None)
    if other is not None:
        got = f'"{first.heading}" and "{other.heading}" were sampled at different times'
        raise DataError(where, got, "channels that were sampled together", "Export them at one rate.")
    headings = [f"{one.heading} ({i})" if i else one.heading for i, one in _counted(channels)]
    rows = zip(first.times, *(one.values for one in channels), strict=True)
    return replace(text, lines=["\t".join((f"Time [{first.unit}]", *headings)), *map("\t".join, rows)], ended=True)


def _counted(channels: Sequence[_Channel]) -> list[tuple[int, _Channel]]:
    """Channels with their number, where several have one heading; 0 elsewhere."""
    called = [one.heading for one in channels]
    return [(i if called.count(one.heading) > 1 else 0, one) for i, one in enumerate(channels, 1)]


def _sets(lines: Sequence[str], where: str) -> list[tuple[int, list[str]]]:
    """Data sets 58, each with the line it begins in."""
    fences = [i for i, line in enumerate(lines) if line.rstrip() == _FENCE]
    found = []
    for start, stop in zip(fences[::2], [*fences[1::2], len(lines)], strict=False):
        kind = lines[start + 1].split()[:1] if start + 1 < stop else []
        if kind == ["58b"]:
            got = "a binary data set 58"
            raise DataError(f"{where}, line {start + 2}", got, "data sets in text", _DO)
        if kind == ["58"]:
            found.append((start + 2, list(lines[start + 1 : stop])))
    return found


def _channel(body: Sequence[str], where: str) -> _Channel:
    """One data set 58, its head in fixed columns as the format has it."""
    try:
        kind, size, even = (int(body[7][i : i + 10]) for i in (0, 10, 20))
        begin, step = (_amount(body[7][i : i + 13].strip()) for i in (30, 43))
        axis, ordinate = (int(body[i][:10]) for i in (8, 9))
        title, unit = body[9][25:46].strip(), body[9][46:67].strip()
        for line in body[9:_HEAD]:
            int(line[:10])
    except (ValueError, IndexError, InvalidOperation):
        got = "a data set 58 whose head is not as the format has it"
        raise DataError(where, got, "eleven lines before its values", _DO) from None
    own = body[8][46:67].strip()
    own = own if units.kind_of(own) == "time" else ""
    if axis != _TIME_AXIS and not own:
        got = f'a function of "{body[8][25:46].strip()}", kind {axis}'
        raise DataError(where, got, f"records in time, kind {_TIME_AXIS}", _DO)
    if kind not in _REAL:
        raise DataError(where, f"values of kind {kind}", "real numbers, kind 2 or 4", _DO)
    values = _values(body[_HEAD:], _REAL[kind][0 if even else 1])
    times, values = ([], values) if even else (values[::2], values[1::2])
    if len(values) != size:
        raise DataError(where, f"{len(values)} values of {size} that its head announces", "all of them", "")
    times = [f"{begin + i * step:f}" for i in range(size)] if even else times
    name = title if title and title != "NONE" else body[1].strip() or f"kind {ordinate}"
    known = unit and unit != "NONE"
    return _Channel(f"{name} [{unit}]" if known else name, own or "s", tuple(times), tuple(values))


def _amount(text: str) -> Decimal:
    if not _AMOUNT.fullmatch(text):
        raise ValueError(text)
    return Decimal(text)


def _values(lines: Sequence[str], widths: Sequence[int]) -> list[str]:
    """Values of fixed width, which may touch."""
    found: list[str] = []
    for line in lines:
        place, end = 0, len(line.rstrip())
        while place < end:
            width = widths[len(found) % len(widths)]
            found.append(line[place : place + width].strip())
            place += width
    return found
