"""``summary.json``: written from its model, read back through it."""

from __future__ import annotations

import os
from collections.abc import Iterable, Mapping
from datetime import UTC, datetime
from pathlib import Path

from fibrefit.core.environment import versions
from fibrefit.core.errors import DataError
from fibrefit.core.paths import nearest_file, read_plain_file, sha256_of, shown_path, write_whole
from fibrefit.study import Study
from fibrefit.study.summaries.part import Part
from fibrefit.study.summaries.results import Provenance

NAME = "summary.json"
LARGEST_SUMMARY = 1 << 27
"""Bytes of a summary at most: that of a batch has some kilobytes for each of its records."""
WITHOUT = {
    "inspection.json": ("an inspection", "Its report is inspection.txt; fibrefit fit makes a result of the study."),
    "simulated": ("a simulation", "Its pictures: fibrefit show FOLDER --figures png. Its records can be fitted."),
    "study.toml": ("a study", "Run fibrefit fit, or another command, on it, and name the folder it writes."),
}
"""What a folder without a summary is known by, what it is, and what to do."""


def write_summary(folder: Path, summary: Part) -> Path:
    """Write ``summary.json`` into a folder.

    Parameters
    ----------
    folder : pathlib.Path
        Folder of the result.
    summary : Part
        One of the models of `fibrefit.study.summaries.results`.
    """
    path = folder / NAME
    write_whole(path, summary.model_dump_json(by_alias=True, indent=1) + "\n")
    return path


def read_summary(result: str | Path) -> Part:
    """Summary of a result.

    Parameters
    ----------
    result : str or pathlib.Path
        Folder of a result, or a ``summary.json``.

    Raises
    ------
    DataError
        If there is none, or it is not JSON.
    StudyError
        If it does not follow its schema.
    """
    path = Path(result)
    if os.path.isdir(path):
        for name, (what, do) in WITHOUT.items() if not os.path.lexists(path / NAME) else ():
            if os.path.lexists(path / name):
                raise DataError(str(path), f"{what}, without a {NAME}", "a result of another command", do)
        path = path / NAME
    content = read_plain_file(path, f"a result with its {NAME}", DataError, most=LARGEST_SUMMARY)
    from fibrefit.study.summaries.files import summary_of  # models of all kinds, which a run does without

    return summary_of(content, str(path))


def folder_of_result(result: Path) -> Path:
    """Folder of a result that is named by it, or by a file in it.

    Raises
    ------
    DataError
        If there is neither.
    """
    if os.path.isdir(result):
        return result
    if os.path.isfile(result):
        return result.parent
    do = nearest_file(result) or "Check the path."
    raise DataError(shown_path(result), "no such file or folder", "the folder of a result", do)


def files_of_result(result: Path) -> list[Path]:
    """Files of a result from which others go on: its summary, its arrays, its study; those that are there.

    Parameters
    ----------
    result : pathlib.Path
        Its folder, or a file in it.

    Raises
    ------
    DataError
        If there is neither.
    """
    folder = folder_of_result(result)
    return [folder / name for name in (NAME, "result.h5", "study.toml") if os.path.isfile(folder / name)]


def provenance(
    study: Study | str,
    inputs: Iterable[Path],
    *,
    seed: int | None = None,
    seconds: float | None = None,
    settings: Mapping[str, str] | None = None,
    read: Mapping[str, str] | None = None,
) -> Provenance:
    """What a result made now rests on.

    Parameters
    ----------
    study : Study or str
        What was carried out; a text where it is of several.
    inputs : iterable of pathlib.Path
        Every file that was read. The digest is that of what was read, where the study knows it: a file may have changed
        since, or be gone, which costs no result.
    seed : int or None
        Seed of all random numbers.
    seconds : float or None
        Wall time of the computation, in s.
    settings : mapping of str to str, optional
        All else the result depends on, by option.
    read : mapping of str to str, optional
        Digests of further files as they were when they were read, by their paths.
    """
    digests = {Path(name): digest for name, digest in (read or {}).items()}
    digests |= {} if isinstance(study, str) else study.digests
    files = {}
    for path in inputs:
        try:
            files[path.as_posix()] = digests.get(path) or sha256_of(path)
        except DataError:
            files[path.as_posix()] = "gone"
    return Provenance(
        created=datetime.now(UTC).isoformat(timespec="seconds"),
        versions=versions(),
        inputs=files,
        resolved_study=study if isinstance(study, str) else study.resolved_toml(),
        seed=seed,
        settings=dict(settings or {}),
        seconds=seconds,
    )
