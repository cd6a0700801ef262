"""What a file says beside its numbers is accounted for: it was used, it changes nothing, is asked about or repeated.

Every claim is held against every column that is read. One that tells what a number is multiplied by, moved by, turned
by or counted in is a question, unless its own number leaves things as they are, it is about something else (another
channel, an amplifier, a picture), its unit shows that it was applied before, or it says so. A largest, a smallest or a
lasting that is claimed is compared with the one that was read.
"""

from __future__ import annotations

import itertools
import re
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from fibrefit.core import units as registry
from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError
from fibrefit.records.columns.held import ReadColumn, held_columns, kinds_of_offset, offset_around
from fibrefit.records.columns.judged import doubt_of, formula_in, stated_over_read
from fibrefit.records.columns.known import AsRead, agrees, is_of_times, kinds_of, states_unit, unknown_in
from fibrefit.records.columns.raw import Annotation, RawColumn
from fibrefit.records.columns.unmoved import DESIGNATION, is_measured, opens_section, tells_change
from fibrefit.records.grammar.claims import Amount, Claim, claims_of
from fibrefit.records.grammar.phrases import GIVE_RATE
from fibrefit.records.grammar.words import kinds_named, score, tokens
from fibrefit.records.thresholds import SAME_PEAK, STATED_ALIKE


def unaccounted(
    annotations: Sequence[Annotation],
    columns: Sequence[RawColumn],
    roles: Mapping[str, int],
    answered: frozenset[int],
    where: str,
    setting: AsRead,
) -> tuple[dict[str, DataError], list[Annotation]]:
    """Doubt about each role whose numbers something in the file may still change, and what is not understood besides.

    Parameters
    ----------
    annotations : sequence of Annotation
        All the file says beside its numbers.
    columns : sequence of RawColumn
        Of the file, in the units the user declares.
    roles : mapping of str to int
        Position of each role.
    answered : frozenset of int
        Columns of which the user says what one of their numbers is worth.
    where : str
        File to name in messages.
    setting : AsRead
        The table.

    Returns
    -------
    found : dict of str to DataError
        The first question of each role, by role.
    unsure : list of Annotation
        What is said of what is measured, and tells no change of it that is known: to be repeated, and not asked.
    """
    reads = held_columns(columns, roles, answered)
    found = _doubted(annotations, reads, setting.mark, where) | _made_of_others(annotations, columns, roles, where)
    names = frozenset(w for c in columns for w in tokens(c.name) if not score(w, "time"))
    unsure: dict[str, Annotation] = {}
    unlike = _differing(annotations, setting.mark)
    said = [*_of_headings(reads, setting.mark, names), *_unknown(annotations, setting.mark, names)]
    for one, claim, open_question in said:
        confirmed = any(abs(stated_over_read(claim, read, one) - 1.0) < SAME_PEAK for read in reads)
        if confirmed or agrees(one.text, claim, setting):
            continue
        apart = tuple(a for a in claim.amounts if a.unit) in unlike
        of_times = is_of_times(claim, names) or kinds_named(DESIGNATION.sub(" ", one.text)) == {"time"}
        moved = open_question or apart or any(_weighs(claim, read) for read in reads)
        if not moved or (of_times and roles.get("time", -1) in answered):
            unsure.setdefault(one.place, one)
        elif of_times:
            found.setdefault("time", _of_times(one, roles, columns, where))
        else:
            kinds = kinds_of(claim, names)
            may_be = [r for r in reads if r.role != "time" and (not kinds or r.kind in kinds)]
            may_be = [read for read in may_be if read.is_open(claim.about, one)]
            for read, told in _moved(claim, one, may_be, setting.mark):
                found.setdefault(read.role, _question(one, read, "is not known to leave as it is", where, told))
    for read in reads:
        for one in _unlisted(annotations) if not read.settled else ():
            if states_unit(one.text, read.kind, read.unit) and one.of in ("", read.column.header):
                found.setdefault(read.role, _question(one, read, "tells another unit than that of", where))
    return found, list(unsure.values())


def _moved(
    claim: Claim, one: Annotation, may_be: Sequence[ReadColumn], mark: str
) -> Iterator[tuple[ReadColumn, Claim]]:
    """Of columns that a claim may move those that it does, each with what it tells: an offset those in its unit."""
    told = offset_around(claim, one.text, mark)
    kinds = kinds_of_offset(told)
    for read in [read for read in may_be if read.kind in kinds] or may_be:
        if not read.is_answered(told):
            yield read, told


def _differing(annotations: Sequence[Annotation], mark: str) -> frozenset[tuple[Amount, ...]]:
    """Amounts by which one is made two of another: 500 N are 2.000 mV/V here and 2.163 mV/V there."""
    found: dict[tuple[float, str, str], set[tuple[Amount, ...]]] = {}
    for claim in (claim for one in annotations if not one.of for claim in claims_of(one.text, mark)):
        first, *others = amounts = tuple(amount for amount in claim.amounts if amount.unit) or (Amount(0.0),)
        if len(others) == 1:
            found.setdefault((first.value, first.unit, others[0].unit), set()).add(amounts)
    return frozenset(amounts for several in found.values() if len(several) > 1 for amounts in several)


