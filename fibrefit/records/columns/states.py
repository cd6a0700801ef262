"""Columns of states: the rows they call bad are no measured values, and those they number may be several recordings."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.core import units
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.grammar.digits import masked_with
from fibrefit.records.grammar.phrases import count
from fibrefit.records.grammar.words import score, tokens
from fibrefit.records.thresholds import LEAP, SHORTEST_RECORDING

#: Last words of the names of columns of ones and zeros: one stands for a good row, or for a bad one.
_GOOD = frozenset(("valid", "ok", "good", "gueltig", "gultig", "validity"))
_BAD = frozenset(
    ("invalid", "error", "fault", "bad", "overload", "overrange", "overflow", "saturated", "clipped", "missing")
) | frozenset(("interpolated", "dropout", "fehler", "ungueltig", "ungultig", "ovl", "ovf", "lost", "defect"))


def flagged(columns: Sequence[RawColumn]) -> list[tuple[str, np.ndarray]]:
    """Columns of ones and zeros that are called as what tells good rows from bad ones, and the rows they call bad.

    Parameters
    ----------
    columns : sequence of RawColumn
        As read.

    Returns
    -------
    list of (str, (n_rows,) bool array)
        Of those that call less than half of the rows bad.
    """
    found = []
    for column in columns:
        words, values = set(tokens(column.name)), column.numbers.values
        if column.unit is None and words & (_GOOD | _BAD) and set(np.unique(values).tolist()) == {0.0, 1.0}:
            bad = values == (0.0 if words & _GOOD and not words & _BAD else 1.0)
            found += [(column.name, bad)] if 2 * bad.sum() < bad.size else []
    return found


def without_bad(
    columns: Sequence[RawColumn], bad: Sequence[tuple[str, np.ndarray]], notes: list[str]
) -> list[RawColumn]:
    """Columns of measured values without the rows that a column of states calls bad.

    Parameters
    ----------
    columns : sequence of RawColumn
        As read.
    bad : sequence of (str, (n_rows,) bool array)
        Name of each column of words, and the rows it calls bad.
    notes : list of str
        Where it is stated.
    """
    found = list(columns)
    for name, rows in bad:
        if not rows.any():
            continue
        own = [i for i, c in enumerate(found) if tokens(c.name)[:1] == tokens(name)[:1] and c.name != name]
        for i in own or range(len(found)):
            if (
                not found[i].clock
                and units.kind_of(found[i].unit or "") != "time"
                and score(found[i].name, "time") == 0
            ):
                found[i] = replace(found[i], numbers=masked_with(found[i].numbers, rows, "unreadable"))
        notes.append(f'{count(int(rows.sum()), "row")} left out of the values: "{name}" calls them bad.')
    return found


def numbered_recordings(columns: Sequence[RawColumn], read: Sequence[int], times: np.ndarray) -> tuple[str, list[int]]:
    """Name of a column that numbers recordings in one table, and the rows at which each begins; empty where none does.

    It counts on by one after stretches of rows, and wherever it does a reading leaps as it does nowhere else, back to
    where a recording begins, or the time pauses as nowhere else. A count of cycles in one motion does neither.

    Parameters
    ----------
    columns : sequence of RawColumn
        As read.
    read : sequence of int
        Positions of those that are read as channels.
    times : (n,) float array
        Of the rows.
    """
    for i, column in enumerate(columns):
        values = column.numbers.values
        if i in read or column.unit is not None or column.clock or values.size != times.size or values.size < 2:
            continue
        steps = np.diff(values)
        starts = np.flatnonzero(steps) + 1
        lengths = np.diff([0, *starts, values.size])
        if not starts.size or not (steps[starts - 1] == 1.0).all() or lengths.min() < SHORTEST_RECORDING:
            continue
        own = [columns[j].numbers.values for j in read if columns[j].numbers.values.size == times.size]
        if any(_leaps(signal, starts) for signal in (*own, times)):
            return column.header, [0, *map(int, starts)]
    return "", []


def _leaps(signal: np.ndarray, starts: np.ndarray) -> bool:
    """Whether a signal changes at some rows far more than anywhere else."""
    steps = np.abs(np.diff(signal))
    elsewhere = np.delete(steps, starts - 1)
    elsewhere = elsewhere[np.isfinite(elsewhere)]
    return bool(elsewhere.size and (steps[starts - 1] > LEAP * elsewhere.max()).all())
