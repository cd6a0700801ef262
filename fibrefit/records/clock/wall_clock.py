"""Clock times to seconds since the first sample.

Only differences matter, so the order of day and month need not be known within a day.
"""

from __future__ import annotations

import datetime
import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.records.grammar.tokens import DATE, clean, clock_of
from fibrefit.records.thresholds import MOST_LOST

_DAY, _HOUR = 86400.0, 3600.0

#: Offset from UTC at the end of a reading.
_ZONE = re.compile(r"(?<=\d)\s?(?:[zZ]|([+-])(\d{2}):?(\d{2}))\s*$")

#: A reading in full seconds, and thousandths behind it, with or without their leading zeros.
_PART = re.compile(r"(\d+|.*:\d{2})[.,:](\d{1,3})")

_MONTHS = {
    name: number
    for number, names in enumerate(
        ("jan", "feb", "mar mär", "apr", "may mai", "jun", "jul", "aug", "sep", "oct okt", "nov", "dec dez"), 1
    )
    for name in names.split()
}


@dataclass(frozen=True, slots=True)
class Clock:
    """Times of a column of clock readings.

    Parameters
    ----------
    seconds : (n,) float array
        Since the first readable sample, in s; NaN where the cell is no time.
    resolution : float
        Step of the last printed decimal, in s.
    start : str
        First reading, as written.
    origin : float
        First reading in s: since the year 1 where a date is written, else since midnight.
    notes : tuple of str
        What had to be decided.
    """

    seconds: np.ndarray
    resolution: float
    start: str
    notes: tuple[str, ...] = ()
    origin: float = 0.0


def parse_clock(texts: Sequence[str], where: str) -> Clock:
    """Seconds from a column of clock readings.

    Parameters
    ----------
    texts : sequence of str
        Cells: ``12.05.2014 14:22:11,0005``, ``2014-05-12T14:22:11.5``, ``02:22:11.000 PM``, ``14:22:11:250``.
    where : str
        File and column to name in messages.

    Returns
    -------
    Clock
        Times; midnight is passed where the date changes or the hours start again.

    Raises
    ------
    DataError
        If no cell holds a time of day, or one without seconds leaves it open what it counts.
    """
    refuse_unpadded(texts, where)
    days: list[str] = []
    seconds, offsets = np.full(len(texts), np.nan), np.zeros(len(texts))
    decimals, zones = 0, 0
    cache: dict[str, tuple[str, float] | None] = {}
    for i, cell in enumerate(texts):
        text, zone = _without_zone(clean(cell))
        if zone is not None:
            offsets[i], zones = zone, zones + 1
        # All but the seconds repeats from row to row.
        head, colon, tail = text.rpartition(":")
        if head not in cache:
            cache[head] = _head(head) if colon else None
        found = cache[head]
        parsed = (_with_tail(found, tail) if found is not None else None) or _whole(text)
        if parsed is None:
            days.append("")
            continue
        day, seconds[i], places = parsed
        days.append(day)
        decimals = max(decimals, places)
    if np.isnan(seconds).all():
        raise DataError(where, f'"{texts[0]}" is no time of day with seconds', "hours, minutes and seconds")
    clock = _since_first(seconds, days, decimals, offsets, texts)
    if not zones:
        _refuse_change_of_hour(clock.seconds, texts, where)
    return clock


def _without_zone(text: str) -> tuple[str, float | None]:
    """Reading without its offset from UTC, and the offset in s; None where it states none."""
    if ":" not in text and "T" not in text:
        return text, None
    match = _ZONE.search(text)
    if match is None:
        return text, None
    sign, hours, minutes = match.groups()
    return text[: match.start()], 0.0 if sign is None else float(f"{sign}1") * (3600 * int(hours) + 60 * int(minutes))


