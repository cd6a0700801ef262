"""From a file to a table, and from a table to a record."""

from __future__ import annotations

import hashlib
import os
import re
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core import limits
from fibrefit.core import units as registry
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError, as_one
from fibrefit.core.formatting import format_number
from fibrefit.core.paths import nearest_file, read_plain_file, shown_path
from fibrefit.records.build import build_table
from fibrefit.records.clock.base import TimeBase
from fibrefit.records.columns.raw import Raw
from fibrefit.records.columns.roles import USUAL, is_signal, with_gain, wrong_kind
from fibrefit.records.files.archive import unpacked
from fibrefit.records.files.block import read_long
from fibrefit.records.files.decode import decode
from fibrefit.records.files.keyed import without_keys
from fibrefit.records.files.lvm import is_lvm, read_lvm
from fibrefit.records.files.sheets.workbook import read_workbook
from fibrefit.records.files.text import read_text
from fibrefit.records.grammar.phrases import Aside, count
from fibrefit.records.layouts.units_behind import with_units_apart
from fibrefit.records.layouts.usual import in_usual_layout
from fibrefit.records.options import ReadOptions, with_unused
from fibrefit.records.record import Record
from fibrefit.records.table import Column, Table
from fibrefit.records.thresholds import FASTEST_LIKELY, SLOWEST_LIKELY

#: A unit of each kind, for messages.
_EXAMPLES = {"s": "s", "N": "N", "m": "mm", "rad": "deg"}


def read_table(path: str | Path, options: ReadOptions | None = None) -> Table:
    """Read what a measurement file says, without choosing from it.

    Parameters
    ----------
    path : str or Path
        Text of any logger, LVM, MATLAB, TDMS, MDF4, UFF 58, JSON, Excel, Parquet, HDF5 or NumPy, also compressed.
    options : ReadOptions, optional
        What the file does not say itself.

    Returns
    -------
    Table
        Columns in SI where units are known, with masks, times and notes.

    Raises
    ------
    DataError
        If the file cannot be read, or not in one way only.
    UsageError
        If an argument makes no sense.
    """
    path, options = Path(path), options or ReadOptions()
    return build_table(*_read(path, options), options)


def read_record(
    path: str | Path,
    *,
    channels: Mapping[str, str | Mapping[str, Any]] | None = None,
    units: Mapping[str, str] | None = None,
    columns: Sequence[str] | None = None,
    rate: float | None = None,
    roles: Sequence[str] | None = None,
    name: str | None = None,
    delimiter: str | None = None,
    decimal: str | None = None,
    header: str | Path | None = None,
) -> Record:
    """Read a record: time, force, position and, where there is one, the drive, in SI.

    Parameters
    ----------
    path : str or Path
        Text of any logger, LVM, MATLAB, TDMS, MDF4, UFF 58, JSON, Excel, Parquet, HDF5 or NumPy, also compressed.
    channels : mapping of str to (str or mapping), optional
        Heading by role, ``{"force": "F_Seil [N]"}``, or ``"column 2"``, or a table with ``column``, ``unit`` and
        ``scale``: ``{"force": {"column": "U1", "unit": "V", "scale": "-200 N/V"}}``.
    units : mapping of str to str, optional
        Unit by role or heading, where the file has none or a wrong one.
    columns : sequence of str, optional
        Headings in order, for a file without any: ``("time [s]", "force [N]")``.
    rate : float, optional
        Sampling rate in Hz, where the file does not tell.
    roles : sequence of str, optional
        Roles to look for among columns that `channels` does not name.
    name : str, optional
        Name of the record; that of the file by default.
    delimiter : str, optional
        Character between columns.
    decimal : {".", ","}, optional
        Sign before decimals.
    header : str or Path, optional
        File that holds the header of this one: rate, names and units of its columns.

    Returns
    -------
    Record
        Channels found by name, or by heading and unit where they leave no doubt. Rows without a usable time are left
        out; all other damage is masked and counted in the history.

    Raises
    ------
    DataError
        If the file is not understood, a channel is in doubt or carries no unit, or there is no channel at all.
    UsageError
        If an argument makes no sense.

    Examples
    --------
    >>> record = fibrefit.read_record(fibrefit.example("drop_series") / "drop_10mm_90deg.csv")
    >>> sorted(record.channels), round(record.rate)
    (['force', 'position'], 2000)
    """
    wanted = tuple(roles or USUAL)
    beside = None if header is None else Path(header)
    options = ReadOptions(channels or {}, units or {}, tuple(columns or ()), rate, wanted, delimiter, decimal, beside)
    return record_of(read_table(path, options), channels=options.channels, name=name)


