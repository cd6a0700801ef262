"""When each sample was taken: from a column of times, or counted at a known rate.

Rows whose time stands still, runs backward or falls off the grid are left without a time; nothing is moved.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.units import format_number, format_quantity
from fibrefit.records.clock.rates import longest_forward, robust_step, round_rate

#: Printed steps this coarse against the step itself do not tell single samples apart.
_COARSE = 0.2

#: Share of stamps that equal the one before from which on samples share stamps; how many of them are looked at.
_SHARED, _LOOKED_AT = 0.2, 1000

#: Deviation of a stamp from an even grid, as a share of the step, below which it is late and not uneven.
_JITTER = 0.25

#: A step this much shorter than the usual one is no step: two stamps of one sample, or a first one made up.
_NO_STEP = 0.05

#: Rows off the grid beyond which the sampling counts as uneven, and a record as out of order.
_MOST_OFF, _MOST_LOST = 0.05, 0.2

#: Relative uncertainty beyond which a rate is not guessed from its roundness.
_OPEN_RATE = 2e-3

#: Relative difference beyond which two statements of a rate contradict each other.
_CONTRADICTS = 0.01

#: What to do where a rate is missing.
_GIVE_RATE = 'Give the sampling rate: sampling_rate = "2 kHz" under [files], or in the record.'

BACKWARD = "time runs backward or stands still"
OFF_GRID = "time is off the grid"
UNREADABLE = "time is not readable"
ALONE = "time stands far from all others"


@dataclass(frozen=True, slots=True)
class Gap:
    """Samples that are missing.

    Parameters
    ----------
    after : float
        Time of the last sample before, in s.
    missing : int
        Number of samples missing.
    """

    after: float
    missing: int


@dataclass(frozen=True, slots=True)
class TimeBase:
    """When the samples of a group of columns were taken.

    Parameters
    ----------
    time : (n,) float array
        In s; NaN where a row has no usable time.
    rate : float
        Samples a second, in Hz; the median where the sampling is uneven.
    source : str
        Where the times come from, as part of a sentence.
    uniform : bool
        Whether all steps are equal, gaps aside.
    gaps : tuple of Gap
        Missing samples.
    lost : mapping of str to tuple of int
        Rows without a usable time, by reason.
    notes : tuple of str
        What had to be decided.
    header : str or None
        Header of the column the times come from; None where they are counted.
    unit : str or None
        Unit of that column; ``"clock"`` and ``"counted"`` stand for none. None is an unknown unit: then times and rate
        are in the unit of the file.
    """

    time: np.ndarray
    rate: float
    source: str
    uniform: bool = True
    gaps: tuple[Gap, ...] = ()
    lost: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    header: str | None = None
    unit: str | None = "counted"


@dataclass(frozen=True, slots=True)
class Readings:
    """A column of times as read.

    Parameters
    ----------
    times : (n,) float array
        In s; NaN where a cell is not readable.
    resolution : float
        Step of the last printed digit, in s; 0 for binary files.
    rows : sequence of str
        Text that tells rows apart, to know a repeated row from a repeated time.
    lines : (n,) int array
        Line of each row.
    where : str
        File and column to name in messages.
    source : str
        What to call the column in sentences.
    placed : bool
        Whether no line between the rows was unreadable.
    """

    times: np.ndarray
    resolution: float
    rows: Sequence[str]
    lines: np.ndarray
    where: str
    source: str
    placed: bool = True


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
    if readable.size < 3:
        raise DataError(readings.where, "fewer than 3 readable times", "a time for each sample")
    times = readings.times[readable]
    forward = np.diff(times)
    if np.count_nonzero(forward <= 0) == forward.size:
        raise DataError(readings.where, "the time never increases", "a time for each sample")
    _refuse_restart(readings, readable, times)
    readings = _shared_stamps(readings, readable, times)
    if _too_coarse(times, readings.resolution, [readings.rows[i] for i in readable.tolist()]):
        return _counted_from_coarse(readings, readable, header_rate, rate)
    base = _from_fine(readings, readable, header_rate if rate is None else rate)
    return _checked_against(base, readings, header_rate, rate)


def _shared_stamps(readings: Readings, readable: np.ndarray, times: np.ndarray) -> Readings:
    """Readings whose resolution is the step between stamps, where several samples share one, as on a bus."""
    steps = np.diff(times)
    still = np.flatnonzero(steps == 0)
    if readings.resolution == 0 or still.size < _SHARED * steps.size:
        return readings
    rows = [readable[i] for i in still[:_LOOKED_AT].tolist()]
    if sum(readings.rows[i] != readings.rows[i + 1] for i in rows) < 0.5 * len(rows):
        return readings  # doubled rows
    return replace(readings, resolution=max(readings.resolution, float(np.median(steps[steps > 0]))))


def _refuse_restart(readings: Readings, readable: np.ndarray, times: np.ndarray) -> None:
    """Refuse times that go back and run on from there, unless most rows are the same again."""
    steps = np.diff(times)
    usual = float(np.median(steps[steps > 0]))
    for j in np.flatnonzero(steps < 0)[:100]:
        start = int(j) + 1
        overlap = int(np.count_nonzero(times[:start] >= times[start]))
        runs_on = steps[start : start + 2]
        if overlap < 2 or runs_on.size < 2 or not ((runs_on > 0) & (runs_on < 2.5 * usual)).all():
            continue
        stop = start + int(np.argmax(np.append(times[start:] > times[:start].max(), True)))
        earlier = {readings.rows[i] for i in readable[:start]}
        known = sum(readings.rows[i] in earlier for i in readable[start:stop])
        if 2 * known < stop - start:
            line = int(readings.lines[readable[start]])
            got = f"the time starts again at {format_number(float(times[start]), 6)} s"
            raise DataError(f"{readings.where}, line {line}", got, "one recording", "Split the file there.")


def _too_coarse(times: np.ndarray, resolution: float, rows: Sequence[str]) -> bool:
    """Whether the printed times leave open where single samples lie."""
    if resolution == 0:
        return False
    steps = np.round(np.diff(times) / resolution)
    usual = float(np.median(steps[steps > 0]))
    if usual * _COARSE >= 1:
        return False
    if np.mean(steps == usual) < 0.8 and not (times.size < 20 and np.mean(steps == usual) >= 0.6):
        return True
    still = np.flatnonzero(steps == 0)
    if sum(rows[i] != rows[i + 1] for i in still.tolist()) > max(3, _MOST_OFF * steps.size):
        return True
    # Equal steps with another now and then: missing or doubled rows, unless they come as regularly as rounding does.
    others = (np.flatnonzero(steps > usual), still)
    return any(other.size >= 4 and int(np.ptp(np.diff(other))) <= 1 for other in others)


def _counted_from_coarse(
    readings: Readings, readable: np.ndarray, header_rate: float | None, rate: float | None
) -> TimeBase:
    """Times counted at a rate that every printed time agrees with."""
    res = readings.resolution
    printed = f"{readings.source} is printed to {format_quantity(res, 's')} only"
    rows = np.arange(readings.times.size)[readable]
    times = readings.times[readable]
    span = float(rows[-1] - rows[0])
    step = float(times[-1] - times[0]) / span
    if step <= 0:
        raise DataError(readings.where, "the last time is not later than the first", "times that increase")
    known = rate or header_rate
    # Half a digit more than the ends can be wrong by: with a row lost, the roundest rate must be tried, and fail.
    found = known if known is not None else round_rate(step, 1.5 * res / span)
    if known is None and res / span > _OPEN_RATE * step:
        found = None
    if found is None:
        got = f"{printed}, which leaves the rate open (about {format_number(1 / step)} Hz)"
        raise DataError(readings.where, got, "more decimals, or a rate", _GIVE_RATE)
    late = rows / found - times
    middle = float(np.median(late))
    off = np.abs(late - middle) > res
    allowed = max(1, int(_MOST_OFF * rows.size))
    if off.sum() > allowed or not readings.placed or not _counts_on(rows[~off], late[~off] / res, res * found):
        at = int(readings.lines[rows[int(np.argmax(np.abs(late - middle)))]])
        got = f"{printed} and does not count on evenly at {format_number(found, 6)} Hz: rows are missing or doubled"
        raise DataError(f"{readings.where}, near line {at}", got, "", "Export the times with more decimals.")
    time = np.full(readings.times.size, np.nan)
    good = rows[~off]
    # Counted from a row of the first one's phase: others may share a printed time with an earlier sample.
    first = int(np.argmax(good % max(1, round(res * found)) == 0))
    time[good] = times[~off][first] + (good - good[first]) / found
    lost = _lost({UNREADABLE: np.isnan(readings.times), OFF_GRID: _mask(rows[off], time.size)})
    origin = "given" if rate else "the header's" if header_rate else "from the first and last time"
    source = f"counted at {format_number(found, 7)} Hz ({origin}), because {printed}"
    return TimeBase(time, found, source, lost=lost)


def _counts_on(rows: np.ndarray, late: np.ndarray, per_digit: float) -> bool:
    """Whether coarse times leave no room for a row more or less.

    Rounded or cut off, printed times stay within one last digit of the true ones. Where whole numbers of samples fall
    on a digit, every phase among them is late by the same amount; only a tie may be rounded either way.

    Parameters
    ----------
    rows : (n,) int array
        Numbers of the samples.
    late : (n,) float array
        True minus printed time, in units of the last printed digit.
    per_digit : float
        Samples that share a printed time.
    """
    close = 1e-6
    if np.ptp(late) > 1 + close:
        return False
    phases = round(per_digit)
    if phases < 2 or abs(per_digit - phases) > close:
        return True
    by_phase = [late[rows % phases == phase] for phase in range(min(phases, rows.size))]
    wide = [values for values in by_phase if np.ptp(values) > close]
    if not wide:
        return True
    # A computer rounds a tie up or down at every turn; one that changes its mind once has lost a row.
    turns = int(np.count_nonzero(np.abs(np.diff(wide[0])) > close))
    return len(wide) == 1 and turns >= max(3, 0.05 * wide[0].size)


def _from_fine(readings: Readings, readable: np.ndarray, hint: float | None) -> TimeBase:
    """Times as printed, with the rows taken out that do not fit into them."""
    times, res, n = readings.times, readings.resolution, readings.times.size
    kept, conflicting = _forward_rows(readings, readable)
    steps = np.diff(times[kept])
    usual = float(np.median(steps))
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
    off = np.abs(late - np.median(late)) > tolerance
    uniform = bool(off.sum() <= max(1, _MOST_OFF * kept.size))
    notes: tuple[str, ...] = ()
    stamps = times
    if not uniform and (np.diff(counts) > 0).mean() > 1 - _MOST_OFF and np.ptp(late) < 2 * _JITTER / rate:
        # Even samples with late stamps: a derivative of these would hold the lateness and not the motion.
        spread = float(np.std(late))
        rate = round_rate(step, 4 * spread / span) or rate
        late = times[kept] - counts / rate
        off, uniform = np.append(False, np.diff(counts) < 1), True
        stamps = times.copy()
        stamps[kept] = np.median(late) + counts / rate
        notes = (_jitter(spread, rate),)
    elif not uniform:
        off, rate = np.append(False, steps < _NO_STEP * usual), 1 / usual
        notes = (_uneven(steps),)
    alone = _alone(counts, off)
    good = ~off & ~alone
    time = np.full(n, np.nan)
    time[kept[good]] = stamps[kept[good]]
    backward = np.setdiff1d(readable, kept)
    lost = {
        UNREADABLE: np.isnan(times),
        BACKWARD: _mask(backward, n) | conflicting,
        OFF_GRID: _mask(kept[off], n),
        ALONE: _mask(kept[alone & ~off], n),
    }
    time[conflicting] = np.nan
    gaps = _gaps(times[kept[good]], counts[good], uniform=uniform)
    return TimeBase(time, rate, readings.source, uniform, gaps, _lost(lost), notes)


def _forward_rows(readings: Readings, readable: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Rows that run forward; and those of one time but different values, of which none can be relied on."""
    times = readings.times[readable]
    conflicting = np.zeros(readings.times.size, bool)
    if (np.diff(times) > 0).all():
        return readable, conflicting
    chosen = longest_forward(times)
    if chosen.size < (1 - _MOST_LOST) * readable.size:
        got = f"the time runs backward or stands still in {readable.size - chosen.size} of {readable.size} rows"
        raise DataError(readings.where, got, "times that increase", "Name the column that holds the time.")
    kept = readable[chosen]
    if kept.size < 3:
        raise DataError(readings.where, "fewer than 3 rows whose time increases", "a time for each sample")
    row_at = dict(zip(readings.times[kept].tolist(), kept.tolist(), strict=True))
    for row in np.setdiff1d(readable, kept).tolist():
        twin = row_at.get(float(readings.times[row]))
        if twin is not None and readings.rows[twin] != readings.rows[row]:
            conflicting[twin] = True
    return kept[~conflicting[kept]], conflicting


