"""TDMS files of LabVIEW and DIAdem, through npTDMS."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn, binary_column
from fibrefit.records.files.arrays.values import stamp_column
from fibrefit.records.files.extras import damage_as_error, require
from fibrefit.records.grammar.facts import Facts
from fibrefit.records.grammar.headings import known_unit, split_heading
from fibrefit.records.grammar.phrases import Aside
from fibrefit.records.grammar.words import score

_UNIT_PROPERTIES = ("unit_string", "NI_UnitDescription", "Unit", "unit", "Einheit")


def read_tdms(path: Path, where: str) -> Raw:
    """Columns of a TDMS file.

    Parameters
    ----------
    path : Path
        The file.
    where : str
        Its name for messages.

    Returns
    -------
    Raw
        All channels of numbers; those without a channel of times carry the rate of their waveform.

    Raises
    ------
    DataError
        If npTDMS is not installed, or the file is damaged.
    """
    nptdms = require("nptdms", "tdms", where, "a TDMS file")
    with damage_as_error(where, "the TDMS file"), nptdms.TdmsFile.open(path) as file:
        channels = [channel for group in file.groups() for channel in group.channels()]
        Allowance(where, DataError).take(sum(8 * len(channel) for channel in channels))
        columns = [_column(channel, where) for channel in channels]
        annotations = [one for said, of in _properties(file, channels) for one in _annotations(said, of)]
    return replace(
        channels_to_raw([column for column in columns if column is not None], "TDMS", where), annotations=annotations
    )


def _properties(file: Any, channels: Sequence[Any]) -> Iterator[tuple[Mapping[str, Any], str]]:
    """Properties of the file and its groups, and of each channel with its name."""
    yield file.properties, ""
    yield from ((group.properties, "") for group in file.groups())
    yield from ((channel.properties, channel.name) for channel in channels)


def _annotations(said: Mapping[str, Any], of: str) -> Iterator[Annotation]:
    """Properties in words; scales of the driver are applied by the library as the numbers are read."""
    for key, value in said.items():
        if not key.startswith(("NI_Scal", "wf_", "NI_Number_Of_Scales")) and isinstance(value, str | int | float):
            yield Annotation(f'property "{key}"{of and f" of {of}"}', " ".join(f"{key} = {value}".split()), of)


def _column(channel: Any, where: str) -> RawColumn | None:
    values = np.asarray(channel[:])
    properties: Mapping[str, Any] = channel.properties
    unit = next((str(properties[key]) for key in _UNIT_PROPERTIES if properties.get(key)), None)
    name, found = split_heading(channel.name)
    if values.size < 3:
        return None
    if values.dtype.kind == "M":
        return stamp_column(channel.name, name or "time", values)
    if values.dtype.kind not in "iuf":
        return None
    second = _second_of(properties, f'{where}, channel "{channel.name}"')
    step = properties.get("wf_increment")
    rate = float(f"{1 / (float(step) * second):.12g}") if step and float(step) > 0 else None
    start = float(properties.get("wf_start_offset") or 0.0) * second
    return binary_column(channel.name, name, unit or found, values, rate=rate, start=start)


def _second_of(properties: Mapping[str, Any], where: str) -> float:
    """What one unit of a waveform's axis is in seconds: seconds, where none is stated."""
    unit = str(properties.get("wf_xunit_string") or "s").strip()
    if (known := known_unit("time", unit)) is not None:
        return units.to_si(known, "s", where)
    axis = str(properties.get("wf_xname") or "its axis")
    raise DataError(where, f"{axis} in {unit}", "a channel over time", "Export the channels as they were measured.")


def channels_to_raw(columns: list[RawColumn], kind: str, where: str) -> Raw:
    """Columns of a file whose channels may differ in length and rate.

    Parameters
    ----------
    columns : list of RawColumn
        All channels of numbers.
    kind : str
        Name of the format.
    where : str
        File to name in messages.

    Returns
    -------
    Raw
        The channels; with a channel of times, those as long as it is.

    Raises
    ------
    DataError
        If there is no channel of numbers.
    """
    if not columns:
        raise DataError(where, "no channel of numbers", "a channel for each measured quantity", "")
    notes: list[str] = []
    times = [column for column in columns if score(column.name, "time") > 0]
    if times and not all(column.rate for column in columns if column not in times):
        size = _size_of_force(times, columns)
        others = [column for column in columns if column.numbers.values.size != size]
        _refuse_several(others, size, where)
        aside = [column.header for column in others]
        columns = [_without_rate(column) for column in columns if column.numbers.values.size == size]
        notes += [Aside(f"Channels of another length are left out: {', '.join(aside[:6])}.")] if aside else []
    elif any(column.rate for column in columns):
        aside = [column.header for column in columns if not column.rate]
        columns = [column for column in columns if column.rate and column not in times]
        notes += [Aside(f"Channels without a rate are left out: {', '.join(aside[:6])}.")] if aside else []
    size = max(column.numbers.values.size for column in columns)
    return Raw(columns, Facts(), np.arange(1, size + 1), layout={"format": kind, "rows": size}, notes=notes)


def _size_of_force(times: Sequence[RawColumn], columns: Sequence[RawColumn]) -> int:
    """Samples of the first channel of times that a force goes with; of the first one where none does."""
    forces = {column.numbers.values.size for column in columns if score(column.name, "force") > 2}
    sizes = [column.numbers.values.size for column in times]
    return next((size for size in sizes if size in forces), sizes[0])


def _refuse_several(others: Sequence[RawColumn], size: int, where: str) -> None:
    """Refuse channels of another length that are called as one that is wanted: recordings of their own, or slower."""
    for role in ("force", "position", "angle"):
        lost = next((column for column in others if score(column.name, role) > 2), None)
        if lost is not None:
            got = f'"{lost.header}" has {lost.numbers.values.size} samples where the times have {size}'
            do = "Export each recording, and each rate, to a file of its own."
            raise DataError(where, got, f"one recording; the {role} would be left out", do)


def _without_rate(column: RawColumn) -> RawColumn:
    return replace(column, rate=None, start=column.start if column.clock else 0.0)
