"""Times printed too coarsely to tell samples apart: counted, where that leaves no room for a row more or less."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_number, format_quantity
from fibrefit.records.clock.base import (
    OFF_GRID,
    UNREADABLE,
    Readings,
    TimeBase,
    lost_rows,
    row_mask,
)
from fibrefit.records.clock.rates import round_rate
from fibrefit.records.grammar.neighbours import typical
from fibrefit.records.grammar.phrases import GIVE_RATE
from fibrefit.records.thresholds import (
    COARSELY_PRINTED,
    EVEN,
    EVEN_OF_FEW,
    MOST_OFF,
    OPEN_RATE,
    SHARED,
    SHARING,
    TIES_TURNED,
)


def shared_stamps(readings: Readings, readable: np.ndarray, times: np.ndarray) -> Readings:
    """Readings whose resolution is the step between stamps, where several samples share one, as on a bus."""
    steps = np.diff(times)
    still = np.flatnonzero(steps == 0)
    if readings.resolution == 0 or still.size < SHARED * steps.size:
        return readings
    rows = [readable[i] for i in still[:SHARING].tolist()]
    if sum(readings.rows[i] != readings.rows[i + 1] for i in rows) < 0.5 * len(rows):
        return readings  # doubled rows
    return replace(readings, resolution=max(readings.resolution, float(np.median(steps[steps > 0]))))


def too_coarse(times: np.ndarray, resolution: float, rows: Sequence[str], readable: np.ndarray) -> bool:
    """Whether the printed times leave open where single samples lie."""
    if resolution == 0:
        return False
    steps = np.round(np.diff(times) / resolution)
    if not (steps > 0).any():
        return True
    usual = typical(steps[steps > 0])
    if usual * COARSELY_PRINTED >= 1:
        return False
    if np.mean(steps == usual) < EVEN and not (times.size < 20 and np.mean(steps == usual) >= EVEN_OF_FEW):
        return True
    still = np.flatnonzero(steps == 0)
    alike = zip(readable[still].tolist(), readable[still + 1].tolist(), strict=True)
    if sum(rows[i] != rows[j] for i, j in alike) > max(3, MOST_OFF * steps.size):
        return True
    # Equal steps with another now and then: missing or doubled rows, unless they come as regularly as rounding does.
    others = (np.flatnonzero(steps > usual), still)
    return any(other.size >= 4 and int(np.ptp(np.diff(other))) <= 1 for other in others)


def counted_from_coarse(
    readings: Readings, readable: np.ndarray, header_rate: float | None, rate: float | None
) -> TimeBase:
    """Times counted at a rate that every printed time agrees with.

    Parameters
    ----------
    readings : Readings
        Times as printed.
    readable : (n,) bool array
        Which of them are numbers.
    header_rate, rate : float, optional
        Rate in Hz that the file states, and that the user gives, which comes first.

    Raises
    ------
    DataError
        If times do not increase, leave the rate open, or show that rows are missing or doubled.
    """
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
    if known is None and res / span > OPEN_RATE * step:
        found = None
    if found is None:
        got = f"{printed}, which leaves the rate open (about {format_number(1 / step)} Hz)"
        raise DataError(readings.where, got, "more decimals, or a rate", GIVE_RATE)
    late = rows / found - times
    middle = float(np.median(late))
    off = np.abs(late - middle) > res
    allowed = max(1, int(MOST_OFF * rows.size))
    if off.sum() > allowed or not readings.placed or not _counts_on(rows[~off], late[~off] / res, res * found):
        at = int(readings.lines[rows[int(np.argmax(np.abs(late - middle)))]])
        got = f"{printed} and does not count on evenly at {format_number(found, 6)} Hz: rows are missing or doubled"
        raise DataError(f"{readings.where}, near line {at}", got, "", "Export the times with more decimals.")
    time = np.full(readings.times.size, np.nan)
    good = rows[~off]
    # Counted from a row of the first one's phase: others may share a printed time with an earlier sample.
    first = int(np.argmax(good % max(1, round(res * found)) == 0))
    time[good] = times[~off][first] + (good - good[first]) / found
    lost = lost_rows({UNREADABLE: np.isnan(readings.times), OFF_GRID: row_mask(rows[off], time.size)})
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
    return len(wide) == 1 and turns >= max(3, TIES_TURNED * wide[0].size)
