"""Many independent pieces of work: in this process, in processes beside it, or on a Dask cluster.

A piece of work is a function and an argument that can be pickled. What it raises is its outcome, and ends nothing else.
"""

from __future__ import annotations

import gc
import logging
import multiprocessing
import os
import signal
import threading
from collections import deque
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import FIRST_COMPLETED, CancelledError, Future, ProcessPoolExecutor, wait
from concurrent.futures.process import BrokenProcessPool
from contextlib import contextmanager, suppress
from multiprocessing.connection import Connection
from multiprocessing.synchronize import Event
from typing import Any, NamedTuple

from fibrefit.core.errors import UsageError

PATIENCE = 10.0
"""Time in which a scheduler must answer, in s."""


class Done(NamedTuple):
    """A piece of work that came to an end.

    Parameters
    ----------
    number : int
        Its place among the arguments.
    outcome : object
        What the function returned; None where it failed.
    error : Exception or None
    """

    number: int
    outcome: Any
    error: Exception | None = None


class ProcessDiedError(Exception):
    """The process that was at a piece of work ended without a word, and did so again when it had only that to do."""


Work = Callable[[Any], Any]


def in_this_process(work: Work, arguments: Sequence[Any]) -> Generator[Done, None, None]:
    """One after the other."""
    frozen_before = gc.get_freeze_count()
    try:
        for number, argument in enumerate(arguments):
            try:
                done = Done(number, _first_then_frozen(work, argument))
            except Exception as error:
                done = Done(number, None, error)
            yield done
    finally:
        if not frozen_before:
            gc.unfreeze()


def _first_then_frozen(work: Work, argument: Any) -> Any:
    """The work; what its first piece left (packages, programs) is not searched for garbage again, which takes long."""
    try:
        return work(argument)
    finally:
        if not gc.get_freeze_count():
            gc.freeze()


def in_processes(work: Work, arguments: Sequence[Any], processes: int) -> Generator[Done, None, None]:
    """In some processes of this machine, in the order in which they end.

    A process that dies takes no work with it: what was under way is tried again, each piece by itself. Where the
    iteration is interrupted or left early, what is under way is ended at once: nobody would take its outcome.

    Parameters
    ----------
    work : callable
        A function of a module.
    arguments : sequence
    processes : int

    Raises
    ------
    UsageError
        If no process comes to its work: each runs the script it was called from as far as nothing guards it.
    """
    waiting = deque(range(len(arguments)))
    while waiting:
        lost: list[int] = []
        yield from _until_one_dies(work, arguments, processes, waiting, lost)
        for number in lost:
            unlucky: list[int] = []
            yield from _until_one_dies(work, arguments, 1, deque([number]), unlucky)
            if unlucky:
                yield Done(number, None, ProcessDiedError("its process died, most likely for want of memory"))


def _until_one_dies(
    work: Work, arguments: Sequence[Any], processes: int, waiting: deque[int], lost: list[int]
) -> Iterator[Done]:
    """Work off what is `waiting`; where a process dies, what was under way is added to `lost`."""
    # JAX does not survive a fork.
    context = multiprocessing.get_context("spawn")
    began = context.Event()
    other_end, lifeline = context.Pipe(duplex=False)
    pool = ProcessPoolExecutor(processes, context, _begin, (other_end, began))
    running: dict[Future[Any], int] = {}
    try:
        while waiting or running:
            # Two more than are worked on: no process waits while an outcome is put away.
            while waiting and len(running) < processes + 2:
                with _interruptions_blocked():
                    running[pool.submit(_first_then_frozen, work, arguments[waiting[0]])] = waiting[0]
                waiting.popleft()
            for future in wait(running, return_when=FIRST_COMPLETED).done:
                number = running[future]
                try:
                    done = Done(number, future.result())
                except BrokenProcessPool:
                    raise
                except Exception as error:
                    done = Done(number, None, error)
                del running[future]
                yield done
    except BrokenProcessPool:
        if not began.is_set():
            raise UsageError(
                "processes", "none of them came to its work",
                'a script whose calls stand below if __name__ == "__main__"',
                "What each of them printed says why; with processes=1 there are none."
            ) from None  # fmt: skip
        lost += running.values()
    except BaseException:
        lifeline.close()
        raise
    finally:
        pool.shutdown(wait=True, cancel_futures=True)
        lifeline.close()
        other_end.close()


@contextmanager
def _interruptions_blocked() -> Iterator[None]:
    """Block in which a process may begin: Ctrl-C is for its parent, also while it still loads what it needs."""
    if not hasattr(signal, "pthread_sigmask"):  # Windows
        yield
        return
    before = signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGINT})
    try:
        yield
    finally:
        signal.pthread_sigmask(signal.SIG_SETMASK, before)


def _begin(lifeline: Connection, began: Event) -> None:
    """What a process does first: say so, leave interruptions to its parent, and end when that lets go of the line."""
    began.set()
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    # The programs of one record are small: threads that share them out wait for each other, a quarter of what such a
    # process does, and take it from the processes beside it. JAX reads the second where it first runs a program.
    for name in ("OMP_NUM_THREADS", "NPROC"):
        os.environ.setdefault(name, "1")

    def watch() -> None:
        # Nothing is ever sent: it ends when the other end is closed, by the parent or because that is gone.
        with suppress(EOFError, OSError):
            lifeline.recv_bytes()
        os._exit(1)

    threading.Thread(target=watch, daemon=True).start()


def on_cluster(work: Work, arguments: Sequence[Any], scheduler: str) -> Generator[Done, None, None]:
    """On the workers of a running Dask cluster, in the order in which they end.

    Parameters
    ----------
    work : callable
        A function of a module that the workers can import; files it reads must be where they are here.
    arguments : sequence
    scheduler : str
        Address, such as ``tcp://host:8786``.

    Raises
    ------
    UsageError
        If `distributed` is not installed, nobody answers, or the scheduler is lost on the way.
    """
    try:
        from distributed import Client, KilledWorker, as_completed
    except ImportError:
        raise UsageError(
            "scheduler",
            "the package distributed is not installed",
            "the extra dask",
            "Install it: pip install 'fibrefit[dask]'.",
        ) from None
    try:
        client = Client(scheduler, timeout=PATIENCE, set_as_default=False)
    except (OSError, TimeoutError, ValueError) as error:
        message = str(error).partition("\n")[0] or type(error).__name__
        raise UsageError(
            f"--scheduler {scheduler}", message, "a running Dask scheduler", "Check its address."
        ) from None
    # What it logs when a connection is lost is said in our own words.
    logging.getLogger("distributed").setLevel(logging.CRITICAL)
    try:
        futures = {client.submit(work, argument, pure=False): n for n, argument in enumerate(arguments)}
        for future in as_completed(list(futures), loop=client.loop):
            # A cluster keeps what somebody still holds.
            number, failed = futures.pop(future), future.exception()
            if isinstance(failed, CancelledError):
                raise failed
            if isinstance(failed, KilledWorker):  # a piece is begun anew on another worker where one dies
                failed = ProcessDiedError("each worker that was at it died, most likely for want of memory")
            yield Done(number, None if failed else future.result(), failed)
    except (CancelledError, OSError):
        raise UsageError(
            f"--scheduler {scheduler}", "was lost during the run", "a scheduler that stays", "Start one and go on."
        ) from None
    finally:
        client.close()
