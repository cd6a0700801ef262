"""Work is done wherever it is sent, whatever some of it does."""

from __future__ import annotations

import gc
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

from fibrefit.core.errors import UsageError
from fibrefit.series.engines import ProcessDiedError, in_processes, in_this_process, on_cluster
from tests.series import work

ROOT = Path(__file__).resolve().parents[2]


def by_number(done: list) -> dict:
    return {one.number: one.outcome if one.error is None else type(one.error) for one in done}


def test_one_failure_ends_nothing_else_here() -> None:
    found = list(in_this_process(work.doubled, [1, 3, 5]))
    assert by_number(found) == {0: 2, 1: ValueError, 2: 10}
    assert str(found[1].error) == "three cannot be done"


def test_what_the_first_piece_left_is_not_searched_for_garbage_until_all_are_done() -> None:
    gc.unfreeze()  # what the suite took out
    running = in_this_process(work.doubled, [1, 2, 4])
    next(running)
    assert gc.get_freeze_count() > 0
    assert [one.outcome for one in running] == [4, 8]
    assert gc.get_freeze_count() == 0
    others = by_number(list(in_processes(work.frozen, [0, 1, 2, 3], 1)))
    assert others.pop(0) == 0
    assert min(others.values()) > 0


def test_one_failure_ends_nothing_else_in_processes() -> None:
    found = list(in_processes(work.doubled, list(range(12)), 2))
    assert by_number(found) == {n: 2 * n if n != 3 else ValueError for n in range(12)}


def test_a_process_that_dies_takes_only_its_own_work_with_it() -> None:
    found = by_number(list(in_processes(work.fatal, [0, 1, -1, 2, 3], 2)))
    assert found == {0: 0, 1: 1, 2: ProcessDiedError, 3: 2, 4: 3}


def test_a_script_that_guards_nothing_is_told_so(tmp_path: Path) -> None:
    """Each process runs it, is refused by the system, and had been taken for one that died for want of memory."""
    script = tmp_path / "script.py"
    script.write_text(
        "from fibrefit.series.engines import in_processes\n"
        "from tests.series import work\n"
        "print(list(in_processes(work.doubled, [1, 2], 2)))\n"
    )
    path = os.environ | {"PYTHONPATH": os.pathsep.join([str(ROOT), *sys.path])}
    command = [sys.executable, str(script)]
    ended = subprocess.run(command, env=path, capture_output=True, text=True, check=False)
    assert ended.returncode == 1
    # What the system says of the processes it ended may come after.
    raised = [line for line in ended.stderr.splitlines() if "UsageError: " in line]
    assert len(raised) == 1, ended.stderr[-600:]
    assert "UsageError: processes: none of them came to its work" in raised[0]
    assert not ended.stdout


def test_work_that_survives_alone_is_done(tmp_path: Path) -> None:
    arguments = [(n, str(tmp_path / "marker")) for n in range(4)]
    assert by_number(list(in_processes(work.fatal_once, arguments, 2))) == {0: 0, 1: 1, 2: 2, 3: 3}


@pytest.mark.skipif(not Path("/proc/self/task").is_dir(), reason="threads are counted by what Linux tells of them")
def test_programs_of_a_process_beside_others_keep_to_one_thread() -> None:
    (done,) = in_processes(work.threads_of_programs, [6], 1)
    assert done.outcome == 1
    assert work.threads_of_programs(6) == int(os.environ.get("NPROC", len(os.sched_getaffinity(0))))


def test_what_is_done_first_comes_first() -> None:
    # Longer than a second process takes to start beside whatever else runs.
    found = list(in_processes(work.slow, [6.0, 0.0, 0.0], 2))
    assert [one.number for one in found] == [1, 2, 0]


def test_leaving_early_ends_the_processes() -> None:
    running = in_processes(work.slow, [0.0, 0.1, 0.1, 0.1], 2)
    pid = next(running).outcome
    running.close()
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


