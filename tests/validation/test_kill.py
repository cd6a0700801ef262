"""``fibrefit sample`` killed at random moments, whatever it is doing: nothing is lost but the last seconds."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import h5py
import numpy as np
import pytest

from tests.fitting import made

MOMENTS = [(0.15, 0.5)] * 7 + [(0.5, 1.1)] * 3
"""When each kill comes, as a share of the time an uninterrupted run takes: most in the chains, some in the writing."""


def words(folder: Path, out: Path) -> list[str]:
    budget = ["--max-steps", "800", "--ess", "1e9", "--checkpoint-seconds", "0.3", "--seed", "4", "--resume"]
    return [sys.executable, "-m", "fibrefit", "sample", str(folder), "--out", str(out), *budget, "-q", "--json"]


def sound(folder: Path) -> int | None:
    """Steps kept in a folder; every file that bears its final name must be whole."""
    for file in folder.glob("*.h5"):
        with h5py.File(file) as content:
            assert "posterior" in content
    if not (folder / "chains.npz").exists():
        return None
    with np.load(folder / "chains.npz", allow_pickle=False) as content:
        return len(content["0.points"])


@pytest.mark.slow
def test_a_run_killed_ten_times_ends_like_one_that_was_not(tmp_path: Path) -> None:
    made.study(tmp_path)
    made.write(tmp_path, made.records(share=0.5, seed=3))
    environment = {**os.environ, "FIBREFIT_CACHE": str(tmp_path / "cache")}
    whole, pieces = tmp_path / "whole", tmp_path / "pieces"
    subprocess.run(words(tmp_path, whole), check=False, env=environment, capture_output=True, timeout=900)
    began = time.perf_counter()
    subprocess.run(words(tmp_path, tmp_path / "timed"), check=False, env=environment, capture_output=True, timeout=900)
    takes = time.perf_counter() - began
    kept: list[int] = []
    random = np.random.default_rng(11)
    for moment in MOMENTS:
        victim = subprocess.Popen(words(tmp_path, pieces), env=environment, stdout=subprocess.DEVNULL)
        try:
            victim.wait(random.uniform(*moment) * takes)
        except subprocess.TimeoutExpired:
            victim.send_signal(signal.SIGKILL)
            victim.wait()
        kept += [
            steps for folder in (pieces.with_name("pieces.partial"), pieces) if (steps := sound(folder)) is not None
        ][:1]
    print(f"\nuninterrupted run {takes:.1f} s; steps kept after each kill: {kept}")
    assert kept == sorted(kept)
    assert len(kept) >= 3
    assert kept[-1] > 0
    last = subprocess.run(words(tmp_path, pieces), check=False, env=environment, capture_output=True, timeout=900)
    assert last.returncode in (0, 5), last.stderr
    with np.load(whole / "chains.npz") as one, np.load(pieces / "chains.npz") as other:
        assert one.files == other.files
        for name in one.files:
            np.testing.assert_array_equal(one[name], other[name], err_msg=name)
    with h5py.File(whole / "result.h5") as one, h5py.File(pieces / "result.h5") as other:
        np.testing.assert_array_equal(one["posterior/stiffness"][:], other["posterior/stiffness"][:])
    assert not [path for path in pieces.rglob(".*") if path.name != ".fibrefit"]
