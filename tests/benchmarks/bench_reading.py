"""Reading against pandas: a million rows, whole processes; and many small files. Run by ``make bench``."""

from __future__ import annotations

import os
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fibrefit.records import read_record

ROWS = 1_000_000
MOST_TIMES, MOST_SECONDS = 3.0, 20.0
OURS = "from fibrefit.records import read_record; read_record({!r})"
THEIRS = "import pandas; pandas.read_csv({!r})"


def rows(n: int) -> str:
    random = np.random.default_rng(0)
    t = np.arange(n) / 2000.0
    force = 12.5 + 3.0 * np.sin(8.0 * t) + 0.2 * random.standard_normal(n)
    position = -0.25 + 1.5 * np.sin(8.0 * t) + 0.01 * random.standard_normal(n)
    return "".join(f"{a:.4f},{b:.3f},{c:.4f}\n" for a, b, c in zip(t, force, position, strict=True))


HEAD = "time [s],force [N],position [mm]\n"


def cost(code: str) -> tuple[float, float]:
    """Processor time in s and peak memory in MiB of a process of its own: the least of three."""
    found = []
    for _ in range(3):
        process = subprocess.Popen([sys.executable, "-c", code])
        _, status, usage = os.wait4(process.pid, 0)
        process.returncode = os.waitstatus_to_exitcode(status)
        assert process.returncode == 0
        found.append((usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024))
    return min(time for time, _ in found), min(memory for _, memory in found)


def test_a_million_rows(tmp_path: Path) -> None:
    path = tmp_path / "long.csv"
    path.write_text(HEAD + rows(ROWS))
    ours, theirs = cost(OURS.format(str(path))), cost(THEIRS.format(str(path)))
    print(f"\n1e6 rows: {ours[0]:.2f} s, {ours[1]:.0f} MiB; pandas {theirs[0]:.2f} s, {theirs[1]:.0f} MiB")
    assert ours[0] < MOST_TIMES * theirs[0]
    assert ours[1] < MOST_TIMES * theirs[1]


@pytest.mark.parametrize("count", [1000])
def test_many_small_files(count: int, tmp_path: Path) -> None:
    text = HEAD + rows(2000)
    paths = [tmp_path / f"{i}.csv" for i in range(count)]
    for path in paths:
        path.write_text(text)
    start = time.process_time()
    for path in paths:
        read_record(path)
    spent = time.process_time() - start
    print(f"\n{count} files of 2000 rows: {spent:.1f} s")
    assert spent < MOST_SECONDS
