"""What the user says of columns, applied to them: units and scales. A declaration that hits nothing is refused."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from fibrefit.core import units as registry
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError, did_you_mean
from fibrefit.core.units import Scale
from fibrefit.records.columns.channel import Channel
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.columns.roles import Heading, find_column
from fibrefit.records.grammar.headings import known_unit, so_much_of
from fibrefit.records.grammar.words import KIND_OF_ROLE, may_be_way, score, tokens
from fibrefit.records.grammar.worth import MERE_FACTOR, OF_COUNTS, are_whole, stated_worth
from fibrefit.records.stamps import stamps_of
from fibrefit.records.thresholds import MOST_LOST, TWO_VALUED

_SUGGESTED = ("N", "mm", "ms", "V", "counts")

_LAST_BRACKET = re.compile(r"[\[(]([^\[\]()]*)[\])]\s*$")

#: Scale of a column, its factor to SI, and the SI unit.
Scaled = tuple[Scale, float, str]


def with_factors_beside(columns: Sequence[RawColumn]) -> list[RawColumn]:
    """Columns beside which another one, or their heading, holds what their numbers may still have to be multiplied by.

    Parameters
    ----------
    columns : sequence of RawColumn
        As read: ``force_N`` and ``force_scale``, or ``force [N] (LSB 0.001)`` above whole numbers.
    """
    found = [
        replace(c, worth=f'"{c.header}"') if OF_COUNTS.search(c.header) and are_whole(c.numbers.values) else c
        for c in columns
    ]
    much = [bool(c.unit and not c.clock and so_much_of(c.unit)) for c in found]
    found = [replace(c, worth=f'"{c.unit}"') if parts else c for c, parts in zip(found, much, strict=True)]
    for beside in columns:
        words = tokens(beside.name)
        present = beside.numbers.values[np.isfinite(beside.numbers.values)]
        if words and MERE_FACTOR.issuperset(words) and present.size and not (present == 1.0).all():
            worth = f'column "{beside.header}" ({present[present != 1.0][0]:g})'
            found = [c if c is beside or c.worth or _of_time(c) else replace(c, worth=worth) for c in found]
        if beside.unit is not None or len(words) < 2 or not present.size:
            continue
        for i, column in enumerate(columns):
            if column is beside or column.worth or column.clock or tokens(column.name)[:1] != words[:1]:
                continue
            kind = np.ones(1, np.int64 if are_whole(column.numbers.values) else np.float64)
            # Where it changes from row to row, one of its values that would change something tells enough.
            worth = next((worth for v in np.unique(present)[:9] if (worth := stated_worth({beside.name: v}, kind))), "")
            found[i] = replace(column, worth=f'column "{beside.header}" ({worth})') if worth else found[i]
    return found


def _of_time(column: RawColumn) -> bool:
    return column.clock or registry.kind_of(column.unit or "") == "time" or score(column.name, "time") > 0


def headings_of(columns: Sequence[RawColumn], units: Mapping[str, str]) -> list[Heading]:
    """What is known of each column; a unit that is declared by its heading helps to tell what the column is.

    Parameters
    ----------
    columns : sequence of RawColumn
        As read.
    units : mapping of str to str
        Unit by role or heading.

    Returns
    -------
    list of Heading
        One for each column.
    """
    headings = [_heading(column) for column in columns]
    for key, unit in units.items():
        place = _called(key, headings) if key in ROLES else find_column(key, headings)
        if place is not None:
            headings[place] = replace(headings[place], unit=unit)
    return headings


def _called(role: str, headings: Sequence[Heading]) -> int | None:
    """The one column that a role is called and that has a unit of something else, which a declared one corrects."""
    kind = KIND_OF_ROLE[role]
    found = [i for i, h in enumerate(headings) if score(h.name, role) > 2 and h.kind not in (None, kind)]
    others = any(h.kind == kind for h in headings)
    return found[0] if len(found) == 1 and not others else None


def _heading(column: RawColumn) -> Heading:
    present = column.numbers.values[np.isfinite(column.numbers.values)]
    two_valued = constant = False
    if present.size >= TWO_VALUED and len(set(present[:TWO_VALUED].tolist())) <= 2:
        low, high = present.min(), present.max()
        two_valued = bool(low < high and ((present == low) | (present == high)).all())
        constant = bool(low == high)
    stamps = stamps_of(present) if column.unit is None else None
    # Counts under another name may be as large: they are stamps where as such they have a rate that records have.
    so_called = not column.name or score(column.name, "time") > 0
    stamped = stamps is not None and (so_called or stamps.likely)
    clock = column.clock or (stamped and np.mean(np.diff(present) > 0) >= 1 - MOST_LOST)
    return Heading(column.header, column.name, column.unit, clock, column.number, two_valued, constant)


def unread_position(
    roles: Mapping[str, int], doubts: Mapping[str, DataError], headings: Sequence[Heading], where: str
) -> dict[str, DataError]:
    """Doubt about the position where a force is read, and a column that may be one is not, as its unit is not known.

    Parameters
    ----------
    roles : mapping of str to int
        Position of each role that was found.
    doubts : mapping of str to DataError
        Roles in doubt.
    headings : sequence of Heading
        All columns.
    where : str
        File to name in messages.
    """
    if "position" in {*roles, *doubts} or "force" not in roles or headings[roles["force"]].kind != "force":
        return {}
    free = [h for i, h in enumerate(headings) if i not in roles.values() and not (h.constant or h.two_valued)]
    looks = next((h for h in free if h.kind is None and may_be_way(re.sub(r"[\[(].*", "", h.header))), None)
    if looks is None:
        return {}
    unit = _LAST_BRACKET.search(looks.header)
    state = f'not known ("{unit[1]}")' if unit else "not stated"
    got = f"it may be the position, and its unit is {state}"
    force = headings[roles["force"]].header
    do = f'Say what it is: position = {{ column = "{looks.header}", unit = ".." }} under [channels]; if it is none, '
    do += f'name the force alone: force = "{force}" under [channels].'
    return {"position": DataError(f'{where}, column "{looks.header}"', got, registry.ACCEPTED["m"], do)}


@dataclass(frozen=True, slots=True)
class Declared:
    """Where what the user says belongs.

    Parameters
    ----------
    headings : sequence of Heading
        All columns.
    roles : mapping of str to int
        Position of each role.
    times : sequence of int
        Positions of the columns of times, one for each group of columns.
    where : str
        File to name in messages.
    """

    headings: Sequence[Heading]
    roles: Mapping[str, int]
    times: Sequence[int]
    where: str

    def with_units(self, columns: Sequence[RawColumn], said: Mapping[str, str]) -> tuple[list[RawColumn], list[str]]:
        """Columns with the units the user declares, by role, heading or number of the column; and remarks.

        Raises
        ------
        DataError
            If there is no such column, or the unit is not known.
        """
        result, remarks = list(columns), []
        for key, unit in said.items():
            place = self.roles[key] if key in self.roles else find_column(key, self.headings)
            if place is None:
                raise self._hits_nothing(key)
            column = columns[place]
            if registry.expression(unit) is None:
                expected = registry.ACCEPTED[ROLES[key]] if key in ROLES else f"a known unit, such as {_SUGGESTED[0]}"
                do = did_you_mean(unit, _SUGGESTED)
                raise DataError(f'{self.where}, unit of "{key}"', f'unit "{unit}"', expected, do)
            if column.unit is not None and registry.expression(column.unit) != registry.expression(unit):
                remarks.append(f'Column "{column.header}" is read in {unit}, as declared, not in {column.unit}.')
            # Each group of columns may have times of its own: what is said of the time is said of all of them.
            same = [i for i in self.times if result[i].unit is None] if key == "time" else []
            for i in {place, *same}:
                result[i] = replace(result[i], unit=unit)
        return result, remarks

    def _hits_nothing(self, key: str) -> DataError:
        """A unit declared for what the file does not have."""
        present = [h.header for h in self.headings if h.header]
        shown = ", ".join(f'"{text}"' for text in present[:8])
        where = f'{self.where}, unit of "{key}"'
        if key in ROLES:
            example = present[0] if present else "column 1"
            do = f'Name its column: {key} = "{example}" under [channels], or drop the unit.'
            return DataError(where, f"no column is known to be the {key}", f"one of {shown}", do)
        do = did_you_mean(key, [*present, *ROLES]) or "Correct the heading, or drop the unit."
        return DataError(where, "no such column", f"a role, or one of {shown}", do)

    def scales(
        self, channels: Mapping[str, Channel], columns: Sequence[RawColumn], doubts: Mapping[str, DataError]
    ) -> dict[int, Scaled]:
        """Scale, factor to SI and SI unit of each column that has a scale.

        Raises
        ------
        DataError
            If a scale has no column, or does not turn its numbers into the role's quantity.
        """
        found = {}
        for role, channel in channels.items():
            if channel.scale is None:
                continue
            if role not in self.roles and role in doubts:
                raise doubts[role]
            if role not in self.roles:
                do = f'Name its column: {role} = {{ column = "...", scale = "{channel.scale.text}" }}.'
                got = "a scale, and no column it belongs to"
                raise DataError(f'{self.where}, channel "{role}"', got, "its column", do)
            column = columns[self.roles[role]]
            unit = self._unit(column, channel.scale, ROLES[role])
            factor = channel.scale.factor(unit, ROLES[role], self._place(column), error=DataError)
            found[self.roles[role]] = (channel.scale, factor, ROLES[role])
        return found

    def with_zeros(self, columns: Sequence[RawColumn], channels: Mapping[str, Channel]) -> list[RawColumn]:
        """Columns with the number that stands for nothing, of each that has one.

        Raises
        ------
        DataError
            If a zero has no column.
        """
        for role, channel in channels.items():
            if channel.zero and role not in self.roles:
                do = f'Name its column: {role} = {{ column = "...", zero = {channel.zero:.15g} }}.'
                raise DataError(
                    f'{self.where}, channel "{role}"', "a zero, and no column it belongs to", "its column", do
                )
        zeros = {self.roles[role]: channel.zero for role, channel in channels.items() if channel.zero}
        return [replace(column, zero=zeros.get(i, 0.0)) for i, column in enumerate(columns)]

    def unapplied(
        self, columns: Sequence[RawColumn], scales: Mapping[int, Scaled], said: Mapping[str, str]
    ) -> dict[str, DataError]:
        """Doubt about each role whose numbers the file lets mean two things, and the user does not say which.

        Parameters
        ----------
        columns : sequence of RawColumn
            Of the file.
        scales : mapping of int to Scaled
            What the user says one number of a column is worth.
        said : mapping of str to str
            Units the user declares, by role or heading.
        """
        found = {}
        stated = {place for key in said if (place := self.roles.get(key, find_column(key, self.headings))) is not None}
        for role, place in self.roles.items():
            column = columns[place]
            if place in scales or role not in ROLES:
                continue
            usual = registry.usual(ROLES[role])
            much = so_much_of(column.worth.strip('"'))
            if much is not None:
                scales_to = f'scale = "{much[0]:.9g} {much[1]}"'
                do = f'Say what one number is worth: {role} = {{ column = "{column.header}", {scales_to} }} under '
                do += f'[channels]; scale = "1 {much[1]}" where the numbers are in {much[1]} already.'
                got = f"its unit is {column.worth}: one number may be worth {much[0]:.9g} {much[1]}"
                found[role] = DataError(self._place(column), got, f"numbers in {much[1]}", do)
            elif column.worth:
                do = f'Say what one number is worth: {role} = {{ column = "{column.header}", scale = "..." }} under '
                do += f'[channels]; scale = "1" where the numbers are in {column.unit or usual} already.'
                got = f"{column.worth} beside numbers that may be before it"
                found[role] = DataError(self._place(column), got, f"numbers in {column.unit or usual}", do)
            elif column.contradicted and place not in stated:
                do = f'Say which it is: {role} = "{column.unit or usual}" under [units].'
                found[role] = DataError(self._place(column), column.contradicted, "one unit", do)
        return found

    def _unit(self, column: RawColumn, scale: Scale, si: str) -> str | None:
        """Unit of the numbers; None where it is not known and the scale is in the quantity itself, as for counts."""
        unit = None if column.unit is None else known_unit(column.name, column.unit)
        if column.unit is not None and unit is None and registry.kind_of(scale.unit) != registry.kind_of(si):
            do = 'Say what the numbers are in: unit = "V" beside the scale, or unit = "counts".'
            got = f'unit "{column.unit}" is not known, so the scale has no meaning'
            raise DataError(self._place(column), got, "", do)
        return unit

    def _place(self, column: RawColumn) -> str:
        return f'{self.where}, column "{column.header}"'
