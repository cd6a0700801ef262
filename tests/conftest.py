"""Property tests meet the same examples at every run, and compiled programs do not pile up from module to module."""

from __future__ import annotations

import gc
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

LARGEST = 2e9
"""Bytes of a process beyond which it forgets its programs at the end of a module; the next module has others."""
GARBAGE = (100_000, 50, 50)
"""How seldom garbage is looked for: as by the command line, once it has begun."""


def pytest_collection_finish() -> None:
    """What was collected stays to the end: it is never looked through for garbage."""
    gc.collect()
    gc.freeze()
    gc.set_threshold(*GARBAGE)


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test of an extra asks for its package before its fixtures are made."""
    for marker in item.iter_markers("extra"):
        need(*marker.args)


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
