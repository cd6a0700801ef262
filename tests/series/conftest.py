"""Trends without a look for garbage after each of them."""

from __future__ import annotations

from tests.workflow.conftest import seldom_collected

__all__ = ["seldom_collected"]
