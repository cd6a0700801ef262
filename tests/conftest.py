"""Property tests meet the same examples at every run, and compiled programs do not pile up from module to module."""

from __future__ import annotations

from collections.abc import Iterator
from unittest.mock import patch

import psutil
import pytest
from hypothesis import settings

from fibrefit.core.programs import bound
from tests.extras import need

settings.register_profile("same", derandomize=True)
settings.load_profile("same")

LARGEST = 1.5e9
"""Bytes of a process beyond which it forgets its programs at the end of a module; the next module has others."""


@pytest.hookimpl(tryfirst=True)
def pytest_runtest_setup(item: pytest.Item) -> None:
    """A test of an extra asks for its package before its fixtures are made."""
    for marker in item.iter_markers("extra"):
        need(*marker.args)


@pytest.fixture(scope="module", autouse=True)
def _bounded() -> Iterator[None]:
    yield
    if psutil.Process().memory_info().rss > LARGEST:
        with patch.object(bound, "MOST_PROGRAMS", 0):
            bound.bound_programs()
