"""As which files figures are written, for all that is written in one call."""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar

from fibrefit.core.errors import UsageError, did_you_mean

FORMATS = ("png", "pdf", "svg")
"""Kinds of files that figures can be written as."""
NONE = "none"

FIGURES: ContextVar[tuple[str, ...] | None] = ContextVar("FIGURES", default=None)
"""Those requested; none at all is possible too. None: nothing was requested, and a result draws what shows it best."""


def requested_formats() -> tuple[str, ...]:
    """Formats to write figures as: PNG unless others, or none, were requested."""
    requested = FIGURES.get()
    return ("png",) if requested is None else requested


def figure_formats(text: str) -> tuple[str, ...]:
    """Formats from a list with commas, such as ``pdf,svg``; ``none`` for no figures.

    Raises
    ------
    UsageError
        If one is not known.
    """
    requested: Sequence[str] = [word.strip().lower() for word in text.split(",") if word.strip()]
    if list(requested) == [NONE]:
        return ()
    for word in requested or [text]:
        if word not in FORMATS:
            expected = f"{', '.join(FORMATS)}, separated by commas, or {NONE}"
            raise UsageError("--figures", word or "nothing", expected, did_you_mean(word, FORMATS))
    return tuple(dict.fromkeys(requested))
