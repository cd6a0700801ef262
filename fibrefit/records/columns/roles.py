"""Which column is the time, the force, the position, the drive: stated by the user, or read from headings and units."""

from __future__ import annotations

import re
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from fibrefit.core import units
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError, did_you_mean
from fibrefit.records.columns.channel import Channel
from fibrefit.records.grammar.headings import known_unit, so_much_of, split_heading
from fibrefit.records.grammar.words import GO_BESIDE, KIND_OF_ROLE, counts_rows, is_no_reading, score, treated

#: Roles looked for when nobody says which; two forces take the place of one they cannot be distinguished from.
USUAL = ("force", "position", "drive", "angle")
PAIR = ("force_1", "force_2")
#: What is measured together: where one is read, counts of an unknown name may be the other.
PAIRED = ("force", "position")


@dataclass(frozen=True, slots=True)
class Heading:
    """What is known of a column before its values are looked at.

    Parameters
    ----------
    header, name : str
        As in the file, with and without unit.
    unit : str or None
        As written.
    clock : bool
        Whether the column holds clock times.
    number : int
        Which of the file's columns it is, counted from 1; 0 where it is only known by its place among the others.
    two_valued : bool
        Whether the column holds two values only, as a command does.
    constant : bool
        Whether it holds one value only, as a condition of the test does.
    """

    header: str
    name: str
    unit: str | None
    clock: bool = False
    number: int = 0
    two_valued: bool = False
    constant: bool = False

    @property
    def kind(self) -> str | None:
        """Kind of quantity the unit tells; None where it tells nothing."""
        if self.clock:
            return "time"
        known = None if self.unit is None else known_unit(self.name, self.unit)
        if known is None and (much := so_much_of(self.unit or "")):
            return units.kind_of(much[1])
        return None if known is None else units.kind_of(known)


def find_column(wanted: str, headings: Sequence[Heading]) -> int | None:
    """Position of the column a user means.

    Parameters
    ----------
    wanted : str
        Its header, with or without unit, or ``"column 3"``.
    headings : sequence of Heading
        All columns.

    Returns
    -------
    int or None
        None where there is no such column, or more than one.
    """
    number = column_number(wanted)
    if number is not None:
        numbers = [h.number or i + 1 for i, h in enumerate(headings)]
        return numbers.index(number) if number in numbers else None
    for plain in (str, _plain):
        for attribute in ("header", "name"):
            found = [i for i, h in enumerate(headings) if plain(getattr(h, attribute)) == plain(wanted)]
            if len(found) == 1:
                return found[0]
    return None


def column_number(text: str) -> int | None:
    """Number in ``"column 3"``; None for anything else."""
    match = re.fullmatch(r"column\s+([0-9]{1,6})", text.strip(), re.IGNORECASE)
    return int(match[1]) if match else None


def _plain(text: str) -> str:
    return "".join(text.casefold().replace("µ", "u").replace("μ", "u").split())


def named_roles(
    channels: Mapping[str, Channel], headings: Sequence[Heading], aside: Mapping[int, str], where: str
) -> dict[str, int]:
    """Columns the user named.

    Parameters
    ----------
    channels : mapping of str to Channel
        What the user says of each role.
    headings : sequence of Heading
        All columns of numbers.
    aside : mapping of int to str
        What the other columns of the file hold, by their number.
    where : str
        File to name in messages.

    Returns
    -------
    dict of str to int
        Position by role.

    Raises
    ------
    DataError
        If a column is not found, is named twice, or holds the time where another quantity is named.
    """
    found: dict[str, int] = {}
    for role, channel in channels.items():
        if channel.column is None:
            continue
        here = f'{where}, channel "{role}"'
        place = find_column(str(channel.column), headings)
        if place is None:
            raise _not_found(str(channel.column), headings, aside, here)
        twin = next((other for other, taken in found.items() if taken == place), None)
        if twin is not None:
            got = f'column "{headings[place].header}" is named for the {twin} too'
            raise DataError(here, got, "a column for each channel", "Correct one of the two.")
        if role != "time" and headings[place].kind == "time" and not (channel.unit or channel.scale):
            got = f'column "{headings[place].header}" holds the time'
            raise DataError(here, got, units.ACCEPTED[ROLES[role]], "Name another column.")
        found[role] = place
    return found


