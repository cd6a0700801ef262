"""The times of a group of columns, in seconds: which unit, which rate, and what to do when there is neither."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.core.units import format_number
from fibrefit.records.clock.timebase import Readings, TimeBase, counted_times, from_readings
from fibrefit.records.columns.damage import absurd
from fibrefit.records.columns.grouping import Group
from fibrefit.records.columns.raw import Raw, RawColumn
from fibrefit.records.grammar.digits import masked_with, oddly_written
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.numbers import Numbers

#: Units a column of times without one may be in, if only one of them agrees with the rate in the header.
_POSSIBLE_UNITS = ("s", "ms", "us", "min")


def time_base(raw: Raw, columns: Sequence[RawColumn], group: Group, rate: float | None, where: str) -> TimeBase:
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
    numbers = _reliable_numbers(column)
    place = f'{where}, column "{column.header}"'
    values = numbers.values[: group.rows]
    factor, unit = _factor(column, values, rate or raw.facts.rate, place)
    readings = Readings(
        times=values * factor,
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
    if column.clock:  # the first reading may have been lost to damage
        base = replace(base, time=base.time - base.time[np.isfinite(base.time)][0])
    if base.rate == raw.facts.rate and base.source == readings.source:
        base = replace(base, source=f'{base.source}, rate from the header ("{raw.facts.quoted}")')
    return replace(base, header=column.header, unit=unit)


def _factor(column: RawColumn, values: np.ndarray, rate: float | None, where: str) -> tuple[float, str | None]:
    """What one unit of the column is in seconds."""
    if column.clock:
        return 1.0, "clock"
    known = None if column.unit is None else known_unit(column.name, column.unit)
    if known is not None:
        return units.to_si(known, "s", where, do="Declare it under [units]."), known
    if rate is not None and column.unit is None:
        steps = np.diff(values[np.isfinite(values)])
        step = float(np.median(steps[steps > 0])) if (steps > 0).any() else 0.0
        agreeing = [u for u in _POSSIBLE_UNITS if step and abs(step * units.to_si(u, "s") * rate - 1) < 0.01]
        if len(agreeing) == 1:
            return units.to_si(agreeing[0], "s"), agreeing[0]
    return 1.0, None


def _counted_base(raw: Raw, columns: Sequence[RawColumn], group: Group, rate: float | None, where: str) -> TimeBase:
    own = columns[group.members[0]] if group.members else None
    if own is not None and own.rate is not None:
        base = counted_times(group.rows, own.rate, "counted at the rate in the header")
        return TimeBase(base.time + own.start, base.rate, base.source)
    found = rate or raw.facts.rate
    if found is None:
        rates = ", ".join(f"{format_number(r, 6)} Hz" for r in raw.facts.rates)
        got = f"no column holds the time, and the header names {'several rates: ' + rates if rates else 'no rate'}"
        do = "Name the time column under [channels], or give the sampling rate."
        raise DataError(where, got, 'a time column, or a rate such as "fs = 2000 Hz"', do)
    origin = "given" if rate else f'from "{raw.facts.quoted}"'
    source = f"counted at {format_number(found, 7)} Hz, {origin}"
    counter = _counter(columns, group)
    if counter is not None:
        values = counter.numbers.values
        header = f'column "{counter.header}"'
        rows = raw.rows or [str(i) for i in range(group.rows)]
        place = f"{where}, {header}"
        start = values[np.isfinite(values)][0]
        readings = Readings(
            (values - start) / found, 1 / found, rows, raw.lines, place, f"{source}, by {header}", raw.placed
        )
        return from_readings(readings, rate=found)
    _refuse_uncertain_count(raw, group, where)
    return counted_times(group.rows, found, source)


def _counter(columns: Sequence[RawColumn], group: Group) -> RawColumn | None:
    """Column that numbers the rows one by one."""
    for i in group.beside:
        values = columns[i].numbers.values
        steps = np.diff(values[np.isfinite(values)])
        if steps.size > 2 and np.mean(steps == 1) > 0.8:
            return columns[i]
    return None


def _refuse_uncertain_count(raw: Raw, group: Group, where: str) -> None:
    """Without a time in each row, one row more or less moves all later samples."""
    do = "Export the file again, with a time column."
    if not raw.placed:
        bad = raw.layout.get("unreadable_lines") or []
        what = f"line {bad[0]} is not readable" if bad else "blank lines stand between the rows"
        raise DataError(where, f"no column holds the time, and {what}, so later times are uncertain", "", do)
    if raw.facts.samples is not None and raw.facts.samples != group.rows:
        got = f"no column holds the time; the header announces {raw.facts.samples} samples, and {group.rows} are there"
        raise DataError(where, got, "", do)


def _reliable_numbers(column: RawColumn) -> Numbers:
    """Numbers of a column of times, those that are oddly written masked.

    Parameters
    ----------
    column : RawColumn
        The column.

    Returns
    -------
    Numbers
        With NaN where a time cannot be relied on.
    """
    numbers = column.numbers
    if not len(numbers.texts):
        return numbers
    numbers = masked_with(numbers, absurd(numbers.values), "absurd")
    return masked_with(numbers, oddly_written(numbers), "digit lost or doubled")