def _alone(counts: np.ndarray, off: np.ndarray) -> np.ndarray:
    """A first or last row far from all others: its time is more likely wrong than right."""
    alone = np.zeros(counts.size, bool)
    far = max(10, 0.02 * counts.size)
    present = np.flatnonzero(~off)
    if present.size > 3:
        alone[present[0]] = counts[present[1]] - counts[present[0]] > far
        alone[present[-1]] = counts[present[-1]] - counts[present[-2]] > far
    return alone


def _gaps(times: np.ndarray, counts: np.ndarray, *, uniform: bool) -> tuple[Gap, ...]:
    missing = np.diff(counts) - 1
    longer = np.flatnonzero(missing > (0 if uniform else 2))
    return tuple(Gap(float(times[i]), int(missing[i])) for i in longer)


def _uneven(steps: np.ndarray) -> str:
    low, high = (format_quantity(float(np.percentile(steps, q)), "s", 3) for q in (1, 99))
    return f"The sampling is uneven: steps between {low} and {high}."


def _jitter(spread: float, rate: float) -> str:
    around = f"an even grid of {format_number(rate, 7)} Hz"
    return f"The stamps scatter by {format_quantity(spread, 's', 2)} (rms) about {around}: the samples are put on it."


def _mask(rows: np.ndarray, n: int) -> np.ndarray:
    mask = np.zeros(n, bool)
    mask[rows] = True
    return mask


def _lost(reasons: Mapping[str, np.ndarray]) -> dict[str, tuple[int, ...]]:
    return {reason: tuple(map(int, np.flatnonzero(mask))) for reason, mask in reasons.items() if mask.any()}


def _checked_against(base: TimeBase, readings: Readings, header_rate: float | None, rate: float | None) -> TimeBase:
    """Compare the column's rate with what header and user say."""
    for said, who in ((rate, "the rate given"), (header_rate if rate is None else None, "the header")):
        if said is None or abs(said / base.rate - 1) <= _CONTRADICTS:
            continue
        got = f"the column runs at {format_number(base.rate, 6)} Hz, {who} says {format_number(said, 6)} Hz"
        ratio = max(said / base.rate, base.rate / said)
        units_mixed_up = any(abs(ratio / wrong - 1) < _CONTRADICTS for wrong in (1e3, 1e6, 60.0))
        if rate is not None or units_mixed_up:
            raise DataError(readings.where, got, "one rate", "Check the unit of the time, or leave the rate out.")
        note = f"{got[0].upper()}{got[1:]}: the column is used."
        return replace(base, notes=(*base.notes, note))
    return base
