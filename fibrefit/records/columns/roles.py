"""Which column is the time, the force, the position, the drive: stated by the user, or read from headings and units."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fibrefit.core import units
from fibrefit.core.errors import DataError, did_you_mean
from fibrefit.core.roles import ROLES
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.words import KIND_OF_ROLE, counts_rows, score

#: Roles looked for when nobody says which; two forces take the place of one they cannot be distinguished from.
USUAL = ("force", "position", "drive", "angle")
PAIR = ("force_1", "force_2")


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
    """

    header: str
    name: str
    unit: str | None
    clock: bool = False

    @property
    def kind(self) -> str | None:
        """Kind of quantity the unit tells; None where it tells nothing."""
        if self.clock:
            return "time"
        known = None if self.unit is None else known_unit(self.name, self.unit)
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
    if wanted.casefold().startswith("column ") and wanted[7:].strip().isdigit():
        number = int(wanted[7:])
        return number - 1 if 1 <= number <= len(headings) else None
    for plain in (str, _plain):
        for attribute in ("header", "name"):
            found = [i for i, h in enumerate(headings) if plain(getattr(h, attribute)) == plain(wanted)]
            if len(found) == 1:
                return found[0]
    return None


def _plain(text: str) -> str:
    return "".join(text.casefold().replace("µ", "u").replace("μ", "u").split())


def named_roles(channels: Mapping[str, str], headings: Sequence[Heading], where: str) -> dict[str, int]:
    """Columns the user named.

    Parameters
    ----------
    channels : mapping of str to str
        Header by role.
    headings : sequence of Heading
        All columns.
    where : str
        File to name in messages.

    Returns
    -------
    dict of str to int
        Position by role.

    Raises
    ------
    DataError
        If a role is not known, or a column is not found.
    """
    found = {}
    for role, header in channels.items():
        if role not in ROLES:
            raise DataError(
                f'{where}, channel "{role}"', "unknown role", f"one of {', '.join(ROLES)}", did_you_mean(role, ROLES)
            )
        place = find_column(str(header), headings)
        if place is None:
            present = [h.header for h in headings if h.header]
            known = ", ".join(f'"{text}"' for text in present[:8]) or "no headings"
            do = did_you_mean(str(header), [*present, *(h.name for h in headings)])
            raise DataError(f'{where}, channel "{role}"', f'no column "{header}"', f"one of {known}", do)
        found[role] = place
    return found


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
    # The drive first: a length that is not called a drive is then the position.
    for role in sorted((r for r in wanted if r not in taken), key=lambda r: r != "drive"):
        used = set(taken.values()) | set(found.values())
        points = {i: _points(h, role) for i, h in enumerate(headings) if i not in used}
        best = max(points.values(), default=0)
        candidates = [i for i, p in points.items() if p == best and p > 0]
        if len(candidates) == 1:
            found[role] = candidates[0]
        elif candidates and role != "drive":
            doubts[role] = _doubt(role, [headings[i] for i in candidates], where)
    for role in wanted:
        if role not in taken and role not in found and role not in doubts:
            doubts |= _wrong_unit(role, headings, where)
    if "force" in doubts and tuple(wanted) == USUAL:
        pair = guessed_roles(headings, {**taken, **found}, PAIR, where)[0]
        if len(pair) == len(PAIR):
            del doubts["force"]
            found |= pair
    return found, doubts


def _wrong_unit(role: str, headings: Sequence[Heading], where: str) -> dict[str, DataError]:
    """Doubt about a role that a column has by its name, but not by its unit: ``Kraft [V]``."""
    named = [h for h in headings if score(h.name, role) > 2 and h.kind is not None and KIND_OF_ROLE[role] != h.kind]
    if not named or role in ("drive", *PAIR):
        return {}
    place = f'{where}, column "{named[0].header}"'
    expected = units.ACCEPTED[ROLES[role]]
    return {role: DataError(place, f'unit "{named[0].unit}"', expected, "Declare it under [units].")}


def _points(heading: Heading, role: str) -> int:
    """How well a column suits a role: its words, if the unit does not speak against it; else its unit alone."""
    kind = heading.kind
    if (kind is not None and kind != KIND_OF_ROLE[role]) or (not heading.name and kind is None):
        return 0
    words = 10 * score(heading.name, role)
    if role in ("force_1", "force_2"):
        words += 5 if words and heading.name.rstrip(" )").endswith(role[-1]) else -words
    if role == "drive":
        return words if words > 10 else 0
    if role == "position" and score(heading.name, "drive") > 1:
        return 0
    return max(words + (5 if kind and words > 0 else 0), 4 if kind else 0)


def _doubt(role: str, candidates: Sequence[Heading], where: str) -> DataError:
    shown = " and ".join(f'"{h.header}"' for h in candidates[:3])
    got = f"columns {shown} could each be the {role.replace('_', ' ')}"
    return DataError(where, got, "one", f'Name it: {role} = "{candidates[0].header}" under [channels].')


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
