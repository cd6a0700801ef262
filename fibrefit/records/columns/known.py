"""Whether all that a line beside the numbers says is known to leave them as they are.

A claim with a number, a quantity or a word of measuring bears on the numbers unless every word of it is known, and its
numbers have an owner that is no reading; so does any claim with a word of change. What is not known is not harmless.
"""

from __future__ import annotations

import functools
import itertools
import re

from fibrefit.core import units as registry
from fibrefit.records.columns.bearing import CHECKED, CONSTANT, DONE, HALVES, OF_OTHERS, UNDONE
from fibrefit.records.columns.lexicon import (
    CERTIFIED,
    CHANGES,
    GLUE,
    LABELS,
    NOT_READ,
    OF_TIMES,
    PHRASES,
    SWITCHED,
    TECHNICAL,
    lexicon,
)
from fibrefit.records.columns.unmoved import (
    COUNTS,
    DESIGNATION,
    OWNER,
    SHARES,
    is_label,
    is_measured,
    is_name_behind_key,
    is_quantity,
    is_told_twice,
    may_bear,
    moves_nothing,
    tells_change,
    without_units,
)
from fibrefit.records.grammar.claims import WORDED, Claim, claims_of, has_day
from fibrefit.records.grammar.words import kinds_named, tokens
from fibrefit.records.grammar.worth import contradicted
from fibrefit.records.thresholds import (
    LEAST_CERTIFICATE,
    LONGEST_LABEL,
    LONGEST_SAID,
    MOST_NAME_WORDS,
    SAME_LENGTH,
    SHORTEST_SENTENCE,
)

_GLUE = lexicon(*GLUE)
_NOT_READ = lexicon(NOT_READ)
#: What is told in per cent of a quantity and changes nothing.
_INACCURACY = lexicon(
    "accuracy genauigkeit uncertainty tolerance* linearity nonlinearity hysteresis noise resolution* limit* class"
    " klasse precision repeatability creep aborted triggered"
)
_RATIO = re.compile(r"\d\s?:\d|\d : \d")
#: What is told by a number of parts and their size: "2 x 1.25 kg", "M8 x 20".
_SIZED = lexicon(
    "zoom cord* lano lana corde corda cuerda lina fibre* sling* rope* seil* weight* gewicht* mass* masse* screw*"
    " schraube* bolt* specimen* plate* size* dimension*"
)
_NEUTRAL = re.compile(
    r"[:=;,\t ]\s*(?:no|none|off|false|nein|aus|0|0[.,]0+|1|1[.,]0+|ok|auto|n/a|disabled|default|normal"
    r"|positive|-|)\W*$",
    re.I,
)
#: A key of which nothing is said.
_NOTHING = re.compile(
    r"([^:=;,|\t]+)[:=;,|\t]\s*(?:no|none|nothing|n/a|keine?[rsn]?|aucune?|ningun[oa]?|nessun[oa]?|zadn[aey]|brak|-+)?\W*",
    re.I,
)
_SWITCHED_ON = re.compile(r"[:=;,\t ]\s*(?:yes|on|true|ja|ein|done|ok|durchgef\w*|active|enabled)\W*$|\bby\b", re.I)
_NO_UNITS = frozenset(("in", "ft", "um"))
_SEPARATORS = r"[:=;|\t,]"
_SLASH = re.compile(r" / (?=\d+(?:\.\d+)? ?[^\W\d]|\d+(?:\.\d+)? ?%)")
#: Forces that are told in units of mass.
_IN_MASS = re.compile(r"^(?!.*(?:mass|weight)).*\bin (?:lbs?|kgs?|kilos?|pounds?|grams?|kilograms?)\b", re.I)
#: A name with digits in it, such as U9C, S2M or drop_4.csv, and what stands in the place of a path.
_SOMEBODY = re.compile(
    r"\b(?:by|von|par|por|da)\s+(?:(?:Dr|Mr|Ms|Prof|Ing)\.?\s+)?(?:[A-Z]\.?\s+)*[A-Z][a-z]+\b(?!\s*\d)"
)
_INITIALS = re.compile(r"\b[A-Z]{2,4}\b")


def unknown_in(line: str, mark: str, names: frozenset[str], of_channel: bool = False) -> tuple[Claim, ...]:
    """Claims of a line that are not known to leave the numbers as they are; none where all of it is.

    Parameters
    ----------
    line : str
        As in the file.
    mark : str
        Decimal mark of the table.
    names : frozenset of str
        Words of the names of all columns.
    of_channel : bool
        Whether it stands in a section on one of them.
    """
    parts = [line] if len(line) <= LONGEST_SAID else re.split(r"(?<=[.;,\t|])\s*", line)
    return tuple(claim for part in parts for claim in _unknown_in(part[:LONGEST_SAID], mark, names, of_channel))


