"""One run at a time in a folder, and none that is held up by what a dead one has left."""

from __future__ import annotations

import signal
import subprocess
import sys
import threading
from pathlib import Path

import pytest
from filelock import FileLock

from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory
from fibrefit.store.directory import lock_file

PAIRS = 3

WRITER = """
import sys
from pathlib import Path
from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory
out, name = Path(sys.argv[1]), sys.argv[2]
print("ready", flush=True)
sys.stdin.readline()
try:
    with ResultDirectory(out, force=True) as result:
        (result.path / f"{name}0.csv").write_text(name)
        print("in", flush=True)
        sys.stdin.readline()
        (result.path / f"{name}1.csv").write_text(name)
except UsageError as error:
    print(error, flush=True)
    sys.exit(2)
"""


def writer(out: Path, name: str) -> subprocess.Popen[str]:
    """A process that begins to write, and ends, at a line that it is told, or where it is told nothing more."""
    words = [sys.executable, "-c", WRITER, str(out), name]
    return subprocess.Popen(words, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)


def line_of(process: subprocess.Popen[str]) -> str:
    assert process.stdout is not None
    return process.stdout.readline()


def tell(process: subprocess.Popen[str]) -> None:
    assert process.stdin is not None
    process.stdin.write("\n")
    process.stdin.flush()


def writing(out: Path, name: str) -> subprocess.Popen[str]:
    """One that has begun to."""
    process = writer(out, name)
    assert line_of(process) == "ready\n"
    tell(process)
    assert line_of(process) == "in\n"
    return process


def names(folder: Path) -> set[str]:
    return {path.name for path in folder.iterdir()}


def test_of_two_at_one_instant_one_computes_and_the_other_says_so(tmp_path: Path) -> None:
    pairs = [[writer(tmp_path / f"{i}" / "out", name) for name in "ab"] for i in range(PAIRS)]
    heard = []
    for pair in pairs:
        assert [line_of(process) for process in pair] == ["ready\n"] * 2
        for process in pair:
            tell(process)
        # The one that is in stays in until the other has spoken.
        said = [line_of(process) for process in pair]
        heard.append([first + process.communicate(timeout=60)[0] for first, process in zip(said, pair, strict=True)])
    for i, pair in enumerate(pairs):
        said = heard[i]
        assert sorted(process.returncode for process in pair) == [0, 2], said
        winner = "ab"[[process.returncode for process in pair].index(0)]
        assert names(tmp_path / f"{i}" / "out") == {f"{winner}0.csv", f"{winner}1.csv", ".fibrefit"}
        assert names(tmp_path / f"{i}") == {"out"}
        assert "is being written by another run (process " in "".join(said)


def test_a_lock_that_does_not_say_yet_whose_it_is_is_asked_again(tmp_path: Path) -> None:
    out = tmp_path / "out"
    with FileLock(lock_file(out)):
        timer = threading.Timer(0.1, lock_file(out).write_text, ["process 7 on node7"])
        timer.start()
        with pytest.raises(UsageError, match="another run \\(process 7 on node7\\)"):
            ResultDirectory(out).check()
        timer.join()


def test_a_dead_run_holds_nobody_up_and_is_cleaned_away(tmp_path: Path) -> None:
    out = tmp_path / "out"
    process = writing(out, "a")
    with pytest.raises(UsageError, match=f"process {process.pid} on "):
        ResultDirectory(out, force=True).check()
    process.send_signal(signal.SIGKILL)
    process.communicate()
    assert names(tmp_path) == {"out.partial", ".out.lock"}
    with ResultDirectory(out) as result:
        (result.path / "b.csv").write_text("b")
    assert names(tmp_path) == {"out"}
    assert names(out) == {"b.csv", ".fibrefit"}


def test_a_stopped_run_still_holds_its_lock(tmp_path: Path) -> None:
    """Whatever its marker says of the machine it runs on."""
    out = tmp_path / "out"
    process = writing(out, "a")
    process.send_signal(signal.SIGSTOP)
    try:
        (tmp_path / "out.partial" / ".fibrefit").write_text('{"pid": 1, "host": "node7"}')
        (tmp_path / ".out.lock").write_text("process 1 on node7")
        with pytest.raises(UsageError, match="being written"):
            ResultDirectory(out, force=True).check()
    finally:
        process.send_signal(signal.SIGCONT)
        process.communicate(timeout=30)
    assert process.returncode == 0
    assert names(out) == {"a0.csv", "a1.csv", ".fibrefit"}


def test_what_a_thread_has_reserved_no_other_thread_enters(tmp_path: Path) -> None:
    out, refused = tmp_path / "out", []

    def other() -> None:
        try:
            ResultDirectory(out).check()
        except UsageError as error:
            refused.append(str(error))

    with ResultDirectory(out).reserved():
        thread = threading.Thread(target=other)
        thread.start()
        thread.join()
        with ResultDirectory(out) as result:
            (result.path / "a.csv").write_text("a")
    assert "being written by another run" in refused[0]
    assert names(tmp_path) == {"out"}


def test_a_result_is_saved_into_what_was_reserved_before_the_work(tmp_path: Path) -> None:
    """A folder that appears during the work neither is touched nor costs the result."""
    out = tmp_path / "out"
    with pytest.raises(UsageError, match="complete in .*out-2"), ResultDirectory(out).reserved():
        out.mkdir()
        with ResultDirectory(out) as result:
            (result.path / "a.csv").write_text("a")
    assert names(tmp_path) == {"out", "out-2"}
