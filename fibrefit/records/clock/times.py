"""The times of a group of columns, in seconds: which unit, which rate, and what to do when there is neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from datetime import date

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number
from fibrefit.records.clock.base import Readings, TimeBase
from fibrefit.records.clock.repeats import repeated_rows
from fibrefit.records.clock.timebase import counted_times, from_readings, tells_times
from fibrefit.records.clock.wall_clock import refuse_unpadded
from fibrefit.records.columns.damage import absurd
from fibrefit.records.columns.grouping import Group, counts_by
from fibrefit.records.columns.raw import Raw, RawColumn
from fibrefit.records.grammar.digits import masked_with, oddly_written
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.numbers import Numbers
from fibrefit.records.grammar.phrases import GIVE_RATE
from fibrefit.records.grammar.words import counts_rows, score
from fibrefit.records.stamps import Stamps, refuse_millionths, since_first, stamps_of
from fibrefit.records.thresholds import CONTRADICTS, FASTEST_LIKELY, SAME_RATE, SLOWEST_LIKELY

#: From the year 1, where clocks count from, to 1970, in s.
EPOCH = 86400.0 * date(1970, 1, 1).toordinal()

#: Units a column of times without one may be in, if only one of them agrees with the rate in the header.
_POSSIBLE_UNITS = ("s", "ms", "us", "min")


def time_base(
    raw: Raw, columns: Sequence[RawColumn], group: Group, rate: float | None, where: str, worth: float | None = None
) -> TimeBase:
    """Times of a group of columns.

    Parameters
    ----------
    raw : Raw
        The file.
    columns : sequence of RawColumn
        Its columns, with the units the user declared.
    group : Group
        Columns sampled together.
    rate : float or None
        Rate the user gave, in Hz.
    where : str
        File to name in messages.
    worth : float or None
        What one number of the column of times is worth in s, where the user says it.

    Returns
    -------
    TimeBase
        In s, or in the unit of the file where that is not known.

    Raises
    ------
    DataError
        If there is neither a column of times nor a rate, or what there is is not understood.
    """
    if group.time is None:
        return _counted_base(raw, columns, group, rate, where)
    column = columns[group.time]
    place = f'{where}, column "{column.header}"'
    numbers = _reliable_numbers(column, place)
    values = numbers.values[: group.rows]
    if (rate or raw.facts.rate) and not tells_times(values):
        counted = _counted_base(raw, columns, replace(group, time=None), rate, where)
        return _noted(counted, f'Column "{column.header}" tells no times: the rows are counted.')
    factor, unit = (worth, "s") if worth else _factor(column, values, rate or raw.facts.rate, place)
    stamps = stamps_of(values) if unit not in ("clock", None) else None
    if stamps is not None and abs(factor / stamps.worth - 1.0) > SAME_RATE:
        stamps = None  # so many of another unit
    readings = Readings(
        times=(since_first(values, numbers.texts) if stamps else values) * factor,
        resolution=(numbers.resolution if len(numbers.texts) else column.resolution) * factor,
        rows=raw.rows or [str(i) for i in range(group.rows)],
        lines=raw.lines,
        where=place,
        source=f'time column "{column.header}"',
        placed=raw.placed,
    )
    if unit is None:
        return replace(from_readings(readings), header=column.header, unit=None)
    base = from_readings(readings, header_rate=raw.facts.rate, rate=rate)
    base = _begun(base, column, stamps, values)
    if base.rate == raw.facts.rate and base.source == readings.source:
        base = replace(base, source=f'{base.source}, rate from the header ("{raw.facts.quoted}")')
    return replace(base, header=column.header, unit=unit)


def _noted(base: TimeBase, note: str) -> TimeBase:
    return replace(base, notes=(*base.notes, note))


def _begun(base: TimeBase, column: RawColumn, stamps: Stamps | None, values: np.ndarray) -> TimeBase:
    """Times of a clock, or of stamps, from zero on: the first reading may have been lost to damage."""
    if stamps is None and not column.clock:
        return base
    first = float(base.time[np.isfinite(base.time)][0])
    began = column.start
    if stamps is not None:
        began = EPOCH + stamps.zero + stamps.worth * float(values[np.isfinite(values)][0])
        if column.unit is None:
            base = _noted(base, f'Column "{column.header}" counts from {stamps.since}, so it is in {stamps.unit}.')
    return replace(base, time=base.time - first, origin=began + first)


def _factor(column: RawColumn, values: np.ndarray, rate: float | None, where: str) -> tuple[float, str | None]:
    """What one unit of the column is in seconds."""
    if column.clock:
        return 1.0, "clock"
    known = None if column.unit is None else known_unit(column.name, column.unit)
    if known is not None:
        refuse_millionths(values, known, where)
        return units.to_si(known, "s", where, do="Declare it under [units]."), known
    if rate is not None and column.unit is None:
        steps = np.diff(values[np.isfinite(values)])
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
        agreeing = [u for u in _POSSIBLE_UNITS if step and abs(step * units.to_si(u, "s") * rate - 1) < CONTRADICTS]
        if len(agreeing) == 1:
            return units.to_si(agreeing[0], "s"), agreeing[0]
    stamps = stamps_of(values) if column.unit is None else None
    return (stamps.worth, stamps.unit) if stamps is not None else (1.0, None)


def in_seconds(base: TimeBase) -> TimeBase:
    """Times; those without a unit in s, where ms would give a rate that no record has, and min none that anybody sets.

    Parameters
    ----------
    base : TimeBase
        As read.
    """
    faster, slower = (base.rate * units.to_si("s", unit) for unit in ("ms", "min"))
    likely = SLOWEST_LIKELY <= base.rate <= FASTEST_LIKELY < faster and round(slower, 6) % 1.0
    if base.unit is not None or not likely or not base.uniform or base.gaps or base.lost:
        return base
    note = f'Column "{base.header}" has no unit: taken as s, {format_number(base.rate, 6)} Hz.'
    return replace(base, unit="s", notes=(*base.notes, note))


def _refuse_another_rate(columns: Sequence[RawColumn], own: float, rate: float | None, where: str) -> None:
    """Refuse a rate that is given where the channels of a file carry theirs, and none of them that one."""
    if rate is None or any(one.rate and abs(one.rate / rate - 1.0) <= CONTRADICTS for one in columns):
        return
    got = f"the rate given is {format_number(rate, 7)} Hz, and the file says {format_number(own, 7)} Hz"
    raise DataError(where, got, "one rate", "Leave the rate out, or correct what the file says.")


def _counted_base(raw: Raw, columns: Sequence[RawColumn], group: Group, rate: float | None, where: str) -> TimeBase:
    own = columns[group.members[0]] if group.members else None
    if own is not None and own.rate is not None:
        _refuse_another_rate(columns, own.rate, rate, where)
        base = counted_times(group.rows, own.rate, "counted at the rate in the header")
        return TimeBase(base.time + own.start, base.rate, base.source)
    found = rate or raw.facts.rate
    if raw.facts.changes:
        got = f"no column holds the time, and {raw.facts.changes} stands inside the table"
        raise DataError(where, got, "one rate throughout", "Split the file there.")
    if rate is None and found is not None:
        _refuse_spectrum(columns, where)
    if found is None and raw.facts.doubt:
        got = f"no column holds the time, and the header says {raw.facts.doubt}"
        raise DataError(where, got, "one reading", GIVE_RATE)
    if found is None:
        raise _no_time(raw, columns, where)
    origin = "given" if rate else f'from "{raw.facts.quoted}"'
    source = f"counted at {format_number(found, 7)} Hz, {origin}"
    counter = _counter(columns, group)
    if counter is not None:
        step = counts_by(counter.numbers.values)
        if step > 1 and rate is None:
            got = f'column "{counter.header}" counts in steps of {step}, and {source.removeprefix("counted at ")}'
            raise DataError(where, got, "the rate of the rows that are here", GIVE_RATE)
        values = counter.numbers.values / step
        header = f'column "{counter.header}"'
        rows = raw.rows or [str(i) for i in range(group.rows)]
        place = f"{where}, {header}"
        start = values[np.isfinite(values)][0]
        readings = Readings(
            (values - start) / found, 1 / found, rows, raw.lines, place, f"{source}, by {header}", raw.placed
        )
        return from_readings(readings, rate=found)
    _refuse_uncertain_count(raw, columns, group, where)
    return counted_times(group.rows, found, source)


def _refuse_spectrum(columns: Sequence[RawColumn], where: str) -> None:
    """Refuse rows that are frequencies and not times, unless the user says at which rate they were sampled."""
    for column in columns:
        values = column.numbers.values
        rises = np.isfinite(values).all() and values.size > 2 and bool((np.diff(values) > 0).all())
        if column.unit is not None and units.kind_of(column.unit) == "frequency" and rises:
            got = f'no column holds the time, and "{column.header}" rises from row to row, as in a spectrum'
            raise DataError(where, got, "a record in time", f"Export the record itself, or: {GIVE_RATE}")


def _no_time(raw: Raw, columns: Sequence[RawColumn], where: str) -> DataError:
    """Why there are no times: what the header says of the rate, and what each column that may hold them holds."""
    rates = ", ".join(f"{format_number(r, 6)} Hz" for r in raw.facts.rates)
    text = next((what for what in raw.aside.values() if score(what.split('"')[1], "time") > 0), "")
    timed = next((c for c in columns if c.unit and units.kind_of(c.unit) == "time"), None)
    counter = next((c for c in columns if counts_rows(c.name) and c.unit is None), None)
    if text:
        why, do = f"the column {text}", "Export the times as numbers in s, or as hours, minutes and seconds. "
    elif timed is not None:
        why = f'"{timed.header}" has a unit of time and does not increase'
        do = f'If it is the time, name it: time = "{timed.header}" under [channels]. '
    elif counter is not None:
        why, do = f'"{counter.header}" only counts the rows', ""
    else:
        shown = ", ".join(f'"{c.header}"' for c in columns[:6])
        line = raw.layout.get("header_line")
        why = f"none of {shown}{f' in line {line}' if line else ''} has a unit of time or is called so"
        do = "Name it, if there is one: time = ... under [channels]. "
    said = f"several rates: {rates}" if rates else "no rate"
    got = f"no column holds the time ({why}), and the header names {said}"
    return DataError(where, got, 'a time column, or a rate such as "fs = 2000 Hz"', f"{do}{GIVE_RATE}")


def _counter(columns: Sequence[RawColumn], group: Group) -> RawColumn | None:
    """Column that numbers the rows."""
    found = (columns[i] for i in group.beside if counts_rows(columns[i].name) and columns[i].numbers.values.size > 3)
    return next((column for column in found if counts_by(column.numbers.values)), None)


def _refuse_uncertain_count(raw: Raw, columns: Sequence[RawColumn], group: Group, where: str) -> None:
    """Without a time in each row, one row more or less moves all later samples."""
    do = "Export the file again, with a time column."
    if not raw.placed:
        raise _uncertain(raw, where)
    down = next((c for c in columns if c.unit is None and not c.clock and counts_by(-c.numbers.values)), None)
    if down is not None:
        got = f'no column holds the time, and "{down.header}" counts down from row to row'
        raise DataError(where, got, "the oldest row first", "Sort the rows, or export them with a time column.")
    for first, twice in repeated_rows([columns[i].numbers.values[: group.rows] for i in group.members]):
        at = f"{where}, line {raw.lines[first]}" if len(raw.lines) > first else where
        do = "Take out what is repeated, or export the file again, with a time column."
        raise DataError(at, f"no column holds the time, and {twice}", "each sample once", do)
    if raw.facts.samples is not None and raw.facts.samples != group.rows:
        got = f"no column holds the time; the header announces {raw.facts.samples} samples, and {group.rows} are there"
        raise DataError(where, got, "", do)


def _uncertain(raw: Raw, where: str) -> DataError:
    """Refusal where something stands between rows that have no times: nobody knows what is missing there."""
    bad = raw.layout.get("unreadable_lines") or []
    between = np.flatnonzero(np.diff(raw.lines) > 1)
    number = int(raw.lines[between[0]]) + 1 if between.size else None
    do = "Export the file again, with a time column."
    if bad:
        what = f"line {bad[0]} is not readable"
    elif number in raw.layout.get("lines_between", ()):
        what = f"line {number} stands between the rows, as where another recording begins"
        do = "Split the file there; or take the line out, if no sample is missing there."
    else:
        what = "blank lines stand between the rows"
    return DataError(where, f"no column holds the time, and {what}, so later times are uncertain", "", do)


def _reliable_numbers(column: RawColumn, where: str) -> Numbers:
    """Numbers of a column of times, those that are oddly written masked.

    Parameters
    ----------
    column : RawColumn
        The column.
    where : str
        File and column to name in messages.

    Returns
    -------
    Numbers
        With NaN where a time cannot be relied on.

    Raises
    ------
    DataError
        If parts of a second are printed without their leading zeros.
    """
    numbers = column.numbers
    if not len(numbers.texts):
        return numbers
    if (np.diff(numbers.values) < 0.0).any():
        refuse_unpadded(numbers.texts, where)
    if not _counts_from_the_first(numbers.values, far := absurd(numbers.values)):
        numbers = masked_with(numbers, far, "absurd")
    return masked_with(numbers, oddly_written(numbers), "digit lost or doubled")


def _counts_from_the_first(values: np.ndarray, far: np.ndarray) -> bool:
    """Whether numbers far from all others are the first ones, and rise: of a counter that runs over after them."""
    number = int(far.sum())
    return number > 1 and bool(far[:number].all()) and bool((np.diff(values[:number]) > 0.0).all())