def test_leaving_early_does_not_wait_for_what_is_under_way() -> None:
    running = in_processes(work.slow, [0.0, 600.0, 600.0], 2)
    pid = next(running).outcome
    left = time.monotonic()
    running.close()
    assert time.monotonic() - left < 300.0
    with pytest.raises(ProcessLookupError):
        os.kill(pid, 0)


INTERRUPTED = """
import signal, sys, time
from fibrefit.series.engines import in_processes
from tests.series import work
if __name__ == "__mp_main__" and sys.argv[1] == "loading":
    print("loading", flush=True)
    time.sleep(3.0)
if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.default_int_handler)  # a shell ignores it in what it runs in the background
    for done in in_processes(work.slow, [0.0, 600.0, 600.0], 2):
        print("at work", flush=True)
"""


@pytest.mark.skipif(not hasattr(os, "killpg"), reason="a terminal interrupts a group of processes")
@pytest.mark.parametrize("when", ["loading", "at work"])
def test_an_interruption_of_all_processes_is_told_by_the_parent_alone(tmp_path: Path, when: str) -> None:
    """As Ctrl-C does it, also while the others still load what they need."""
    (tmp_path / "parent.py").write_text(INTERRUPTED)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    command = [sys.executable, str(tmp_path / "parent.py"), when]
    parent = subprocess.Popen(
        command, env=environment, start_new_session=True, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    assert parent.stdout is not None
    assert parent.stdout.readline().startswith(when)
    os.killpg(parent.pid, signal.SIGINT)
    _, said = parent.communicate(timeout=300.0)
    assert said.count("Traceback") == 1, said
    assert said.rstrip().endswith("KeyboardInterrupt")


ORPHANS = """
from fibrefit.series.engines import in_processes
from tests.series import work
if __name__ == "__main__":
    for done in in_processes(work.slow, [0.0, 60.0], 1):
        print(done.outcome, flush=True)
"""


def test_no_process_outlives_its_parent(tmp_path: Path) -> None:
    (tmp_path / "parent.py").write_text(ORPHANS)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    parent = subprocess.Popen([sys.executable, str(tmp_path / "parent.py")], stdout=subprocess.PIPE, env=environment)
    assert parent.stdout is not None
    child = int(parent.stdout.readline())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    parent.stdout.close()
    for _ in range(100):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        if Path(f"/proc/{child}/stat").exists() and Path(f"/proc/{child}/stat").read_text().split()[2] == "Z":
            return
        time.sleep(0.1)
    os.kill(child, signal.SIGKILL)
    pytest.fail("the process is still there")


@pytest.mark.extra("distributed")
def test_a_cluster_does_the_same() -> None:
    script = (
        "from distributed import LocalCluster\n"
        "from fibrefit.series.engines import on_cluster\n"
        "from tests.series import work\n"
        "if __name__ == '__main__':\n"
        "    how = {'n_workers': 1, 'threads_per_worker': 2, 'processes': False, 'dashboard_address': None}\n"
        "    with LocalCluster(**how) as cluster:\n"
        "        found = sorted(on_cluster(work.doubled, list(range(5)), cluster.scheduler_address))\n"
        "        print([(n, x, type(e).__name__) for n, x, e in found])\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.stdout.strip() == (
        "[(0, 0, 'NoneType'), (1, 2, 'NoneType'), (2, 4, 'NoneType'), (3, None, 'ValueError'), (4, 8, 'NoneType')]"
    ), done.stderr


@pytest.mark.extra("distributed")
def test_a_cluster_that_does_not_answer_is_refused() -> None:
    script = (
        "import fibrefit.series.engines as e; from tests.series import work; e.PATIENCE = 0.5\n"
        "try: list(e.on_cluster(work.doubled, [1], 'tcp://127.0.0.1:9'))\n"
        "except Exception as error: print(type(error).__name__, error)\n"
    )
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, cwd=ROOT, check=False)
    assert done.stdout.startswith("UsageError --scheduler tcp://127.0.0.1:9"), done.stderr


def test_without_its_package_it_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(UsageError, match=r"pip install 'fibrefit\[dask\]'"):
        list(on_cluster(work.doubled, [1], "tcp://nowhere:1"))
