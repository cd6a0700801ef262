"""What a user says about a file that it does not say itself."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.errors import UsageError
from fibrefit.core.formatting import in_words
from fibrefit.records.columns.channel import Channel
from fibrefit.records.columns.raw import Raw
from fibrefit.records.columns.roles import USUAL


@dataclass(frozen=True, slots=True)
class ReadOptions:
    """How a file is to be read, where it can be read in two ways or does not tell.

    Parameters
    ----------
    channels : mapping of str to (str or mapping)
        Header by role (``{"force": "F_Seil [N]"}``), or ``"column 2"``, or a table with ``column``, ``unit`` and
        ``scale`` (``{"force": {"column": "U1", "unit": "V", "scale": "-200 N/V"}}``).
    units : mapping of str to str
        Unit by role or header, where the file has none or a wrong one.
    columns : sequence of str
        Headings in order, for a file without any (``"time [s]"``, ``"force [N]"``).
    rate : float or None
        Sampling rate in Hz, where the file does not tell.
    roles : sequence of str
        Roles to look for among columns nobody named.
    delimiter, decimal : str or None
        Characters between columns and before decimals.
    header : path or None
        File that holds the header of the one that is read: rate, names and units of its columns.

    Raises
    ------
    UsageError
        If one makes no sense.
    """

    channels: Mapping[str, str | Mapping[str, Any]] = field(default_factory=dict)
    units: Mapping[str, str] = field(default_factory=dict)
    columns: Sequence[str] = ()
    rate: float | None = None
    roles: Sequence[str] = USUAL
    delimiter: str | None = None
    decimal: str | None = None
    header: str | Path | None = None

    def __post_init__(self) -> None:
        if self.rate is not None and not (np.isfinite(self.rate) and self.rate > 0):
            raise UsageError("rate", f"{self.rate}", "a positive number in Hz")
        if self.decimal is not None and self.decimal not in (".", ","):
            raise UsageError("decimal", f'"{self.decimal}"', '"." or ","')
        if self.delimiter is not None and len(self.delimiter) != 1:
            raise UsageError("delimiter", f'"{self.delimiter}"', "one character")

    @property
    def wanted(self) -> frozenset[str]:
        """Headings named as channels."""
        said = [said.get("column") if isinstance(said, Mapping) else said for said in self.channels.values()]
        return frozenset(column for column in said if isinstance(column, str))

    def declared(self, where: str) -> dict[str, Channel]:
        """What is said of each role.

        Parameters
        ----------
        where : str
            File to name in messages.

        Returns
        -------
        dict of str to Channel
            By role.

        Raises
        ------
        DataError
            If a role, a unit or a scale is not known.
        """
        return {role: Channel.of(role, said, where) for role, said in self.channels.items()}


def with_unused(raw: Raw, options: ReadOptions, *used: str) -> Raw:
    """The same; told is what was stated of all files of a study and changes nothing in one with a layout of its own.

    Parameters
    ----------
    raw : Raw
    options : ReadOptions
    used : str
        Options that such a file does ask for.

    Returns
    -------
    Raw
        With a note where an option was stated in vain.
    """
    names = ("columns", "delimiter", "decimal", "header")
    stated = [name for name in names if name not in used and getattr(options, name)]
    if not stated:
        return raw
    note = f"What is stated of {in_words(stated)} changed nothing: the file has a layout of its own."
    return replace(raw, notes=[*raw.notes, note])