def _not_found(wanted: str, headings: Sequence[Heading], aside: Mapping[int, str], where: str) -> DataError:
    """Why a column a user named is not there: no such one, several of the name, or one without numbers."""
    same = [h.number or i + 1 for i, h in enumerate(headings) if _plain(wanted) in (_plain(h.header), _plain(h.name))]
    if len(same) > 1:
        numbers = ", ".join(f'"column {number}"' for number in same[:4])
        return DataError(where, f'{len(same)} columns "{wanted}"', "one", f"Name it by its number: one of {numbers}.")
    number = column_number(wanted)
    other = {place: what for place, what in aside.items() if place == number or f'"{wanted}"' in what}
    if other:
        place, what = next(iter(other.items()))
        return DataError(where, f"column {place} ({what})", "a column of numbers", "Name another column.")
    present = [h.header for h in headings if h.header]
    known = ", ".join(f'"{text}"' for text in present[:8]) or "no headings"
    columns = max([len(headings), *aside, *(h.number for h in headings)])
    do = did_you_mean(wanted, [*present, *(h.name for h in headings)])
    do = do or f'Write a heading as it stands in the file, or "column 1" to "column {columns}".'
    return DataError(where, f'no column "{wanted}"', f"one of {known}", do)


def guessed_roles(
    headings: Sequence[Heading], taken: Mapping[str, int], wanted: Sequence[str], where: str
) -> tuple[dict[str, int], dict[str, DataError]]:
    """Columns whose heading and unit leave no doubt; and, for each role that is in doubt, why.

    Parameters
    ----------
    headings : sequence of Heading
        All columns, those that hold the time marked as taken.
    taken : mapping of str to int
        Columns that have a role already.
    wanted : sequence of str
        Roles to look for.
    where : str
        File to name in messages.

    Returns
    -------
    tuple of dict and dict
        Position by role, and error by role.
    """
    found: dict[str, int] = {}
    doubts: dict[str, DataError] = {}
    unread: dict[str, DataError] = {}
    # The drive first: a length that is not called a drive is then the position.
    for role in sorted((r for r in wanted if r not in taken), key=lambda r: r != "drive"):
        used = set(taken.values()) | set(found.values())
        points = {i: _points(h, role) for i, h in enumerate(headings) if i not in used}
        commands = {i for i, p in points.items() if p > 0 and headings[i].two_valued}
        measured = {i: p for i, p in points.items() if i not in commands}
        best = max(measured.values(), default=0)
        candidates = [i for i, p in measured.items() if p == best and p > 0]
        if len(candidates) == 1:
            candidates += _below_the_same(candidates[0], headings, KIND_OF_ROLE[role], used)
            candidates += _treated_otherwise(candidates[0], measured, headings)
        kind = is_no_reading(headings[candidates[0]].name) if candidates and role != "drive" else ""
        if len(candidates) == 1 and kind:
            unread[role] = _no_reading(role, headings[candidates[0]], kind, where)
        elif len(candidates) == 1:
            found[role] = candidates[0]
        elif commands and not candidates and role != "drive":
            doubts[role] = _command(role, headings[max(commands, key=points.__getitem__)], where)
        elif candidates and role != "drive":
            doubts[role] = _doubt(role, [headings[i] for i in candidates], where)
    # What is wanted, or goes with a quantity, is left out beside what was measured; alone it may be what is meant. A
    # statistic or the like may be meant wherever nothing else is the quantity.
    alone = not found and not taken.keys() & ROLES.keys() - {"time"}
    doubts |= {role: doubt for role, doubt in unread.items() if alone or not doubt.got.startswith(GO_BESIDE)}
    for role in wanted:
        if role not in taken and role not in found and role not in doubts:
            used = {i for one, i in {**taken, **found}.items() if one != "time"}
            doubts |= _wrong_unit(role, headings, used, where)
    if "force" in doubts and tuple(wanted) == USUAL:
        pair = guessed_roles(headings, {**taken, **found}, PAIR, where)[0]
        numbered = [h for h in headings if re.search(r"[3-9][\s)]*$", h.name) and _points(h, "force") > 9]
        if len(pair) == len(PAIR) and not numbered:
            del doubts["force"]
            found |= pair
    return found, doubts