def record_of(table: Table, *, channels: Mapping[str, Any] | None = None, name: str | None = None) -> Record:
    """Record from a table.

    Parameters
    ----------
    table : Table
        What the file says.
    channels : mapping, optional
        Roles the user named: these must be there, whatever group of columns they belong to.
    name : str, optional
        Name of the record.

    Returns
    -------
    Record
        Of the group of columns that holds the force, or else the first channel found.

    Raises
    ------
    DataError
        As for `read_record`.
    """
    where = shown_path(table.path.name)
    if table.doubts:
        raise as_one(list(table.doubts.values()), where)
    found = {role: table.columns[place] for role, place in table.roles.items() if role in ROLES and role != "time"}
    if not found:
        headers = ", ".join(f'"{column.header}"' for column in table.columns[:8])
        do = f"Name the channels, such as {_example(table)}, under [channels]."
        raise DataError(where, f"no channel is known among {headers or 'the columns'}", "a force or a position", do)
    group = _group(found, channels or {}, where)
    kept = {role: column for role, column in found.items() if column.group == group}
    _refuse_no_row_in_common(kept, where)
    base = table.times[group]
    _check_units(base, kept, where)
    usable = np.isfinite(base.time)
    rows = slice(None) if usable.all() else usable
    damage = _damage(base, kept)
    return Record(
        name=name or where,
        path=table.path,
        sha256=table.sha256,
        time=base.time[rows],
        channels={role: column.values[rows] for role, column in kept.items()},
        valid={role: column.valid[rows] for role, column in kept.items()},
        rate=base.rate,
        uniform=base.uniform,
        gaps=base.gaps,
        headers={"time": base.header or base.source} | {role: column.header for role, column in kept.items()},
        scales={role: column.scale for role, column in kept.items() if column.scale is not None},
        history=(*_how_read(table, kept, group), *damage, *table.notes),
        origin=base.origin,
        notes=(*damage, *(note for note in table.notes if not isinstance(note, Aside))),
    )


def _read(path: Path, options: ReadOptions) -> tuple[Raw, Path, str]:
    """Columns of a file, its path and the SHA-256 of its bytes, which are let go here."""
    near = "" if os.path.isfile(path) else nearest_file(path)
    data = read_plain_file(path, "a measurement file", DataError, near)
    return _raw(data, path, options), path, hashlib.sha256(data).hexdigest()


