"""A true SIGINT: to a fit in its search, twice, and too early."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.skipif(os.name == "nt", reason="Windows has no SIGINT for a single process")

STUDY = Path(__file__).resolve().parents[2] / "configs" / "drop_series" / "study.toml"
LONGEST = 240.0

#: The command, with a search that tells of its parts and takes its time over them. Parts run side by side: one
#: system call writes a whole line, where `print` would let the lines of two threads run into each other.
SLOW = """
import importlib, os, signal, sys, time
# A job script may have its children ignore the signal that is tested here.
signal.signal(signal.SIGINT, signal.default_int_handler)
from fibrefit.cli.main import main
name, wait = sys.argv[1:3]
module, _, function = name.rpartition(".")
module = importlib.import_module(module)
plain = getattr(module, function)
def slowly(*given, **more):
    os.write(1, b"at it\\n")
    time.sleep(float(wait))
    return plain(*given, **more)
setattr(module, function, slowly)
sys.argv[1:] = sys.argv[3:]
main()
"""


class Fit:
    """A fit in a process of its own that stops over each call of a function.

    Parameters
    ----------
    out : pathlib.Path
    slow : str
        Dotted name of the function.
    wait : float
        In s, over each call.
    """

    def __init__(self, out: Path, slow: str, wait: float) -> None:
        command = [sys.executable, "-c", SLOW, slow, str(wait), "fit", str(STUDY), "--out", str(out), "--starts", "64"]
        pipe = subprocess.PIPE
        self.process = subprocess.Popen(command, stdout=pipe, stderr=pipe, text=True)

    def interrupt(self, after: int) -> None:
        """Ctrl-C once the function has been called so often; what is reported before that is skipped."""
        assert self.process.stdout is not None
        for _ in range(after):
            while (line := self.process.stdout.readline()) != "at it\n":
                assert line, "the process ended before it was at it"
        self.process.send_signal(signal.SIGINT)

    def end(self) -> tuple[int, str, str]:
        """Exit code, what is left of stdout, and stderr."""
        out, err = self.process.communicate(timeout=LONGEST)
        return self.process.returncode, out, err


@pytest.fixture
def fits(tmp_path: Path) -> Iterator[list[Fit]]:
    started: list[Fit] = []
    yield started
    for fit in started:
        if fit.process.poll() is None:
            fit.process.kill()
        fit.process.communicate()


def test_a_fit_concludes_with_what_there_is(tmp_path: Path, fits: list[Fit]) -> None:
    out = tmp_path / "out"
    fits.append(fit := Fit(out, "fibrefit.fitting.search.starts._part", 0.3))
    fit.interrupt(after=3)
    code, said, remarks = fit.end()
    assert code == 130
    assert "Interrupted: concluding with what there is. Ctrl-C again ends at once." in remarks
    assert "Interrupted: 1 of 64 starts came to an end" in " ".join(said.split())
    summary = json.loads((out / "summary.json").read_text())
    assert summary["status"] != "ok"
    (check,) = [check for check in summary["checks"] if check["name"] == "the fit ran to its end"]
    assert not check["passed"]
    assert summary["parameters"]["stiffness"]["value"] == pytest.approx(2e4, rel=0.5)
    assert (out / "result.h5").exists()
    assert not list(tmp_path.glob("*.partial"))


def test_the_second_time_it_ends_at_once(tmp_path: Path, fits: list[Fit]) -> None:
    out = tmp_path / "out"
    fits.append(fit := Fit(out, "fibrefit.fitting.identify.with_second_solver", 20.0))
    fit.interrupt(after=1)
    assert fit.process.stderr is not None
    assert fit.process.stderr.readline().startswith("Interrupted: concluding")
    fit.process.send_signal(signal.SIGINT)
    code, _, remarks = fit.end()
    assert code == 130
    assert "Nothing was written." in remarks
    assert not out.exists()


def test_before_anything_is_known_it_says_so(tmp_path: Path, fits: list[Fit]) -> None:
    out = tmp_path / "out"
    fits.append(fit := Fit(out, "fibrefit.workflow.fit.read_records", 1.0))
    fit.interrupt(after=1)
    code, _, remarks = fit.end()
    assert code == 130
    assert "Interrupted. Nothing is known yet; nothing was written." in remarks
    assert not out.exists()


def test_what_was_not_drawn_is_said(tmp_path: Path, fits: list[Fit]) -> None:
    out = tmp_path / "out"
    fits.append(fit := Fit(out, "fibrefit.workflow.fit.fit_groups", 1.0))
    fit.interrupt(after=1)
    code, _, remarks = fit.end()
    assert code == 130
    assert "Not all figures were drawn." in remarks
    assert json.loads((out / "summary.json").read_text())["parameters"]
    assert not list((out / "figures").glob("*")) if (out / "figures").exists() else True


@pytest.mark.parametrize(("code", "waits"), [(130, False), (0, True)])
def test_an_interrupted_command_does_not_wait_for_its_threads(code: int, waits: bool) -> None:
    # A thread that compiles cannot be ended. Any other command waits for its own.
    program = f"""
import threading, time
from fibrefit.cli import main
def run(args):
    threading.Thread(target=lambda: (time.sleep(1.0), print("thread ended"))).start()
    print("said")
    return {code}
main.run = run
main.main()
"""
    ended = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=LONGEST)
    assert ended.returncode == code
    assert ended.stdout.startswith("said")
    assert ("thread ended" in ended.stdout) == waits
