"""When the samples of a group of columns were taken, and the column of times this is found from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

BACKWARD = "time runs backward or stands still"
OFF_GRID = "time is off the grid"
UNREADABLE = "time is not readable"
ALONE = "time stands far from all others"


@dataclass(frozen=True, slots=True)
class TimeGap:
    """Samples that are missing.

    Parameters
    ----------
    after : float
        Time of the last sample before, in s.
    missing : int
        Number of samples missing.
    """

    after: float
    missing: int


@dataclass(frozen=True, slots=True)
class TimeBase:
    """When the samples of a group of columns were taken.

    Parameters
    ----------
    time : (n,) float array
        In s; NaN where a row has no usable time.
    rate : float
        Samples a second, in Hz; the median where the sampling is uneven.
    source : str
        Where the times come from, as part of a sentence.
    uniform : bool
        Whether all steps are equal, gaps aside.
    gaps : tuple of TimeGap
        Missing samples.
    lost : mapping of str to tuple of int
        Rows without a usable time, by reason.
    notes : tuple of str
        What had to be decided.
    header : str or None
        Header of the column the times come from; None where they are counted.
    unit : str or None
        Unit of that column; ``"clock"`` and ``"counted"`` stand for none. None is an unknown unit: then times and rate
        are in the unit of the file.
    origin : float or None
        Time of day, and date, at which a clock read zero here, in s; None where the file has no clock.
    """

    time: np.ndarray
    rate: float
    source: str
    uniform: bool = True
    gaps: tuple[TimeGap, ...] = ()
    lost: Mapping[str, tuple[int, ...]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    header: str | None = None
    unit: str | None = "counted"
    origin: float | None = None


@dataclass(frozen=True, slots=True)
class Readings:
    """A column of times as read.

    Parameters
    ----------
    times : (n,) float array
        In s; NaN where a cell is not readable.
    resolution : float
        Step of the last printed digit, in s; 0 for binary files.
    rows : sequence of str
        Text that tells rows apart, to know a repeated row from a repeated time.
    lines : (n,) int array
        Line of each row.
    where : str
        File and column to name in messages.
    source : str
        What to call the column in sentences.
    placed : bool
        Whether no line between the rows was unreadable.
    """

    times: np.ndarray
    resolution: float
    rows: Sequence[str]
    lines: np.ndarray
    where: str
    source: str
    placed: bool = True


def row_mask(rows: np.ndarray, n: int) -> np.ndarray:
    """Mask of `n` rows with some of them True."""
    mask = np.zeros(n, bool)
    mask[rows] = True
    return mask


def lost_rows(reasons: Mapping[str, np.ndarray]) -> dict[str, tuple[int, ...]]:
    """Rows by reason, from masks; reasons without a row are left out."""
    return {reason: tuple(map(int, np.flatnonzero(mask))) for reason, mask in reasons.items() if mask.any()}
