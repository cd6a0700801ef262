"""Measurements that are listed twice: two measurements differ by their noise, copies of one do not."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterator, Sequence
from itertools import combinations
from typing import NamedTuple

import numpy as np

from fibrefit.records.record import Record
from fibrefit.records.thresholds import COPIED, SAME_SAMPLES

PLACES, LENGTH = 64, 8
"""Stretches of a record by whose means it is known again, and their samples."""


class Fingerprint(NamedTuple):
    """What of a record tells it from all others, in few numbers: to be kept beside its result.

    Parameters
    ----------
    samples : int
    means : dict of str to list of float
        By role, of stretches of it; None where a sample is missing.
    reach : dict of str to float
        By role, how far those of a copy may be.
    """

    samples: int
    means: dict[str, list[float | None]]
    reach: dict[str, float]


def fingerprint_of(record: Record) -> Fingerprint:
    """What of a record tells it from all others."""
    number = len(record.time)
    first = np.unique(np.linspace(0, max(number - LENGTH, 0), PLACES).astype(int))
    at = np.minimum(first[:, None] + np.arange(LENGTH), number - 1)
    means, reach = dict[str, list[float | None]](), dict[str, float]()
    for role, signal in sorted(record.channels.items()):
        found = np.asarray(signal)[at].mean(axis=1)
        means[role] = [float(value) if np.isfinite(value) else None for value in found]
        reach[role] = _reach(np.asarray(signal))
    return Fingerprint(number, means, reach)


def copies_by_fingerprint(looks: Sequence[Fingerprint]) -> dict[int, int]:
    """Numbers of records that are copies, and of the first one that each is a copy of.

    Two that are not share all of some hundred means by chance only if nothing in them is noise.
    """
    groups: dict[tuple[object, ...], list[int]] = defaultdict(list)
    for number, one in enumerate(looks):
        groups[(one.samples, *one.means)].append(number)
    found: dict[int, int] = {}
    for members in groups.values():
        if len(members) < 2:
            continue
        width = len(next(iter(looks[members[0]].means.values()), ()))
        means = np.array([[v for row in looks[m].means.values() for v in row] for m in members], dtype=float)
        reach = np.repeat([list(looks[m].reach.values()) for m in members], width, axis=1)
        for i, number in enumerate(members):
            if number in found or not means.shape[1]:
                continue
            near = i + 1 + np.flatnonzero(~(np.abs(means[i + 1 :, 0] - means[i, 0]) > reach[i, 0]))
            apart = np.abs(means[near] - means[i])
            shared = np.isfinite(apart).reshape(len(near), means.shape[1] // width, width).sum(axis=2).min(axis=1)
            same = ~(apart > reach[i]).any(axis=1) & (shared >= SAME_SAMPLES)
            found |= {members[j]: number for j in near[same] if members[j] not in found}
    return found


def first_copy(records: Sequence[Record]) -> tuple[Record, Record] | None:
    """The first two records that hold the same data; None where there are none.

    The same is what differs by less than `COPIED` of its steps from sample to sample, in every channel. Records are
    looked up by a few of their samples, so that a thousand take a thousand comparisons and not half a million.
    """
    groups: dict[tuple[object, ...], list[int]] = defaultdict(list)
    for number, record in enumerate(records):
        groups[(len(record.time), *sorted(record.channels))].append(number)
    found = [pair for members in groups.values() for pair in _near(records, members) if _alike(records, pair)]
    return (records[min(found)[0]], records[min(found)[1]]) if found else None


def _near(records: Sequence[Record], members: list[int]) -> Iterator[tuple[int, int]]:
    """Pairs whose few samples are alike."""
    if len(members) < 2:
        return
    from scipy.spatial import KDTree

    looks, points, reach = _looks(records, members), [], [np.zeros(len(members))]
    for role in records[members[0]].channels:
        signals = [np.asarray(records[number].channels[role]) for number in members]
        each = np.array([_reach(signal) for signal in signals])
        if (usual := float(np.median(each))) > 0.0:
            points.append(np.stack([signal[looks] for signal in signals]) / usual)
            reach.append(each / usual)
    if points and len(looks):
        where = np.concatenate(points, axis=1)
        for i, others in enumerate(KDTree(where).query_ball_point(where, np.max(reach, axis=0), p=np.inf)):
            yield from ((members[i], members[j]) for j in others if i < j)
    else:
        yield from combinations(members, 2)


def _looks(records: Sequence[Record], members: list[int]) -> np.ndarray:
    """Numbers of some samples that no record misses, `SAME_SAMPLES` of each."""
    known = np.ones(len(records[members[0]].time), dtype=bool)
    for number in members:
        for signal in records[number].channels.values():
            known &= np.isfinite(signal)
    there = np.flatnonzero(known)
    return there[np.linspace(0, len(there) - 1, min(SAME_SAMPLES, len(there))).astype(int)]


def _reach(signal: np.ndarray) -> float:
    """How far a copy may be from a signal."""
    known = signal[np.isfinite(signal)]
    return COPIED * float(np.std(np.diff(known))) if known.size > 1 else 0.0


def _alike(records: Sequence[Record], pair: tuple[int, int]) -> bool:
    one, other = (records[number].channels for number in pair)
    return bool(one) and all(_equal(np.asarray(one[role]), np.asarray(other[role])) for role in one)


def _equal(a: np.ndarray, b: np.ndarray) -> bool:
    both = np.isfinite(a) & np.isfinite(b)
    return bool(both.any()) and bool(np.max(np.abs(a[both] - b[both])) <= _reach(a))
