"""Randomly damaged files: refused with a reason, or read with the undamaged values wherever they are not masked."""

from __future__ import annotations

import contextlib
import json
from collections import Counter
from dataclasses import replace
from pathlib import Path

import damage
import numpy as np
import pytest
from layouts import LAYOUTS

from fibrefit.core.errors import FibrefitError
from fibrefit.records import Record, describe, read_record, read_table

SHEETS = damage.sheets()

#: Cases by default, in the long run, and of damage of any kind.
CASES, MANY_CASES, ANY_CASES = 300, 3000, 120

#: Share of damaged files that must still be read: a reader that refuses everything would pass otherwise.
STILL_READ = 0.7


def read(content: bytes, sheet: damage.Sheet, folder: Path) -> Record:
    path = folder / "file.csv"
    path.write_bytes(content)
    return read_record(path, **sheet.options)


def wrong(record: Record, undamaged: Record, *, clock: bool) -> str:
    """What differs from the undamaged record; empty if nothing does."""
    if not (np.isfinite(record.time).all() and (np.diff(record.time) > 0).all()):
        return "times do not increase"
    if not np.isclose(record.rate, undamaged.rate, rtol=1e-6):
        return f"rate {record.rate}"
    # A clock starts at the first reading that is left.
    found = [_wrong_values(record, undamaged, shift) for shift in (range(12) if clock else (0,))]
    return min(found, key=len)


def _wrong_values(record: Record, undamaged: Record, shift: int) -> str:
    places = np.round(record.time * undamaged.rate).astype(int) + shift
    if places.min() < 0 or places.max() >= len(undamaged):
        return "times outside the record"
    if np.abs(record.time + shift / undamaged.rate - undamaged.time[places]).max() > 1e-6:
        return "times off the grid"
    for role, values in record.channels.items():
        if role not in undamaged.channels:
            return f"a channel {role} out of nothing"
        valid = record.valid[role]
        if not np.allclose(values[valid], undamaged.channels[role][places][valid], rtol=1e-9, atol=1e-12):
            return f"values of {role}"
    return ""


def run(cases: range, folder: Path) -> Counter[str]:
    """Damage, read and compare; a failure names the case and the kind of damage."""
    undamaged = [read(sheet.bytes(), sheet, folder) for sheet in SHEETS]
    outcome: Counter[str] = Counter()
    for case in cases:
        rng = np.random.default_rng(case)
        number = int(rng.integers(len(SHEETS)))
        sheet = SHEETS[number]
        kinds = damage.ANY + (() if sheet.timeless else damage.TIMED)
        kind = kinds[int(rng.integers(len(kinds)))]
        try:
            record = read(kind(sheet, rng), sheet, folder)
        except FibrefitError:
            outcome["refused"] += 1
        else:
            difference = wrong(record, undamaged[number], clock=sheet.clock)
            assert not difference, f"case {case}: {kind.__name__} of {sheet.name!r}: {difference}"
            outcome["read"] += 1
            outcome["masked"] += any(not valid.all() for valid in record.valid.values())
    return outcome


def test_damaged_files(tmp_path: Path) -> None:
    outcome = run(range(CASES), tmp_path)
    assert outcome["read"] > STILL_READ * CASES
    assert outcome["masked"] > 0


@pytest.mark.slow
def test_many_damaged_files(tmp_path: Path) -> None:
    outcome = run(range(CASES, CASES + MANY_CASES), tmp_path)
    assert outcome["read"] > STILL_READ * MANY_CASES


@pytest.mark.parametrize("sheet", SHEETS, ids=lambda sheet: sheet.name)
def test_undamaged_files_are_read_whole(sheet: damage.Sheet, tmp_path: Path) -> None:
    record = read(sheet.bytes(), sheet, tmp_path)
    assert len(record) == len(sheet.cells)
    assert all(valid.all() for valid in record.valid.values())
    assert not record.gaps


def test_negative_control_the_comparison_sees_a_changed_value(tmp_path: Path) -> None:
    sheet = SHEETS[0]
    record = read(sheet.bytes(), sheet, tmp_path)
    force = record.channels["force"].copy()
    force[7] += 1e-3
    changed = replace(record, channels={**record.channels, "force": force})
    assert wrong(changed, record, clock=False) == "values of force"
    assert wrong(record, record, clock=False) == ""
    late = replace(record, time=record.time + 0.0005)
    assert wrong(late, record, clock=False)


def test_any_damage_at_all_ends_in_a_word_and_not_in_a_traceback(tmp_path: Path) -> None:
    """Bytes of every kind anywhere: nothing is said about the values, only that the reader answers."""
    contents = [layout.content for layout in LAYOUTS]
    contents = [c if isinstance(c, bytes) else c.encode("utf-8") for c in contents]
    for case in range(ANY_CASES):
        rng = np.random.default_rng(case)
        content = bytearray(contents[int(rng.integers(len(contents)))])
        for _ in range(int(rng.integers(1, 6))):
            place = int(rng.integers(len(content)))
            lost, put = int(rng.integers(0, 60)), rng.integers(0, 256, int(rng.integers(0, 12)), dtype=np.uint8)
            content[place : place + lost] = bytes(put)
        path = tmp_path / "file.csv"
        path.write_bytes(bytes(content))
        with contextlib.suppress(FibrefitError):
            json.dumps(read_table(path).understood, allow_nan=False)
        with contextlib.suppress(FibrefitError):
            describe(read_record(path))
