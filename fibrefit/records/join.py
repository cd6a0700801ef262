"""One record from several files: cut into parts that follow on one another, or written by two loggers side by side."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number, format_quantity
from fibrefit.records.clock.base import TimeGap
from fibrefit.records.clock.repeats import repeated_rows
from fibrefit.records.record import Record
from fibrefit.records.thresholds import IN_COMMON, ON_GRID, ON_TIME, SAME_RATE


def joined(parts: Sequence[Record]) -> Record:
    """Record that was cut into several files.

    Parts whose clocks run on are put together as their times say. Parts that each begin anew follow on one another
    without a gap: that is what a file that is cut means, and the history says so.

    Parameters
    ----------
    parts : sequence of Record
        In the order in which they were measured.

    Returns
    -------
    Record
        With the name of the first.

    Raises
    ------
    DataError
        If the parts hold different channels, rates, or overlap in time.
    """
    whole = parts[0]
    for part in parts[1:]:
        whole = _followed_by(whole, part)
    return whole


def _followed_by(record: Record, part: Record) -> Record:
    where = part.path.name
    if set(part.channels) != set(record.channels):
        got = f"the channels {', '.join(part.channels)} in a part of a record of {', '.join(record.channels)}"
        raise DataError(where, got, "the same channels in all parts", "Name the channels, or take the part out.")
    if abs(part.rate / record.rate - 1) > SAME_RATE:
        got = f"{format_number(part.rate, 6)} Hz in a part of a record of {format_number(record.rate, 6)} Hz"
        raise DataError(where, got, "one rate", "Give the sampling rate, or take the part out.")
    step, end = 1.0 / record.rate, float(record.time[-1])
    begin, said = _begin(record, part)
    if said.endswith("anew"):
        _refuse_repeated(record, part)
    if begin <= end:
        got = f"it begins at {format_quantity(begin, 's', 6)}, and the part before it ends at "
        got += format_quantity(end, "s", 6)
        raise DataError(where, got, "parts that follow on one another", "Name the parts in their order.")
    missing = round((begin - end) / step) - 1
    gap = (TimeGap(end, missing),) if missing > 0 else ()
    lost = f"{missing} samples are missing between" if missing > 0 else "no sample is missing between"
    shift, told = begin - float(part.time[0]), f"{where} follows{said}; {lost}."
    return replace(
        record,
        time=np.concatenate([record.time, part.time + shift]),
        channels={role: np.concatenate([values, part.channels[role]]) for role, values in record.channels.items()},
        valid={role: np.concatenate([mask, part.valid[role]]) for role, mask in record.valid.items()},
        uniform=record.uniform and part.uniform and _on_grid(begin - end, step),
        gaps=(*record.gaps, *gap, *(TimeGap(g.after + shift, g.missing) for g in part.gaps)),
        history=(*_both(record.history, part.history), told),
        notes=(*_both(record.notes, part.notes), *([told] if missing > 0 else [])),
    )


def _both(first: tuple[str, ...], then: tuple[str, ...]) -> tuple[str, ...]:
    """Sentences on two files, those that are the same of both once."""
    return (*first, *(line for line in then if line not in first))


def _refuse_repeated(record: Record, part: Record) -> None:
    """Refuse a part that begins with what the part before it ends with: no time tells where it belongs."""
    columns = [np.append(record.channels[role], part.channels[role]) for role in sorted(record.channels)]
    for first, twice in repeated_rows(columns):
        if first == len(record):
            do = "Take out what is repeated, or export the times too."
            raise DataError(part.path.name, f"where it begins {twice}", "each sample once", do)


def _begin(record: Record, part: Record) -> tuple[float, str]:
    """Instant on the record's clock at which a part begins, and how it is known."""
    end = float(record.time[-1])
    if record.origin is not None and part.origin is not None:
        return part.origin - record.origin + float(part.time[0]), " by its clock"
    if float(part.time[0]) > end:
        return float(part.time[0]), " by its times"
    if float(part.time[0]) <= float(record.time[0]) + 1.0 / record.rate:
        return end + 1.0 / record.rate, " without a gap, as its times begin anew"
    return float(part.time[0]), ""


