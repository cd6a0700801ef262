"""Work shared out among threads: one each for linear algebra, records side by side, programs made in the background."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import ContextVar, copy_context
from functools import cache, wraps
from typing import Any, ParamSpec, TypeVar

P = ParamSpec("P")
R = TypeVar("R")
THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
"""Cores this process may use."""
UNWAITED: ContextVar[bool] = ContextVar("UNWAITED", default=False)
"""Whether a thread makes programs that nothing waits for: they take no time from what goes on beside them."""


def one_blas_thread(function: Callable[P, R]) -> Callable[P, R]:
    """A function during which NumPy's and SciPy's linear algebra keeps to the thread that asks for it.

    Threads of BLAS beside those of the work wait for each other: where other work keeps the cores busy, eigenvalues of
    a matrix of 600 rows take 5 s of processor time in place of 0.04 s. And sums that are split by the number of cores
    differ from machine to machine in their last digits.
    """

    @wraps(function)
    def alone(*args: P.args, **kwargs: P.kwargs) -> R:
        with _libraries().limit(limits=1, user_api="blas"):
            return function(*args, **kwargs)

    return alone


@cache
def _libraries() -> Any:
    """What is loaded; to look for it takes as long as reading a small record."""
    import scipy.linalg  # noqa: F401  its library is limited only once it is loaded
    from threadpoolctl import ThreadpoolController

    return ThreadpoolController()


@contextmanager
def thread_pool(number: int) -> Iterator[ThreadPoolExecutor]:
    """Threads that begin nothing more once the block is left by an exception; by Ctrl-C, they are not waited for."""
    pool = ThreadPoolExecutor(number)
    try:
        yield pool
    except BaseException as error:
        pool.shutdown(wait=not isinstance(error, KeyboardInterrupt), cancel_futures=True)
        raise
    pool.shutdown()


def for_each(job: Callable[..., R], *of: Iterable[Any]) -> list[R]:
    """Results of a job for each record, in their order; a time limit around it holds in each of its threads.

    Parameters
    ----------
    job : callable
        Of one element of each sequence.
    *of : iterable
        One for each argument, all of the same length.
    """
    jobs = list(zip(*of, strict=True))
    if THREADS == 1 or len(jobs) < 2:
        return [job(*each) for each in jobs]
    with thread_pool(min(THREADS, len(jobs))) as pool:
        return list(pool.map(lambda context, each: context.run(job, *each), [copy_context() for _ in jobs], jobs))


@contextmanager
def in_background(jobs: Iterable[Callable[[], Any]]) -> Iterator[None]:
    """Make programs, one after the other, in a thread of their own while the block goes on.

    What is not begun when the block is left is not made; with one core nothing is. What cannot be made fails where it
    is needed.

    Parameters
    ----------
    jobs : iterable of callable
    """
    pool = ThreadPoolExecutor(1, initializer=UNWAITED.set, initargs=(True,))
    for job in jobs if THREADS > 1 else ():
        pool.submit(job)
    try:
        yield
    finally:
        pool.shutdown(wait=False, cancel_futures=True)
