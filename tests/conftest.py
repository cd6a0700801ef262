"""Property tests meet the same examples at every run, and compiled programs do not pile up from module to module."""

from __future__ import annotations

import gc
import os
import signal
import sys
from collections.abc import Iterator
from unittest.mock import patch

import psutil
import pytest
from hypothesis import settings

from fibrefit.core import programs
from tests.extras import need

settings.register_profile("same", derandomize=True)
settings.load_profile("same")

LARGEST = 2.5e9
"""Bytes of a process beyond which it forgets its programs at the end of a module; the next module has others."""
GARBAGE = (100_000, 50, 50)
"""How seldom garbage is looked for: as by the command line, once it has begun."""


def pytest_addoption(parser: pytest.Parser) -> None:
    """``--longest``, by which `make quick` leaves out what takes long; no list of such tests has to be kept."""
    parser.addoption("--longest", type=float, default=0.0, help="s after which a test, or a fixture, is skipped")


def pytest_configure(config: pytest.Config) -> None:
    """Of several processes each has one core: threads of one would wait for those of the others, ten times as long."""
    if config.getoption("numprocesses", None):
        for name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "NPROC"):
            os.environ.setdefault(name, "1")


def in_time(item: pytest.Item) -> Iterator[None]:
    """Skip the test if what comes next takes longer than a test may."""
    longest = item.config.getoption("longest")
    if not longest:
        return (yield)

    def skip(*_: object) -> None:
        pytest.skip(f"takes longer than {longest:g} s")

    signal.signal(signal.SIGALRM, skip)
    signal.setitimer(signal.ITIMER_REAL, longest)
    try:
        return (yield)
    finally:
        signal.setitimer(signal.ITIMER_REAL, 0.0)


pytest_runtest_call = pytest.hookimpl(wrapper=True)(in_time)


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Files of `workflow` take longest and come first: of two workers none waits long for the other at the end."""
    items.sort(key=lambda item: "workflow" not in item.path.parts)


def pytest_collection_finish() -> None:
    """What was collected stays to the end: it is never looked through for garbage."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*GARBAGE)


@pytest.hookimpl(wrapper=True)
def pytest_runtest_setup(item: pytest.Item) -> Iterator[None]:
    """A test of an extra asks for its package before its fixtures are made."""
    for marker in item.iter_markers("extra"):
        need(*marker.args)
    return (yield from in_time(item))


@pytest.fixture(scope="session", autouse=True)
def _kept_in_a_module() -> Iterator[None]:
    """Programs of one fit serve the next; a command forgets them once they are many, and tests would compile anew."""
    with patch.object(programs, "MOST_PROGRAMS", sys.maxsize):
        yield


@pytest.fixture(scope="module", autouse=True)
def _bounded() -> Iterator[None]:
    if not gc.get_freeze_count():
        gc.freeze()
    yield
    if psutil.Process().memory_info().rss > LARGEST:
        with patch.object(programs, "MOST_PROGRAMS", 0):
            programs.bound_programs()
