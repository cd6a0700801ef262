"""``report``: results as one page that needs no other file."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from urllib.parse import quote

from fibrefit.core.errors import DataError, FibrefitError, UsageError
from fibrefit.core.paths import path_from, write_whole
from fibrefit.report.page import Illustration, Result, page
from fibrefit.store import read_result, read_summary
from fibrefit.study.summaries.discovery import DiscoverySummary
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import FitSummary, PosteriorSummary
from fibrefit.study.summaries.series import BatchSummary
from fibrefit.workflow.outcome.draw import figures_of

CHOSEN: dict[type[Part], tuple[str, ...]] = {
    FitSummary: ("overview", "snaps", "correlation", "errors", "starts"),
    DiscoverySummary: ("overview", "curve", "places", "states", "map", "spectrum"),
    PosteriorSummary: ("corner", "traces", "prior"),
    BatchSummary: ("parameters",),
}
"""Figures that belong on the page of a kind of result; of other kinds, all up to `MOST_PICTURES`."""
MOST_PICTURES = 6
GENERATOR, HEAD = b'<meta name="generator" content="fibrefit', 4096
"""What stands in the head of every page, and the bytes in which it does."""


def report_results(folders: Sequence[Path | str], out: Path | str, *, force: bool = False) -> Path:
    """Write the page of some results.

    Parameters
    ----------
    folders : sequence of pathlib.Path or str
        Folders of results of any kind.
    out : pathlib.Path or str
        The page; in a folder it is called ``report.html``.
    force : bool
        Replace what is there.

    Raises
    ------
    UsageError
        If the page is there already, or cannot be written.
    DataError
        If a folder holds no result.
    """
    file = page_file(Path(out), force)
    results = [_read(Path(folder), file.parent) for folder in folders]
    title = "fibrefit: " + (Path(folders[0]).resolve().name if len(folders) == 1 else f"{len(folders)} results")
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        write_whole(file, page(results, title))
    except OSError as error:
        raise UsageError(str(file), error.strerror or "cannot be written", "a file to write to") from None
    return file


def page_file(out: Path, force: bool) -> Path:
    """File of the page, refused before any work is done for it.

    Raises
    ------
    UsageError
        If it exists and may not be replaced, or is no page of ours: that is not replaced whatever is said.
    """
    file = out / "report.html" if out.is_dir() or not out.suffix else out
    there = Path(os.path.realpath(file))
    if file.is_symlink() and not there.exists():
        raise UsageError(str(file), f"is a link to {there}, which does not exist", "a file", "Name another --out.")
    if file.exists() and not force:
        raise UsageError(str(file), "exists already", "a new file", "Add --force to replace it, or name another --out.")
    if file.exists() and not _is_page(there):
        do = "Nothing was removed. Move it, or name another --out."
        raise UsageError(str(file), "is no page of this program", "a new file, or an earlier page", do)
    return there if file.is_symlink() else file


def _is_page(file: Path) -> bool:
    if not os.path.isfile(file):
        return False
    try:
        with file.open("rb") as page:
            return GENERATOR in page.read(HEAD)
    except OSError:
        return False


def _read(result: Path, beside: Path) -> Result:
    """A result from its folder, or from its summary alone."""
    summary = read_summary(result)
    folder = result if result.is_dir() else result.parent
    groups = read_result(folder / "result.h5")[0] if (folder / "result.h5").is_file() else {}
    items = _items(summary, folder)
    link = quote(path_from(beside, folder))
    return Result(result.as_posix(), summary, _pictures(summary, groups, folder), groups, items, link)


def _pictures(summary: Part, groups: Mapping, folder: Path) -> list[Illustration]:
    """The figures that belong on the page: as they lie in the folder; those that do not, drawn from what was saved."""
    chosen = CHOSEN.get(type(summary))
    files = {path.stem: path for path in sorted((folder / "figures").glob("*.png"), key=_order)}
    names = [name for name in (chosen or files) if name in files][:MOST_PICTURES]
    pictures = [(name, *_small(files[name])) for name in names]
    if chosen and (missing := [name for name in chosen if name not in files]):
        pictures += _drawn(summary, groups, missing)
        pictures.sort(key=lambda picture: chosen.index(picture[0]))
    return [Illustration(name, caption or name.replace("_", " "), png) for name, png, caption in pictures]


def _small(file: Path) -> tuple[bytes, str]:
    from fibrefit.plots.shrink import small_png

    try:
        return small_png(file.read_bytes())
    except OSError as error:
        got = error.strerror or "is damaged, or no picture"
        raise DataError(str(file), got, "a figure of a result", "Remove that file.") from None


def _drawn(summary: Part, groups: Mapping, chosen: Sequence[str]) -> list[tuple[str, bytes, str]]:
    from fibrefit.plots.save import figure_file
    from fibrefit.plots.shrink import small_png

    figures: Mapping = figures_of(summary, groups) or {}
    there = {name: figures[words] for name in chosen if (words := name.replace("_", " ")) in figures}
    return [(name, *small_png(figure_file(figure))) for name, figure in there.items()]


def _order(path: Path) -> list[tuple[int, int, str]]:
    """By name, with numbers in their order: ``drop_5mm`` before ``drop_10mm``."""
    return [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in re.findall(r"\d+|\D+", path.stem)]


def _items(summary: Part, folder: Path) -> dict[str, Part]:
    """Summaries of the items of a batch, of those that have one."""
    if not isinstance(summary, BatchSummary):
        return {}
    found = {}
    for name, item in summary.items.items():
        try:
            found[name] = read_summary(folder / (item.result or ""))
        except FibrefitError:
            # The table has what the batch itself says of it.
            continue
    return {name: one for name, one in found.items() if one != summary}
