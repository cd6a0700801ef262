"""``report``: results as one page that needs no other file."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from fibrefit.core.errors import DataError, UsageError
from fibrefit.report.page import Result, page
from fibrefit.store import read_summary, write_whole

FIRST = ("corner", "gap", "parameters", "prior", "snaps", "places", "candidates")
"""Figures that come first, where they are."""


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

    Returns
    -------
    pathlib.Path
        The page.

    Raises
    ------
    UsageError
        If the page is there already, or cannot be written.
    DataError
        If a folder holds no result.
    """
    file = page_file(Path(out), force)
    results = [_read(Path(folder)) for folder in folders]
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
        If it exists and may not be replaced.
    """
    file = out / "report.html" if out.is_dir() or not out.suffix else out
    if file.exists() and not force:
        raise UsageError(str(file), "exists already", "a new file", "Add --force to replace it, or name another --out.")
    return file


def _read(folder: Path) -> Result:
    summary = read_summary(folder)
    pictures = folder / "figures" if folder.is_dir() else folder.parent / "figures"
    try:
        paths = sorted(pictures.glob("*.png"), key=_order)
        figures = [(path.stem.replace("_", " "), path.read_bytes()) for path in paths]
    except OSError as error:
        raise DataError(str(pictures), error.strerror or "cannot be read", "figures of a result") from None
    return Result(folder.as_posix(), summary, figures)


def _order(path: Path) -> tuple[int, list[tuple[int, int, str]]]:
    """Overviews first, then by name, with numbers in their order: ``drop_5mm`` before ``drop_10mm``."""
    first = FIRST.index(path.stem) if path.stem in FIRST else len(FIRST)
    parts = re.findall(r"\d+|\D+", path.stem)
    return first, [(0, int(part), "") if part.isdigit() else (1, 0, part) for part in parts]
