"""When each sample was taken: from a column of times, or counted at a known rate.

Rows whose time stands still, runs backward or falls off the grid are left without a time; nothing is moved but times of
a counter that runs over.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number, format_quantity
from fibrefit.records.clock.base import (
    ALONE,
    BACKWARD,
    OFF_GRID,
    UNREADABLE,
    Readings,
    TimeBase,
    TimeGap,
    lost_rows,
    row_mask,
)
from fibrefit.records.clock.coarse import counted_from_coarse, shared_stamps, too_coarse
from fibrefit.records.clock.rates import longest_forward, robust_step, round_rate
from fibrefit.records.grammar.neighbours import typical
from fibrefit.records.grammar.phrases import GIVE_RATE, split_at
from fibrefit.records.thresholds import (
    ALONE_BY,
    CONTRADICTS,
    FEWEST_ROWS,
    JITTER,
    MOST_LOST,
    MOST_OFF,
    NO_STEP,
    RUNS_ON,
)


def counted_times(n: int, rate: float, source: str) -> TimeBase:
    """Times counted from zero at a known rate.

    Parameters
    ----------
    n : int
        Number of samples.
    rate : float
        In Hz.
    source : str
        Where the rate comes from.

    Returns
    -------
    TimeBase
        Uniform, without gaps: a missing row cannot be seen.
    """
    return TimeBase(np.arange(n) / rate, rate, source)


def tells_times(values: np.ndarray) -> bool:
    """Whether a column of times tells when rows were sampled: a clock without fractions may be the same in all of them.

    Parameters
    ----------
    values : (n,) float array
        NaN where a cell is not readable.
    """
    present = values[np.isfinite(values)]
    return present.size >= FEWEST_ROWS and bool((present != present[0]).any())


def from_readings(readings: Readings, *, header_rate: float | None = None, rate: float | None = None) -> TimeBase:
    """Time base from a column of times.

    Parameters
    ----------
    readings : Readings
        The column.
    header_rate : float or None
        Rate the header names, in Hz.
    rate : float or None
        Rate the user gave, in Hz; it settles a contradiction between header and column.

    Returns
    -------
    TimeBase
        Times as printed, or counted where they are printed too coarsely to tell samples apart.

    Raises
    ------
    DataError
        If the times start again, mostly run backward, contradict a rate, or are too coarse to tell the rate.
    """
    readable = np.flatnonzero(np.isfinite(readings.times))
    if readable.size == readings.times.size == 2 and readings.times[1] > readings.times[0]:
        return TimeBase(readings.times, 1 / float(np.diff(readings.times)[0]), readings.source)
    if readable.size < FEWEST_ROWS:
        raise DataError(readings.where, "fewer than 3 readable times", "a time for each sample, or a rate", GIVE_RATE)
    readings, ran_over = _counted_on(readings, readable)
    times = readings.times[readable]
    forward = np.diff(times)
    if (forward < 0).all():
        got = "the time runs backward from the first row to the last: the newest first, or the time that is left"
        raise DataError(readings.where, got, "times that increase", "Sort the rows by their time.")
    if np.count_nonzero(forward <= 0) == forward.size:
        raise DataError(readings.where, "the time never increases", "a time for each sample, or a rate", GIVE_RATE)
    _refuse_restart(readings, readable, times)
    readings = shared_stamps(readings, readable, times)
    if too_coarse(times, readings.resolution, readings.rows, readable):
        coarse = counted_from_coarse(readings, readable, header_rate, rate)
        return replace(coarse, notes=(*coarse.notes, *ran_over))
    base = _from_fine(readings, readable, header_rate if rate is None else rate)
    base = replace(base, notes=(*base.notes, *ran_over))
    return _checked_against(base, readings, header_rate, rate)


def _counted_on(readings: Readings, readable: np.ndarray) -> tuple[Readings, tuple[str, ...]]:
    """Times of a counter of 16 or 32 bits that ran over, counted on; and what is said of that."""
    steps = np.diff(readings.times[readable])
    back = np.flatnonzero(steps < 0.0)
    if not back.size or not (steps > 0.0).any() or not readings.resolution:
        return readings, ()
    usual, times = typical(steps[steps > 0.0]), readings.times[readable]
    for bits in (16, 32):
        full = 2.0**bits * readings.resolution
        # It ends at its last number and begins again at nil; a second recording begins where the first one did.
        ends, begins = full - times[back], times[back + 1]
        again = np.isclose(begins, times[0], rtol=0.0, atol=usual).any()
        if not again and ((ends > 0.0) & (begins >= 0.0) & (ends + begins < RUNS_ON * usual)).all():
            turns = np.zeros(readings.times.size)
            turns[readable[back + 1]] = full
            often = f"{back.size} times" if back.size > 1 else "once"
            note = f"The {bits}-bit counter of the times overflowed {often}; the times are continued."
            return replace(readings, times=readings.times + np.cumsum(turns)), (note,)
    return readings, ()


def _refuse_restart(readings: Readings, readable: np.ndarray, times: np.ndarray) -> None:
    """Refuse times that go back and run on from there, unless most rows are the same again."""
    steps = np.diff(times)
    if steps.min() >= 0:
        return
    usual = typical(steps[steps > 0])
    for j in np.flatnonzero(steps < 0)[:100]:
        start = int(j) + 1
        overlap = int(np.count_nonzero(times[:start] >= times[start]))
        runs_on = steps[start : start + 2]
        if overlap < 2 or runs_on.size < 2 or not ((runs_on > 0) & (runs_on < RUNS_ON * usual)).all():
            continue
        stop = start + int(np.argmax(np.append(times[start:] > times[:start].max(), True)))
        earlier = {readings.rows[i] for i in readable[:start]}
        known = sum(readings.rows[i] in earlier for i in readable[start:stop])
        if 2 * known < stop - start:
            line = int(readings.lines[readable[start]])
            got = f"the time starts again at {format_number(float(times[start]), 6)} s"
            again = np.flatnonzero((steps < 0) & (times[1:] < times[start] + RUNS_ON * usual)) + 1
            starts = [int(readings.lines[readable[i]]) for i in (0, *again)]
            do = split_at(readings.where, starts)
            raise DataError(f"{readings.where}, line {line}", got, "one recording", do)


def _from_fine(readings: Readings, readable: np.ndarray, hint: float | None) -> TimeBase:
    """Times as printed, with the rows taken out that do not fit into them."""
    times, res, n = readings.times, readings.resolution, readings.times.size
    kept, conflicting = _forward_rows(readings, readable)
    steps = np.diff(times[kept])
    usual = typical(steps)
    near = steps[np.abs(steps - usual) <= max(2 * res, 0.05 * usual)]
    usual_step = float(near.mean()) if near.size else usual
    counts = np.concatenate([[0], np.cumsum(np.round(steps / usual_step))]).astype(int)
    step, span = robust_step(times[kept], counts)
    rounding = 8 * np.finfo(float).eps * float(np.abs(times[kept]).max())
    error = 2 * max(res, rounding) / span
    agrees = hint is not None and abs(1 / hint - step) <= error
    rate = hint if agrees and hint is not None else round_rate(step, error) or 1 / step
    late = times[kept] - counts / rate
    tolerance = max(1.01 * res, 1e-6 / rate, rounding)
    off = np.abs(late - typical(late)) > tolerance
    uniform = bool(off.sum() <= max(1, MOST_OFF * kept.size))
    notes: tuple[str, ...] = ()
    stamps = times
    if not uniform and (np.diff(counts) > 0).mean() > 1 - MOST_OFF and np.ptp(late) < 2 * JITTER / rate:
        # Even samples with late stamps: a derivative of these would hold the lateness and not the motion.
        spread = float(np.std(late))
        rate = round_rate(step, 4 * spread / span) or rate
        late = times[kept] - counts / rate
        off, uniform = np.append(False, np.diff(counts) < 1), True
        stamps = times.copy()
        stamps[kept] = np.median(late) + counts / rate
        notes = (_jitter(spread, rate),)
    elif not uniform:
        off, rate = np.append(False, steps < NO_STEP * usual), 1 / usual
        notes = (_uneven(steps),)
    alone = _alone(counts, off)
    good = ~off & ~alone
    time = np.full(n, np.nan)
    time[kept[good]] = stamps[kept[good]]
    backward = _others(readable, kept)
    lost = {
        UNREADABLE: np.isnan(times),
        BACKWARD: row_mask(backward, n) | conflicting,
        OFF_GRID: row_mask(kept[off], n),
        ALONE: row_mask(kept[alone & ~off], n),
    }
    time[conflicting] = np.nan
    left = int(np.isfinite(time).sum())
    if left < (1 - MOST_LOST) * readable.size:
        got = f"{readable.size - left} of {readable.size} stamps do not fit into the steps of the others"
        raise DataError(readings.where, got, "stamps in one unit", "Export them in one unit, or name another column.")
    gaps = _gaps(times[kept[good]], counts[good], uniform=uniform)
    return TimeBase(time, rate, readings.source, uniform, gaps, lost_rows(lost), notes)


def _forward_rows(readings: Readings, readable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows that run forward; and those of one time but different values, of which none can be relied on."""
    times = readings.times[readable]
    conflicting = np.zeros(readings.times.size, bool)
    if (np.diff(times) > 0).all():
        return readable, conflicting
    chosen = longest_forward(times)
    if chosen.size < (1 - MOST_LOST) * readable.size:
        got = f"the time runs backward or stands still in {readable.size - chosen.size} of {readable.size} rows"
        raise DataError(readings.where, got, "times that increase", "Name the column that holds the time.")
    kept = readable[chosen]
    row_at = dict(zip(readings.times[kept].tolist(), kept.tolist(), strict=True))
    for row in _others(readable, kept).tolist():
        twin = row_at.get(float(readings.times[row]))
        if twin is not None and readings.rows[twin] != readings.rows[row]:
            conflicting[twin] = True
    return kept[~conflicting[kept]], conflicting


