"""Packages of extras that `make test` leaves out: without one its tests are skipped, and fail in `make test-extras`."""

from __future__ import annotations

import os

import pytest

REQUIRED = "FIBREFIT_EXTRAS_REQUIRED"
"""Environment variable under which a missing package is a failure."""


def need(package: str) -> None:
    """Go on only if a package can be imported."""
    try:
        pytest.importorskip(package)
    except pytest.skip.Exception as skipped:
        if REQUIRED in os.environ:
            pytest.fail(str(skipped), pytrace=False)
        raise
