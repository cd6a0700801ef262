"""As which files figures are written, for all that is written in one call."""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar

from fibrefit.core.errors import UsageError, did_you_mean

FORMATS = ("png", "pdf", "svg")
"""Kinds of files that figures can be written as."""
NONE = "none"

FIGURES: ContextVar[tuple[str, ...] | None] = ContextVar("FIGURES", default=None)
"""Those asked for; none at all is possible too. None: nobody has asked, and a result draws what shows it best."""


def formats_asked() -> tuple[str, ...]:
    """Formats to write figures as: PNG unless others, or none, were asked for."""
    asked = FIGURES.get()
    return ("png",) if asked is None else asked


def figure_formats(text: str) -> tuple[str, ...]:
    """Formats from a list with commas, such as ``pdf,svg``; ``none`` for no figures.

    Raises
    ------
    UsageError
        If one is not known.
    """
    asked: Sequence[str] = [word.strip().lower() for word in text.split(",") if word.strip()]
    if list(asked) == [NONE]:
        return ()
    for word in asked or [text]:
        if word not in FORMATS:
            expected = f"{', '.join(FORMATS)}, separated by commas, or {NONE}"
            raise UsageError("--figures", word or "nothing", expected, did_you_mean(word, FORMATS))
    return tuple(dict.fromkeys(asked))
