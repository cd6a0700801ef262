"""What a file says beside its numbers is accounted for: it was used, it changes nothing, or it is asked about.

Every claim is held against every column that is read. One that tells what a number is multiplied by, moved by, turned
by or counted in is a question, unless its own number leaves things as they are, it is about something else (another
channel, an amplifier, a picture), its unit shows that it was applied before, or it says so. A largest, a smallest or a
lasting that is claimed is compared with the one that was read.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from fibrefit.core import units as registry
from fibrefit.core.errors import DataError
from fibrefit.core.roles import ROLES
from fibrefit.records.columns.held import ReadColumn, held_columns
from fibrefit.records.columns.judged import doubt_of
from fibrefit.records.columns.raw import RawColumn, Told


def unaccounted(
    told: Sequence[Told],
    columns: Sequence[RawColumn],
    roles: Mapping[str, int],
    answered: frozenset[int],
    where: str,
    mark: str = ".",
) -> dict[str, DataError]:
    """Doubt about each role whose numbers something in the file may still change.

    Parameters
    ----------
    told : sequence of Told
        All the file says beside its numbers.
    columns : sequence of RawColumn
        Of the file, in the units the user declares.
    roles : mapping of str to int
        Position of each role.
    answered : frozenset of int
        Columns of which the user says what one of their numbers is worth.
    where : str
        File to name in messages.
    mark : str
        Decimal mark of its lines.

    Returns
    -------
    dict of str to DataError
        The first question of each role, by role.
    """
    found: dict[str, DataError] = {}
    for read in held_columns(columns, roles, answered):
        heading = Told(f'heading "{read.column.header}"', read.column.name, read.column.header)
        for one in (heading, *told):
            if one.of and one.of != read.column.header:
                continue
            doubt = doubt_of(one, read, mark)
            if doubt:
                found[read.role] = _question(one, read, doubt, where)
                break
    return found


def _question(one: Told, read: ReadColumn, doubt: str, where: str) -> DataError:
    usual = read.column.unit or registry.usual(ROLES[read.role])
    shown = " ".join(one.text.split())[:80]
    got = f'"{shown}" {doubt} "{read.column.header}"'
    if read.role == "time":
        usual, do = "s", 'Say what one number is worth: time = { column = "...", scale = "1 ms" } under [channels], or '
        do += f'scale = "1 {usual}" where the times are in it already.'
        return DataError(f"{where}, {one.place}", got, "times with nothing left to be done to them", do)
    do = f'Say what one number is worth: {read.role} = {{ column = "{read.column.header}", scale = "..." }} under '
    do += f'[channels]; scale = "1" where the numbers are in {usual} already, with nothing left to be done to them.'
    return DataError(f"{where}, {one.place}", got, f"numbers in {usual} with nothing left to be done to them", do)