def _weighs(claim: Claim, read: ReadColumn) -> bool:
    """Whether the force begins at the weight of a mass that is stated of the sensor: it hangs below it."""
    values = read.column.numbers.values[np.isfinite(read.column.numbers.values)]
    if read.kind != "force" or read.unit is None or not values.size or not any(map(is_measured, tokens(claim.about))):
        return False
    start = abs(float(np.median(values[: len(values) // 50 + 1]))) * registry.to_si(read.unit, "N")
    kilogram = registry.to_si("kgf", "N")
    weights = [kilogram * a.value * registry.to_si(a.unit, "kg") for a in claim.amounts if a.kind == "mass"]
    return any(max(start, weight) <= STATED_ALIKE * min(start, weight) for weight in weights if start > 0)


def _doubted(
    annotations: Sequence[Annotation], reads: Sequence[ReadColumn], mark: str, where: str
) -> dict[str, DataError]:
    """The first line of each role that tells what may still be done to it."""
    found = {}
    for read in reads:
        about = [one for one in (_heading_of(read), *annotations) if one.of in ("", read.column.header)]
        doubts = ((one, doubt) for one in about if (doubt := doubt_of(one, read, mark)))
        for one, doubt in itertools.islice(doubts, 1):
            found[read.role] = _question(one, read, doubt, where)
    return found


def _made_of_others(
    annotations: Sequence[Annotation], columns: Sequence[RawColumn], roles: Mapping[str, int], where: str
) -> dict[str, DataError]:
    """Questions about what no column holds as it is, and a formula makes of one: ``F = 100 * U1``."""
    found = {}
    for one in annotations:
        left, right = formula_in(one.text)
        unread = [c for i, c in enumerate(columns) if i not in roles.values() and right == c.name]
        for column in unread[:1]:
            for role in (role for role in ROLES if role not in roles and score(left, role) > 0):
                do = f'Say so: {role} = {{ column = "{column.header}", scale = "..." }} under [channels].'
                got = f'"{" ".join(one.text.split())[:80]}" makes it of "{column.header}"'
                found[role] = DataError(f"{where}, {one.place}", got, f"a column of the {role}", do)
    return found


def _heading_of(read: ReadColumn) -> Annotation:
    """What the heading of a column says beside its unit."""
    return Annotation(f'heading "{read.column.header}"', read.column.name, read.column.header)


def _of_headings(
    reads: Sequence[ReadColumn], mark: str, names: frozenset[str]
) -> Iterator[tuple[Annotation, Claim, bool]]:
    """Claims of headings that tell a change. A number in one is of its unit, or tells which channel it is."""
    for read in reads:
        heading = _heading_of(read)
        for claim, moves in unknown_in(heading.text, mark, names):
            if moves and any(tells_change(word) and not kinds_named(word) for word in tokens(claim.about)):
                yield heading, claim, moves


def _unknown(
    annotations: Sequence[Annotation], mark: str, names: frozenset[str]
) -> Iterator[tuple[Annotation, Claim, bool]]:
    """Claims that are not known to be harmless, with what they stand in; those of a section on a channel are of it."""
    of_channel = False
    for one in _unlisted(annotations):
        section = opens_section(one.text, names)
        of_channel = of_channel if section is None else section
        yield from ((one, *found) for found in unknown_in(one.text, mark, names, of_channel))


def _unlisted(annotations: Sequence[Annotation]) -> list[Annotation]:
    """What is said, without lines of which every cell is said of its column too."""
    cells: dict[str, str] = {}
    for one in annotations:
        if one.of:
            cells[one.place] = f"{cells.get(one.place, '')} {one.text}"

    def listed(one: Annotation) -> bool:
        parts = [cell.strip(' "') for cell in re.split(r"[;,\t|]", one.text)]
        return not one.of and one.place in cells and all(part in cells[one.place] for part in parts)

    return [one for one in annotations if not listed(one)]


def _of_times(one: Annotation, roles: Mapping[str, int], columns: Sequence[RawColumn], where: str) -> DataError:
    """Question about what may bear on the times, of a column or counted off."""
    got = f'"{" ".join(one.text.split())[:80]}" is not known to leave the times as they are'
    do = _timed(columns[roles["time"]]) if "time" in roles else GIVE_RATE
    return DataError(f"{where}, {one.place}", got, "times with nothing left to be done to them", do)


def _timed(column: RawColumn) -> str:
    """What to say of times that are as they stand, or not."""
    none, other = ("1", "0.001") if column.unit else ("1 s", "1 ms")
    unit = column.unit or "s"
    do = f'Say what one number is worth: time = {{ column = "{column.header}", scale = "{other}" }} under [channels]'
    return f'{do}, or scale = "{none}" where the times are in {unit} already, with nothing left to be done to them.'


def _question(one: Annotation, read: ReadColumn, doubt: str, where: str, claim: Claim | None = None) -> DataError:
    usual = read.column.unit or registry.usual(ROLES[read.role])
    shown = " ".join(one.text.split())[:80]
    got = f'"{shown}" {doubt} "{read.column.header}"'
    zero = None if claim is None else read.zero_by(claim)
    said = "Say what one number is worth" if zero is None else "Say what the column reads without load"
    either = re.search(r"\d,\d{3}(?!\d)", one.text)  # thousands, or decimals
    answer = 'scale = "..."' if zero is None else "zero = ..." if either else f"zero = {zero:.9g}"
    do = f'{said}: {read.role} = {{ column = "{read.column.header}", {answer} }} under '
    do += f'[channels]; scale = "1" where the numbers are in {usual} already, with nothing left to be done to them.'
    return DataError(f"{where}, {one.place}", got, f"numbers in {usual} with nothing left to be done to them", do)
