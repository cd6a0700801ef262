"""Whole commands killed at random moments, by process id: the old result or the new one, whole."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
import psutil
import pytest

from tests.reliability.studies import copied

NARROW = ("--set", "sweep.lowest=4.2 Hz", "--set", "sweep.highest=4.6 Hz", "--set", "sweep.step=0.1 Hz")
COMMANDS = {
    "fit": ("drop_series", "--starts", "2"),
    "sweep": ("pendulum", *NARROW),
    "batch": ("drop_series", "--starts", "1", "--jobs", "2"),
    "sample": ("drop_series", "--max-steps", "60", "--ess", "1e9", "--checkpoint-seconds", "0.5"),
}
GO_ON = ("batch", "sample")
"""Commands that keep what a killed run has done."""
RECORDS = {"sample": 1}
"""Of the study, where all are too many."""
KILLS = {"sample": 8}
USUAL_KILLS = 5
LONGEST = 600.0
OTHERS_END = 10.0
"""Time in which processes end whose parent was killed, s."""


def command(name: str, out: Path, *words: str) -> list[str]:
    study, *settings = COMMANDS[name]
    return [
        sys.executable, "-m", "fibrefit", name, str(out.parent / study), *settings, *words,
        "--out", str(out), "--figures", "svg",
    ]  # fmt: skip


def whole(out: Path) -> dict[str, Any]:
    """What a result says, but for when it was made; all that its marker lists is there."""
    marker = json.loads((out / ".fibrefit").read_text())
    assert all((out / file).is_file() for file in marker["files"])
    assert any(file.endswith(".svg") for file in marker["files"])
    summary = json.loads((out / "summary.json").read_text())
    summary.pop("provenance")
    return summary


def finished(line: list[str]) -> None:
    done = subprocess.run(line, capture_output=True, text=True, check=False, timeout=LONGEST)
    assert done.returncode in (0, 5), done.stderr


def killed(line: list[str], after: float) -> None:
    """One command that lasts at most so long; those it has begun end by themselves."""
    process = subprocess.Popen(line, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    try:
        process.wait(after)
    except subprocess.TimeoutExpired:
        family = psutil.Process(process.pid).children(recursive=True)
        process.send_signal(signal.SIGKILL)
        process.wait()
        _, left = psutil.wait_procs(family, timeout=OTHERS_END)
        assert not left, f"{left} outlive the command"


@pytest.mark.slow
@pytest.mark.parametrize("name", COMMANDS)
def test_a_command_killed_at_any_moment(tmp_path: Path, name: str) -> None:
    study = COMMANDS[name][0]
    copied(study, tmp_path, records=RECORDS.get(name))
    out, begun = tmp_path / "out", tmp_path / "out.partial" / ".fibrefit"
    finished(command(name, out))
    old = whole(out)
    changed = ("--set", "name=changed")
    finished(command(name, tmp_path / "new", *changed))
    new = whole(tmp_path / "new")
    began = time.monotonic()
    finished(command(name, tmp_path / "new", *changed, "--force"))
    lasts = time.monotonic() - began
    assert whole(tmp_path / "new") == new != old
    there = {"old": 0, "new": 0}
    shares = np.random.default_rng(7).uniform(0.0, 1.0, KILLS.get(name, USUAL_KILLS))
    for number, share in enumerate(shares):
        goes_on = name in GO_ON and number % 2 and begun.exists()
        killed(command(name, out, *changed, "--resume" if goes_on else "--force"), float(share) * lasts)
        found = whole(out)
        assert found in (old, new), f"killed after {share:.2f} of the time"
        there["old" if found == old else "new"] += 1
    finished(command(name, out, *changed, "--resume" if name in GO_ON and begun.exists() else "--force"))
    assert whole(out) == new
    assert {path.name for path in tmp_path.iterdir()} == {study, "out", "new"}
    tried = len(shares)
    print(f"\n{name} of {lasts:.0f} s killed {tried} times: afterwards {there['old']} old results, {there['new']} new")


@pytest.mark.slow
def test_a_command_that_is_killed_leaves_no_result_where_there_was_none(tmp_path: Path) -> None:
    copied("drop_series", tmp_path)
    line = command("fit", tmp_path / "out")
    for after in (0.3, 1.5, 3.0):
        killed(line, after)
        assert not (tmp_path / "out").exists() or whole(tmp_path / "out")
    finished([*line, "--force"] if (tmp_path / "out").exists() else line)
    assert {path.name for path in tmp_path.iterdir()} == {"drop_series", "out"}
    assert not [name for name in os.listdir(tmp_path) if name.startswith(".")]
