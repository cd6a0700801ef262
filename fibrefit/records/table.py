"""What a file says: its columns in SI, what is missing in them, and when the samples were taken."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.formatting import printable
from fibrefit.core.units import Scale
from fibrefit.records.clock.base import TimeBase

SCHEMA = "fibrefit/understood/1"


@dataclass(frozen=True, slots=True, eq=False)
class Column:
    """One column of a file.

    Parameters
    ----------
    header : str
        As written in the file.
    name : str
        Header without its unit.
    unit : str or None
        As written or declared; None where there is none.
    si : str or None
        SI unit of `values`; None where the unit is not known, and then `values` are as in the file.
    values : (n,) float array
        In `si`, read-only; NaN where nothing usable was measured.
    valid : (n,) bool array
        True where `values` holds a measured sample.
    masked : mapping of str to int
        Samples that are not valid, by reason.
    group : int
        Which of the table's time bases the column belongs to.
    outliers : tuple of int
        Rows of single samples far from their neighbours; they are valid.
    scale : Scale or None
        What one unit of the column was declared to be worth.
    zero : float
        Number of the column that was declared to stand for nothing, taken off before the scale.
    number : int
        Which of the file's columns it is, counted from 1; 0 where a file has no order of columns.
    """

    header: str
    name: str
    unit: str | None
    si: str | None
    values: np.ndarray
    valid: np.ndarray
    masked: Mapping[str, int]
    group: int = 0
    outliers: tuple[int, ...] = ()
    scale: Scale | None = None
    zero: float = 0.0
    number: int = 0


@dataclass(frozen=True, slots=True, eq=False)
class Table:
    """What a file says, before anything is chosen from it.

    Parameters
    ----------
    path : Path
        The file.
    sha256 : str
        Of its bytes.
    columns : tuple of Column
        Columns of numbers, those that hold the time left out.
    times : tuple of TimeBase
        One for each group of columns sampled together.
    roles : mapping of str to int
        Position in `columns` of each role, where that is beyond doubt.
    doubts : mapping of str to DataError
        Why a role was not settled.
    layout : mapping
        Encoding, delimiter, decimal mark, lines of header, units and data.
    notes : tuple of str
        Sentences on everything that was decided or left out.
    """

    path: Path
    sha256: str
    columns: tuple[Column, ...]
    times: tuple[TimeBase, ...]
    roles: Mapping[str, int] = field(default_factory=dict)
    doubts: Mapping[str, DataError] = field(default_factory=dict)
    layout: Mapping[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()

    def column(self, header: str) -> Column:
        """Column with a header or a name.

        Parameters
        ----------
        header : str
            As in the file, with or without its unit.

        Returns
        -------
        Column
            The first that fits.

        Raises
        ------
        KeyError
            If there is none.
        """
        for column in self.columns:
            if header in (column.header, column.name):
                return column
        raise KeyError(header)

    @property
    def understood(self) -> dict[str, Any]:
        """Everything that was understood, ready for `json.dumps`; without the samples themselves."""
        return {
            "schema": SCHEMA,
            "file": printable(self.path.name),
            "sha256": self.sha256,
            "layout": dict(self.layout),
            "roles": {role: self.columns[place].header for role, place in self.roles.items()},
            "columns": [_column_understood(column) for column in self.columns],
            "times": [_time_understood(base) for base in self.times],
            "notes": list(self.notes),
        }


def _column_understood(column: Column) -> dict[str, Any]:
    valid = column.values[column.valid]
    return {
        "header": column.header,
        "name": column.name,
        "unit": column.unit,
        "scale": None if column.scale is None else column.scale.text,
        "zero": column.zero or None,
        "si": column.si,
        "group": column.group,
        "samples": int(column.values.size),
        "valid": int(valid.size),
        "masked": dict(column.masked),
        "outliers": len(column.outliers),
        "minimum": float(valid.min()) if valid.size else None,
        "maximum": float(valid.max()) if valid.size else None,
    }


def _time_understood(base: TimeBase) -> dict[str, Any]:
    usable = base.time[np.isfinite(base.time)]
    return {
        "column": base.header,
        "unit": base.unit,
        "samples": int(usable.size),
        "from": float(usable[0]) if usable.size else None,
        "to": float(usable[-1]) if usable.size else None,
        "rate_hz": None if base.unit is None else base.rate,
        "uniform": base.uniform,
        "source": base.source,
        "gaps": [{"after": gap.after, "missing": gap.missing} for gap in base.gaps],
        "rows_without_time": {reason: len(rows) for reason, rows in base.lost.items()},
    }


def frozen(array: np.ndarray) -> np.ndarray:
    """Array that cannot be written to.

    Parameters
    ----------
    array : (n,) array
        Any array; a copy is made where somebody else could still write to its data.

    Returns
    -------
    (n,) array
        Contiguous and read-only.
    """
    if not array.flags.writeable and array.base is None:
        return array
    owner = array if array.base is None else array.base
    if isinstance(owner, np.ndarray) and not owner.flags.writeable and array.flags.c_contiguous:
        return array
    fixed = np.array(array)
    fixed.flags.writeable = False
    return fixed


def frozen_mapping(mapping: Mapping[str, Any]) -> Mapping[str, Any]:
    """View of a copy of a mapping, which cannot be written to."""
    return MappingProxyType(dict(mapping))