def _raw(data: bytes, path: Path, options: ReadOptions) -> Raw:
    """Columns of a file, by the reader its first bytes call for."""
    where = shown_path(path.name)
    packed = data
    data, name = unpacked(data, path.name, where)
    ending = Path(name).suffix.casefold()
    tdms, mdf = data[:4] == b"TDSm", data[:3] == b"MDF" or data[:6] == b"UnFinM"
    arrays = data[:6] == b"MATLAB" or b"\x89HDF\r\n\x1a\n" in data[:1024] or ending == ".mat"
    if data is not packed and (tdms or mdf or arrays):
        raise DataError(where, f'a packed file of another kind ("{name}")', "a packed text file", "Unpack it first.")
    if ending == ".xlsx":
        raw = read_workbook(data, where, options, with_units_apart)
        return with_unused(raw, options, "columns", "decimal", "header")
    if ending == ".npz" or data[:6] == b"\x93NUMPY":
        from fibrefit.records.files.arrays.numpy_file import read_numpy

        return read_numpy(data, where, options)
    if data[:4] == b"PAR1":
        from fibrefit.records.files.parquet import read_parquet

        return with_unused(read_parquet(data, where), options)
    if tdms:
        from fibrefit.records.files.tdms import read_tdms

        return with_unused(read_tdms(path, where), options)
    if mdf:
        from fibrefit.records.files.mdf import read_mdf

        return with_unused(read_mdf(path, where), options)
    if arrays:
        from fibrefit.records.files.matlab import read_matlab

        return with_unused(read_matlab(path, where, options.wanted), options)
    _refuse_many_cells(data, where)
    text = in_usual_layout(data, where)
    if text is None:
        long = read_long(data, where, options)
        if long is not None:
            return long
        text = decode(data, where)
    if is_lvm(text):
        return with_unused(read_lvm(text, where), options, "decimal")
    return read_text(without_keys(text, where), where, options)


def _refuse_many_cells(data: bytes, where: str) -> None:
    """Refuse text that would take all memory: each cell takes far more than the signs it is written with."""
    if data.count(b"\n") + max(data.count(sign) for sign in (b",", b";", b"\t", b" ")) > limits.MOST_CELLS:
        raise limits.too_many_cells(where, DataError)


def _example(table: Table) -> str:
    """How a column that may hold the force is named, by its heading, or by its number where it has none."""
    fits = (column for column in table.columns if column.si in (None, ROLES["force"]))
    first = next(fits, next(iter(table.columns), None))
    heading = ".." if first is None else first.header or f"column {first.number}"
    unit = first.unit if first is not None else None
    return with_gain("force", heading, unit) if unit and is_signal(unit) else f'force = "{heading}"'


def _group(found: Mapping[str, Column], channels: Mapping[str, Any], where: str) -> int:
    """Group of columns the record is made of."""
    named = {found[role].group for role in channels if role in found}
    if len(named) > 1:
        headers = ", ".join(f'"{found[role].header}"' for role in channels if role in found)
        do = "Export them at one rate."
        raise DataError(where, f"the channels {headers} were sampled at different times", "one time base", do)
    if named:
        return named.pop()
    if len({column.group for column in found.values()}) > 1:
        shown = ", ".join(f'{role} ("{column.header}")' for role, column in found.items())
        role, first = next(iter(found.items()))
        do = f'Export them at one rate, or name those that are meant: {role} = "{first.header}" under [channels]; what '
        do += "was sampled at other times is then left out."
        raise DataError(where, f"channels that were sampled at different times: {shown}", "one time base", do)
    return next(iter(found.values())).group


def _refuse_no_row_in_common(kept: Mapping[str, Column], where: str) -> None:
    """Refuse channels that take turns from row to row: each was measured while the others were not."""
    valid = [column.valid for column in kept.values()]
    if all(mask.any() for mask in valid) and not np.logical_and.reduce(valid).any():
        headers = ", ".join(f'"{column.header}"' for column in kept.values())
        do = "Export a value of each channel in each row."
        raise DataError(where, f"no row has a value of each of {headers}", "channels that were sampled together", do)


