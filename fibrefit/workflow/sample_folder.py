"""The folder of a posterior while its chains grow: what was done survives whatever ends the run."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory
from fibrefit.workflow.sample_start import CHAINS, START


@contextmanager
def growing_folder(out: Path, *, force: bool = False, resume: bool = False) -> Iterator[ResultDirectory]:
    """Folder that takes the place of `out` at the end, with the chains of the run that goes on.

    Parameters
    ----------
    out : pathlib.Path
        Folder of the result.
    force : bool
        Replace an earlier result, and forget a run that was cut short.
    resume : bool
        Go on with a run that was cut short, or with a finished one.

    Yields
    ------
    ResultDirectory

    Raises
    ------
    UsageError
        If the folder may not be replaced, or holds a run that was cut short and nobody said what to do with it.
    """
    directory = ResultDirectory(out, force=force, resume=resume, keep=True)
    directory.check()
    if not (force or resume) and (directory.path / CHAINS).exists():
        raise UsageError(
            str(out), "holds a run that was cut short", "a new folder, or to go on with it",
            "Add --resume to go on, or --force to begin anew.",
        )  # fmt: skip
    with directory:
        if resume:
            _tidy(directory.path)
            _take_over(directory.out, directory.path)
        try:
            yield directory
        except BaseException:
            if not (directory.path / CHAINS).exists():
                (directory.path / START).unlink(missing_ok=True)  # without chains it is of no use
            raise


def _tidy(growing: Path) -> None:
    """Remove what a run that was killed had half written: nothing reads it."""
    for half in (*growing.rglob(".*.tmp"), *growing.glob(".*.copy")):
        half.unlink(missing_ok=True)


def _take_over(finished: Path, growing: Path) -> None:
    """Copy what a finished run kept; the chains last, since they tell that all is there."""
    if (growing / CHAINS).exists() or not (finished / CHAINS).exists():
        return
    for name in (START, CHAINS):
        if (finished / name).exists():
            shutil.copyfile(finished / name, growing / f".{name}.copy")
            (growing / f".{name}.copy").replace(growing / name)
