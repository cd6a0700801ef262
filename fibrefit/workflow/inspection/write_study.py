"""A study of what was understood of bare files."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import UsageError
from fibrefit.study.written import Understood, study_text
from fibrefit.workflow.inspection.inspection import Inspection

if TYPE_CHECKING:
    from fibrefit.records import Table


def write_study(
    found: Inspection, path: Path, rig: str | None = None, overrides: Sequence[str] = (), *, force: bool = False
) -> None:
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
        Whether an earlier file may be replaced.

    Raises
    ------
    UsageError
        If a study was inspected, the file exists, or a file cannot be used as a record yet.
    """
    from fibrefit.store.files import write_whole

    where = f"--write {path}"
    if found.study is not None:
        raise UsageError(where, "a study given", "bare records", "Copy the study instead.")
    if path.is_dir():
        raise UsageError(where, "it is a folder", "a file", f"Name one in it, such as {path / 'study.toml'}.")
    if path.exists() and not force:
        raise UsageError(where, "it exists already", "a new name", "Use --force to replace it.")
    unusable = next((one for one in found.seen if one.verdict != "understood"), None)
    if unusable is not None:
        got = f"{unusable.understood['file']} cannot be used as a record yet"
        raise UsageError(where, got, "files that are understood", "Say what is missing with --set, as above.")
    files = [Understood(t.path, *_said(t)) for t in (one.table for one in found.seen) if t is not None]
    text = study_text(files, rig, overrides, path.parent)
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, text)
    except OSError as error:
        raise UsageError(where, error.strerror or "cannot be written", "a file that can be written") from None


def _said(table: Table) -> tuple[dict[str, Any], dict[str, str]]:
    """Channels and units as a study writes them, so that the file is read the same way again."""
    channels: dict[str, Any] = {}
    units: dict[str, str] = {}
    for role, place in table.roles.items():
        column = table.columns[place]
        named = column.header or f"column {column.number}"
        if column.scale is not None or column.zero:
            said = {"unit": column.unit, "scale": column.scale and column.scale.text, "zero": column.zero}
            channels[role] = {"column": named} | {key: value for key, value in said.items() if value}
        else:
            channels[role] = named
            units |= {role: column.unit} if column.unit else {}
    base = table.times[0]
    if base.header and base.unit and base.unit not in ("clock", "counted"):
        channels["time"], units["time"] = base.header, base.unit
    return channels, units
