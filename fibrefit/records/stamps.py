"""Numbers that are dates and times of day: what one of them is worth, by their size."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.grammar.neighbours import typical
from fibrefit.records.thresholds import CENTURY_BEGINS, CENTURY_ENDS, FASTEST_LIKELY, SLOWEST_LIKELY


@dataclass(frozen=True, slots=True)
class Stamps:
    """What the size of stamps tells: in one way of counting only they are of this century.

    Parameters
    ----------
    unit : str
        Of one count.
    worth : float
        The same in s.
    zero : float
        Time at which they read nothing, in s since 1970.
    since : str
        What they count from, as part of a sentence.
    rate : float
        Of the rows by these stamps, in Hz; 0 where they do not increase.
    """

    unit: str
    worth: float
    zero: float
    since: str
    rate: float = 0.0

    @property
    def likely(self) -> bool:
        """Whether the rate is one that mechanical records have: counts of anything else may be as large."""
        return SLOWEST_LIKELY <= self.rate <= FASTEST_LIKELY


_DIGITS = re.compile(r"(\d+)(?:\.\d+)?")

#: Ways to count: since 1970, days of a spreadsheet, and steps of 100 ns as Windows and .NET count them.
_STAMPS = (
    *(Stamps(unit, units.to_si(unit, "s"), 0.0, "1970") for unit in ("s", "ms", "us", "ns")),
    Stamps("days", 86400.0, -86400.0 * 25569, "1900, as spreadsheets do"),
    Stamps("100 ns", 1e-7, -86400.0 * 134774, "1601, as Windows does"),
    Stamps("100 ns", 1e-7, -86400.0 * 719162, "the year 1, as .NET does"),
)


def stamps_of(values: np.ndarray) -> Stamps | None:
    """How stamps of this century count; None where numbers are none.

    Numbers of the size of days are many things: they are days where as such they have a rate that records have.

    Parameters
    ----------
    values : (n,) float array
        NaN where there is none.
    """
    present = values[np.isfinite(values)]
    middle = typical(present) if present.size else 0.0
    steps = np.diff(present)
    usual = typical(steps[steps > 0.0]) if (steps > 0.0).any() else 0.0
    for one in _STAMPS:
        if CENTURY_BEGINS < middle * one.worth + one.zero < CENTURY_ENDS:
            found = replace(one, rate=1.0 / (usual * one.worth) if usual > 0.0 else 0.0)
            return found if found.likely or one.unit != "days" else None
    return None


def refuse_millionths(values: np.ndarray, unit: str, where: str) -> None:
    """Refuse days since 1900 times a million under a unit of ms: no clock of a controller has run for years in ms.

    Parameters
    ----------
    values : (n,) float array
        NaN where there is none.
    unit : str
        Of the heading.
    where : str
        File and column to name in the message.

    Raises
    ------
    DataError
        With what one number is worth.
    """
    present = values[np.isfinite(values)]
    first = float(present[0]) if present.size else 0.0
    days = _STAMPS[4]
    if units.expression(unit) == "(ms)" and CENTURY_BEGINS < first * days.worth / 1e6 + days.zero < CENTURY_ENDS:
        column = where.partition('column "')[2].removesuffix('"')
        got = f"it begins at {first:.9g} ms, which is a date of this century in millionths of a day"
        do = f'If it is, as WinCC writes it: time = {{ column = "{column}", scale = "86.4" }} under [channels]; '
        raise DataError(where, got, "times in ms", f'{do}scale = "1" where the numbers are in ms.')


def since_first(values: np.ndarray, texts: Sequence[str]) -> np.ndarray:
    """Stamps less the first of them, to the last digit where their texts are there: years leave few digits to a float.

    Parameters
    ----------
    values : (n,) float array
        NaN where there is none.
    texts : sequence of str
        As printed; empty of a binary file.

    Returns
    -------
    (n,) float array
        In their own unit.
    """
    present = np.flatnonzero(np.isfinite(values))
    plain = values - values[present[0]]
    shown = [texts[i].strip().replace(",", ".") for i in present.tolist()] if len(texts) else []
    parts = [_DIGITS.fullmatch(text) for text in shown]
    if not shown or not all(parts) or len({part.end(1) for part in parts if part}) != 1:
        return plain
    ends = zip(min(shown), max(shown), strict=False)
    same = next((i for i, (a, b) in enumerate(ends) if a != b or a == "."), 0)  # digits that all of them begin with
    rest = np.array([float(text[same:] or "0") for text in shown])
    plain[present] = rest - rest[0]
    return plain
