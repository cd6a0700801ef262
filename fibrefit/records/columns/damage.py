"""What a sensor does to a record: absurd values, a full scale that was reached, a reading that froze.

A held weight, a slack fibre and a drive at rest are flat too, and rightly so. A reading counts as frozen or full only
if it is exactly the same for longer than the noise around it allows; without noise, only if it stops dead at its
extreme while it was running on.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from fibrefit.records.grammar.neighbours import neighbourhood, smallest_step, typical
from fibrefit.records.thresholds import (
    ABSURD,
    ABSURD_RATIO,
    ALWAYS,
    AROUND,
    AT_ZERO,
    BEYOND_ROUNDING,
    CALM,
    LEFT_OVER,
    LONE,
    NINES_RATIO,
    NOISY_TURNS,
    ON_PHASE,
    OVERSHOOT,
    PIECE,
    PIECES,
    REPEATED,
    RETURNS,
    RUN_BY_CHANCE,
    RUNS_OVER,
    SHORT_STOP,
    SHORTEST_RUN,
    STEPS_OF_NEWS,
    TAKES_TURNS,
    TWO_VALUED,
)


@dataclass(frozen=True, slots=True)
class Flat:
    """Stretches in which a reading does not move although it should.

    Parameters
    ----------
    saturated : (n,) bool array
        At the extreme of the column.
    at_zero : (n,) bool array
        The same where that extreme is exactly zero: so it is for an input that takes one sign, and for the speed of a
        machine that stands.
    stuck : (n,) bool array
        Elsewhere.
    clipped : (n,) bool array
        Without any noise in the column: several short stops at one and the same extreme.
    stops_dead : (n,) bool array
        The other stops without noise: a full sensor, an end stop, or a drive that holds.
    """

    saturated: np.ndarray
    at_zero: np.ndarray
    stuck: np.ndarray
    clipped: np.ndarray
    stops_dead: np.ndarray


def absurd(values: np.ndarray) -> np.ndarray:
    """Samples that are no measured value: 1E+10 among tens, or -9999 among ones.

    Parameters
    ----------
    values : (n,) float array
        NaN where there is none.

    Returns
    -------
    (n,) bool array
        True for absurd ones.
    """
    size = np.abs(values)
    present = size[np.isfinite(size)]
    if present.size < 3:
        return np.zeros(values.size, bool)
    usual = typical(present)
    huge = (size >= ABSURD) & (size > ABSURD_RATIO * max(usual, 1e-300))
    nines = np.isin(size, _nines(float(present.max())))
    rest = size[~huge & ~nines & np.isfinite(size)]
    far = size > NINES_RATIO * float(rest.max()) if rest.size else np.zeros(values.size, bool)
    return huge | (nines & far)


def _nines(largest: float) -> np.ndarray:
    """999, 999.9, 9999, ... up to the largest value; and 999.25, which one family of loggers writes."""
    digits = range(3, int(math.log10(max(largest, 10.0))) + 2)
    return np.array([999.25] + [float("9" * n) + tail for n in digits for tail in (0.0, 0.9, 0.99)])


def flat_stretches(values: np.ndarray, resolution: float) -> Flat:
    """Find where a reading is frozen or cut off at full scale.

    Parameters
    ----------
    values : (n,) float array
        Readings; NaN where there is none.
    resolution : float
        Step of the last printed digit, in the unit of `values`; 0 where it is not known.

    Returns
    -------
    Flat
        Masks.
    """
    masks = Flat(*(np.zeros(values.size, bool) for _ in range(5)))
    rows = np.flatnonzero(np.isfinite(values))
    run = values[rows]
    if run.size < 20 or np.ptp(run) == 0:
        return masks
    ends = float(run.min()), float(run.max())
    starts, lengths = _runs_of_equals(run)
    noisy = _is_noisy(run, lengths)
    kept = _kept_in_a_step(_parts(run)) if noisy else 0.0
    dead: dict[float, list[tuple[int, int]]] = {}
    for which in np.flatnonzero(lengths >= SHORTEST_RUN).tolist():
        start, length = int(starts[which]), int(lengths[which])
        level = float(run[start])
        extreme = level in ends
        if noisy:
            if length <= _longest_by_chance(lengths, which, kept):
                continue
            if extreme:
                # Noise lets short runs reach full scale too.
                (masks.saturated if level else masks.at_zero)[rows[run == level]] = True
            else:
                masks.stuck[rows[start : start + length]] = True
        elif extreme and abs(level) > AT_ZERO * (ends[1] - ends[0]) and _stops_dead(run, start, length, resolution):
            dead.setdefault(level, []).append((start, length))
    for stops in dead.values():
        short = [stop for stop in stops if _is_short(stop, run.size)]
        for start, length in stops:
            clipped = len(short) > 1 and (start, length) in short
            (masks.clipped if clipped else masks.stops_dead)[rows[start : start + length]] = True
    return masks


def _is_short(stop: tuple[int, int], n: int) -> bool:
    """Whether a stop lies inside the record and is over soon."""
    start, length = stop
    return start > 0 and start + length < n and length <= max(10, SHORT_STOP * n)


def _runs_of_equals(run: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    starts = np.concatenate([[0], np.flatnonzero(np.diff(run) != 0) + 1])
    return starts, np.diff(np.append(starts, run.size))


def _is_noisy(run: np.ndarray, lengths: np.ndarray) -> bool:
    """Whether readings scatter from sample to sample."""
    run = _parts(run)
    second = np.diff(run, 2)
    second = second[second != 0]
    if second.size < 10:
        return False
    # Noise that does not reach across a step leaves equal readings for as long as a signal stays in the middle of one.
    if _noise(run) < BEYOND_ROUNDING * smallest_step(run):
        return False
    # White noise turns its curvature round at nearly three samples in four, a smooth motion hardly ever.
    turns = np.mean(np.sign(second[1:]) != np.sign(second[:-1]))
    return bool(turns >= NOISY_TURNS and _share_of_equals(np.sort(lengths)[: max(1, lengths.size - 5)]) <= REPEATED)


def _noise(run: np.ndarray) -> float:
    """Standard deviation of what scatters from sample to sample, from third differences."""
    third = np.sort(np.diff(run, 3) ** 2)
    return math.sqrt(float(np.mean(third[: max(int(CALM * third.size), 1)])) / 20.0)


def _parts(run: np.ndarray) -> np.ndarray:
    """Stretches from all over a long record, which tell whether it is noisy as well as the whole."""
    if run.size <= PIECES * PIECE:
        return run
    starts = np.linspace(0, run.size - PIECE, PIECES).astype(int)
    return np.concatenate([run[start : start + PIECE] for start in starts.tolist()])


def _share_of_equals(lengths: np.ndarray) -> float:
    """Readings that equal the one before, as a share of all."""
    return 1.0 - lengths.size / float(lengths.sum()) if lengths.size else 0.0


def _kept_in_a_step(run: np.ndarray) -> float:
    """Chance that noise leaves a reading in its step while what is slow stays in the middle of that."""
    noise = _noise(run)
    return math.erf(0.5 * smallest_step(run) / (math.sqrt(2.0) * noise)) if noise > 0.0 else 1.0


def _longest_by_chance(lengths: np.ndarray, which: int, kept: float) -> float:
    """Longest run of equal readings that noise leaves where one of the runs is, as far as the runs around tell.

    They do not where noise is slow, too: it wanders from edges of steps, which end a run, to the middle of one.
    """
    samples = int(lengths.sum())
    sides = np.sort(lengths)[: max(1, lengths.size - 5)], lengths[:which][-AROUND:], lengths[which + 1 :][:AROUND]
    # Others as long as the one in question may be frozen too.
    usual = [side[side < max(lengths[which] / 2, SHORTEST_RUN)] for side in sides]
    equal = min(max(*map(_share_of_equals, usual), kept, 1.0 / samples), ALWAYS)
    return max(SHORTEST_RUN, 1 + math.log(RUN_BY_CHANCE / samples) / math.log(equal))


def _stops_dead(run: np.ndarray, start: int, length: int, resolution: float) -> bool:
    """Whether a smooth reading was on its way past the flat level when it stopped, or came from beyond it."""
    level, stop = run[start], start + length
    outward = 1.0 if level == run.max() else -1.0
    overshoots = []
    for before in (
        run[start - 3 : start] if start >= 3 else None,
        run[stop : stop + 3][::-1] if stop + 3 <= run.size else None,
    ):
        if before is not None:
            slope, curvature = before[2] - before[1], before[2] - 2 * before[1] + before[0]
            beyond = outward * (before[2] + 2 * slope + 3 * curvature - level)
            overshoots.append(beyond > OVERSHOOT * max(abs(curvature), resolution))
    return bool(overshoots) and all(overshoots)


def held_over(values: np.ndarray) -> np.ndarray:
    """Samples that repeat the one before because a slower channel is written until its next reading comes.

    Its readings change at every so many-th row and hardly ever in between, by more than one step of their digits: a
    coarse reading in even motion changes so, too, by one step.

    Parameters
    ----------
    values : (n,) float array
        Readings; NaN where there is none.

    Returns
    -------
    (n,) bool array
        None of them true where readings are not held.
    """
    none = np.zeros(values.size, bool)
    present = np.isfinite(values)
    if present.mean() < ON_PHASE or ON_PHASE * np.count_nonzero(np.diff(values)) > 0.5 * values.size:
        return none
    values = values[np.maximum.accumulate(np.where(present, np.arange(values.size), int(present.argmax())))]
    starts, lengths = _runs_of_equals(values)
    if starts.size < TWO_VALUED:
        return none
    period = int(np.bincount(lengths).argmax())
    phase = int(np.bincount(starts[1:] % period).argmax())
    even = typical(np.abs(np.diff(values[starts]))) < STEPS_OF_NEWS * smallest_step(values[starts])
    if even or period < 2 or np.mean(starts[1:] % period == phase) < ON_PHASE:
        return none
    held = np.ones(values.size, bool)
    held[starts[present[np.maximum(starts - 1, 0)]]] = held[phase::period] = False  # news behind a gap may be old
    return held


def is_fresh(values: np.ndarray) -> bool:
    """Whether readings change from sample to sample as a rule."""
    run = values[np.isfinite(values)]
    return run.size > 0 and _share_of_equals(_runs_of_equals(run)[1]) <= REPEATED


def returning(values: np.ndarray) -> np.ndarray:
    """Samples of a noisy reading that leave it again and again for one and the same number, as out of range.

    Noise brings no far reading back to its last digit.

    Parameters
    ----------
    values : (n,) float array
        Readings; NaN where there is none.

    Returns
    -------
    (n,) bool array
        Masks.
    """
    found = np.zeros(values.size, bool)
    rows = np.flatnonzero(np.isfinite(values))
    run = values[rows]
    starts, lengths = _far(run) if run.size >= 20 else (rows[:0], rows[:0])
    if starts.size < RETURNS or not _is_noisy(run, _runs_of_equals(run)[1]):
        return found
    levels, times = np.unique(run[starts], return_counts=True)
    again = times >= RETURNS
    if 2 * times[again].sum() > starts.size:  # most of what is far
        for which in np.flatnonzero(np.isin(run[starts], levels[again])).tolist():
            found[rows[starts[which] : starts[which] + lengths[which]]] = True
    return found


def _far(run: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Starts of runs of equals that lie far from both neighbours, and their lengths; long ones are taken apart."""
    starts, lengths = _runs_of_equals(run)
    first = np.repeat(lengths >= SHORTEST_RUN, lengths)
    first[starts] = True
    rows = np.flatnonzero(first)
    single = run[rows]
    apart = np.abs(single[1:-1] - 0.5 * (single[:-2] + single[2:]))
    scatter = 1.4826 * typical(apart) if apart.size else 0.0
    if scatter == 0.0 or apart.max() <= LONE * scatter:
        return rows[:0], rows[:0]
    _, spread = neighbourhood(single)
    far = 1 + np.flatnonzero(apart > LONE * np.maximum(scatter, spread[1:-1]))
    return rows[far], np.diff(np.append(rows, run.size))[far]


