"""The folder of a search while it goes on, with the journal it goes on from."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from fibrefit.core.environment import versions
from fibrefit.store import ResultDirectory, Run
from fibrefit.study import Study
from fibrefit.workflow.discovery.discover import SearchOptions, own_laws
from fibrefit.workflow.growing import growing_folder

JOURNAL = "journal"


@contextmanager
def journal_folder(
    out: Path, study: Study, options: SearchOptions, *, force: bool = False, resume: bool = False
) -> Iterator[tuple[ResultDirectory, Path]]:
    """Folder of a result, and the one in it where a search keeps what it has found so far, until `forgotten`.

    Parameters
    ----------
    out : pathlib.Path
        Folder of the result.
    study : Study
    options : SearchOptions
    force : bool
        Replace an earlier result, and forget a search that was cut short.
    resume : bool
        Go on with a search that was cut short.

    Yields
    ------
    (ResultDirectory, pathlib.Path)

    Raises
    ------
    UsageError
        If the folder may not be replaced, or what is in it is another search.
    """
    # How long a search may take is no part of what it finds out; the versions are, to the last bit.
    settings = f"{replace(options, seconds=0.0).as_settings()} {options.seed} {versions()}"
    run = Run.of("discover", study, settings, own_laws(study, options))
    with growing_folder(out, (JOURNAL,), force=force, resume=resume, run=run) as directory:
        journal = directory.path / JOURNAL
        journal.mkdir(exist_ok=True)
        try:
            yield directory, journal
        except BaseException:
            if not any(journal.glob("*.job")):
                shutil.rmtree(journal)  # nothing to go on from
            raise


def forgotten(journal: Path) -> None:
    """Remove what a search has kept that came to its end; one whose time ended goes on from it."""
    shutil.rmtree(journal)