@functools.lru_cache(maxsize=4096)
def _unknown_in(line: str, mark: str, names: frozenset[str], of_channel: bool) -> tuple[Claim, ...]:
    unknown = []
    nothing = _NOTHING.fullmatch(line)
    if nothing and not any(tells_change(word) or TECHNICAL.fullmatch(word) for word in tokens(nothing[1])):
        return ()
    first, _, rest = line.partition(", ")
    if not of_channel and is_name_behind_key(first, mark, names):
        line = f"{re.split(_SEPARATORS, first)[0]}: {rest}"
    prose = _is_prose(line) and not has_day(line)
    said = tokens(line) if _is_prose(line) else ()
    plain = not (of_channel or any(may_bear(word, names) or "time" in kinds_named(word) for word in said))
    bears = prose and any(_bears(word, names) for word in tokens(line))
    claims = tuple(claims_of(PHRASES.sub(" ", HALVES.sub(_noun, _SOMEBODY.sub(" ", _SLASH.sub("; ", line)))), mark))
    if CHECKED.search(line) and is_told_twice(claims, bare=prose):
        return claims
    for claim in claims:
        about = without_units(DESIGNATION.sub(" ", claim.about))
        if not claim.amounts and about != about.upper():
            about = _INITIALS.sub(lambda m: m[0] if CHANGES.fullmatch(m[0].casefold()) else " ", about)
        found = tokens(about)
        if (not found and not any(a.factor for a in claim.amounts)) or set(found) in ({"double"}, {"format", "double"}):
            continue  # a row of numbers is told by where it stands; names of types change nothing
        if plain and (said or len(found) <= MOST_NAME_WORDS) and moves_nothing(claim, found, names):
            continue
        if _harmless(claim, found, line, names, bears):
            continue
        unknown.append(claim)
    return tuple(unknown)


def told_unit(line: str, kind: str, unit: str | None) -> bool:
    """Whether a short line has a unit of a kind for itself, which is another one than a column has.

    Parameters
    ----------
    line : str
        As in the file.
    kind, unit : str
        Of the column.
    """
    if kind == "force" and _is_prose(line) and _IN_MASS.search(line):
        return True
    words = [w.strip(".,;:=\"'()[]") for w in re.split(r"[\s=:;,|\t]+", line)]
    units = [w for w in words if w not in _NO_UNITS and len(w) > 1 and registry.kind_of(w) == kind]
    if not (unit and any(contradicted([unit, u]) for u in units)):
        return False
    bare = tokens(without_units(line))
    return _is_prose(line) or not any(registry.expression(w) is None and OWNER.fullmatch(w) for w in bare)


def kinds_of(claim: Claim, names: frozenset[str]) -> frozenset[str]:
    """Kinds of quantity of which alone a claim tells amounts, with no word of a change; empty where it may be of all.

    Parameters
    ----------
    claim : Claim
        Of a line.
    names : frozenset of str
        Words of the names of all columns but those of times.
    """
    words = tokens(claim.about)
    bears = (tells_change, is_measured, TECHNICAL.fullmatch, WORDED.get)
    if any(told(w) for w in words for told in bears) or any(is_quantity(w, names) for w in words):
        return frozenset()
    kinds = [amount.kind for amount in claim.amounts if not amount.factor and amount.unit.casefold() not in COUNTS]
    return (
        frozenset(kind for kind in kinds if kind)
        if None not in kinds and len(kinds) == len(claim.amounts)
        else frozenset()
    )


def agrees(claim: Claim, rate: float) -> bool:
    """Whether a claim tells the rate or the step of the rows as they were read, and no change.

    Parameters
    ----------
    claim : Claim
        Of a line.
    rate : float
        In Hz; nothing agrees with 0.
    """
    told = [a.value * registry.to_si(a.unit, "Hz") for a in claim.amounts if a.kind == "frequency"]
    told += [1.0 / (a.value * registry.to_si(a.unit, "s") or 1.0) for a in claim.amounts if a.kind == "time"]
    words = tokens(claim.about)
    changed = any(tells_change(word) or TECHNICAL.fullmatch(word) or word in WORDED for word in words)
    return (
        bool(told)
        and len(told) == len(claim.amounts)
        and not changed
        and all(abs(t - rate) < SAME_LENGTH * rate for t in told)
    )


def is_of_times(claim: Claim, names: frozenset[str]) -> bool:
    """Whether a claim may be about how the rows came about, and names no quantity of theirs.

    Parameters
    ----------
    claim : Claim
        Of a line.
    names : frozenset of str
        Words of the names of all columns but those of times.
    """
    by = claim.amounts or claim.about.endswith("times g")
    found = [w for w in tokens(claim.about) if not (w == "times" and by)]  # "times 2" multiplies
    rates = bool(claim.amounts) and all(amount.kind in ("frequency", "time") for amount in claim.amounts)
    named = any(OF_TIMES.fullmatch(word) or "time" in kinds_named(word) for word in found)
    return (rates or named) and not any(is_quantity(word, names) for word in found)


