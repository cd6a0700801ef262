"""Figures as files."""

from __future__ import annotations

import io
import re
import unicodedata
from collections.abc import Callable, Mapping
from pathlib import Path

from matplotlib.figure import Figure
from matplotlib.text import Text

LONGEST = 80

#: Names that mean a device, not a file, on some systems.
DEVICES = {"con", "prn", "aux", "nul", *(f"{port}{i}" for port in ("com", "lpt") for i in range(1, 10))}


def save_figures(figures: Mapping[str, Figure], folder: Path, stop: Callable[[], bool] = lambda: False) -> list[Path]:
    """Write every figure as ``<name>.png``.

    Parameters
    ----------
    figures : mapping of str to matplotlib.figure.Figure
        By name; signs that a file system may refuse are replaced, names that would then be equal are numbered.
    folder : pathlib.Path
        Made where it does not exist.
    stop : callable
        Asked before each figure whether to leave out the rest of them.

    Returns
    -------
    list of pathlib.Path
        The files, in the order of the figures.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / f"{stem}.png" for stem in file_names(list(figures))]
    written = []
    for path, figure in zip(paths, figures.values(), strict=True):
        if stop():
            break
        path.write_bytes(png_of(figure))
        written.append(path)
    return written


def png_of(figure: Figure) -> bytes:
    """A figure as PNG, its texts as they stand: a heading of a file may hold half a formula."""
    for text in figure.findobj(Text):
        text.set_parse_math(False)
    drawn = io.BytesIO()
    figure.savefig(drawn, format="png")
    return drawn.getvalue()


def file_names(names: list[str]) -> list[str]:
    """Names fit for any file system, one for each of `names` and no two alike, even where case does not count."""
    taken: set[str] = set()
    found = []
    for name in names:
        stem = first = _plain(name)
        number = 2
        while stem.casefold() in taken:
            stem, number = f"{first}_{number}", number + 1
        taken.add(stem.casefold())
        found.append(stem)
    return found


def _plain(name: str) -> str:
    ascii_only = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    stem = re.sub(r"[^A-Za-z0-9_-]+", "_", ascii_only).strip("_-")[:LONGEST] or "figure"
    return f"{stem}_" if stem.casefold() in DEVICES else stem