def lone_outliers(values: np.ndarray) -> np.ndarray:
    """Samples far from both neighbours, which agree among themselves. They are reported, not masked.

    Up to three that are equal count as one.

    Parameters
    ----------
    values : (n,) float array
        Readings; NaN where there is none.

    Returns
    -------
    (m,) int array
        Rows of the first of each.
    """
    rows = np.flatnonzero(np.isfinite(values))
    run = values[rows]
    if run.size < 20:
        return np.zeros(0, int)
    return rows[_far(run)[0]]


def folded(values: np.ndarray) -> str:
    """Why readings are not those of one quantity on one scale, from row to row; empty where they may be.

    Parameters
    ----------
    values : (n,) float array
        Readings; NaN where there is none.
    """
    run = values[np.isfinite(values)]
    if run.size < TWO_VALUED:
        return ""
    bent = np.diff(run, 2)
    bent[::2] *= -1.0
    if max(np.mean(bent > 0), np.mean(bent < 0)) >= TAKES_TURNS:
        return "every second reading lies on one side of those around it, as where two channels take turns"
    turn = 2.0 ** math.ceil(math.log2(np.ptp(run) + 1.0))
    steps = np.diff(run)
    over = np.flatnonzero(np.abs(steps) > (1.0 - RUNS_OVER) * turn)
    if not over.size or turn < 256 or not (run == np.rint(run)).all():
        return ""
    steps = np.abs(steps - turn * np.rint(steps / turn))
    around = np.maximum(steps[np.maximum(over - 1, 0)], steps[np.minimum(over + 1, steps.size - 1)])
    if steps.max() > RUNS_OVER * turn or (steps[over] > OVERSHOOT * around + 1.0).any():
        return ""
    return f"it jumps by nearly {turn:.0f}, as a counter that runs over"


def switched(values: np.ndarray, other: np.ndarray) -> bool:
    """Whether readings jump wherever another column changes, by the factor by which that changes.

    Parameters
    ----------
    values, other : (n,) float array
        Readings, and what may be the range or the gain of their amplifier; NaN where there is none.
    """
    if values.size != other.size or not np.isfinite(other).all() or other.min() <= 0.0:
        return False
    at = np.flatnonzero(np.diff(other))
    if not at.size or at.size > other.size / TWO_VALUED or (np.diff(other)[at] == 1.0).all():  # 1, 2, 3 are phases
        return False
    ratio, before, after = other[at + 1] / other[at], values[at], values[at + 1]
    left = np.minimum(np.abs(after / ratio - before), np.abs(after * ratio - before))
    return bool((left < LEFT_OVER * np.abs(after - before)).all())
