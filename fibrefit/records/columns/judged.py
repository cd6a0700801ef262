"""What a line beside the numbers may still change of a column: its factor, its zero, its sign, its unit."""

from __future__ import annotations

import re

import numpy as np

from fibrefit.core import units as registry
from fibrefit.records.columns.bearing import (
    AGAINST,
    BEFORE,
    DONE,
    FORMULA,
    HALVES,
    IN_STEPS,
    MISTAKEN,
    MULTIPLIED,
    NEGATED,
    NO_STATISTIC,
    NOT_YET,
    OF_OTHERS,
    OTHER_QUANTITY,
    SLOWED,
    STATISTIC,
    TYPE,
    UNDONE,
    UPWARDS,
)
from fibrefit.records.columns.damage import absurd
from fibrefit.records.columns.held import ReadColumn
from fibrefit.records.columns.lexicon import OFFSETS
from fibrefit.records.columns.raw import Annotation
from fibrefit.records.grammar.claims import WORDED, Claim, claims_of, has_day
from fibrefit.records.grammar.words import kinds_named, tokens
from fibrefit.records.grammar.worth import OF_COUNTS, PLACES, are_whole
from fibrefit.records.thresholds import LONGEST_HEADING, SAME_PEAK

#: A word that is added or taken off.
_SIGNED = re.compile(r"([+\u2212-])\s*([^\W\d_]+)")


def doubt_of(one: Annotation, read: ReadColumn, mark: str) -> str:
    """What a line may still change of a column; empty for nothing."""
    line = one.text
    if len(line) > 4 * LONGEST_HEADING:
        return ""
    if read.role == "time":
        if DONE.search(line) and not UNDONE.search(line):
            return ""
        claims = [c for c in claims_of(line, mark) if "time" in kinds_named(c.about) or SLOWED.search(c.about)]
        return next((doubt for c in claims if (doubt := _factor(c, read, line))), "")
    doubt = _in_steps(line, one, read) or _formula(line, one, read)
    doubt = doubt or _worded(line, one, read)
    if doubt:
        return doubt
    if one.row:
        doubt = next((_row(c, read) for c in claims_of(line, mark) if not c.about.strip(" -#")), "")
        if doubt:
            return doubt
    places = PLACES.search(line)
    if (places or OF_COUNTS.search(line)) and are_whole(read.column.numbers.values) and read.concerns(line, one):
        numbers = [a.value for c in claims_of(line, mark) for a in c.amounts]
        if not read.settled and any(v not in (0.0, 0.0 if places else 1.0) for v in numbers) and not has_day(line):
            return "may be what one number is worth of"
    before = BEFORE.search(line) or NOT_YET.search(line)
    if (
        before
        and not (read.settled and not one.of and not read.named(line))
        and read.concerns(line, one)
        and not OTHER_QUANTITY.search(line)
    ):
        return f'("{before.group()}") may be of the numbers of'
    done = bool(DONE.search(line)) and not UNDONE.search(line)
    for claim in claims_of(line, mark):
        about = claim.about
        answered = read.settled and not one.of and not read.named(about)
        if not done and not answered and read.concerns(about, one):
            said = _factor(claim, read, line)
            if said:
                return said
        said = _statistic(claim, read, one)
        if said:
            return said
    return ""


def _factor(claim: Claim, read: ReadColumn, line: str) -> str:
    """A bare number beside a word that multiplies, which is of nothing but the column, or of its times."""
    of_times = SLOWED.search(line) or "time" in kinds_named(line)
    others = OF_OTHERS.search(f"{line} {claim.about}") or (of_times and read.role != "time")
    if not MULTIPLIED.search(claim.about) or has_day(line) or (others and not read.named(claim.about)):
        return ""
    factors = [a.value for a in read.own(claim) if not a.unit and a.value not in (0.0, 1.0)]
    return f"({claim.about.strip(' =:[(')[:40]}: {factors[0]:g}) may still have to be applied to" if factors else ""


def _row(claim: Claim, read: ReadColumn) -> str:
    """Numbers below the headings, without a word: they are counted off, change nothing, or are a question."""
    own = read.own(claim)
    values = [a.value for a in claim.amounts]
    counted = len(values) > 1 and np.array_equal(np.diff(values), np.ones(len(values) - 1))
    whole = len(values) == read.beside + 1 and not counted
    if len(own) == 1 and len(values) > 1 and (own[0].factor or whole) and own[0].value not in (0.0, 1.0):
        return f"({own[0].value:g}) is no reading and may be a factor of"
    return ""