def _below_the_same(place: int, headings: Sequence[Heading], kind: str, used: Collection[int]) -> list[int]:
    """Columns to the right without a name and with a unit of the same kind: one heading spans them."""
    found = []
    for i in range(place + 1, len(headings)):
        if headings[i].header or headings[i].kind != kind or i in used:
            break
        found.append(i)
    return found


def _treated_otherwise(best: int, points: Mapping[int, int], headings: Sequence[Heading]) -> list[int]:
    """Columns that may be the same reading before or after a filter, or the like: which one is meant is a question.

    A plain heading beside one that is called filtered is the measured one.
    """
    mine = treated(headings[best].name)
    others = {i: treated(headings[i].name) for i, p in points.items() if p > 0 and i != best}
    named = {i for i in others if points[i] > 4 or others[i]} - {i for i in others if is_no_reading(headings[i].name)}
    same = {i for i in named if (headings[i].kind is None) == (headings[best].kind is None)}
    return [i for i in sorted(same) if others[i] != mine and (mine or others[i] == "raw")]


def nothing_below(
    found: Mapping[str, int], wanted: Sequence[str], aside: Mapping[int, str], where: str
) -> dict[str, DataError]:
    """Doubt about each role that no column has and one is called by, below whose heading no numbers stand.

    Parameters
    ----------
    found : mapping of str to int
        Position by role.
    wanted : sequence of str
        Roles to look for.
    aside : mapping of int to str
        What the columns without numbers hold, by their number.
    where : str
        File to name in messages.
    """
    doubts = {}
    for role in wanted:
        for place, what in aside.items() if role not in found and role != "drive" and found.keys() - {"time"} else ():
            name, unit = split_heading(what.split('"')[1])
            fits = unit is not None and units.kind_of(unit) == KIND_OF_ROLE[role]
            figures = re.search(r' is empty|, such as "[^"]*\d', what)
            if score(name, role) > 2 and (fits or (unit is None and figures)):
                other = next(iter(found.keys() - {"time"}))
                do = f"Save the numbers there, not formulas; or name the channels that are meant: {other} = ... under "
                got = f"{what}, and no other column is the {role}"
                doubts[role] = DataError(f"{where}, column {place}", got, f"a measured {role}", f"{do}[channels].")
    return doubts


def _wrong_unit(role: str, headings: Sequence[Heading], used: Collection[int], where: str) -> dict[str, DataError]:
    """Doubt about a role that a column has by its name, but not by its unit: ``Kraft [V]``; or may have, in counts."""
    if role in ("drive", *PAIR):
        return {}
    named = [h for h in headings if score(h.name, role) > 2 and h.kind is not None and KIND_OF_ROLE[role] != h.kind]
    if not named and role == "force":  # what hangs on a cell is often read in kg
        named = [h for i, h in enumerate(headings) if i not in used and h.kind == "mass" and not h.constant]
    counts = [h for i, h in enumerate(headings) if i not in used and h.kind == "number" and not counts_rows(h.name)]
    if not named and used and len(counts) == 1 and role in PAIRED:
        named = [h for h in counts if not any(score(h.name, other) for other in ROLES)]
    if not named:
        return {}
    return {role: wrong_kind(role, named[0].header, named[0].unit or "", where)}


_WEIGHTS = {"kg": "kgf", "g": "gf", "lb": "lbf"}


def wrong_kind(role: str, header: str, unit: str, where: str) -> DataError:
    """Refusal of a column whose unit measures something else than its role, with what would make it that.

    Parameters
    ----------
    role : str
        One of `ROLES`.
    header, unit : str
        Of the column, as written.
    where : str
        File to name in the message.
    """
    place, si = f'{where}, column "{header}"', ROLES[role]
    weight = _WEIGHTS.get((units.expression(unit) or "").strip("()")) if si == "N" else None
    if weight is not None:
        do = f'If it is the force of that weight: {role} = "{weight}" under [units].'
        return DataError(place, f'unit "{unit}", a mass', units.ACCEPTED[si], do)
    if is_signal(unit):
        stated = with_gain(role, header, unit)
        do = f"State what it is worth, by the sensitivity of its sensor: {stated} under [channels]."
        return DataError(place, f'unit "{unit}", a signal', units.ACCEPTED[si], do)
    do = f"Say what it is worth: {with_gain(role, header, unit)} under [channels], "
    do += f'or correct its unit: {role} = ".." under [units].'
    return DataError(place, f'unit "{unit}"', units.ACCEPTED[si], do)


