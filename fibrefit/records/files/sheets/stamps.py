"""Dates, times of day and durations in the cells of a sheet, as far as the numbers behind them tell."""

from __future__ import annotations

import datetime
from collections.abc import Sequence

_MICROSECOND = datetime.timedelta(microseconds=1)
_MINUTE = datetime.timedelta(minutes=1)
#: Steps of a clock in microseconds, the coarsest first.
_STEPS = (1000, 100, 10)


class Stamp(str):
    """A date, a time of day or a duration of a cell, as it is written out."""

    __slots__ = ()


def stamp(value: datetime.datetime | datetime.time | datetime.timedelta) -> Stamp:
    """A value of a cell as a clock shows it: dates in ISO, durations in hours, minutes and seconds.

    Parameters
    ----------
    value : datetime, time or timedelta
        As openpyxl gives it.
    """
    if isinstance(value, datetime.timedelta):
        minutes, rest = divmod(value, _MINUTE)
        return Stamp(f"{minutes // 60}:{minutes % 60:02d}:{rest.seconds:02d}.{rest.microseconds:06d}")
    return Stamp(value.isoformat(" ") if isinstance(value, datetime.datetime) else value.isoformat())


def exact_stamps(numbers: Sequence[float], shown: Sequence[str], epoch: datetime.datetime) -> list[Stamp]:
    """Stamps of a column from the numbers behind them, each in the form that it was shown in.

    A double tells a date to a microsecond: what is a multiple of a coarser step but for that is one.

    Parameters
    ----------
    numbers : sequence of float
        Days since the epoch of the workbook, since midnight or since the beginning.
    shown : sequence of str
        The stamps in milliseconds.
    epoch : datetime
        Of the workbook.
    """
    since = [round(datetime.timedelta(days=number) / _MICROSECOND) for number in numbers]
    step = next((step for step in _STEPS if all((one + 1) % step <= 2 for one in since)), 1)
    rounded = [step * round(one / step) * _MICROSECOND for one in since]
    return [stamp(epoch + one if " " in text else one) for one, text in zip(rounded, shown, strict=True)]