def _in_steps(line: str, one: Annotation, read: ReadColumn) -> str:
    """A unit that is so much of another one: "in 0.1 N"."""
    for number, unit in IN_STEPS.findall(line) if not (read.settled and not read.named(line)) else ():
        of_kind = registry.kind_of(unit.rstrip(".")) == read.kind
        if of_kind and _amount(number) not in (0.0, 1.0) and not (OF_OTHERS.search(line) and "unit =" not in line):
            return f"({number} {unit}) may be what one number is worth of"
    return ""


def _amount(text: str) -> float:
    """Number of a text, which may be a fraction."""
    above, _, below = text.replace(",", ".").partition("/")
    return float(above) / (float(below or 1) or 1.0)


def formula_in(line: str) -> tuple[str, str]:
    """What a line makes, and what of, where it multiplies; empty where it does not."""
    match = FORMULA.search(line)
    return ("", "") if match is None else (match[1] or match[5], match[2] or match[3] or match[4])


def _formula(line: str, one: Annotation, read: ReadColumn) -> str:
    """A line that multiplies: of what is read already, or of nobody knows what."""
    turned = NEGATED.search(line)
    if turned and read.named(turned[1]):
        return "may turn the sign of"
    left, right = formula_in(line)
    if not right or (read.settled and not read.named(line)):
        return ""
    made = read.named(left) and not read.named(right) and right.casefold() != "x"
    own = set(tokens(right)) & set(tokens(read.column.name)) or (
        right.casefold() in ("x", "m") and read.concerns(line, one)
    )
    return "may still have to be applied to" if own and not made else ""


def _worded(line: str, one: Annotation, read: ReadColumn) -> str:
    """A number in words that is said of a column, or is to be applied."""
    if (DONE.search(line) and not UNDONE.search(line)) or (read.settled and not read.named(line) and not one.of):
        return ""
    heading = one.place.startswith("heading")
    line = HALVES.sub(" ", line)
    words = tokens(line)
    typed = words == ["double"] or TYPE.search(line)  # a type of numbers
    found = "" if typed else next((word for word in words if word in WORDED), "")
    kinds = kinds_named(line)
    against = {"force": AGAINST, "length": UPWARDS}.get(read.kind)
    sides = against.search(line) if against and (read.kind in kinds or not kinds) else None
    if sides:
        return f"({sides.group()}) may turn the sign of"
    moved = next((m for m in _SIGNED.finditer(line) if OFFSETS.fullmatch(m[2].casefold())), None) if heading else None
    if moved:
        return f"({moved.group().strip()}) may move the numbers of"
    meant = (one.of and not heading) or (read.named(line) and (not heading or MULTIPLIED.search(line)))
    others = OF_OTHERS.search(line) and not read.named(line)
    return f"({found}) may be a factor of" if found and meant and not others else ""


def stated_over_read(claim: Claim, read: ReadColumn, one: Annotation) -> float:
    """A largest, smallest or mean value that is claimed, over the one that is read; 0 where none is claimed.

    Parameters
    ----------
    claim : Claim
        Of `one`.
    read : ReadColumn
        The column.
    one : Annotation
        What is said; of the column itself also without a unit.
    """
    if NO_STATISTIC.search(claim.about) or not (read.named(claim.about) or not kinds_named(claim.about)):
        return 0.0
    values = read.column.numbers.values
    with np.errstate(over="ignore"):
        values = values[np.isfinite(values) & ~absurd(values)]  # an overload is no reading
    if not values.size or read.unit is None:
        return 0.0
    bare = one.of == read.column.header
    for name, words in STATISTIC.items():
        amounts = [a for a in claim.amounts if (a.kind == read.kind or (bare and not a.unit)) and a.value]
        if not words.search(claim.about) or len(amounts) != 1:
            continue
        own = {"max": values.max(), "min": values.min(), "mean": values.mean()}[name]
        worth = registry.to_si(amounts[0].unit or read.unit, registry.si_unit(read.unit) or "")
        stated = amounts[0].value * worth / registry.to_si(read.unit, registry.si_unit(read.unit) or "")
        return float(stated / own) if own else 0.0
    return 0.0


def _statistic(claim: Claim, read: ReadColumn, one: Annotation) -> str:
    """A largest, smallest or mean value that is claimed and is another one by a factor for which units are mistaken."""
    ratio = stated_over_read(claim, read, one)
    mistaken = any(abs(ratio / factor - 1.0) < SAME_PEAK for f in MISTAKEN for factor in (f, 1.0 / f))
    return f"({ratio:.3g} times the one that is read) contradicts" if mistaken else ""
