"""Which records hold the same data, and that a thousand are not compared each with each."""

from __future__ import annotations

from itertools import combinations
from pathlib import Path

import numpy as np
import pytest

from fibrefit.records import Record, copies

TIMES = np.arange(600) / 2000.0


def record(name: str, **channels: np.ndarray) -> Record:
    valid = {role: np.isfinite(values) for role, values in channels.items()}
    return Record(name, Path(f"{name}.csv"), "", TIMES, channels, valid, 2000.0)


def measured(random: np.random.Generator, number: int) -> list[Record]:
    """The same motion, each with its own noise."""
    return [
        record(
            f"r{i}",
            force=30.0 * np.sin(30.0 * TIMES) + random.normal(0.0, 0.3, TIMES.size),
            position=np.round(0.01 * np.cos(30.0 * TIMES) + random.normal(0.0, 2e-5, TIMES.size), 5),
        )
        for i in range(number)
    ]


def changed(one: Record, *, force: np.ndarray | None = None, position: np.ndarray | None = None) -> Record:
    force = np.asarray(one.channels["force"]) if force is None else force
    position = np.asarray(one.channels["position"]) if position is None else position
    return record(f"copy of {one.name}", force=force, position=position)


def gappy(values: np.ndarray, gap: slice) -> np.ndarray:
    values = np.array(values)
    values[gap] = np.nan
    return values


COPIES = {
    "digits": lambda one: changed(one, force=np.round(one.channels["force"], 4)),
    "a gap": lambda one: changed(one, force=gappy(one.channels["force"], slice(100, 300))),
    "gaps": lambda one: changed(one, force=gappy(one.channels["force"], slice(0, None, 2))),
}
OTHERS = {
    "another force": lambda one: changed(one, force=one.channels["force"] + 0.01 * np.cos(np.arange(TIMES.size))),
    "nothing in common": lambda one: changed(one, force=np.full(TIMES.size, np.nan)),
    "a force only": lambda one: record("alone", force=np.asarray(one.channels["force"])),
}


@pytest.mark.parametrize("change", ["digits", "a gap"])
def test_a_copy_is_known_by_how_a_record_looks(change: str) -> None:
    """That little is what a batch keeps of each record."""
    records = measured(np.random.default_rng(1), 300)
    records.insert(11, COPIES[change](records[3]))
    assert copies.copies_by_fingerprint([copies.fingerprint_of(one) for one in records]) == {11: 3}


@pytest.mark.parametrize("change", OTHERS)
def test_what_is_no_copy_does_not_look_like_one(change: str) -> None:
    """Readings in coarse steps are alike where nothing moves; those in motion are not."""
    records = [
        changed(one, force=np.round(one.channels["force"]), position=np.round(one.channels["position"], 3))
        for one in measured(np.random.default_rng(2), 300)
    ]
    records.insert(11, OTHERS[change](records[3]))
    assert copies.copies_by_fingerprint([copies.fingerprint_of(one) for one in records]) == {}


@pytest.mark.parametrize("change", COPIES)
def test_a_copy_is_found(change: str) -> None:
    records = measured(np.random.default_rng(1), 20)
    records.insert(11, COPIES[change](records[3]))
    assert copies.first_copy(records) == (records[3], records[11])


@pytest.mark.parametrize("change", OTHERS)
def test_what_is_no_copy_is_not(change: str) -> None:
    records = measured(np.random.default_rng(1), 20)
    assert copies.first_copy([*records, OTHERS[change](records[3])]) is None


def test_signals_that_stand_still_are_compared_as_well() -> None:
    still = np.full(TIMES.size, 3.0)
    assert copies.first_copy([record("one", force=still), record("two", force=still + 1.0)]) is None
    assert copies.first_copy([record("one", force=still), record("two", force=still)]) is not None


def test_looking_up_misses_no_copy() -> None:
    """Comparison of each with each is the definition."""
    random = np.random.default_rng(4)
    records = measured(random, 30)
    records += [changed(records[int(i)], force=np.round(records[int(i)].channels["force"], 3)) for i in range(0, 30, 7)]
    order = random.permutation(len(records))
    records = [records[i] for i in order]
    pairs = [pair for pair in combinations(range(len(records)), 2) if copies._alike(records, pair)]
    assert pairs
    one, other = pairs[0]
    assert copies.first_copy(records) == (records[one], records[other])


def test_comparisons_grow_with_the_records(monkeypatch: pytest.MonkeyPatch) -> None:
    compared, alike = [], copies._alike
    monkeypatch.setattr(copies, "_alike", lambda *given: compared.append(1) or alike(*given))
    assert copies.first_copy(measured(np.random.default_rng(2), 400)) is None
    assert len(compared) < 400, "each with each are 79 800"
