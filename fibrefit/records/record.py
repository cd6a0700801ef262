"""A measured record in SI: immutable, with the history of what was done to it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import UsageError, did_you_mean
from fibrefit.core.formatting import Card, Shown, format_number, format_quantity
from fibrefit.core.units import Scale
from fibrefit.records.clock.base import TimeGap
from fibrefit.records.table import frozen, frozen_mapping


@dataclass(frozen=True, slots=True, eq=False, repr=False)
class Record(Shown):
    """Measured channels of one run.

    Arrays cannot be written to; every method returns a new record whose history says what was done.

    Parameters
    ----------
    name : str
        Name in results and messages.
    path : Path
        File it was read from.
    sha256 : str
        Of that file's bytes.
    time : (n,) float array
        In s, strictly increasing.
    channels : mapping of str to (n,) float array
        By role (force in N, position and drive in m, angle in rad); NaN where nothing usable was measured.
    valid : mapping of str to (n,) bool array
        By role; True where the channel holds a measured sample.
    rate : float
        Samples a second, in Hz; the median where `uniform` is False.
    uniform : bool
        Whether all steps in time are equal, gaps aside.
    gaps : tuple of TimeGap
        Missing samples.
    headers : mapping of str to str
        Header in the file of each role, the time included.
    history : tuple of str
        Sentences: how it was read, what was left out, what was done since.
    origin : float or None
        Time of day, and date where it is written, at which `time` is zero, in s; None where the file has no clock.
    notes : tuple of str
        Those of the history that may give a reason to doubt a number: what is damaged, missing or not understood.
    scales : mapping of str to Scale
        What one unit of a role's column was declared to be worth, with its uncertainty.

    Examples
    --------
    >>> import pandas as pd
    >>> table = pd.DataFrame(dict(record.channels), index=pd.Index(record.time, name="time"))
    >>> sorted(table.columns), len(table) == len(record)
    (['force', 'position'], True)
    """

    name: str
    path: Path
    sha256: str
    time: np.ndarray
    channels: Mapping[str, np.ndarray]
    valid: Mapping[str, np.ndarray]
    rate: float
    uniform: bool = True
    gaps: tuple[TimeGap, ...] = ()
    headers: Mapping[str, str] | None = None
    history: tuple[str, ...] = ()
    scales: Mapping[str, Scale] | None = None
    origin: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        n = self.time.size
        sizes = {role: (values.size, self.valid[role].size) for role, values in self.channels.items()}
        if any(size != (n, n) for size in sizes.values()):
            raise ValueError(f"channels and masks of {sizes} samples do not fit {n} times")
        object.__setattr__(self, "time", frozen(self.time))
        object.__setattr__(self, "channels", frozen_mapping({r: frozen(v) for r, v in self.channels.items()}))
        object.__setattr__(self, "valid", frozen_mapping({r: frozen(v) for r, v in self.valid.items()}))
        object.__setattr__(self, "headers", frozen_mapping(self.headers or {}))
        object.__setattr__(self, "scales", frozen_mapping(self.scales or {}))

    def __reduce__(self) -> tuple[Any, ...]:
        plain = {f: getattr(self, f) for f in self.__dataclass_fields__}
        plain |= {f: dict(plain[f]) for f in ("channels", "valid", "headers", "scales")}
        return _rebuilt, (plain,)

    def __len__(self) -> int:
        return int(self.time.size)

    @property
    def duration(self) -> float:
        """Time between the first and the last sample, in s."""
        return float(self.time[-1] - self.time[0])

    @property
    def units(self) -> dict[str, str]:
        """SI unit of each channel."""
        return {role: ROLES[role] for role in self.channels}

    def window(self, start: float | None = None, stop: float | None = None) -> Record:
        """Part of the record.

        Parameters
        ----------
        start, stop : float or None
            First and last time kept, in s; None keeps that end.

        Returns
        -------
        Record
            Its times stay as they were.

        Raises
        ------
        UsageError
            If fewer than 3 samples are left.

        Examples
        --------
        >>> round(record.window(0.1, 0.3).duration, 3)
        0.2
        """
        low = self.time[0] if start is None else start
        high = self.time[-1] if stop is None else stop
        keep = (self.time >= low) & (self.time <= high)
        if keep.sum() < 3:
            span = f"{format_number(float(self.time[0]), 6)} to {format_number(float(self.time[-1]), 6)} s"
            got = f"a window from {format_number(low, 6)} to {format_number(high, 6)} s holds {int(keep.sum())} samples"
            raise UsageError(self.name, got, f"at least 3 of the record's {span}")
        said = f"Kept {format_number(low, 6)} to {format_number(high, 6)} s: {int(keep.sum())} of {len(self)} samples."
        gaps = tuple(gap for gap in self.gaps if low <= gap.after < high)
        return self._rows(keep, said, gaps)

    def masked(self, role: str, where: np.ndarray, why: str) -> Record:
        """Record with some samples of a channel declared unusable.

        Parameters
        ----------
        role : str
            The channel.
        where : (n,) bool array
            Samples to mask.
        why : str
            Reason, for the history.

        Returns
        -------
        Record
            With those samples NaN and not valid.

        Raises
        ------
        UsageError
            If the record has no such channel.

        Examples
        --------
        >>> record.masked("force", record.time > 0.4, "the cable was touched").history[-1]
        'Masked ... samples of force: the cable was touched.'
        """
        self._check(role)
        fresh = int((self.valid[role] & where).sum())
        values, valid = self.channels[role].copy(), self.valid[role] & ~where
        values[where] = np.nan
        said = f"Masked {fresh} samples of {role}: {why}."
        return replace(
            self,
            channels={**self.channels, role: values},
            valid={**self.valid, role: valid},
            history=(*self.history, said),
            notes=(*self.notes, said),
        )

    def only(self, *roles: str) -> Record:
        """Record with some of its channels.

        Parameters
        ----------
        *roles : str
            Channels to keep.

        Returns
        -------
        Record
            Without the others.

        Raises
        ------
        UsageError
            If the record lacks one of them.

        Examples
        --------
        >>> sorted(record.only("force").channels)
        ['force']
        """
        for role in roles:
            self._check(role)
        return replace(
            self,
            channels={role: self.channels[role] for role in roles},
            valid={role: self.valid[role] for role in roles},
            history=(*self.history, f"Kept the channels {', '.join(roles)}."),
        )

    def _rows(self, keep: np.ndarray, said: str, gaps: tuple[TimeGap, ...]) -> Record:
        return replace(
            self,
            time=self.time[keep],
            channels={role: values[keep] for role, values in self.channels.items()},
            valid={role: mask[keep] for role, mask in self.valid.items()},
            gaps=gaps,
            history=(*self.history, said),
        )

    def _check(self, role: str) -> None:
        if role not in self.channels:
            do = did_you_mean(role, self.channels)
            raise UsageError(self.name, f'no channel "{role}"', f"one of {', '.join(self.channels)}", do)

    def _card(self) -> Card:
        span, rate = format_quantity(self.duration, "s"), format_number(self.rate, 6)
        line = f"{', '.join(self.channels)}; {len(self)} samples, {span}, {rate} Hz{'' if self.uniform else ', uneven'}"
        rows = []
        for role, values in self.channels.items():
            usable = values[self.valid[role]]
            ends = (float(usable.min()), float(usable.max())) if usable.size else ()
            shown = " to ".join(format_quantity(end, ROLES[role]) for end in ends) or "nothing usable"
            rows.append((role, shown, str(int((~self.valid[role]).sum()))))
        return Card(f"Record {self.name!r}", line, ("channel", "range", "masked"), rows)


def _rebuilt(plain: dict[str, Any]) -> Record:
    return Record(**plain)
