"""Pieces of work carried out in processes of their own, each for as long as it is allowed at most."""

from __future__ import annotations

import math
import multiprocessing
import time
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field
from multiprocessing.connection import Connection, wait
from pathlib import Path
from typing import Any, NamedTuple

LIFETIME = 12
"""Pieces of work after which a process is replaced: compiled programs pile up in it."""
CONTEXT = multiprocessing.get_context("spawn")


class Done(NamedTuple):
    """A piece of work and what came of it; None where it took too long or its process died.

    Parameters
    ----------
    job : as it was handed over
    result : of the function
    seconds : by the clock, until it ended or was ended
    """

    job: Any
    result: Any
    seconds: float


def most_memory(since: bool = False) -> float:
    """GB that this process has held at most since it was asked to count anew; nan where the system does not tell.

    Parameters
    ----------
    since : bool
        Whether to begin to count anew.
    """
    try:
        if since:
            Path("/proc/self/clear_refs").write_text("5")
        lines = Path("/proc/self/status").read_text().splitlines()
        return next(float(line.split()[1]) / 1e6 for line in lines if line.startswith("VmHWM"))
    except (OSError, StopIteration):
        return math.nan


def _serve(function: Callable[[Any], Any], line: Connection) -> None:
    # What the function needs has been imported: its time begins to count.
    line.send(None)
    while (job := line.recv()) is not None:
        line.send(function(job))


@dataclass
class _Worker:
    """A process that works on one piece at a time."""

    function: Callable[[Any], Any]
    job: Any = None
    began: float = 0.0
    served: int = 0
    line: Connection = field(init=False)
    process: Any = field(init=False)

    def __post_init__(self) -> None:
        self.line, other = CONTEXT.Pipe()
        self.process = CONTEXT.Process(target=_serve, args=(self.function, other), daemon=True)
        self.process.start()
        other.close()
        self.line.recv()

    def take(self, job: Any) -> None:
        self.job, self.began = job, time.perf_counter()
        self.served += 1
        self.line.send(job)

    def give(self) -> Done:
        try:
            result = self.line.recv()
        except (EOFError, ConnectionError):
            result, self.served = None, LIFETIME
        return Done(self.job, result, time.perf_counter() - self.began)

    def end(self) -> None:
        self.process.kill()
        self.process.join()
        self.line.close()


def carried_out(function: Callable[[Any], Any], jobs: Iterable[Any], processes: int, limit: float) -> Iterator[Done]:
    """Results as they come, the quickest first.

    Parameters
    ----------
    function : importable, of one argument; neither may be None
    jobs : what it is called with
    processes : number that work side by side
    limit : s one job may take; its process is ended then
    """
    left, workers = iter(jobs), []
    try:
        for job in left:
            workers.append(_Worker(function))
            workers[-1].take(job)
            if len(workers) == processes:
                break
        while workers:
            soonest = min(worker.began for worker in workers) + limit - time.perf_counter()
            ready = wait([worker.line for worker in workers], max(soonest, 0.0))
            for worker in list(workers):
                late = time.perf_counter() - worker.began > limit
                if worker.line not in ready and not late:
                    continue
                done = worker.give() if worker.line in ready else Done(worker.job, None, limit)
                workers.remove(worker)
                job = next(left, None)
                if job is None or done.result is None or worker.served >= LIFETIME:
                    worker.end()
                    worker = _Worker(function) if job is not None else None
                if worker is not None:
                    worker.take(job)
                    workers.append(worker)
                yield done
    finally:
        for worker in workers:
            worker.end()
