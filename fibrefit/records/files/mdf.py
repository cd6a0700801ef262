"""MDF4 files of vehicle and test-bench loggers, through asammdf."""

from __future__ import annotations

import contextlib
import gc
import re
import sys
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn, binary_column
from fibrefit.records.columns.roles import Heading
from fibrefit.records.files.extras import damage_of, require
from fibrefit.records.grammar.facts import Facts
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.phrases import Aside
from fibrefit.records.grammar.words import KIND_OF_ROLE, score


def read_mdf(path: Path, where: str) -> Raw:
    """Columns of an MDF file.

    Parameters
    ----------
    path : Path
        The file.
    where : str
        Its name for messages.

    Returns
    -------
    Raw
        The group of channels with the force, or else the longest, with its master channel as the time.

    Raises
    ------
    DataError
        If asammdf is not installed, the file is damaged, or holds no channel of numbers.
    """
    asammdf = require("asammdf", "mdf", where, "an MDF file")
    with _silent_clean_up():
        groups, damage, annotations = _groups(asammdf, path, Allowance(where, DataError))
    if damage:
        raise DataError(where, f"the MDF file is damaged ({damage})", "a complete file", "Export it again.")
    groups = [columns for columns in groups if len(columns) > 1]
    if not groups:
        raise DataError(where, "no channel of numbers", "a channel for each measured quantity", "")
    chosen = max(groups, key=lambda columns: (_holds_force(columns), columns[0].numbers.values.size))
    aside = [column.header for columns in groups if columns is not chosen for column in columns[1:]]
    # Channels of other groups that share the same clock belong to the record too.
    for columns in groups:
        if columns is not chosen and np.array_equal(columns[0].numbers.values, chosen[0].numbers.values):
            chosen = [*chosen, *columns[1:]]
            aside = [header for header in aside if header not in {column.header for column in columns}]
    size = chosen[0].numbers.values.size
    notes: list[str] = [Aside(f"Channels of other groups are left out: {', '.join(aside[:6])}.")] if aside else []
    layout = {"format": "MDF", "rows": size}
    return Raw(chosen, Facts(), np.arange(1, size + 1), layout=layout, notes=notes, annotations=annotations)


@contextlib.contextmanager
def _silent_clean_up() -> Iterator[None]:
    """Keep quiet about errors in destructors: the library's own fails on a file it could not open."""
    before = sys.unraisablehook
    sys.unraisablehook = lambda _: None
    try:
        yield
    finally:
        gc.collect()
        sys.unraisablehook = before


def _groups(asammdf: ModuleType, path: Path, allowed: Allowance) -> tuple[list[list[RawColumn]], str, list[Annotation]]:
    """Channels by group, or what the library says about a damaged file; and the remarks of file and channels."""
    try:
        with asammdf.MDF(path) as file:
            allowed.take(sum(8 * group.channel_group.cycles_nr * len(group.channels) for group in file.groups))
            return [_group(file, index) for index in range(len(file.groups))], "", _annotations(file)
    except DataError:
        raise
    except Exception as error:  # the library raises whatever a damaged file provokes
        return [], damage_of(error), []


def _annotations(file: Any) -> list[Annotation]:
    """Remarks of the file and of its channels, without the marks of XML."""
    channels = [channel for group in file.groups for channel in group.channels]
    said = [("", file.header), *((channel.name, channel) for channel in channels)]
    said = [(of, str(getattr(one, "comment", "") or "")) for of, one in said]
    plain = [(of, " ".join(re.sub(r"<[^>]*>", " ", text).split())) for of, text in said]
    return [Annotation(f"the remark{of and f' of {of}'}", text, of) for of, text in plain if text]


def _group(file: Any, index: int) -> list[RawColumn]:
    """Master channel of a group, and its channels of numbers."""
    times = np.asarray(file.get_master(index))
    columns = [binary_column("time", "time", "s", times)]
    for place, channel in enumerate(file.groups[index].channels):
        if file.masters_db.get(index) == place:
            continue
        signal = file.get(group=index, index=place)
        values = np.asarray(signal.samples)
        if values.ndim == 1 and values.dtype.kind in "iuf" and values.size == times.size >= 3:
            name, unit = split_heading(channel.name)
            columns.append(binary_column(channel.name, name, signal.unit or unit, values))
    return columns


def _holds_force(columns: list[RawColumn]) -> bool:
    headings = [Heading(column.header, column.name, column.unit) for column in columns[1:]]
    return any(h.kind == KIND_OF_ROLE["force"] or score(h.name, "force") > 1 for h in headings)
