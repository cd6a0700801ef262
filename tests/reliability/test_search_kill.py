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
WORDS = ("--only", "guide.*", "--exclude", "guide.presliding", "--time", "600")
LONGEST = 600.0


def search(out: Path, *words: str) -> list[str]:
    return [sys.executable, "-m", "fibrefit", "discover", str(STUDY), "--out", str(out), *WORDS, *words]


def told(out: Path) -> dict[str, Any]:
    """What a result says, but for when and how long it was made."""
    summary = json.loads((out / "summary.json").read_text())
    summary.pop("provenance")
    return summary


@pytest.mark.slow
def test_ten_kills(tmp_path: Path) -> None:
    began = time.monotonic()
    subprocess.run(search(tmp_path / "whole"), check=True, capture_output=True, timeout=LONGEST)
    lasts = time.monotonic() - began
    went_on = 0
    for number, share in enumerate(np.random.default_rng(13).uniform(0.5, 0.95, 10)):
        out = tmp_path / f"killed-{number}"
        process = subprocess.Popen(search(out), stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        time.sleep(float(share) * lasts)
        process.send_signal(signal.SIGKILL)
        process.wait()
        jobs = len(list(out.parent.glob(f"{out.name}.partial/journal/*.job")))
        went_on += jobs > 0
        if not out.exists():
            subprocess.run(search(out, "--resume"), check=True, capture_output=True, timeout=LONGEST)
        assert told(out) == told(tmp_path / "whole"), f"killed after {share:.2f} of the time, {jobs} jobs kept"
    assert went_on >= 3, "the search is over before a kill finds anything to go on from"
