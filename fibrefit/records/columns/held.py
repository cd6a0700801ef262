"""A column that is read, as what is said beside the numbers is held against it."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from fibrefit.core import units as registry
from fibrefit.core.declarations import ROLES
from fibrefit.records.columns.bearing import OF_SENSORS, OTHER_QUANTITY
from fibrefit.records.columns.lexicon import MULTIPLIES, OFFSETS
from fibrefit.records.columns.raw import Annotation, RawColumn
from fibrefit.records.columns.unmoved import NO_QUANTITY
from fibrefit.records.grammar.claims import Amount, Claim, claims_of
from fibrefit.records.grammar.headings import known_unit
from fibrefit.records.grammar.words import kinds_named, tokens


@dataclass(frozen=True, slots=True)
class ReadColumn:
    """A column that is read for a role, and what is to be known of it.

    Parameters
    ----------
    role : str
        One of `ROLES`.
    column : RawColumn
        In the unit the user declares.
    kind : str
        Kind of quantity.
    unit : str or None
        In a known spelling.
    place, beside : int
        Which of the columns that are no times it is, from 0, and how many these are.
    others : frozenset of str
        Words of the names of the other columns.
    settled : bool
        Whether the user says of some column of readings what one of its numbers is worth: what is said of none by name
        is answered.
    zeroed : bool
        Whether the user says of some column of readings what it reads without load.
    """

    role: str
    column: RawColumn
    kind: str
    unit: str | None
    place: int
    beside: int
    others: frozenset[str]
    settled: bool
    zeroed: bool = False

    def zero_by(self, claim: Claim) -> float | None:
        """Number of the column that stands for nothing by what is claimed; None where no offset of its kind is."""
        if not is_of_offset(claim) or self.unit is None:
            return None
        mine = [a for a in claim.amounts if not a.unit or _measures(a) == self.kind]
        if len(mine) != 1:
            return None
        amount, weight = mine[0], mine[0].kind == "mass"
        si = registry.si_unit(self.unit) or ""
        worth = registry.to_si(amount.unit, "kg") * registry.to_si("kgf", "N") if weight else 0.0
        worth = worth or registry.to_si(amount.unit or self.unit, si)
        return amount.value * worth / registry.to_si(self.unit, si)

    def is_answered(self, claim: Claim) -> bool:
        """Whether a claim is of an offset, and the user states a zero: of the column, or of one where none is named."""
        if not is_of_offset(claim):
            return False
        own = any(_measures(amount) == self.kind for amount in claim.amounts)
        return bool(self.column.zero) or (self.zeroed and not own and not self.named(claim.about))

    def concerns(self, about: str, one: Annotation) -> bool:
        """Whether words are about the column: they name it, its quantity, or no channel at all."""
        if one.of:
            return True
        words = set(tokens(about))
        if words & set(tokens(self.column.name)):
            return True
        kinds = kinds_named(about)
        if self.kind in kinds:
            return True
        named = words & self.others or kinds or OTHER_QUANTITY.search(about)
        return not named

    def is_open(self, about: str, one: Annotation) -> bool:
        """Whether what is not known to be harmless may bear on the column, and the user has not answered it.

        A claim that names no quantity is about those that its line names.
        """
        if one.of:
            return one.of == self.column.header
        mine = set(tokens(self.column.name))
        if set(tokens(about)) & self.others and not set(tokens(about)) & mine:
            return False
        if not (kinds_named(_quantities(about, mine)) - {"time"} or set(tokens(about)) & mine):
            about = one.text
        sensors = {kind for kind, words in OF_SENSORS.items() if words.search(about)}
        if sensors:
            return self.kind in sensors or bool(set(tokens(about)) & mine)
        about = _quantities(about, mine)
        return self.named(about) if self.settled or kinds_named(about) - {"time"} else self.role != "time"

    def named(self, about: str) -> bool:
        """Whether words name the column, or its quantity."""
        words = tokens(about)
        several = " ".join(word.removesuffix("s") if len(word) > 3 else word for word in words)
        return bool(set(words) & set(tokens(self.column.name))) or self.kind in kinds_named(about) | kinds_named(
            several
        )

    def own(self, claim: Claim) -> Sequence[Amount]:
        """Of a row with a number for each column that of this one; else all of them."""
        if len(claim.amounts) < 2 or self.beside < 2:
            return claim.amounts
        if len(claim.amounts) == self.beside:
            return claim.amounts[self.place : self.place + 1]
        first = self.column.number - 1
        return (
            claim.amounts[first : first + 1] if first >= 0 and len(claim.amounts) == self.beside + 1 else claim.amounts
        )


def is_of_offset(claim: Claim) -> bool:
    """Whether a claim tells by how much readings are off, and nothing that they are to be multiplied by."""
    words = tokens(claim.about)
    if not claim.amounts or any(map(MULTIPLIES.fullmatch, words)) or not any(map(OFFSETS.fullmatch, words)):
        return False
    return all(not a.factor and (not a.unit or _measures(a) in ("force", "length", "angle")) for a in claim.amounts)


def kinds_of_offset(claim: Claim) -> frozenset[str]:
    """Kinds of quantity of which a claim tells an offset, by its units; empty where it tells none, or has none."""
    if not is_of_offset(claim) or not all(amount.unit for amount in claim.amounts):
        return frozenset()
    return frozenset(_measures(amount) or "" for amount in claim.amounts)


def offset_around(claim: Claim, line: str, mark: str) -> Claim:
    """The offset that a line tells, of which a claim without a number is a part: ``offset 3 N, still in the data``.

    Digits behind a comma are decimals, also beside a table with a point.

    Parameters
    ----------
    claim : Claim
        Of the line.
    line : str
        As in the file.
    mark : str
        Decimal mark of the table.
    """
    decimals = re.search(r"\d,\d", line)
    if (claim.amounts and not decimals) or any(map(MULTIPLIES.fullmatch, tokens(claim.about))):
        return claim
    mark = "," if decimals else mark
    return next(filter(is_of_offset, claims_of(line, mark)), claim)


def _measures(amount: Amount) -> str | None:
    """Kind of quantity of an amount; a mass is the force of its weight."""
    return "force" if amount.kind == "mass" else amount.kind


def _quantities(text: str, mine: set[str]) -> str:
    """Words of a text without those that in a sentence are of a part or of a supply, and not of a quantity."""
    return " ".join(word for word in tokens(text) if word in mine or word not in NO_QUANTITY)


def held_columns(columns: Sequence[RawColumn], roles: Mapping[str, int], answered: frozenset[int]) -> list[ReadColumn]:
    """Columns that are read, without those of which the user says what one of their numbers is worth.

    Parameters
    ----------
    columns : sequence of RawColumn
        Of the file.
    roles : mapping of str to int
        Position of each role.
    answered : frozenset of int
        Positions of the columns left out.
    """
    reads = []
    for role, place in roles.items():
        column = columns[place]
        if place in answered or role not in ROLES or column.clock:
            continue
        unit = None if column.unit is None else known_unit(column.name, column.unit)
        kind = registry.kind_of(unit) if unit else None
        mine = set(tokens(column.name))
        others = {word for c in columns if c is not column for word in tokens(c.name)} - mine
        valued = [i for i, c in enumerate(columns) if not c.clock and i != roles.get("time")]
        order = valued.index(place) if place in valued else 0
        reads.append(
            ReadColumn(
                role,
                column,
                kind or registry.kind_of(ROLES[role]) or "",
                unit,
                order,
                len(valued),
                frozenset(others),
                bool(answered - {roles.get("time", -1), -1}),
                any(c.zero for c in columns),
            )
        )
    return reads
