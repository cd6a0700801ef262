"""What these tests share."""

from __future__ import annotations

from tests.cli.conftest import fibrefit

__all__ = ["fibrefit"]
