"""Writers killed at random moments, by process id: the old result or the new one, whole, and then cleaned away."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from fibrefit.store import ResultDirectory

FILES = 12
WRITER = """
import sys
from pathlib import Path
from fibrefit.store import ResultDirectory
print("ready", flush=True)
for number in range(1, 100_000):
    with ResultDirectory(Path(sys.argv[1]), force=True) as result:
        (result.path / "figures").mkdir(exist_ok=True)
        for file in range(12):
            (result.path / "figures" / f"{file}.png").write_text(str(number))
"""


def versions(out: Path) -> set[str]:
    """What the files of a result say; one text where it is whole."""
    files = sorted((out / "figures").iterdir())
    assert len(files) == FILES
    return {file.read_text() for file in files}


def killed(out: Path, after: float) -> None:
    process = subprocess.Popen([sys.executable, "-c", WRITER, str(out)], stdout=subprocess.PIPE)
    assert process.stdout is not None
    process.stdout.readline()
    time.sleep(after)
    process.send_signal(signal.SIGKILL)
    process.wait()
    process.stdout.close()


@pytest.mark.parametrize("kills", [3, pytest.param(100, marks=pytest.mark.slow)])
def test_a_kill_at_any_moment_leaves_a_whole_result(tmp_path: Path, kills: int) -> None:
    out = tmp_path / "out"
    moments = np.random.default_rng(16).uniform(0.0, 0.5, kills)
    first, lost, seen = 0, 0, False
    for moment in moments:
        killed(out, float(moment))
        # Where the file system cannot exchange two folders, there is an instant in which the earlier one stands beside.
        stands = next((place for place in (out, out.with_name("out.replaced")) if place.exists()), None)
        if stands is None:
            assert not seen, "the earlier result is gone"
            first += 1
            continue
        seen = True
        lost += len(versions(stands)) != 1
        (stands / "notes.txt").write_text("mine")
        (stands / "notes.txt").unlink()
    assert seen, "no kill came after a result"
    with ResultDirectory(out, force=True) as result:
        (result.path / "summary.json").write_text("last")
    print(f"\n{kills} kills while results were put in place: {lost} lost, {first} before there was one")
    assert lost == 0
    assert {path.name for path in tmp_path.iterdir()} == {"out"}
    assert {path.name for path in out.iterdir()} == {"summary.json", ".fibrefit"}


def test_a_disk_that_fills_up_keeps_the_old_result(tmp_path: Path) -> None:
    """The limit is of the system: no file may grow beyond it."""
    code = """
import resource, sys
from pathlib import Path
import numpy as np
from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory, provenance, write_result
from fibrefit.study.summaries.part import Variable
out = Path(sys.argv[1])
with ResultDirectory(out) as result:
    (result.path / "summary.json").write_text("old")
resource.setrlimit(resource.RLIMIT_FSIZE, (20_000, 20_000))
try:
    with ResultDirectory(out, force=True) as result:
        (result.path / "summary.json").write_text("new")
        values = Variable(np.random.default_rng(0).normal(size=50_000), ("draw",))
        write_result(result.path / "result.h5", "x", {"group": {"values": values}}, provenance("", []))
except UsageError as error:
    print(error)
    sys.exit(2)
"""
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "out")], capture_output=True, text=True, check=False
    )
    assert done.returncode == 2, done.stderr
    assert (
        "File too large; expected room for the result. Make room and start again. The earlier result is" in done.stdout
    )
    assert done.stderr == ""
    assert (tmp_path / "out" / "summary.json").read_text() == "old"
    assert {path.name for path in tmp_path.iterdir()} == {"out"}
