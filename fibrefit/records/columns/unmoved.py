"""What a line beside the numbers cannot do to them, by its form: known or not, it is of something else.

A statement moves no number where none of its words is of a channel, of the measuring chain or of a change, and none of
its numbers could be a factor, a zero or a step of others. Nor does a name behind a key.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Sequence

from fibrefit.core import units as registry
from fibrefit.records.columns.lexicon import BESIDE, CHANGES, OF_TIMES, TECHNICAL, lexicon
from fibrefit.records.grammar.claims import WORDED, Amount, Claim, claims_of
from fibrefit.records.grammar.words import kinds_named, tokens
from fibrefit.records.thresholds import LEAST_SERIAL, LONGEST_STEP, MOST_NAME_WORDS, SHORTEST_NAME, STATED_ALIKE

#: Words of measuring: of what is read, if not of something that is named beside them.
_MEASURED = lexicon(
    "compression compressive pull push signal* channel* kanal* kanale reading* measure* messwert* wert* value* data"
    " daten sensor* *zelle cell* record* sample* samples row* rows column* number* scan* laser* encoder* lvdt"
    " loadcell results transducer* *aufnehmer capteur* sensore* snimac* czujnik* celda celula cella canal* recorder*"
    " logger* amp amplifier* verstarker everything all alles tout todo tutto vse wszystko *signal *sensor *kanal"
    " *messung wegmess* wegaufnehmer bridge brucke pont most gauge* transducer"
)
#: Numbers in words that are shares or factors wherever they stand.
SHARES = frozenset(("double", "doubled", "doubles", "twice", "doppelt", "doppelte", "verdoppelt", "both", "pair"))
#: Words of a quantity that in a head are those of a part or of a supply.
NO_QUANTITY = frozenset(("gauge", "excitation", "motor", "rotation"))
#: Units of counts, which as words say more.
COUNTS = frozenset(("pulses", "pulse", "counts", "ticks", "digits", "increments", "edges", "steps"))
#: Whole numbers without a unit that are years.
_YEARS = (1950, 2100)
_SECTION = re.compile(r"\W*\[([^\[\]]+)\]\W*")
_KEY = re.compile(r'[\W_]*([^:=;,|\t]{1,60}?)\s*(?:[:=;|\t]|,(?! ))\s*"?(.*)')
DESIGNATION = re.compile(
    r"\b(?=[\w-]*\d)(?=[\w-]*[^\W\d_])[\w./-]*\w|\b\w+\.\w{2,4}\b|0x[0-9a-fA-F]+|\S+[/\\]\S+[/\\]\S*"
)


def opens_section(line: str, names: frozenset[str]) -> bool | None:
    """Whether a line opens a section on a channel, such as ``[Channel2]``; None where it opens none.

    Parameters
    ----------
    line : str
        As in the file.
    names : frozenset of str
        Words of the names of all columns.
    """
    title = _SECTION.fullmatch(line.strip())
    words = tokens(re.sub(r"\d+$", "", title[1])) if title else []
    return any(is_measured(word) or is_quantity(word, names) for word in words) if title else None


def may_bear(word: str, names: frozenset[str]) -> bool:
    """Whether a word is of the numbers, or tells a change of anything."""
    bears = tells_change(word) or is_measured(word) or TECHNICAL.fullmatch(word) or word in WORDED
    return bool(bears) or is_quantity(word, names) or (len(word) >= SHORTEST_NAME and registry.kind_of(word) == "force")


def moves_nothing(claim: Claim, words: list[str], names: frozenset[str]) -> bool:
    """Whether what is stated of something has nothing to do with the numbers, known or not.

    It is of no channel, tells no change and has no number that they could be multiplied by, moved by or timed by.
    """
    if any(may_bear(word, names) for word in words):
        return False
    timed = not all((a.unit and a.kind not in (None, "time", "frequency")) or is_long(a) for a in claim.amounts)
    if (timed or "unit" in words) and any(map(OF_TIMES.fullmatch, words)):
        return False
    return any(len(word) >= SHORTEST_NAME for word in words) and all(_is_of_itself(amount) for amount in claim.amounts)


def is_stated_twice(claims: Sequence[Claim], *, bare: bool) -> bool:
    """Whether one unit, or none, has two amounts, of which one may be what the other is taken for."""
    amounts: dict[str, list[float]] = {}
    unit = ""
    for amount in (a for claim in claims for a in claim.amounts if a.unit or bare):
        unit = "" if amount.counted and not amount.unit else amount.unit or unit  # "2.0 mV/V (file made with 1.0)"
        si = registry.si_unit(unit) if unit else None
        worth = registry.to_si(unit, si) if si else 1.0
        amounts.setdefault(si or unit, []).append(abs(amount.value) * worth)
    return any(max(values) > STATED_ALIKE * min(values) for values in amounts.values())


def is_stated_alike(claims: Sequence[Claim]) -> bool:
    """Whether all amounts are of one unit and hardly differ: one thing that is stated and was measured."""
    amounts = [amount for claim in claims for amount in claim.amounts]
    one = len(amounts) > 1 and len({amount.unit for amount in amounts}) == 1 and amounts[0].unit
    return bool(one) and not is_stated_twice(claims, bare=False)


def is_long(amount: Amount) -> bool:
    """Whether a time is too long to be that from one sample to the next."""
    return amount.kind == "time" and amount.value * registry.to_si(amount.unit, "s") >= LONGEST_STEP


def _is_of_itself(amount: Amount) -> bool:
    """Whether a number cannot be a factor, a zero or a step of others: a count, a length, a temperature, an hour."""
    if is_long(amount):
        return True
    if amount.factor or amount.kind in ("force", "time", "frequency") or (amount.kind is None and "/" in amount.unit):
        return False
    return bool(amount.unit) or amount.counted


def is_name_behind_key(line: str, mark: str, names: frozenset[str]) -> bool:
    """Whether a name stands behind a key: of a person, a sensor, a program with its version; numbers in it are its own.

    The key may be of a part of the measuring chain, and tells no change; the name is of no channel.
    """
    key = _KEY.match(line)
    if key is None or not re.match(r"[^\W\d_]", key[2]) or re.search(r"[:=;|\t]", key[2]):
        return False
    if any(a.unit or not a.counted for claim in claims_of(key[1], mark) for a in claim.amounts):
        return False
    keys, name = (tokens(without_units(text)) for text in (key[1], DESIGNATION.sub(" ", key[2])))
    if len(key[1].split()) > MOST_NAME_WORDS or any(
        tells_change(word) or TECHNICAL.fullmatch(word) or word in WORDED for word in keys
    ):
        return False
    if any(is_quantity(word, names) for word in keys) and not any(map(is_measured, keys)):
        return False
    if len(name) > MOST_NAME_WORDS or any(
        may_bear(word, names) or BESIDE.fullmatch(word) for word in name if word not in WORDED or word in SHARES
    ):
        return False
    return not any(amount.unit or amount.factor for claim in claims_of(key[2], mark) for amount in claim.amounts)


def is_measured(word: str) -> bool:
    """Whether a word is of what is read: a signal, a sensor, a row."""
    return _MEASURED.fullmatch(word) is not None


def tells_change(word: str) -> bool:
    """Whether a word tells that something is, was or should be otherwise."""
    return bool(CHANGES.fullmatch(word))


def is_label(amount: Amount) -> bool:
    """Whether a whole number tells which one: a year, a serial number; none that counts of a converter end at."""
    if not amount.counted or amount.unit:
        return False
    value = int(amount.value)
    return _YEARS[0] <= value <= _YEARS[1] or (
        value > LEAST_SERIAL and value % 1000 > 0 and value & (value + 1) > 0 < value & (value - 1)
    )


@functools.lru_cache(maxsize=8192)
def is_quantity(word: str, names: frozenset[str]) -> bool:
    """Whether a word is of a column's name, or of a quantity but time."""
    return word in names or (bool(kinds_named(word) - {"time"}) and word not in NO_QUANTITY)


def _is_unit(word: str) -> bool:
    """Whether a word is a unit; words for counts, such as pulses, say more than that."""
    return word.casefold() not in COUNTS and registry.expression(word) is not None


def without_units(text: str) -> str:
    """Words without those that are units as they are written."""
    words = [word.strip(".,;:=") for word in re.split(r"[\s\[\]()/_;:=,|]+", text)]
    return " ".join(w for w in words if not _is_unit(w))
