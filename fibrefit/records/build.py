"""From columns as read to a table in SI: roles, units, times, and what is masked."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from fibrefit.core import units as registry
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number
from fibrefit.core.limits import LARGEST_SIZE
from fibrefit.core.paths import shown_path
from fibrefit.records.clock.base import TimeBase
from fibrefit.records.clock.claimed import annotated_first_row, newest_first, wrong_times
from fibrefit.records.clock.times import in_seconds, time_base
from fibrefit.records.columns.account import unaccounted
from fibrefit.records.columns.bearing import THINNED
from fibrefit.records.columns.damage import (
    absurd,
    flat_stretches,
    folded,
    held_over,
    is_fresh,
    lone_outliers,
    returning,
    switched,
)
from fibrefit.records.columns.declared import Declared, Scaled, headings_of, unread_position, with_factors_beside
from fibrefit.records.columns.grouping import Group, grouped, refuse_two_clocks
from fibrefit.records.columns.known import AsRead
from fibrefit.records.columns.raw import Raw, RawColumn
from fibrefit.records.columns.roles import Heading, guessed_roles, named_roles, nothing_below
from fibrefit.records.columns.states import flagged, numbered_recordings, without_bad
from fibrefit.records.grammar.digits import grouped_digits, masked_with, odd_numbers
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.numbers import REASONS, Numbers
from fibrefit.records.grammar.phrases import count, not_understood, split_at
from fibrefit.records.options import ReadOptions
from fibrefit.records.table import Column, Table, frozen, frozen_mapping
from fibrefit.records.thresholds import CONTRADICTS

#: SI units of signals that a full amplifier cuts off; a length that stops dead may be an end stop or a drive at rest.
_CUT_OFF_BY_AMPLIFIERS = ("N", "V")
#: Those of what is exactly zero while a machine stands.
_SPEEDS = ("m/s", "rad/s", "Hz")


def build_table(raw: Raw, path: Path, sha256: str, options: ReadOptions) -> Table:
    """Table of a file: in SI where units are known.

    Raises
    ------
    DataError
        If a named column is not there, or the times are not understood.
    """
    where = shown_path(path.name)
    channels = options.declared(where)
    notes = [*raw.notes, *raw.facts.notes]
    raw = replace(raw, columns=without_bad(with_factors_beside(raw.columns), flagged(raw.columns), notes))
    headings = headings_of(raw.columns, options.units)
    named = named_roles(channels, headings, raw.aside, where)
    groups = grouped(raw.columns, headings, named)
    refuse_two_clocks(groups, raw.columns, headings, named, where)
    roles, doubts = _roles(named, groups, headings, options.roles, where)
    if not named.keys() - {"time"}:
        doubts |= nothing_below(roles, options.roles, raw.aside, where)
        doubts |= unread_position(roles, doubts, headings, where) if "position" in options.roles else {}
    said = {**options.units, **{role: channel.unit for role, channel in channels.items() if channel.unit}}
    declared = Declared(headings, roles, [group.time for group in groups if group.time is not None], where)
    columns, remarks = declared.with_units(raw.columns, said)
    notes += remarks
    scales = declared.scales(channels, columns, doubts)
    columns = declared.with_zeros(columns, channels)
    doubts |= declared.unapplied(columns, scales, said)
    timed = [_timed(raw, columns, group, options.rate, where, scales) for group in groups]
    doubts |= {} if "time" in named else _numbered(raw, columns, roles, timed[0], where)
    if all(columns[i].unit or i in scales for role, i in roles.items() if role != "time"):
        timed = [in_seconds(base) for base in timed]
    settled = frozenset((*scales, *_timed_by_user(options, roles, said)))
    ask = partial(_questions, raw, columns, roles, where)
    questions, unsure = ask(settled, timed)
    doubts |= _against_header(raw, timed, options.rate, where, lambda bases: ask(frozenset(scales), bases)[0])
    doubts, notes = questions | doubts, [*notes, *unsure]
    doubts |= _grouped(columns, roles, options, where)
    groups, bases = _merged(groups, timed)
    notes += [note for base in bases for note in base.notes]
    members = [(i, g) for g, group in enumerate(groups) for i in group.members]
    held = _held({i: columns[i] for role, i in roles.items() if role != "time"}, dict(members), notes)
    columns = [replace(one, numbers=held.get(i, one.numbers)) for i, one in enumerate(columns)]
    finished = {i: _finished(columns[i], bases[g], g, scales.get(i), notes) for i, g in members}
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


def _numbered(
    raw: Raw, columns: Sequence[RawColumn], roles: Mapping[str, int], base: TimeBase, where: str
) -> dict[str, DataError]:
    """Doubt about times that run on over several recordings, which a column numbers."""
    read = [i for role, i in roles.items() if role != "time"]
    numbering, starts = numbered_recordings(columns, read, base.time)
    if not starts or len(raw.lines) <= starts[-1]:
        return {}
    got = f'"{numbering}" counts to {len(starts)}, and where it counts on, the readings or the times leap'
    do = split_at(where, [int(raw.lines[i]) for i in starts])
    if base.header:
        do = f'If it is one recording, name the column of its times ("{base.header}") under [channels]. If not: {do}'
    return {"time": DataError(f"{where}, line {int(raw.lines[starts[1]])}", got, "one recording", do)}


def _timed(
    raw: Raw,
    columns: Sequence[RawColumn],
    group: Group,
    rate: float | None,
    where: str,
    scales: Mapping[int, Scaled],
) -> TimeBase:
    """Times of a group of columns; of their column by its scale where the user states one."""
    scale = None if group.time is None else scales.get(group.time)
    return time_base(raw, columns, group, rate, where, None if scale is None else scale[1])


def _timed_by_user(options: ReadOptions, roles: Mapping[str, int], said: Mapping[str, str]) -> list[int]:
    """Position of the times, -1 where there are none, if the user says what they are in, or the rate of the samples."""
    return [roles.get("time", -1)] if "time" in said or options.rate is not None else []


def _questions(
    raw: Raw,
    columns: Sequence[RawColumn],
    roles: Mapping[str, int],
    where: str,
    settled: frozenset[int],
    timed: Sequence[TimeBase],
) -> tuple[dict[str, DataError], list[str]]:
    """What the file says beside its numbers and is neither used, nor harmless, nor answered: by role; and the rest."""
    mark = "," if raw.layout.get("decimal") == "comma" else "."
    annotations = [*raw.annotations, *annotated_first_row(raw, timed)]
    times = {} if roles.get("time", -1) in settled else wrong_times(raw, timed, where, mark)
    setting = AsRead(mark, _rate(timed[0]), timed[0].time.size, any(THINNED.search(one.text) for one in annotations))
    found, unsure = unaccounted(annotations, columns, roles, settled, where, setting)
    found = _jumps(columns, roles, settled, where) | found
    return times | found | newest_first(raw, timed, where), not_understood([(one.place, one.text) for one in unsure])


def _jumps(
    columns: Sequence[RawColumn], roles: Mapping[str, int], settled: frozenset[int], where: str
) -> dict[str, DataError]:
    """Doubt about readings whose jumps from row to row are not those of what was measured, whatever the file says."""
    found = {}
    for role, i in roles.items():
        values = columns[i].numbers.values
        if role not in ROLES or role == "time" or columns[i].clock:
            continue
        got, do = folded(values), "Export one channel a column, and counts that run on."
        for other in columns if i not in settled and not got else ():
            if other is not columns[i] and not other.clock and switched(values, other.numbers.values):
                got = f'it jumps wherever "{other.header}" changes, by the same factor'
                do = f'Export readings of one range, or say that they are: {role} = {{ column = "..", scale = "1" }}.'
        if got:
            place = f'{where}, column "{columns[i].header}"'
            found[role] = DataError(place, got, "readings on one scale", do)
    return found


def _grouped(
    columns: Sequence[RawColumn], roles: Mapping[str, int], options: ReadOptions, where: str
) -> dict[str, DataError]:
    """Doubt about readings whose mark separates thousands as well as decimals, unless the user says which it is."""
    found = {}
    for role, i in roles.items() if options.decimal is None else ():
        if cell := grouped_digits(columns[i].numbers):
            place, mark = f'{where}, column "{columns[i].header}"', columns[i].numbers.mark
            got = f'"{cell.strip()}" beside whole numbers below 1000: "{mark}" may separate thousands or decimals'
            do = f'Export plain digits; or, if "{mark}" separates decimals, decimal = "{mark}" under [files].'
            found[role] = DataError(place, got, "one way to read a number", do)
    return found


def _against_header(
    raw: Raw,
    timed: Sequence[TimeBase],
    rate: float | None,
    where: str,
    ask: Callable[[Sequence[TimeBase]], Mapping[str, DataError]],
) -> dict[str, DataError]:
    """Doubt about a rate the user gives where the file, read without it, states another one beyond doubt."""
    stated = raw.facts.rate
    if rate is None or stated is None or timed[0].header is not None or abs(rate / stated - 1.0) <= CONTRADICTS:
        return {}
    if "time" in ask([replace(base, time=base.time * rate / stated, rate=stated) for base in timed]):
        return {}
    got = f'the rate given is {format_number(rate, 7)} Hz, and the file says "{raw.facts.quoted}"'
    return {"time": DataError(where, got, "one rate", "Leave the rate out, or correct what the file says.")}


def _rate(base: TimeBase) -> float:
    """Rate of the rows in Hz; 0 where their times tell none."""
    steps = np.diff(base.time[np.isfinite(base.time)])
    return 1.0 / float(np.median(steps)) if steps.size and np.median(steps) > 0.0 else 0.0


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


def _held(channels: Mapping[int, RawColumn], group_of: Mapping[int, int], notes: list[str]) -> dict[int, Numbers]:
    """Numbers of channels that are slower than others and written on until their next reading: the first stays."""
    found = {}
    for i, column in channels.items():
        others = [other for k, other in channels.items() if k != i and group_of.get(k) == group_of.get(i)]
        held = held_over(column.numbers.values)
        if held.any() and any(is_fresh(other.numbers.values) for other in others):
            found[i] = masked_with(column.numbers, held, "held over")
            each = round(held.size / (held.size - int(held.sum())))
            notes.append(f'Column "{column.header}" changes at every {each}th row only: the rows between are masked.')
    return found


@np.errstate(over="ignore", invalid="ignore")  # of readings near the largest number there is: they are no faults
def _finished(column: RawColumn, base: TimeBase, group: int, scale: Scaled | None, notes: list[str]) -> Column:
    """Column in SI with all that is wrong with it masked."""
    zero = column.zero
    known = None if column.unit is None else known_unit(column.name, column.unit)
    si = None if known is None else registry.si_unit(known)
    factor = 1.0 if known is None or si is None else registry.to_si(known, si)
    if scale is not None:
        _, factor, si = scale
    elif column.unit is not None and si is None:
        notes.append(f'Column "{column.header}": unit "{column.unit}" is not known; the values are as in the file.')
    numbers, outliers = _masked(column, base, si, notes)
    if si is not None:
        numbers = masked_with(numbers, np.abs(numbers.values - zero) > LARGEST_SIZE / abs(factor), "absurd")
    valid = numbers.reasons == 0
    counts = {REASONS[c]: int(n) for c, n in enumerate(np.bincount(numbers.reasons)) if c and n}
    return Column(
        header=column.header,
        name=column.name,
        unit=column.unit,
        si=si,
        values=frozen(_scaled(numbers.values - zero, factor)),
        valid=frozen(valid),
        masked=frozen_mapping(counts),
        group=group,
        outliers=tuple(map(int, outliers)),
        scale=None if scale is None else scale[0],
        zero=zero,
        number=column.number,
    )


def _scaled(values: np.ndarray, factor: float) -> np.ndarray:
    """Values times a factor; by division where that is exact, so that 12.5 mm is 0.0125 m to the last bit."""
    inverse = 1.0 / factor
    return (
        values / round(inverse)
        if 0 < factor < 1 and abs(inverse - round(inverse)) < 1e-9 * inverse
        else values * factor + 0.0  # zero has no sign
    )


def _masked(column: RawColumn, base: TimeBase, si: str | None, notes: list[str]) -> tuple[Numbers, np.ndarray]:
    """Numbers of a column with damage masked, and the rows of outliers that are only reported."""
    n = base.time.size
    whole = column.numbers
    numbers = Numbers(whole.values[:n], whole.reasons[:n], whole.shapes[:n], whole.texts[:n], whole.mark)
    numbers = masked_with(numbers, absurd(numbers.values), "absurd")
    if len(numbers.texts):
        numbers = masked_with(numbers, odd_numbers(numbers), "digit lost or doubled")
    numbers = masked_with(numbers, np.isnan(base.time), "time unusable")
    numbers = masked_with(numbers, returning(numbers.values), "out of range")
    flat = flat_stretches(numbers.values, numbers.resolution if len(numbers.texts) else column.resolution)
    numbers = masked_with(numbers, flat.saturated, "saturated")
    if si not in _SPEEDS:
        numbers = masked_with(numbers, flat.at_zero, "saturated")
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
