"""How each file of a record is read: one file, several parts, or two side by side."""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from fibrefit.core.errors import FibrefitError
from fibrefit.records import ReadOptions, Table, read_table

if TYPE_CHECKING:
    from fibrefit.study import Study

#: A file, and the arguments for its reader.
Reading = tuple[Path, dict[str, Any]]


def readings_of(study: Study, record: Any) -> tuple[list[Reading], Reading | None]:
    """Files of a measured record with the arguments for their reader.

    Parameters
    ----------
    record : object
        One of the study's, with a file.

    Returns
    -------
    list of tuple of Path and dict
        The record's file and the parts that continue it.
    tuple of Path and dict, or None
        The file beside it.
    """
    said, beside = study.reading(record), record.beside
    names = (record.file, *(record.parts or ()))
    if beside is None:
        return [(study.path_of(name), said) for name in names], None
    here, there = _divided(study, said, record.file, beside.file)
    return [(study.path_of(name), here) for name in names], (study.path_of(beside.file), there)


def _divided(study: Study, said: dict[str, Any], file: str, other: str) -> tuple[dict[str, Any], dict[str, Any]]:
    """What is said of a record, for each of its two files: a channel belongs to the one that has its column.

    A file that is not understood may have what the other one lacks; whoever reads it will say what is wrong with it.
    """
    options = ReadOptions(**{**said, "channels": {}, "units": {}})
    tables = [_understood(study.path_of(name), options) for name in (file, other)]
    here, there = ({**said, "channels": {}, "units": {}} for _ in tables)
    if tables[1] is None and said.get("rate") is not None:
        # The rate of a record is not that of a logger beside it which tells its own.
        tables[1] = _understood(study.path_of(other), replace(options, rate=None))
        there |= {} if tables[1] is None else {"rate": None}
    for role, channel in said["channels"].items():
        column = channel if isinstance(channel, str) else channel.get("column")
        pairs = zip((here, there), tables, strict=True)
        holders = [part for part, table in pairs if role == "time" or (table is not None and _has(table, column))]
        unread = [part for part, table in zip((here, there), tables, strict=True) if table is None]
        for part in holders or unread or (here,):
            part["channels"] = {**part["channels"], role: channel}
    for key, unit in said["units"].items():
        for part, table in zip((here, there), tables, strict=True):
            if key == "time" or table is None or key in table.roles or key in part["channels"] or _has(table, key):
                part["units"] = {**part["units"], key: unit}
    return here, there


def _understood(path: Path, options: ReadOptions) -> Table | None:
    with suppress(FibrefitError):
        return read_table(path, options)
    return None


def _has(table: Table, column: str | None) -> bool:
    return any(column in (one.header, one.name) for one in table.columns)
