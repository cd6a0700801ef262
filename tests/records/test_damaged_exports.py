"""Damaged files of every kind: a table, or a refusal that says where and what; never a fault, and never for long."""

from __future__ import annotations

import random
import time
from pathlib import Path

import pytest

from fibrefit.workflow.inspection.inspection import seen_in
from tests.records.exports import KINDS
from tests.records.exports.outcome import written

EXPORTS = [export for exports in KINDS.values() for export in exports]
LONGEST = 20.0
TOKENS = (
    *(
        b"\x00",
        b"\xff",
        b"\xef\xbb\xbf",
        b"nan",
        b"1e999",
        b"-",
        b'"',
        b"'",
        b"{",
        b"[",
        b"}",
        b"\\",
        b"\r",
        b"\t",
        b";",
    ),
    *(b"=", b"1" * 400, b"$\\badmacro{", b"-1.#IND", b"***End_of_Header***\n", b"\x1b]0;x\x07", b"sep=;\n"),
    b"LabVIEW Measurement\n",
)


def damaged(data: bytes, chance: random.Random) -> bytes:
    """A file with one to four damages."""
    for _ in range(chance.randint(1, 4)):
        n = max(len(data), 1)
        i, j = sorted((chance.randrange(n), chance.randrange(n)))
        k = min(n, i + chance.randint(1, 40))
        lines = data.splitlines(keepends=True) or [b""]
        a, b = chance.randrange(len(lines)), chance.randrange(len(lines))
        data = chance.choice(
            [
                data[:i] + bytes([chance.randrange(256)]) + data[i + 1 :],
                data[:i] + data[k:],
                data[:k] + data[i:],
                data[:i] + chance.choice(TOKENS) + data[i:],
                data[:j],
                data[i:],
                data[:i] + b"\x00" * (k - i) + data[k:],
                data[:i] + data[j:],
                b"".join([*lines[:a], lines[b], *lines[a:]]),
                b"".join(lines[:a] + lines[a + 1 :]),
                b"".join(chance.sample(lines, len(lines))),
                data.replace(b",", b";", chance.randint(1, 400)),
                data.replace(b"\n", b"", chance.randint(1, 3)),
                data.swapcase(),
            ]
        )
    return data


def survive(number: int, folder: Path) -> bool:
    """Whether a damaged file was read; fails for a fault of the program, and for one that takes too long."""
    chance = random.Random(number)
    export = chance.choice(EXPORTS)
    path = written(export, folder)
    path.write_bytes(damaged(path.read_bytes(), chance))
    arguments = {"channels": {}, "units": {}, "columns": (), "delimiter": None, "decimal": None, "rate": None}
    start = time.process_time()
    found = seen_in(path, {**arguments, **export.options})
    assert time.process_time() - start < LONGEST, f"{export.name}, number {number}"
    return found.refusal is None


def survive_all(numbers: range, folder: Path) -> int:
    read = 0
    for number in numbers:
        try:
            read += survive(number, folder)
        except Exception as error:
            raise AssertionError(f"number {number}: {type(error).__name__}: {error}") from error
    return read


def test_100_damaged_files(tmp_path: Path) -> None:
    # Both outcomes must occur, or the test would show nothing.
    assert 10 < survive_all(range(100), tmp_path) < 90


@pytest.mark.slow
def test_3000_damaged_files(tmp_path: Path) -> None:
    assert 300 < survive_all(range(1000, 4000), tmp_path) < 2700
