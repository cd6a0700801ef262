"""A batch on a Dask cluster whose workers and scheduler are killed: nothing twice, the same table bit for bit."""

from __future__ import annotations

import json
import os
import shutil
import signal
import socket
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest

pytestmark = pytest.mark.extra("distributed")

SERIES = Path(__file__).resolve().parents[2] / "configs" / "drop_series"
ITEMS = 10
PATIENCE = 600.0


class Cluster:
    """A scheduler and workers on this machine, each a process of its own."""

    def __init__(self, folder: Path) -> None:
        with socket.socket() as free:
            free.bind(("127.0.0.1", 0))
            self.port = free.getsockname()[1]
        self.address = f"tcp://127.0.0.1:{self.port}"
        self.folder = folder
        self.scheduler = self._begin("scheduler", "--host", "127.0.0.1", "--port", str(self.port))
        self.workers: list[subprocess.Popen[bytes]] = []

    def _begin(self, what: str, *words: str) -> subprocess.Popen[bytes]:
        command = [sys.executable, "-m", f"distributed.cli.dask_{what}", *words, "--no-dashboard"]
        null = subprocess.DEVNULL
        return subprocess.Popen(command, cwd=self.folder, stdin=null, stdout=null, stderr=null)

    def add_worker(self, threads: int = 1) -> None:
        words = (self.address, "--host", "127.0.0.1", "--nthreads", str(threads), "--no-nanny")
        self.workers.append(self._begin("worker", *words))

    def close(self) -> None:
        for process in (self.scheduler, *self.workers):
            if process.poll() is None:
                process.kill()
            process.wait()


@pytest.fixture
def cluster(tmp_path: Path) -> Iterator[Cluster]:
    """Begun without workers."""
    (tmp_path / "cluster").mkdir()
    made = Cluster(tmp_path / "cluster")
    try:
        yield made
    finally:
        made.close()


@pytest.fixture
def series(tmp_path: Path) -> Path:
    """Ten records: those of the drop series, and each of them again from its second reading on."""
    folder = Path(shutil.copytree(SERIES, tmp_path / "series"))
    text = (folder / "study.toml").read_text("utf-8")
    head, *records = text.split("[[records]]")
    records[-1] += "\n"
    for file in SERIES.glob("*.csv"):
        first, _, *rest = file.read_text("utf-8").splitlines(keepends=True)
        (folder / f"again_{file.name}").write_text("".join([first, *rest]), "utf-8")
    again = [record.replace('file = "', 'file = "again_') for record in records]
    (folder / "study.toml").write_text("[[records]]".join([head, *records, *again]), "utf-8")
    return folder


def batch(series: Path, out: Path, *words: str) -> subprocess.Popen[str]:
    command = [sys.executable, "-m", "fibrefit", "batch", str(series), "--out", str(out), "--starts", "1", *words]
    return subprocess.Popen(command, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, cwd=series)


def finished(process: subprocess.Popen[str]) -> str:
    _, said = process.communicate(timeout=PATIENCE)
    assert process.returncode in (0, 5), said
    return said


def done_in(out: Path) -> dict[str, int]:
    """Items that are done, and when each was written."""
    found = [*out.with_name(f"{out.name}.partial").glob("items/*/item.json"), *out.glob("items/*/item.json")]
    return {path.parent.name: path.stat().st_mtime_ns for path in found}


def wait_for(out: Path, number: int) -> None:
    began = time.perf_counter()
    while len(done_in(out)) < number:
        assert time.perf_counter() - began < PATIENCE, f"{len(done_in(out))} of {number} items"
        time.sleep(0.05)


@pytest.mark.slow
def test_the_table_does_not_hang_on_who_computes_nor_on_who_is_killed(
    tmp_path: Path, series: Path, cluster: Cluster
) -> None:
    finished(batch(series, tmp_path / "one", "--jobs", "1"))
    expected = (tmp_path / "one" / "results.csv").read_bytes()
    assert len(expected.splitlines()) == ITEMS + 1

    # Two processes, one of which is killed.
    two = tmp_path / "two"
    running = batch(series, two, "--jobs", "2")
    wait_for(two, 2)
    victim = _children(running.pid)[-1]
    os.kill(victim, signal.SIGKILL)
    finished(running)
    assert (two / "results.csv").read_bytes() == expected

    # Threads of one worker.
    cluster.add_worker(threads=2)
    threads = tmp_path / "threads"
    finished(batch(series, threads, "--scheduler", cluster.address))
    assert (threads / "results.csv").read_bytes() == expected

    # Two workers, one of which is killed; then the scheduler; then on from there with another.
    cluster.add_worker()
    cluster.add_worker()
    out = tmp_path / "killed"
    running = batch(series, out, "--scheduler", cluster.address)
    wait_for(out, 2)
    cluster.workers[1].kill()
    wait_for(out, 4)
    cluster.scheduler.kill()
    _, said = running.communicate(timeout=PATIENCE)
    assert running.returncode == 2, said
    assert "was lost during the run" in said
    assert "--resume goes on" in said
    before = done_in(out)
    assert len(before) >= 4
    last = Cluster(tmp_path / "cluster")
    try:
        last.add_worker()
        said = finished(batch(series, out, "--scheduler", last.address, "--resume"))
    finally:
        last.close()
    assert f"{len(before)} of {ITEMS} had been done before" in said
    after = done_in(out)
    assert len(after) == ITEMS
    assert {name: after[name] for name in before} == before, "no item was carried out twice"
    assert (out / "results.csv").read_bytes() == expected
    items = json.loads((out / "summary.json").read_text("utf-8"))["items"]
    assert len(items) == ITEMS
    print(
        f"\nbatch of {ITEMS}: same table for 1 process, 2 (one killed), 2 threads, 3 workers (worker, scheduler killed)"
    )


def _children(pid: int) -> list[int]:
    """Processes of the pool that a batch has begun."""
    import psutil

    spawned = [child for child in psutil.Process(pid).children() if "spawn_main" in " ".join(child.cmdline())]
    return [child.pid for child in spawned]


def test_a_lost_scheduler_is_said(cluster: Cluster) -> None:
    from fibrefit.core.errors import UsageError
    from fibrefit.series.engines import on_cluster

    cluster.add_worker()
    seen = []
    with pytest.raises(UsageError, match="was lost during the run"):
        for done in on_cluster(time.sleep, [0.01, 0.01, 60.0, 60.0], cluster.address):
            seen.append(done.number)
            if len(seen) == 2:
                cluster.scheduler.kill()
    assert sorted(seen) == [0, 1]


def test_a_worker_that_is_killed_loses_nothing(cluster: Cluster) -> None:
    from fibrefit.series.engines import on_cluster

    cluster.add_worker()
    seen = []
    for done in on_cluster(time.sleep, [0.01, 0.01, 1.0, 1.0], cluster.address):
        seen.append(done.number)
        if len(seen) == 2:
            cluster.add_worker()
            cluster.workers[0].kill()
        assert done.error is None
    assert sorted(seen) == [0, 1, 2, 3]