def _on_grid(span: float, step: float) -> bool:
    return abs(span / step - round(span / step)) < ON_GRID


def side_by_side(record: Record, other: Record, offset: float | None = None) -> Record:
    """Record with the channels of another file that was written at the same time, by a clock of its own.

    Parameters
    ----------
    record : Record
        Its times are kept.
    other : Record
        Brings the channels that `record` lacks.
    offset : float or None
        Time of `record` at which the clock of `other` read zero, in s; None takes it from both files' time of day, and
        zero where they have none.

    Returns
    -------
    Record
        Samples of `other` on the instants of `record`; interpolated linearly where they fall between, not valid where
        there are none, as in a gap of `other`.

    Raises
    ------
    DataError
        If the files hold the same channels, or have no time in common.
    """
    twice = sorted(set(record.channels) & set(other.channels))
    if twice:
        do = "Name the channels that each file is to give."
        raise DataError(other.path.name, f"the {twice[0]}, which {record.path.name} holds too", "other channels", do)
    origins = (record.origin, other.origin)
    if offset is None:
        known = origins[0] is not None and origins[1] is not None
        offset = float(origins[1] - origins[0]) if known else 0.0  # type: ignore[operator]
    times = other.time + offset
    inside = _in_common(record, other, times)
    after = np.clip(np.searchsorted(times, record.time), 1, times.size - 1)
    before = after - 1
    share = np.clip((record.time - times[before]) / (times[after] - times[before]), 0.0, 1.0)
    share = np.where(share < ON_TIME, 0.0, np.where(share > 1 - ON_TIME, 1.0, share))
    between = (share > 0.0) & (share < 1.0)
    bridged = between & np.isin(before, [int(np.argmin(np.abs(other.time - gap.after))) for gap in other.gaps])
    channels, valid = dict(record.channels), dict(record.valid)
    for role, values in other.channels.items():
        mask = other.valid[role]
        good = inside & ~bridged & (mask[before] | (share == 1.0)) & (mask[after] | (share == 0.0))
        mixed = np.where(share == 0.0, values[before], np.where(share == 1.0, values[after], 0.0))
        mixed = np.where(between, (1 - share) * values[before] + share * values[after], mixed)
        channels[role], valid[role] = np.where(good, mixed, np.nan), good
    moved = int((between & inside & ~bridged).sum())
    how = f"interpolated linearly at {moved} instants" if moved else "sample by sample"
    late = format_quantity(offset, "s", 6)
    said = f"{', '.join(other.channels)} from {other.path.name}, whose clock read zero at {late}; {how}."
    return replace(
        record,
        channels=channels,
        valid=valid,
        headers={**(record.headers or {}), **{r: h for r, h in (other.headers or {}).items() if r in other.channels}},
        scales={**(record.scales or {}), **(other.scales or {})},
        history=(*record.history, *other.history, said[0].upper() + said[1:]),
        notes=_both(record.notes, other.notes),
    )


def _in_common(record: Record, other: Record, times: np.ndarray) -> np.ndarray:
    """Samples of a record at which another has some, ``(n,)``; refused where these are too few."""
    slack = ON_TIME / other.rate
    inside = (record.time >= times[0] - slack) & (record.time <= times[-1] + slack)
    if inside.sum() >= IN_COMMON:
        return inside
    ends = [[format_quantity(float(t[k]), "s", 6) for k in (0, -1)] for t in (times, record.time)]
    spans = [" to ".join(pair) for pair in ends]
    got = f"times from {spans[0]}, where {record.path.name} runs from {spans[1]}"
    do = 'State the offset of its clock: beside = { file = "...", clock_offset = "12.5 ms" }.'
    raise DataError(other.path.name, got, "times in common", do)
