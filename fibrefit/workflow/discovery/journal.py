"""The folder of a search while it goes on: its journal, and which search it belongs to."""

from __future__ import annotations

import json
import shutil
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from fibrefit.core.environment import versions
from fibrefit.core.errors import UsageError
from fibrefit.store import ResultDirectory, sha256_of
from fibrefit.store.files import write_whole
from fibrefit.study import Study
from fibrefit.workflow.discovery.discover import Options, inputs_of
from fibrefit.workflow.growing import growing_folder

JOURNAL = "journal"
SEARCH = "search.json"
"""What tells the search a journal belongs to."""


@contextmanager
def journal_folder(
    out: Path, study: Study, options: Options, *, force: bool = False, resume: bool = False
) -> Iterator[tuple[ResultDirectory, Path]]:
    """Folder of a result, and the one in it where a search keeps what it has found so far.

    Parameters
    ----------
    out : pathlib.Path
        Folder of the result.
    study : Study
    options : Options
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
    with growing_folder(out, (JOURNAL,), force=force, resume=resume) as directory:
        journal, now = directory.path / JOURNAL, _identity(study, options)
        if journal.is_dir():
            _check_same(out, journal / SEARCH, now)
        journal.mkdir(exist_ok=True)
        write_whole(journal / SEARCH, json.dumps(now, indent=1) + "\n")
        try:
            yield directory, journal
        except BaseException:
            if not any(journal.glob("*.job")):
                shutil.rmtree(journal)  # nothing to go on from
            raise
        shutil.rmtree(journal)


def _identity(study: Study, options: Options) -> dict[str, object]:
    """All that the jobs of a search depend on; not how long it may take."""
    return {
        "study": study.resolved_toml(),
        "inputs": sorted(sha256_of(path) for path in inputs_of(study, options) if path.is_file()),
        "settings": replace(options, seconds=0.0).as_settings(),
        "seed": options.seed,
        "versions": versions(),
    }


def _check_same(out: Path, file: Path, now: dict[str, object]) -> None:
    try:
        then = json.loads(file.read_text(encoding="utf-8"))
    except (OSError, ValueError):
        then = {}
    if differs := [name for name in now if then.get(name) != now[name]]:
        raise UsageError(
            str(out), f"holds a search with other {' and '.join(differs)}", "the search that is to go on",
            "Name another --out, or add --force instead of --resume to begin anew.",
        )  # fmt: skip
