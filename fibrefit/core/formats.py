"""As which files figures are written, for all that is written in one call."""

from __future__ import annotations

from collections.abc import Sequence
from contextvars import ContextVar

from fibrefit.core.errors import UsageError, did_you_mean

FORMATS = ("png", "pdf", "svg")
"""Kinds of files that figures can be written as."""
NONE = "none"

FIGURES: ContextVar[tuple[str, ...]] = ContextVar("FIGURES", default=("png",))
"""Those asked for; none at all is possible too."""


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
