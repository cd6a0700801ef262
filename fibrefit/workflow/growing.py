"""The folder of a result that takes long: what was done survives whatever ends the run."""

from __future__ import annotations

import shutil
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory, Run


@contextmanager
def growing_folder(
    out: Path, kept: Sequence[str], *, force: bool = False, resume: bool = False, run: Run | None = None
) -> Iterator[ResultDirectory]:
    """Folder that takes the place of `out` at the end, with what an earlier run kept where it goes on.

    Parameters
    ----------
    out : pathlib.Path
        Folder of the result.
    kept : sequence of str
        Files and folders a run goes on from, or patterns of their names; without the last one, which is no pattern,
        there is nothing to go on from.
    force : bool
        Replace an earlier result, and forget a run that was cut short.
    resume : bool
        Go on with a run that was cut short, or with a finished one.
    run : Run, optional
        What the run rests on; it goes on only from the same.

    Raises
    ------
    UsageError
        If the folder may not be replaced, holds a run that was cut short and nobody said what to do with it, or
        another run than the one that is to go on; or if it is to be forgotten and gone on with at once.
    """
    if force and resume:
        do = "--resume goes on with what is there, --force begins anew."
        raise UsageError("--force", "--resume beside it", "one of the two", do)
    with ResultDirectory(out, force=force, resume=resume, keep=True, run=run) as directory:
        if resume:
            _tidy(directory.path)
            _take_over(directory.out, directory.path, kept)
        try:
            yield directory
        except BaseException:
            if not (directory.path / kept[-1]).exists():
                for path in (path for name in kept[:-1] for path in directory.path.glob(name)):
                    path.unlink()  # of no use alone
            raise


def _tidy(growing: Path) -> None:
    """Remove what a run that was killed had half written: nothing reads it."""
    for half in growing.rglob(".*.tmp"):
        half.unlink(missing_ok=True)
    for half in growing.glob(".*.copy"):
        shutil.rmtree(half) if half.is_dir() else half.unlink()


def _take_over(finished: Path, growing: Path, kept: Sequence[str]) -> None:
    """Copy what a finished run kept; the last of it tells that all is there."""
    if (growing / kept[-1]).exists() or not (finished / kept[-1]).exists():
        return
    for path in (path for name in kept for path in sorted(finished.glob(name))):
        half = growing / f".{path.name}.copy"
        if path.is_dir():
            shutil.copytree(path, half)
        else:
            shutil.copyfile(path, half)
        half.replace(growing / path.name)
