"""A study of what was understood of bare files."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import UsageError
from fibrefit.core.paths import read_plain_file
from fibrefit.records.grammar.headings import split_heading
from fibrefit.study.draft import FileReading, split_overrides, study_text
from fibrefit.study.reading import reading_of
from fibrefit.workflow.inspection.inspection import Inspection, Seen

if TYPE_CHECKING:
    from fibrefit.records import Table


def write_study(
    found: Inspection, path: Path, rig: str | None = None, overrides: Sequence[str] = (), *, force: bool = False
) -> tuple[str, ...]:
    """Write what was understood of bare files as a study.

    Parameters
    ----------
    found : Inspection
        Of bare files.
    path : pathlib.Path
        The study file.
    rig : str or None
        Kind of the rig; None takes the one whose channels are there.
    overrides : sequence of str
        What the command line said: it goes into the study.
    force : bool
        Whether an earlier study may be replaced.

    Returns
    -------
    tuple of str
        Constants of the rig that are still to be stated in it.

    Raises
    ------
    UsageError
        If a study was inspected, the file exists or is no study, or a file cannot be used as a record yet.
    """
    from fibrefit.core.paths import write_whole

    where = f"--write {path}"
    if found.study is not None:
        raise UsageError(where, "a study given", "bare records", "Copy the study instead.")
    if path.is_dir():
        raise UsageError(where, "it is a folder", "a file", f"Name one in it, such as {path / 'study.toml'}.")
    if path.exists() and not _is_study(path):
        raise UsageError(where, "a file that is no study", "the name of the study to write", "Such as study.toml.")
    if path.exists() and not force:
        raise UsageError(where, "it exists already", "a new name", "Use --force to replace it.")
    unusable = next((one for one in found.seen if one.verdict != "understood"), None)
    if unusable is not None:
        raise _refused(unusable, where)
    reading = reading_of(split_overrides(overrides)[0])
    given = bool(reading["units"]) or any(isinstance(one, Mapping) for one in reading["channels"].values())
    files = [_understood(one.table, given) for one in found.seen if one.table is not None]
    study = study_text(files, rig, overrides, path.parent)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, study.text)
    except OSError as error:
        raise UsageError(where, error.strerror or "cannot be written", "a file that can be written") from None
    return study.unstated


def _is_study(path: Path) -> bool:
    """Whether what stands there may be replaced by a study: measured data may not."""
    try:
        content = tomllib.loads(read_plain_file(path, "a study", UsageError).decode())
    except (UsageError, ValueError, RecursionError):
        return False
    return "rig" in content or "schema" in content


def _refused(unusable: Seen, where: str) -> UsageError:
    """Why no study is written of a file that is not there, or of one that is not understood."""
    file = unusable.understood["file"]
    if unusable.missing and unusable.asked is not None:
        return UsageError(where, f'no file "{file}"', "files that are there", unusable.asked.do)
    got, do = f"{file} cannot be used as a record yet", "What to do is said above."
    if unusable.asked is not None:  # a program is told nothing else
        got, do = f"{got} ({unusable.asked.got})", unusable.asked.do or do
    return UsageError(where, got, "files that are understood", do)


def _understood(table: Table, given: bool) -> FileReading:
    """Channels and units as a study writes them, so that the file is read the same way again.

    Parameters
    ----------
    given : bool
        Whether units were given on the command line: then a heading alone shows that the file says one itself.
    """
    channels: dict[str, Any] = {}
    units: dict[str, str] = {}
    declared: list[str] = []
    for role, place in table.roles.items():
        column = table.columns[place]
        named = column.header or f"column {column.number}"
        if column.scale is not None or column.zero:
            said = {"unit": column.unit, "scale": column.scale and column.scale.text, "zero": column.zero}
            channels[role] = {"column": named} | {key: value for key, value in said.items() if value}
        else:
            channels[role] = named
            units |= {role: column.unit} if column.unit else {}
            declared += [role] if given and column.unit not in (None, split_heading(column.header)[1]) else []
    base = table.times[0]
    if base.header and base.unit and base.unit not in ("clock", "counted"):
        channels["time"], units["time"] = base.header, base.unit
        heading = split_heading(base.header)[1]
        stated = heading == base.unit if given else heading or table.layout.get("unit_line")
        declared += [] if stated else ["time"]
    return FileReading(table.path, channels, units, tuple(declared))
