"""Rows that stand twice: without a time in each, what is repeated moves all later samples."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from fibrefit.records.thresholds import NO_ACCIDENT, SAME_ALWAYS


def repeated_rows(columns: Sequence[np.ndarray]) -> Iterator[tuple[int, str]]:
    """Rows from which on others stand again, and what is repeated there.

    A block that repeats the one before it is known by so many numbers that noise does not bring them twice, none of
    which stands a third time, as those of a signal at rest or in steady motion do.

    Parameters
    ----------
    columns : sequence of (n_rows,) float array
        What was measured.
    """
    moving = [v for v in columns if v.size and np.fmin.reduce(v) < np.fmax.reduce(v)]
    if not moving:
        return
    rows = _marks(moving)
    starts = np.flatnonzero(np.append(True, rows[1:] != rows[:-1]))
    lengths = np.diff(np.append(starts, rows.size))[1:-1]
    times = int(np.median(lengths)) if lengths.size * len(moving) >= NO_ACCIDENT else 1
    if times > 1 and np.mean(lengths == times) >= SAME_ALWAYS:
        yield int(starts[1]) + 1, f"each row stands {times} times"
    order = np.argsort(rows, kind="stable")
    again = np.flatnonzero(rows[order][1:] == rows[order][:-1])
    back, twice = np.zeros(rows.size, int), np.zeros(rows.size, bool)
    back[order[again + 1]] = order[again + 1] - order[again]
    lonely = np.diff(np.concatenate([[-2], again, [rows.size + 1]])) > 1
    twice[order[again[lonely[:-1] & lonely[1:]] + 1]] = True
    edges = np.flatnonzero(np.append(True, (back[1:] != back[:-1]) | (twice[1:] != twice[:-1])))
    lengths = np.diff(np.append(edges, rows.size))
    repeated = twice[edges] & (lengths == back[edges]) & (lengths * len(moving) >= NO_ACCIDENT)
    for first, length in zip(edges[repeated].tolist(), lengths[repeated].tolist(), strict=True):
        yield first, f"{length} rows repeat the {length} before them"


def _marks(columns: Sequence[np.ndarray]) -> np.ndarray:
    """A whole number for each row, the same for rows that are the same."""
    mark = np.zeros(columns[0].size, np.int64)
    for values in columns:
        mark = mark * np.int64(6364136223846793005) + np.ascontiguousarray(values, float).view(np.int64)
        mark ^= mark >> 29
    return mark
