"""Files that ask for more memory than there is are refused by what they declare, before it is taken."""

from __future__ import annotations

import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from fibrefit.core import limits
from fibrefit.core.errors import DataError
from fibrefit.records import read_table
from tests.reliability.bombs import BOMBS

MIB, GIB = 1 << 20, 1 << 30
SMALL = 8 * MIB
"""The limit of the fast tests, and half of what their files unpack to."""
FEW_CELLS = 200_000
REFUSED = r"more than .* (unpacked or declared|cells)|MB; expected a measurement file of .* at most|is damaged"
MOST_MEMORY = 600.0
"""MB of a whole process that refuses a file; without anything to read it is 60 to 80, openpyxl goes on to 310."""


@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    """With limits a hundredth of the real ones, so that the files are made in an instant."""
    monkeypatch.setattr(limits, "LARGEST", SMALL)
    monkeypatch.setattr(limits, "MOST_CELLS", FEW_CELLS)
    BOMBS[name](tmp_path / name, 2 * SMALL)
    on_disk = 0 if name in ("holes.csv", "cells.csv") else (tmp_path / name).stat().st_size
    assert on_disk < 1 * MIB
    tracemalloc.start()
    try:
        with pytest.raises(DataError, match=REFUSED):
            read_table(tmp_path / name)
        assert tracemalloc.get_traced_memory()[1] < 2 * SMALL
    finally:
        tracemalloc.stop()


def test_what_is_within_the_limits_is_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The negative control: the same kinds of files, not hostile, with the same limits."""
    import gzip
    import zipfile

    import h5py
    import scipy.io

    monkeypatch.setattr(limits, "LARGEST", SMALL)
    monkeypatch.setattr(limits, "MOST_CELLS", FEW_CELLS)
    n = 50_000
    columns = {"time_s": np.arange(n) / 2000.0, "force_N": np.sin(np.arange(n))}
    text = "time [s],force [N]\n" + "".join(f"{t:.4f},{f:.3f}\n" for t, f in zip(*columns.values(), strict=True))
    (tmp_path / "a.csv").write_text(text)
    with gzip.open(tmp_path / "a.csv.gz", "wt") as file:
        file.write(text)
    with zipfile.ZipFile(tmp_path / "a.zip", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("a.csv", text)
    for compressed in (False, True):
        scipy.io.savemat(tmp_path / f"a{compressed}.mat", columns, do_compression=compressed)
    scipy.io.savemat(tmp_path / "four.mat", columns, format="4")
    with h5py.File(tmp_path / "a.h5", "w") as file:
        for name, values in columns.items():
            file.create_dataset(name, data=values)
    for name in ("a.csv", "a.csv.gz", "a.zip", "aFalse.mat", "aTrue.mat", "four.mat", "a.h5"):
        assert read_table(tmp_path / name).columns[0].values.size == n, name


@pytest.mark.slow
@pytest.mark.parametrize("name", BOMBS)
def test_a_bomb_takes_no_memory(tmp_path: Path, name: str) -> None:
    """At their full size and the real limits, by the command line; the system counts the memory."""
    path = tmp_path / name
    BOMBS[name](path, GIB + GIB // 4)
    with (tmp_path / "said").open("wb") as said:
        process = subprocess.Popen([sys.executable, "-m", "fibrefit", "inspect", str(path)], stdout=said, stderr=said)
        _, status, usage = os.wait4(process.pid, 0)
    process.returncode = os.waitstatus_to_exitcode(status)
    path.unlink()
    assert process.returncode == 3, (tmp_path / "said").read_text()
    memory = usage.ru_maxrss / 1024.0
    spent = usage.ru_utime + usage.ru_stime
    print(f"\n{name}: refused with {memory:.0f} MB and {spent:.1f} s of processor")
    assert memory < MOST_MEMORY
