"""Figures as files."""

from __future__ import annotations

import io
import re
import unicodedata
import warnings
from collections.abc import Callable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from matplotlib.artist import Artist
from matplotlib.axis import Axis
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.ticker import Formatter

from fibrefit.core.formatting import harmless
from fibrefit.core.paths import numbered_stems, requested_formats, safe_stem, without_end, write_whole
from fibrefit.plots.style import caption_of, in_own_style

PACKED = 3
"""How hard a PNG is packed, of 9: the usual 6 takes half as long again for two in a hundred of its size."""


def save_figures(
    figures: Mapping[str, Figure],
    folder: Path,
    stop: Callable[[], bool] = lambda: False,
    formats: Sequence[str] | None = None,
) -> list[Path]:
    """Write every figure as ``<name>.png``, with its caption inside, and in other formats where they are requested.

    Parameters
    ----------
    figures : mapping of str to matplotlib.figure.Figure
        By name; signs that a file system may refuse are replaced, names that would then be equal are numbered.
    folder : pathlib.Path
        Made where it does not exist.
    stop : callable
        Asked before each figure whether to leave out the rest of them.
    formats : sequence of str, optional
        Some of `fibrefit.core.paths.FORMATS`; what was requested on the command line, or PNG, unless said.

    Returns
    -------
    list of pathlib.Path
        The files, in the order of the figures.
    """
    kinds = requested_formats() if formats is None else formats
    if kinds:
        folder.mkdir(parents=True, exist_ok=True)
    written = []
    for paths, figure in zip(figure_paths(list(figures), folder, kinds), figures.values(), strict=True):
        if stop():
            break
        for path, kind in zip(paths, kinds, strict=True):
            write_whole(path, figure_file(figure, kind))
        written += paths
    return written


def figure_paths(names: Sequence[str], folder: Path, formats: Sequence[str]) -> list[list[Path]]:
    """Files of each figure in a folder, one for each format."""
    stems = file_names([without_end(name) for name in names])
    return [[folder / f"{stem}.{kind}" for kind in formats] for stem in stems]


@in_own_style
def figure_file(figure: Figure, kind: str = "png") -> bytes:
    """A figure as a file with its caption inside, its texts as they stand: a heading may hold half a formula."""
    for text in _texts(figure):
        text.set_parse_math(False)
        text.set_text(harmless(text.get_text()))
    drawn = io.BytesIO()
    with warnings.catch_warnings():
        # A sign of a name that the font lacks is an empty box in the picture, and nothing a user could mend.
        warnings.filterwarnings("ignore", r"Glyph \d+", UserWarning)
        how: dict[str, Any] = {"pil_kwargs": {"compress_level": PACKED}} if kind == "png" else {}
        figure.savefig(drawn, format=kind, metadata=_metadata(kind, harmless(caption_of(figure))), **how)
    return drawn.getvalue()


def _texts(artist: Artist) -> Iterator[Text]:
    """Texts of a figure but the names and numbers of axes, which are made anew whenever it is drawn."""
    if isinstance(artist, Text):
        yield artist
    elif isinstance(artist, Axis):
        yield from (artist.label, artist.offsetText)
        for formatter in (artist.get_major_formatter(), artist.get_minor_formatter()):
            formatter.format_ticks = partial(_harmless_marks, formatter)  # type: ignore[method-assign]
    else:
        for child in artist.get_children():
            yield from _texts(child)


def _harmless_marks(formatter: Formatter, places: list[float]) -> list[str]:
    return [harmless(said) for said in type(formatter).format_ticks(formatter, places)]


def _metadata(kind: str, caption: str) -> dict[str, str | None]:
    """The caption where each format has room for it; without the date, so that the same figure is the same file."""
    if kind == "pdf":
        return {"Title": caption, "CreationDate": None}
    return {"Description": caption} if kind == "png" else {"Description": caption, "Date": None}


def file_names(names: list[str]) -> list[str]:
    """Names fit for any file system, one for each of `names` and no two alike, even where case does not count."""
    return numbered_stems(_plain(name) for name in names)


def _plain(name: str) -> str:
    ascii_only = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    return safe_stem(re.sub(r"[^A-Za-z0-9_-]+", "_", ascii_only).strip("_-")) or "figure"
