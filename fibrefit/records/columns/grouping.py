"""Columns that were sampled together, each group with its own column of times."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.columns.roles import Heading, is_time
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.numbers import CODE
from fibrefit.records.grammar.words import counts_rows, score, tokens
from fibrefit.records.thresholds import COUNTS_ON, SAME_RATE


@dataclass(frozen=True, slots=True)
class Group:
    """Columns sampled together.

    Parameters
    ----------
    time : int or None
        Position of the column that holds the times; None where they are to be counted.
    members : tuple of int
        Positions of the columns of measured values.
    beside : tuple of int
        Further columns of times, and columns that number the rows.
    rows : int
        Samples in the group.
    """

    time: int | None
    members: tuple[int, ...]
    beside: tuple[int, ...]
    rows: int


def grouped(columns: Sequence[RawColumn], headings: Sequence[Heading], named: Mapping[str, int]) -> list[Group]:
    """Groups of columns.

    Parameters
    ----------
    columns : sequence of RawColumn
        All columns of numbers.
    headings : sequence of Heading
        Their headings.
    named : mapping of str to int
        Columns the user named, by role: these are what they are named.

    Returns
    -------
    list of Group
        In the order of the file. One group unless several columns of times, or rates by column, say otherwise.
    """
    if any(column.rate is not None for column in columns):
        return _by_rate(columns)
    time, others = named.get("time"), {i for role, i in named.items() if role != "time"}
    possible = [i for i, h in enumerate(headings) if i == time or (is_time(h) and i not in others)]
    forward = [i for i in possible if i == time or _runs_forward(columns[i].numbers.values)]
    times = forward or [i for i in possible if score(headings[i].name, "time") > 0]
    counters = [
        i for i in range(len(columns)) if i not in times and i not in others and _is_counter(columns[i], headings[i])
    ]
    owned = _by_name([i for i in times if i != time], headings, {*times, *counters}) if time is None else {}
    spans: list[tuple[list[int], list[int]]] = [([], []), *(([i], mine) for i, mine in owned.items())]
    if owned:
        rest = [i for i in range(len(columns)) if i not in owned and all(i not in mine for mine in owned.values())]
        spans[1][0].extend(i for i in rest if i in times)
        spans[1][1].extend(i for i in rest if i not in times and i not in counters)
        spans.pop(0)
    for i in range(len(columns)) if not owned else ():
        here_times, here_members = spans[-1]
        if i in times and here_times and here_members:
            spans.append(([i], []))
        elif i in times:
            here_times.append(i)
        elif i not in counters:
            here_members.append(i)
    if len(spans) > 1 and not spans[-1][1]:  # a column of times at the end belongs to those before it
        last = spans.pop()
        spans[-1][0].extend(last[0])
    several = len(spans) > 1
    groups = []
    for number, (here_times, here_members) in enumerate(spans):
        chosen = _best_time(here_times, columns, headings, time)
        beside = [i for i in here_times if i != chosen] + (counters if number == 0 else [])
        rows = _rows_used(columns[chosen]) if several and chosen is not None else _length(columns)
        groups.append(Group(chosen, tuple(here_members), tuple(beside), rows))
    return groups


def _by_name(times: Sequence[int], headings: Sequence[Heading], others: set[int]) -> dict[int, list[int]]:
    """Members of each column of times that is called by theirs, as ``force_time`` is; none where only one is."""
    words = [set(tokens(heading.name)) for heading in headings]
    found = {
        i: [j for j in range(len(headings)) if j not in others and words[j] and words[j] < words[i]] for i in times
    }
    owned = {i: mine for i, mine in found.items() if mine}
    several = len(owned) > 1 and len({j for mine in owned.values() for j in mine}) == sum(map(len, owned.values()))
    return owned if several else {}


def refuse_two_clocks(
    groups: Sequence[Group],
    columns: Sequence[RawColumn],
    headings: Sequence[Heading],
    named: Mapping[str, int],
    where: str,
) -> None:
    """Refuse times beside those of a group that run at another rate, where the user names none of them.

    Parameters
    ----------
    groups : sequence of Group
        As from `grouped`.
    columns, headings, named
        As for `grouped`.
    where : str
        File to name in the message.

    Raises
    ------
    DataError
        If two columns could each be the time, and are not the same but for where they begin.
    """
    for group in groups if "time" not in named else ():
        clocks = [i for i in (group.time, *group.beside) if i is not None and headings[i].kind == "time"]
        lasted = [(i, *_lasted(columns[i], headings[i])) for i in clocks]
        first, *others = [one for one in lasted if one[1] > 0] or [(0, 0.0, 0.0)]
        for other, seconds, rounding in others:
            if abs(seconds - first[1]) > SAME_RATE * first[1] + rounding + first[2]:
                names = f'columns "{headings[first[0]].header}" and "{headings[other].header}"'
                got = f"{names} could each be the time: from first to last {first[1]:.6g} s and {seconds:.6g} s"
                do = f'Name it: time = "{headings[first[0]].header}" under [channels].'
                raise DataError(where, got, "one clock", do)


def _lasted(column: RawColumn, heading: Heading) -> tuple[float, float]:
    """Time from the first row to the last and how far it is rounded, in s; zero for what does not always run on."""
    values = column.numbers.values
    if not np.isfinite(values).all() or values.size < 3 or not (np.diff(values) > 0).all():
        return 0.0, 0.0
    unit = None if column.clock or heading.unit is None else known_unit(heading.name, heading.unit)
    factor = 1.0 if unit is None else units.to_si(unit, "s")
    return factor * float(values[-1] - values[0]), 2 * factor * column.resolution


def _is_counter(column: RawColumn, heading: Heading) -> bool:
    """Whether a column numbers the rows: its name says so, it has no unit, and it counts on evenly."""
    return heading.kind is None and counts_rows(heading.name) and counts_by(column.numbers.values) > 0


def counts_by(values: np.ndarray) -> int:
    """Step by which nearly all numbers of a column count on: 1, or more where not every sample was kept; 0 for none.

    Parameters
    ----------
    values : (n,) float array
        NaN where there is none.
    """
    steps = np.diff(values[np.isfinite(values)])
    usual = float(np.median(steps)) if steps.size else 0.0
    even = usual >= 1 and usual == round(usual) and np.mean(steps == usual) > COUNTS_ON
    return int(usual) if even else 0


def _by_rate(columns: Sequence[RawColumn]) -> list[Group]:
    members: dict[tuple[float | None, float, int], list[int]] = {}
    for i, column in enumerate(columns):
        members.setdefault((column.rate, column.start, column.numbers.values.size), []).append(i)
    return [Group(None, tuple(found), (), key[2]) for key, found in members.items()]


def _length(columns: Sequence[RawColumn]) -> int:
    return max((column.numbers.values.size for column in columns), default=0)


def _runs_forward(values: np.ndarray) -> bool:
    """Whether a column grows as times do; a pause or a delay that is only measured in seconds does not."""
    present = values[np.isfinite(values)]
    steps = np.diff(present)
    return steps.size > 0 and bool(2 * np.count_nonzero(steps >= 0) > steps.size and (steps > 0).any())


def _best_time(
    times: Sequence[int], columns: Sequence[RawColumn], headings: Sequence[Heading], named: int | None
) -> int | None:
    """Of several columns of times the one the user named, or one with a unit, or a clock; of two one that runs on."""
    if named in times:
        return named

    def suits(i: int) -> tuple[int, bool]:
        runs_on = not (np.diff(columns[i].numbers.values) < 0.0).any()  # that of a cycle begins anew
        return (headings[i].kind is not None) + (not columns[i].clock), runs_on

    return max(times, key=suits, default=None)


def _rows_used(column: RawColumn) -> int:
    filled = np.flatnonzero(column.numbers.reasons != CODE["empty"])
    return int(filled[-1]) + 1 if filled.size else 0