def _others(rows: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Rows that are not among those kept."""
    if rows.size == kept.size:
        return rows[:0]
    left = np.zeros(int(rows[-1]) + 1, bool)
    left[rows], left[kept] = True, False
    return np.flatnonzero(left)


def _alone(counts: np.ndarray, off: np.ndarray) -> np.ndarray:
    """A first or last row far from all others: its time is more likely wrong than right."""
    alone = np.zeros(counts.size, bool)
    far = max(10, ALONE_BY * counts.size)
    present = np.flatnonzero(~off)
    if present.size > 3:
        alone[present[0]] = counts[present[1]] - counts[present[0]] > far
        alone[present[-1]] = counts[present[-1]] - counts[present[-2]] > far
    return alone


def _gaps(times: np.ndarray, counts: np.ndarray, *, uniform: bool) -> tuple[TimeGap, ...]:
    missing = np.diff(counts) - 1
    longer = np.flatnonzero(missing > (0 if uniform else 2))
    return tuple(TimeGap(float(times[i]), int(missing[i])) for i in longer)


def _uneven(steps: np.ndarray) -> str:
    low, high = (format_quantity(float(np.percentile(steps, q)), "s", 3) for q in (1, 99))
    return f"The sampling is uneven: steps between {low} and {high}."


def _jitter(spread: float, rate: float) -> str:
    around = f"an even grid of {format_number(rate, 7)} Hz"
    return f"The stamps scatter by {format_quantity(spread, 's', 2)} (rms) about {around}: the samples are put on it."


def _checked_against(base: TimeBase, readings: Readings, header_rate: float | None, rate: float | None) -> TimeBase:
    """Compare the column's rate with what header and user say."""
    for said, who in ((rate, "the rate given"), (header_rate if rate is None else None, "the header")):
        if said is None or abs(said / base.rate - 1) <= CONTRADICTS:
            continue
        got = f"the column runs at {format_number(base.rate, 6)} Hz, {who} says {format_number(said, 6)} Hz"
        ratio = max(said / base.rate, base.rate / said)
        units_mixed_up = any(abs(ratio / wrong - 1) < CONTRADICTS for wrong in (1e3, 1e6, 60.0))
        if rate is not None or units_mixed_up:
            raise DataError(readings.where, got, "one rate", "Check the unit of the time, or leave the rate out.")
        note = f"{got[0].upper()}{got[1:]}: the column is used."
        return replace(base, notes=(*base.notes, note))
    return base
