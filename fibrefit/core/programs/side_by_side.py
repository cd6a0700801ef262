"""Work shared out by records: linear algebra runs without holding the interpreter."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from contextvars import copy_context
from typing import Any, TypeVar

from fibrefit.core.programs.longest import unwaited

R = TypeVar("R")
THREADS = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
"""Cores this process may use."""


@contextmanager
def threads(number: int) -> Iterator[ThreadPoolExecutor]:
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
    with threads(min(THREADS, len(jobs))) as pool:
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
    pool = ThreadPoolExecutor(1)
    for job in jobs if THREADS > 1 else ():
        pool.submit(_unwaited_for, job)
    try:
        yield
    finally:
        pool.shutdown(wait=False, cancel_futures=True)


def _unwaited_for(job: Callable[[], Any]) -> None:
    with unwaited():
        job()
