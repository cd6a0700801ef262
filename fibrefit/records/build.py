"""From columns as read to a table in SI: roles, units, times, and what is masked."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from fibrefit.core import units as registry
from fibrefit.core.errors import DataError, did_you_mean
from fibrefit.core.roles import ROLES
from fibrefit.core.scale import Scale
from fibrefit.records.clock.timebase import TimeBase
from fibrefit.records.clock.times import time_base
from fibrefit.records.columns.channel import Channel
from fibrefit.records.columns.damage import absurd, flat_stretches, lone_outliers
from fibrefit.records.columns.grouping import Group, grouped
from fibrefit.records.columns.raw import Raw, RawColumn
from fibrefit.records.columns.roles import Heading, find_column, guessed_roles, named_roles
from fibrefit.records.grammar.digits import masked_with, odd_numbers
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.numbers import REASONS, Numbers
from fibrefit.records.grammar.phrases import count
from fibrefit.records.options import ReadOptions
from fibrefit.records.table import Column, Table, frozen, frozen_mapping

#: SI units of signals that a full amplifier cuts off; a length that stops dead may be an end stop or a drive at rest.
_CUT_OFF_BY_AMPLIFIERS = ("N", "V")

#: Readings among which two values only are no accident.
_ENOUGH = 20


def build_table(raw: Raw, path: Path, sha256: str, options: ReadOptions) -> Table:
    """Table of a file.

    Parameters
    ----------
    raw : Raw
        Its columns as read.
    path : Path
        The file.
    sha256 : str
        Of its bytes.
    options : ReadOptions
        What the user says.

    Returns
    -------
    Table
        In SI where units are known.

    Raises
    ------
    DataError
        If a named column is not there, or the times are not understood.
    """
    where = path.name
    channels = options.declared(where)
    headings = [_heading(column) for column in raw.columns]
    for key, unit in options.units.items():
        place = None if key in ROLES else find_column(key, headings)
        if place is not None:  # what is said of a column by its heading helps to tell what it is
            headings[place] = replace(headings[place], unit=unit)
    named = named_roles(channels, headings, raw.aside, where)
    groups = grouped(raw.columns, headings, named)
    notes = [*raw.notes, *raw.facts.notes]
    roles, doubts = _roles(named, groups, headings, options.roles, where)
    said = options.units | {role: channel.unit for role, channel in channels.items() if channel.unit}
    times = [group.time for group in groups if group.time is not None]
    columns = _declared(raw.columns, headings, said, roles, times, where, notes)
    scales = _scales(channels, roles, columns, doubts, where)
    timed = [time_base(raw, columns, group, options.rate, where) for group in groups]
    groups, bases = _merged(groups, timed)
    notes += [note for base in bases for note in base.notes]
    finished = {
        i: _finished(columns[i], bases[g], g, scales.get(i), notes)
        for g, group in enumerate(groups)
        for i in group.members
    }
    places = {i: place for place, i in enumerate(finished)}
    return Table(
        path=path,
        sha256=sha256,
        columns=tuple(finished.values()),
        times=tuple(replace(base, time=frozen(base.time)) for base in bases),
        roles=frozen_mapping({role: places[i] for role, i in roles.items() if i in places}),
        doubts=frozen_mapping(doubts),
        layout=frozen_mapping(raw.layout),
        notes=tuple(dict.fromkeys(notes)),
    )


def _roles(
    named: Mapping[str, int], groups: Sequence[Group], headings: Sequence[Heading], wanted: Sequence[str], where: str
) -> tuple[dict[str, int], dict[str, DataError]]:
    """Position of each role, named or guessed; roles in doubt with the reason."""
    times = [i for group in groups for i in (group.time, *group.beside) if i is not None and i not in named.values()]
    taken = {**named, **{f"time {i}": i for i in times}}
    guessed, doubts = guessed_roles(headings, taken, wanted, where)
    roles = {**named, **guessed}
    if groups[0].time is not None:
        roles.setdefault("time", groups[0].time)
    return roles, doubts


def _declared(
    columns: Sequence[RawColumn],
    headings: Sequence[Heading],
    declared: Mapping[str, str],
    roles: Mapping[str, int],
    times: Sequence[int],
    where: str,
    notes: list[str],
) -> list[RawColumn]:
    """Columns with the units the user declared, by role, header or number of the column."""
    result = list(columns)
    for key, unit in declared.items():
        place = roles[key] if key in roles else find_column(key, headings)
        if place is None:
            raise _hits_nothing(key, headings, where)
        column = columns[place]
        if registry.expression(unit) is None:
            expected = registry.ACCEPTED[ROLES[key]] if key in ROLES else "a known unit, such as N, mm, ms, V or counts"
            raise DataError(
                f'{where}, unit of "{key}"', f'unit "{unit}"', expected, did_you_mean(unit, ("N", "mm", "ms", "V", "counts"))
            )
        if column.unit is not None and registry.expression(column.unit) != registry.expression(unit):
            notes.append(f'Column "{column.header}" is read in {unit}, as declared, not in {column.unit}.')
        # Each group of columns may have times of its own: what is said of the time is said of all of them.
        same = [i for i in times if result[i].unit is None] if key == "time" else []
        for i in {place, *same}:
            result[i] = replace(result[i], unit=unit)
    return result


def _heading(column: RawColumn) -> Heading:
    values = column.numbers.values
    present = values[np.isfinite(values)]
    two_valued = False
    if present.size >= _ENOUGH:
        low, high = present.min(), present.max()
        two_valued = bool(low < high and ((present == low) | (present == high)).all())
    return Heading(column.header, column.name, column.unit, column.clock, column.number, two_valued)


def _hits_nothing(key: str, headings: Sequence[Heading], where: str) -> DataError:
    """A unit declared for what the file does not have."""
    present = [h.header for h in headings if h.header]
    shown = ", ".join(f'"{text}"' for text in present[:8])
    if key in ROLES:
        do = f'Name its column: {key} = "{present[0] if present else "column 1"}" under [channels], or drop the unit.'
        return DataError(f'{where}, unit of "{key}"', f"no column is known to be the {key}", f"one of {shown}", do)
    do = did_you_mean(key, [*present, *ROLES]) or "Correct the heading, or drop the unit."
    return DataError(f'{where}, unit of "{key}"', "no such column", f"a role, or one of {shown}", do)


def _scales(
    channels: Mapping[str, Channel],
    roles: Mapping[str, int],
    columns: Sequence[RawColumn],
    doubts: Mapping[str, DataError],
    where: str,
) -> dict[int, tuple[Scale, float, str]]:
    """Scale, factor to SI and SI unit of each column that has one declared."""
    found = {}
    for role, channel in channels.items():
        if channel.scale is None:
            continue
        if role not in roles:
            if role in doubts:
                raise doubts[role]
            do = f'Name its column: {role} = {{ column = "...", scale = "{channel.scale.text}" }}.'
            raise DataError(f'{where}, channel "{role}"', "a scale, and no column it belongs to", "its column", do)
        column = columns[roles[role]]
        unit = None if column.unit is None else known_unit(column.name, column.unit)
        place = f'{where}, column "{column.header}"'
        if column.unit is not None and unit is None:
            do = f'Say what the numbers are in: unit = "V" beside the scale, or unit = "counts".'
            raise DataError(place, f'unit "{column.unit}" is not known, so the scale has no meaning', "", do)
        factor = channel.scale.factor(unit, ROLES[role], place, error=DataError)
        found[roles[role]] = (channel.scale, factor, ROLES[role])
    return found


def _merged(groups: Sequence[Group], bases: Sequence[TimeBase]) -> tuple[list[Group], list[TimeBase]]:
    """Groups whose samples were taken at the same times, put together."""
    merged: list[Group] = []
    kept: list[TimeBase] = []
    for group, base in zip(groups, bases, strict=True):
        for i, other in enumerate(kept):
            if other.time.size == base.time.size and np.array_equal(other.time, base.time, equal_nan=True):
                merged[i] = replace(merged[i], members=merged[i].members + group.members)
                break
        else:
            merged.append(group)
            kept.append(base)
    return merged, kept


def _finished(
    column: RawColumn, base: TimeBase, group: int, scale: tuple[Scale, float, str] | None, notes: list[str]
) -> Column:
    """Column in SI with all that is wrong with it masked."""
    known = None if column.unit is None else known_unit(column.name, column.unit)
    si = None if known is None else registry.si_unit(known)
    factor = 1.0 if known is None or si is None else registry.to_si(known, si)
    if scale is not None:
        stated, factor, si = scale
        notes.append(f'Column "{column.header}" is scaled by {stated.text}.')
    elif column.unit is not None and si is None:
        notes.append(f'Column "{column.header}": unit "{column.unit}" is not known; the values are as in the file.')
    numbers, outliers = _masked(column, base, si, notes)
    valid = numbers.reasons == 0
    counts = {REASONS[c]: int(n) for c, n in zip(*np.unique(numbers.reasons[~valid], return_counts=True), strict=True)}
    return Column(
        header=column.header,
        name=column.name,
        unit=column.unit,
        si=si,
        values=frozen(_scaled(numbers.values, factor)),
        valid=frozen(valid),
        masked=frozen_mapping(counts),
        group=group,
        outliers=tuple(map(int, outliers)),
        scale=None if scale is None else scale[0],
    )


def _scaled(values: np.ndarray, factor: float) -> np.ndarray:
    """Values times a factor; by division where that is exact, so that 12.5 mm is 0.0125 m to the last bit."""
    inverse = 1.0 / factor
    return values / round(inverse) if 0 < factor < 1 and abs(inverse - round(inverse)) < 1e-9 * inverse else values * factor


def _masked(column: RawColumn, base: TimeBase, si: str | None, notes: list[str]) -> tuple[Numbers, np.ndarray]:
    """Numbers of a column with damage masked, and the rows of outliers that are only reported."""
    n = base.time.size
    whole = column.numbers
    numbers = Numbers(whole.values[:n], whole.reasons[:n], whole.shapes[:n], whole.texts[:n], whole.mark)
    numbers = masked_with(numbers, absurd(numbers.values), "absurd")
    if len(numbers.texts):
        numbers = masked_with(numbers, odd_numbers(numbers), "digit lost or doubled")
    numbers = masked_with(numbers, np.isnan(base.time), "time unusable")
    flat = flat_stretches(numbers.values, numbers.resolution if len(numbers.texts) else column.resolution)
    numbers = masked_with(numbers, flat.saturated, "saturated")
    numbers = masked_with(numbers, flat.stuck, "stuck")
    if si in _CUT_OFF_BY_AMPLIFIERS:
        numbers = masked_with(numbers, flat.clipped, "saturated")
    stopped = (flat.stops_dead | flat.clipped) & (numbers.reasons == 0)
    if stopped.any():
        notes.append(_stops_dead(column, stopped))
    outliers = lone_outliers(numbers.values)
    if outliers.size:
        shown = ", ".join(f"{base.time[i]:.6g}" for i in outliers[:3])
        more = " ..." if outliers.size > 3 else ""
        notes.append(f'Column "{column.header}" has {count(outliers.size, "lone outlier")} (at {shown}{more} s); kept.')
    return numbers, outliers


def _stops_dead(column: RawColumn, where: np.ndarray) -> str:
    stopped = count(int(where.sum()), "sample")
    return (
        f'Column "{column.header}" stops dead at its extreme for {stopped}: an end stop, a drive at rest, '
        "or a sensor at full scale; kept."
    )
