"""How long work tells what it is doing."""

from __future__ import annotations

from collections.abc import Callable

Progress = Callable[[str, float | None], None]
"""Callback of long work: called with what is being done and the share that is finished, None where it is not known."""


def quiet(doing: str, share: float | None) -> None:
    """Progress that is reported to nobody."""