def is_signal(unit: str) -> bool:
    """Whether a unit is that of a sensor's signal, as V, mA, mV/V or counts: it measures nothing without a gain."""
    return units.kind_of(unit) in ("voltage", "current", "number")


def with_gain(role: str, header: str, unit: str) -> str:
    """How a study states what one unit of a column is worth, with the number left open."""
    usual = units.usual(ROLES[role])
    worth = usual if units.kind_of(unit) in (None, "number") else f"{usual}/{unit}"
    return f'{role} = {{ column = "{header}", scale = ".. {worth}" }}'


def _points(heading: Heading, role: str) -> int:
    """How well a column suits a role: its words, if the unit does not speak against it; else its unit alone."""
    kind = heading.kind
    if (kind is not None and kind != KIND_OF_ROLE[role]) or (not heading.name and kind is None):
        return 0
    words, other = 10 * score(heading.name, role), is_no_reading(heading.name)
    if words and ((kind is None and treated(heading.name) == "raw") or other not in ("", *GO_BESIDE)):  # raw: counts
        words = max(words - 20, 1)
    if role in PAIR:
        if not heading.name.rstrip(" )").endswith(role[-1]) or heading.name[-2:-1] == ".":  # pandas counts alike names
            return 0
        words += 5 if words else 0
    if role == "drive":
        return words if words > 10 else 0
    if role == "position" and score(heading.name, "drive") > 1:
        return 0
    # A height or a preload that is written into every row has the unit of a reading.
    by_unit = 0 if heading.constant else 3 if other else 4
    return max(words + (5 if kind and words > 0 else 0), by_unit if kind else 0)


def _doubt(role: str, candidates: Sequence[Heading], where: str) -> DataError:
    done = [treated(h.name) for h in candidates]
    # Of the same reading before and after a filter the one before it is advised.
    best = next((done.index(kind) for kind in ("raw", "") if kind in done), 0) if any(done) else 0
    names = [h.header or f"column {h.number}" for h in candidates]
    if len(set(names)) < len(names) and all(h.number for h in candidates):  # a heading that stands twice names none
        names = [f"column {h.number}" for h in candidates]
    first = names[best] if all(h.header for h in candidates) else f"column {candidates[best].number}"
    shown = " and ".join(f'"{name}"' for name in names[:3])
    shown += f' ("{candidates[0].header}")' if names[0] != candidates[0].header and candidates[0].header else ""
    got = f"columns {shown} could each be the {role.replace('_', ' ')}"
    why = "The record is wanted as it was measured: a filter or a mean changes what is found. " if any(done) else ""
    return DataError(where, got, "one", f'{why}Name it: {role} = "{first}" under [channels].')


def _no_reading(role: str, heading: Heading, kind: str, where: str) -> DataError:
    do = f'If it is what was measured, name it: {role} = "{heading.header}" under [channels].'
    got = f"{kind} by its name, and no other column is the {role.replace('_', ' ')}"
    return DataError(f'{where}, column "{heading.header}"', got, f"a measured {role.replace('_', ' ')}", do)


def _command(role: str, heading: Heading, where: str) -> DataError:
    got = "two values only, as a command has"
    do = f'If it was measured, name it: {role} = "{heading.header}" under [channels].'
    return DataError(f'{where}, column "{heading.header}"', got, f"a measured {role.replace('_', ' ')}", do)


def is_time(heading: Heading) -> bool:
    """Whether a column may hold the time: a clock, a unit of time, or a word for time and no unit.

    Parameters
    ----------
    heading : Heading
        A column.

    Returns
    -------
    bool
        True where it may.
    """
    if heading.clock or heading.kind == "time":
        return True
    return (
        heading.kind is None
        and heading.unit is None
        and score(heading.name, "time") > 0
        and not counts_rows(heading.name)
    )