def _check_units(base: TimeBase, kept: Mapping[str, Column], where: str) -> None:
    """Refuse channels without a unit, all at once, or with one of another kind."""
    bare = [(role, column.header) for role, column in kept.items() if column.unit is None and column.scale is None]
    if base.unit is None:
        bare.insert(0, ("time", base.header or ""))
    if len(bare) > 1:
        headers = ", ".join(f'"{header}"' for _, header in bare)
        words = [_word_in_brackets(header) for _, header in bare]
        # Where a file states units that are not known, an example would be taken for them.
        units = _EXAMPLES | {"s": _likely(base)}
        shown = [".." if any(words) else units[ROLES[role]] for role, _ in bare]
        declared = ", ".join(f'{role} = "{unit}"' for (role, _), unit in zip(bare, shown, strict=True))
        do = f"Declare them under [units], such as {declared}."
        do += f" Of the time: {_rates(base)}." if base.unit is None and not any(words) else ""
        raise DataError(f"{where}, columns {headers}", "no units", "one for each", do)
    for role, header in bare:
        place, expected = f'{where}, column "{header}"', registry.ACCEPTED[ROLES[role]]
        if word := _word_in_brackets(header):
            do = f'Declare under [units] which it is: {role} = "..".'
            raise DataError(place, f'no unit that is known ("{word}")', expected, do)
        said = f"time = {_rates(base)}" if role == "time" else f'{role} = "{_EXAMPLES[ROLES[role]]}"'
        raise DataError(place, "no unit", expected, f"Declare it under [units]: {said}.")
    wrong = {role: column for role, column in kept.items() if column.si != ROLES[role]}
    if wrong:
        raise as_one([wrong_kind(role, one.header, one.unit or "", where) for role, one in wrong.items()], where)


def _likely(base: TimeBase) -> str:
    """Unit in which times without one are more likely: that of the rate which mechanical records have.

    Sheets keep times in days.
    """
    rates = _rates_by_unit(base)
    return next((unit for unit, rate in rates.items() if SLOWEST_LIKELY <= rate <= FASTEST_LIKELY), "ms")


def _rates_by_unit(base: TimeBase) -> dict[str, float]:
    """Rate in Hz of times that have no unit, by the units that they may be in."""
    return {unit: base.rate / registry.to_si(unit, "s") for unit in ("s", "ms", "d")}


def _rates(base: TimeBase) -> str:
    """Either unit of times that have none, with the rate in it, the likelier first."""
    rates = _rates_by_unit(base)
    likely = _likely(base)
    other = next(unit for unit in rates if unit != likely)
    first, second = (f"{format_number(rates[unit], 6)} Hz" for unit in (likely, other))
    return f'"{likely}" ({first}) or "{other}" ({second})'


def _word_in_brackets(header: str) -> str:
    """A word behind a heading that may be a unit in a spelling that is not known; empty where there is none."""
    found = re.search(r"[(<{\[]\s*([^\W\d_][^()<>{}\[\]]*?)\s*[)>}\]]\s*$", header)
    return found[1] if found else ""


def _in_unit(column: Column) -> str:
    inside = f"in {column.unit}" if column.unit else "without a unit"
    inside += f", from {column.zero:.15g}" if column.zero else ""
    return inside if column.scale is None else f"{inside}, scaled by {column.scale.text}"


def _how_read(table: Table, kept: Mapping[str, Column], group: int) -> list[str]:
    """Sentences on where a record's numbers come from, and what else the file holds."""
    said = [f"Read from {shown_path(table.path.name)}; time: {table.times[group].source}."]
    said += [f'{role}: column "{column.header}" {_in_unit(column)}.' for role, column in kept.items()]
    aside = [column.header for column in table.columns if column.group == group and column not in kept.values()]
    if aside:
        said.append(f"Columns left out: {', '.join(aside)}.")
    for number, other in enumerate(table.times):
        slower = [column.header for column in table.columns if column.group == number != group]
        if slower:
            said.append(f"Left out, sampled at {format_number(other.rate, 6)} Hz: {', '.join(slower)}.")
    return said


def _damage(base: TimeBase, kept: Mapping[str, Column]) -> list[str]:
    """Sentences on what of a record could not be used, and what is missing."""
    said = [f"{count(len(rows), 'row')} left out: {reason}." for reason, rows in base.lost.items()]
    for role, column in kept.items():
        for reason, number in column.masked.items():
            if reason != "time unusable":
                said.append(f"{role}: {count(number, 'sample')} masked ({reason}).")
    missing = sum(gap.missing for gap in base.gaps)
    if missing:
        said.append(f"{count(missing, 'sample')} missing in {count(len(base.gaps), 'gap')}.")
    return said