def refuse_unpadded(texts: Sequence[str], where: str) -> None:
    """Refuse parts of a second without their leading zeros: decimals run backward, and thousandths do not.

    Parameters
    ----------
    texts : sequence of str
        Cells of a column of times: clock readings, or numbers.
    where : str
        File and column to name in messages.

    Raises
    ------
    DataError
        With the first two readings that tell it.
    """
    if len(set(map(len, texts))) < 2:
        return
    parts = [match for text in texts if (match := _PART.fullmatch(clean(text)))]
    digits = [part[2] for part in parts]
    if len(parts) < (1.0 - MOST_LOST) * len(texts) or len(set(map(len, digits))) < 2:
        return
    found = [(_whole(f"{part[1]}.0") or ("", np.nan))[1] if ":" in part[1] else float(part[1]) for part in parts]
    whole, counted = np.array(found), np.array([float(text) for text in digits])
    back = np.flatnonzero(np.diff(whole + np.array([float(f"0.{text}") for text in digits])) < 0.0)
    if back.size and (np.diff(whole + 1e-3 * counted) > 0.0).all():
        before, after = (parts[back[0] + k][0] for k in (0, 1))
        got = f'"{before}" is followed by "{after}": thousandths without their leading zeros'
        raise DataError(where, got, "three digits of thousandths", "Export the times with all digits, or in seconds.")


def _refuse_change_of_hour(seconds: np.ndarray, texts: Sequence[str], where: str) -> None:
    """Refuse local times that jump by an hour: the change of summer time, or a pause; only the logger knows."""
    present = np.flatnonzero(np.isfinite(seconds))
    steps = np.diff(seconds[present])
    if steps.size < 3:
        return
    usual = float(np.median(np.abs(steps)))
    jumps = np.flatnonzero((np.abs(np.abs(steps) - _HOUR) <= 10 * usual) & (usual < _HOUR / 100))
    if jumps.size:
        before, after = (texts[present[jumps[0] + k]].strip() for k in (0, 1))
        if after.count(":") == 1:
            got = f'"{before}" is followed by "{after}": minutes and seconds without their hours'
            raise DataError(where, got, "times that run on", "Show the hours, as h:mm:ss.000, and export it again.")
        got = f'"{before}" is followed by "{after}", an hour apart as at the change of summer time'
        do = "Export the times in UTC, with their UTC offsets, or in seconds; or split the file there."
        raise DataError(where, got, "times that run on", do)


def _head(head: str) -> tuple[str, float] | None:
    """Date and seconds up to the full minute of a reading without its seconds; None where it is anything else."""
    match = re.fullmatch(r"(?:(\S+(?: \S+ \d{4})?)[ T])?(\d{1,2}):(\d{2})", clean(head))
    if match is None or not DATE.fullmatch(match.group(1) or "1.1.2000") or int(match.group(2)) > 23:
        return None
    return match.group(1) or "", 3600.0 * int(match.group(2)) + 60.0 * int(match.group(3))


def _with_tail(head: tuple[str, float], tail: str) -> tuple[str, float, int] | None:
    whole, _, fraction = tail.strip().removesuffix("Z").replace(",", ".").partition(".")
    if not (whole.isdecimal() and fraction.isdecimal() and len(whole) == 2 and whole < "61"):
        return None
    return head[0], head[1] + float(f"{whole}.{fraction}"), len(fraction)


def _whole(text: str) -> tuple[str, float, int] | None:
    """Date, seconds of the day and decimals of one reading."""
    text = clean(text)
    match = clock_of(text)
    if match is None or match.group("time") is None:
        return None
    sign = -1.0 if text.startswith("-") else 1.0  # before the trigger
    parts = re.split(r":", match.group("time"))
    if len(parts) == 4:  # 14:22:11:250, the thousandths after a colon
        parts = [*parts[:2], f"{parts[2]}.{parts[3]}"]
    if len(parts) == 2 and not re.search("[.,]", parts[1]):
        return None  # hours and minutes, or minutes and seconds
    last = parts[-1].replace(",", ".")
    hours = int(parts[0]) if len(parts) == 3 else 0
    minutes = int(parts[-2])
    half = (match.group("half") or "").strip().replace(".", "").casefold()
    if half:
        hours = hours % 12 + (12 if half == "pm" else 0)
    too_late = hours > 23 and match.group("date") is not None
    if too_late or (minutes > 59 and len(parts) == 3) or float(last) >= 61:
        return None
    seconds = _DAY * int(match.group("days") or 0) + 3600.0 * hours + 60.0 * minutes + float(last)
    return match.group("date") or "", sign * seconds, len(last.partition(".")[2])


