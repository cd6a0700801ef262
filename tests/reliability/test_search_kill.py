"""A search killed at random moments, by process id, and resumed: the result of one that nobody killed."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import pytest

STUDY = Path(__file__).resolve().parents[1] / "data" / "discover" / "viscous" / "study.toml"
TRIED = ("viscous_friction", "quadratic_drag", "friction_drift", "friction_wear", "stribeck_friction")
WORDS = (*(f"--only=guide.{name}" for name in TRIED), "--time", "600", "--figures", "none")
LONGEST = 600.0
KILLS = 10


def search(out: Path, *words: str) -> list[str]:
    return [sys.executable, "-m", "fibrefit", "discover", str(STUDY), "--out", str(out), *WORDS, *words]


def told(out: Path) -> dict[str, Any]:
    """What a result says, but for when and how long it was made."""
    summary = json.loads((out / "summary.json").read_text())
    summary.pop("provenance")
    return summary


def jobs_done(out: Path) -> int:
    """Results of a search that is under way, or was."""
    return len(list(out.parent.glob(f"{out.name}.partial/journal/*.job")))


@pytest.fixture(scope="module")
def whole(tmp_path_factory: pytest.TempPathFactory) -> tuple[dict[str, Any], int]:
    """What a search says that nobody kills, and the jobs it is made of."""
    out, most = tmp_path_factory.mktemp("search") / "whole", 0
    process = subprocess.Popen(search(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    while process.poll() is None:
        most = max(most, jobs_done(out))
        time.sleep(0.05)
    assert process.returncode == 0
    return told(out), most


@pytest.mark.slow
@pytest.mark.parametrize("number", range(KILLS))
def test_a_kill_costs_nothing(tmp_path: Path, whole: tuple[dict[str, Any], int], number: int) -> None:
    """Moments are counted in the jobs that a search is made of, so that they are spread over it on any machine."""
    expected, most = whole
    random = np.random.default_rng([13, number])
    done, more = int((number + random.uniform()) / KILLS * most), float(random.uniform(0.0, 0.3))
    out = tmp_path / "out"
    process = subprocess.Popen(search(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    began = time.monotonic()
    while jobs_done(out) < done and process.poll() is None and not out.exists():
        assert time.monotonic() - began < LONGEST
        time.sleep(0.002)
    time.sleep(more)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = jobs_done(out)
    print(f"\nkilled with {kept} of {most} jobs done{', after the end' if out.exists() else ''}")
    assert kept >= done or out.exists()
    if not out.exists():
        subprocess.run(search(out, "--resume"), check=True, capture_output=True, timeout=LONGEST)
    assert told(out) == expected
    assert {path.name for path in tmp_path.iterdir()} <= {"out", ".out.lock"}