def _noun(match: re.Match[str]) -> str:
    return f" {re.split(r'[- ]', match[0])[-1]} "


def _is_prose(line: str) -> bool:
    """Whether a line is a sentence, and no statement of a key."""
    return not re.search(r"[:=;|\t]", line) and len(line.split()) >= SHORTEST_SENTENCE


def _bears(word: str, names: frozenset[str]) -> bool:
    return is_measured(word) or is_quantity(word, names) or "time" in kinds_named(word)


def _harmless(claim: Claim, words: list[str], line: str, names: frozenset[str], bears: bool) -> bool:
    """Whether a claim does not bear on the numbers, or is known to leave them as they are."""
    quantity = any(is_quantity(word, names) for word in words)
    measured = bears or any(is_measured(word) for word in words)
    counted = _counted(words) if not (quantity or measured) else frozenset[str]()
    words = [word for word in words if word not in counted]
    changes = [w for w in words if tells_change(w) or w in WORDED or TECHNICAL.fullmatch(w)]
    unknown = [w for w in words if not _known(w, names) and not TECHNICAL.fullmatch(w)]
    amounts = [a for a in claim.amounts if a.value != 0.0 and (a.value != 1.0 or a.unit) and not is_label(a)]
    if not (quantity or amounts or measured or any(w in WORDED for w in words)):
        return not any(map(tells_change, words)) or _settled(claim, words, line, names)
    if unknown:
        return False
    if changes:
        return _settled(claim, words, line, names)
    factors = [a for a in amounts if a.factor and (not a.ratio or _RATIO.search(line))]
    if factors and not any(map(_SIZED.fullmatch, words)):
        return False
    if any(is_measured(word) for word in words) and any(a.kind == "angle" for a in amounts):
        return False
    if amounts and not any(map(OWNER.fullmatch, words)):
        return False
    if not (amounts and quantity):
        return True
    shares = any(a.factor or a.unit in ("%", "\u2030") for a in amounts) and not any(map(_INACCURACY.fullmatch, words))
    return not shares and any(map(_NOT_READ.fullmatch, words))


def _counted(words: list[str]) -> frozenset[str]:
    """Numbers in words that count something, such as three strands, or tell which one it is: rig three."""
    pairs = list(itertools.pairwise(words))
    counts = {a for a, b in pairs if WORDED.get(a, 0.5) in range(2, 11) and a not in SHARES and OWNER.fullmatch(b)}
    return frozenset(counts | {b for a, b in pairs if WORDED.get(b, 0.5) in range(2, 11) and a in ("rig", "run", "of")})


def _settled(claim: Claim, words: list[str], line: str, names: frozenset[str]) -> bool:
    """Whether a change is none, was made before, or is of something else that is named."""
    if any(not _known(w, names) and not TECHNICAL.fullmatch(w) for w in words):
        return False
    changes = [w for w in words if TECHNICAL.fullmatch(w)]
    if _NEUTRAL.search(line) or (has_day(line) and not claim.amounts):
        return True
    named = all(a.counted and not a.unit and a.value >= LEAST_CERTIFICATE for a in claim.amounts)
    if (
        named
        and changes
        and all(map(CERTIFIED.fullmatch, changes))
        and not (CONSTANT.search(line) or UNDONE.search(line))
    ):
        return True
    if not claim.amounts and changes and all(w.startswith(("zero", "null")) for w in changes):
        return True
    plain = any(a.unit and "/" not in a.unit for a in claim.amounts)
    weighed = plain and any(map(CERTIFIED.fullmatch, changes))  # "calibration: 100 N applied"
    if weighed:
        return False
    if DONE.search(line) and not UNDONE.search(line):
        return True
    if _SWITCHED_ON.search(line) and all(map(SWITCHED.fullmatch, changes)):
        return True
    if not claim.amounts and changes and not any(map(tells_change, words)):
        return True
    if not claim.amounts and all(map(LABELS.fullmatch, changes)) and len(words) <= LONGEST_LABEL:
        return True
    if claim.amounts and all(a.value in (0.0, 1.0) for a in claim.amounts):
        return True
    if claim.amounts and all("/" in a.unit and not _is_ratio(a.unit) for a in claim.amounts):
        return True
    quantity = any(is_quantity(word, names) for word in words)
    others = OF_OTHERS.search(line if all(w.startswith("gain") for w in changes) else claim.about)
    brief = bool(claim.amounts) and len(words) <= MOST_NAME_WORDS
    return bool(others) and brief and not quantity and not any(word in WORDED for word in words)


def _is_ratio(unit: str) -> bool:
    above, _, below = unit.partition("/")
    return registry.kind_of(above) == registry.kind_of(below.strip("()")) != "voltage"


@functools.lru_cache(maxsize=8192)
def _known(word: str, names: frozenset[str]) -> bool:
    if word in WORDED:
        return False
    return bool(OWNER.fullmatch(word) or _GLUE.fullmatch(word) or word in names or kinds_named(word))