def _since_first(
    seconds: np.ndarray, days: list[str], decimals: int, offsets: np.ndarray, texts: Sequence[str]
) -> Clock:
    first = int(np.flatnonzero(np.isfinite(seconds))[0])
    distinct = list(dict.fromkeys(day for day in days if day))
    notes: tuple[str, ...] = ()
    if len(distinct) > 1:
        numbers = dict(zip(distinct, _day_numbers(distinct), strict=True))
        usual = max(distinct, key=days.count)  # counted from there, a date that is wrong costs the others no digit
        offset = {day: _DAY * (number - numbers[usual]) for day, number in numbers.items()} | {"": 0.0}
        seconds = seconds + np.array([offset[day] for day in days])
        notes = ("The record passes midnight.",) if min(map(days.count, distinct)) > 2 else ()
    else:
        present = np.flatnonzero(np.isfinite(seconds))
        starts_again = _midnights(seconds[present])
        if starts_again:
            turns = np.zeros(seconds.size)
            turns[present[starts_again]] = 1.0
            seconds = seconds + _DAY * np.cumsum(turns)
            notes = ("The record passes midnight.",)
    seconds = seconds - (offsets - offsets[first])
    ordinals = [n for n in (_ordinal(days[first], order) for order in ("ymd", "dmy", "mdy")) if n is not None]
    origin = float(seconds[first] - offsets[first]) + _DAY * (ordinals[0] if ordinals else 0)
    # Times of day hold 5 digits before the point: round away what the subtraction leaves over.
    since = np.round(seconds - seconds[first], decimals + 1)
    return Clock(since, float(10.0**-decimals), texts[first].strip(), notes, origin)


def _midnights(seconds: np.ndarray) -> list[int]:
    """Rows at which the hours start again and stay low; a single wrong hour does not make a day."""
    back = np.flatnonzero(np.diff(seconds) < -_DAY / 2) + 1
    return [int(i) for i in back if np.median(seconds[i : i + 5]) < np.median(seconds[max(0, i - 5) : i]) - _DAY / 2]


def _day_numbers(dates: list[str]) -> list[int]:
    """Days since the first date; of the possible orders of day, month and year, the one with the shortest span."""
    spans = []
    for order in ("ymd", "dmy", "mdy"):
        numbers = [_ordinal(date, order) for date in dates]
        known = [number for number in numbers if number is not None]
        if len(known) == len(numbers) and known == sorted(known):
            spans.append((known[-1] - known[0], [number - known[0] for number in known]))
    return min(spans)[1] if spans else list(range(len(dates)))


def _ordinal(date: str, order: str) -> int | None:
    named = re.search(r"[^\W\d_]{3}", date)
    if named:
        date = re.sub(r"[^\W\d_]+\.?", f"{_MONTHS.get(named[0].casefold(), 0):02d}", date)
        order = "dmy"
    parts = [int(part) for part in re.findall(r"\d+", date)]
    if len(parts) != 3 or (order == "ymd") != (len(re.findall(r"\d+", date)[0]) == 4):
        return None
    fields = dict(zip(order, parts, strict=True))
    year = fields["y"] + (2000 if fields["y"] < 100 else 0)
    try:
        return datetime.date(year, fields["m"], fields["d"]).toordinal()
    except ValueError:
        return None
