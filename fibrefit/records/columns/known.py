"""What a line beside the numbers may do to them: move them, which is asked about, or nothing that is known.

A claim is asked about where a word of it tells a change, a share, a side or another unit, or a number of it stands
beside what is measured and is of nothing else. What else is said of channels is repeated beside the record.
"""

from __future__ import annotations

import functools
import itertools
import re
from collections.abc import Sequence
from typing import NamedTuple

from fibrefit.core import units as registry
from fibrefit.records.columns.bearing import (
    CHECKED,
    CONSTANT,
    DONE,
    FOREIGN_FORCES,
    HALVES,
    OF_OTHERS,
    OF_SENSORS,
    OTHER_QUANTITY,
    UNDONE,
)
from fibrefit.records.columns.lexicon import (
    BESIDE,
    CERTIFIED,
    CONTRAST,
    COVARIES,
    DATED,
    IN_MASS,
    INACCURACY,
    NEUTRAL,
    NO_UNITS,
    NOT_READ,
    NOTHING,
    OF_SIDES,
    OF_TIMES,
    ONE_OF,
    PHRASES,
    RANGE,
    RATIO,
    SEPARATORS,
    SIDED,
    SIZED,
    SLASH,
    SWITCHED,
    SWITCHED_ON,
    TECHNICAL,
    TO_BE,
    UNIT_KEY,
    VERSION,
    names_types,
)
from fibrefit.records.columns.unmoved import (
    COUNTS,
    DESIGNATION,
    SHARES,
    is_label,
    is_long,
    is_measured,
    is_name_behind_key,
    is_quantity,
    is_stated_alike,
    is_stated_twice,
    may_bear,
    moves_nothing,
    tells_change,
    without_units,
)
from fibrefit.records.grammar.claims import WORDED, Amount, Claim, claims_of, has_day
from fibrefit.records.grammar.facts import OF_OTHER_RATES, find_facts
from fibrefit.records.grammar.words import kinds_named, tokens
from fibrefit.records.grammar.worth import contradicted
from fibrefit.records.thresholds import (
    LEAST_CERTIFICATE,
    LONGEST_LABEL,
    LONGEST_SAID,
    LONGEST_STEP,
    MOST_NAME_WORDS,
    SAME_LENGTH,
    SHORTEST_NAME,
    SHORTEST_SENTENCE,
)

_RECORDED = re.compile(
    r"\b(?:sampl|record|logg|acqui|aufgezeichnet|aufgenommen|enregistr|registra|zazn|nagran)\w*", re.I
)
#: A whole number behind a word.
_WHICH = re.compile(r"[^\W\d_]{3,} \d+(?![\d.,/x\u00d7])")


class AsRead(NamedTuple):
    """What is known of a table when what stands beside it is weighed.

    Parameters
    ----------
    mark : str
        Decimal mark of its lines.
    rate : float
        Of its rows as they were read, in Hz; 0 where they tell none.
    rows : int
        How many there are.
    thinned : bool
        Whether the file says that some were left out: each is then one of several that were sampled.
    """

    mark: str = "."
    rate: float = 0.0
    rows: int = 0
    thinned: bool = False


def unknown_in(line: str, mark: str, names: frozenset[str], of_channel: bool = False) -> tuple[tuple[Claim, bool], ...]:
    """Claims of a line on what is measured, each with whether it may well move the numbers; none where it has none.

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
    return tuple(one for part in parts for one in _unknown_in(part[:LONGEST_SAID], mark, names, of_channel))


@functools.lru_cache(maxsize=4096)
def _unknown_in(line: str, mark: str, names: frozenset[str], of_channel: bool) -> tuple[tuple[Claim, bool], ...]:
    unknown = []
    nothing = NOTHING.fullmatch(line)
    if nothing and not any(tells_change(word) or TECHNICAL.fullmatch(word) for word in tokens(nothing[1])):
        return ()
    if VERSION.fullmatch(line) and not any(
        tells_change(word) or TECHNICAL.fullmatch(word) or is_quantity(word, names) for word in tokens(line)
    ):
        return ()
    halves = {match[0].casefold() for match in HALVES.finditer(line)}
    if len(halves) > len({re.split("[- ]", half)[-1] for half in halves}):
        return tuple((claim, True) for claim in claims_of(line, mark))
    first, _, rest = line.partition(", ")
    if not of_channel and is_name_behind_key(first, mark, names):
        line = f"{re.split(SEPARATORS, first)[0]}: {rest}"
    prose = _is_prose(line) and not has_day(line)
    said = tokens(line) if _is_prose(line) else ()
    plain = not (
        of_channel or ONE_OF.search(line) or any(may_bear(word, names) or "time" in kinds_named(word) for word in said)
    )
    bears = prose and any(_bears(word, names) for word in tokens(DESIGNATION.sub(" ", line)))
    claims = tuple(claims_of(PHRASES.sub(" ", HALVES.sub(_noun, SLASH.sub("; ", line))), mark))
    sensitivities = {a.value for claim in claims for a in claim.amounts if a.unit.casefold() == "mv/v"}
    if len(sensitivities) > 1 and not any(map(RANGE.fullmatch, tokens(line))):
        return tuple((claim, True) for claim in claims)
    if CHECKED.search(line):
        if is_stated_twice(claims, bare=_is_prose(line.replace(";", ",")) or "/" in line):
            return tuple((claim, True) for claim in claims)
        if is_stated_alike(claims) and not any(of.search(line) for of in OF_SENSORS.values()):
            return ()
    for claim in claims:
        differs = any(a.factor for a in claim.amounts) and is_stated_twice([claim], bare=True)
        if differs and any(_bears(word, names) for word in tokens(claim.about)):
            return tuple((claim, True) for claim in claims)
        about = without_units(DESIGNATION.sub(" ", claim.about))
        found = tokens(about)
        if (not found and not any(a.factor for a in claim.amounts)) or names_types(found):
            continue  # a row of numbers is known by where it stands; names of types change nothing
        if plain and (said or len(found) <= MOST_NAME_WORDS) and moves_nothing(claim, found, names):
            continue
        moves = _may_move(claim, found, line, names, bears)
        if moves is not None:
            unknown.append((claim, moves))
    return tuple(unknown)


def states_unit(line: str, kind: str, unit: str | None) -> bool:
    """Whether a short line has a unit of a kind for itself, which is another one than a column has.

    Parameters
    ----------
    line : str
        As in the file.
    kind, unit : str
        Of the column.
    """
    if kind == "force" and ((_is_prose(line) and IN_MASS.search(line)) or UNIT_KEY.search(line)):
        return True
    plain = re.sub(r"\d[\d.,]*\s*[^\W\d]+", " ", line)
    words = [w.strip(".,;:=\"'()[]") for w in re.split(r"[\s=:;,|\t]+", plain)]
    if kind == "force" and any(w in FOREIGN_FORCES for w in words):
        return True
    units = [w for w in words if w not in NO_UNITS and w[1:].isalpha() and registry.kind_of(w) == kind]
    units = [w for w in units if kind != "time" or registry.to_si(w, "s") <= LONGEST_STEP]
    if not (unit and any(contradicted([unit, u]) for u in units)):
        return False
    return _is_prose(line) or (kind != "time" and len(tokens(without_units(line))) <= LONGEST_LABEL)


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
    if any(bearing(w) for w in words for bearing in bears) or any(is_quantity(w, names) for w in words):
        return frozenset()
    kinds = [amount.kind for amount in claim.amounts if not amount.factor and amount.unit.casefold() not in COUNTS]
    return (
        frozenset(kind for kind in kinds if kind)
        if None not in kinds and len(kinds) == len(claim.amounts)
        else frozenset()
    )


def agrees(line: str, claim: Claim, read: AsRead) -> bool:
    """Whether a claim tells the rate, the step or the number of the rows as they were read, and no change.

    Parameters
    ----------
    line : str
        In which it stands.
    claim : Claim
        Of a line.
    read : AsRead
        The table.
    """
    mark, rate, rows, thinned = read
    words = tokens(claim.about)
    if not claim.amounts or any(tells_change(word) or TECHNICAL.fullmatch(word) or word in WORDED for word in words):
        return False
    rates_stated = [a.value * registry.to_si(a.unit, "Hz") for a in claim.amounts if a.kind == "frequency"]
    rates_stated += [1.0 / (a.value * registry.to_si(a.unit, "s") or 1.0) for a in claim.amounts if a.kind == "time"]
    read_as = [rates_stated if len(rates_stated) == len(claim.amounts) else [], find_facts([line], mark).rates]
    bare = [a.value for a in claim.amounts if not a.unit]
    if len(bare) == len(claim.amounts) and (
        set(bare) <= {float(rows)} or (set(bare) <= {rate} and any(map(OF_TIMES.fullmatch, words)))
    ):
        return True
    shares = [[t / (round(t / rate) or 1) if thinned and rate else t for t in rates] for rates in read_as]
    return any(rates and all(abs(t - rate) < SAME_LENGTH * rate for t in rates) for rates in shares)


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
    kinds = [amount.kind for amount in claim.amounts if amount.unit or not amount.counted]
    rates = bool(kinds) and set(kinds) <= {"frequency", "time"}
    named = any(OF_TIMES.fullmatch(word) or "time" in kinds_named(word) for word in found)
    other = any(is_quantity(w, names) or registry.kind_of(w) in ("force", "length") for w in found if w not in NO_UNITS)
    return (rates or named) and not other and not any(a.kind in ("force", "length") for a in claim.amounts)


def _noun(match: re.Match[str]) -> str:
    return f" {re.split(r'[- ]', match[0])[-1]} "


def _is_prose(line: str) -> bool:
    """Whether a line is a sentence, and no statement of a key."""
    return not re.search(r":(?!\d)|[=;|\t]", line) and len(line.split()) >= SHORTEST_SENTENCE


def _bears(word: str, names: frozenset[str]) -> bool:
    return is_measured(word) or is_quantity(word, names) or "time" in kinds_named(word)


def _may_move(claim: Claim, words: list[str], line: str, names: frozenset[str], bears: bool) -> bool | None:
    """Whether a claim may well move the numbers; None where it cannot, and False where nothing speaks for it.

    A change, a contrast, a way of the load or a number that is no name, beside what is measured, speaks for it. A word
    that is not known does not.
    """
    quantity = any(is_quantity(word, names) for word in words)
    measured = bears or any(is_measured(word) for word in words)
    counted = _counted(tokens(claim.about)) if not (quantity or measured) else frozenset[str]()
    words = [word for word in words if word not in counted]
    technical = [w for w in words if TECHNICAL.fullmatch(w)]
    amounts = [a for a in claim.amounts if a.value != 0.0 and (a.value != 1.0 or a.unit) and not is_label(a)]
    times = [
        w
        for w in words
        if (OF_TIMES.fullmatch(w) or "time" in kinds_named(w)) and registry.kind_of(w) in (None, "number")
    ]
    units = any(a.unit.casefold() in COUNTS for a in amounts) or (
        not claim.amounts
        and any(registry.kind_of(w.casefold()) in ("force", "length") for w in claim.about.split() if len(w) > 1)
    )
    touched = quantity or measured or units or bool(technical) or not {"height", "distance"}.isdisjoint(words)
    contrast = bool(claim.amounts and CONTRAST.search(line))
    if ONE_OF.search(line) or (
        touched and (contrast or SIDED.search(line) or COVARIES.search(line) or TO_BE.search(line))
    ):
        return True
    changes = [w for w in words if tells_change(w) or w in WORDED] + technical
    changes += [w for w in words if BESIDE.fullmatch(w) and (touched or contrast or set(times) - {w})]
    inexact = any(map(INACCURACY.fullmatch, tokens(line))) and {a.unit for a in amounts} <= {"%", "\u2030"}
    if re.search(r"-\W*$", line) and any(map(OF_SIDES.fullmatch, technical)):
        return True
    if changes and not (inexact and changes == technical):
        return (False if _is_prose(line) else None) if _settled(claim, words, line, names) else True
    if changes or not (touched or times or amounts) or (not amounts and len(words) <= LONGEST_LABEL):
        return None
    if measured and any(a.kind == "angle" for a in amounts):
        return True
    of_rows = any(OF_TIMES.fullmatch(w) and not w.startswith("time") for w in times)
    rates = any(a.kind == "frequency" or (a.kind == "time" and not is_long(a)) for a in amounts)
    states_rates = _RECORDED.search(line) and any(a.kind == "frequency" for a in amounts)
    if ((of_rows and rates) or states_rates) and not OF_OTHER_RATES.search(line):
        return not OTHER_QUANTITY.search(claim.about)
    return _multiplies(amounts, words, line, touched, quantity)


def _multiplies(amounts: Sequence[Amount], words: Sequence[str], line: str, touched: bool, quantity: bool) -> bool:
    """Whether a number may be a factor: it is written as one, or stands beside what is measured and is of nothing."""
    if any(a.factor and (not a.ratio or RATIO.search(line)) for a in amounts):
        return not any(map(SIZED.fullmatch, words))
    bare = [a for a in amounts if not a.unit]
    which = all(a.counted for a in bare) and len(_WHICH.findall(line)) >= len(bare)  # of several: channel 2
    if not touched:
        short = max(map(len, words), default=0) < SHORTEST_NAME
        return short and any(not a.counted for a in bare) and not any(map(OF_OTHERS.search, words))
    if bare and not any(map(NOT_READ.fullmatch, words)) and (quantity or not which):
        return True
    return any(a.unit in ("%", "\u2030") for a in amounts) and not any(map(INACCURACY.fullmatch, words))


def _counted(words: list[str]) -> frozenset[str]:
    """Numbers in words that count something, such as three strands, or tell which one it is: rig three."""
    pairs = list(itertools.pairwise(words))
    shared = {b for a, b in pairs if a in ("of", "von", "de", "dei", "in")}
    counts = {a for a, b in pairs if WORDED.get(a, 0.5) in range(2, 11) and a not in SHARES | shared}
    return frozenset(counts | {b for a, b in pairs if WORDED.get(b, 0.5) in range(2, 11) and a in ("rig", "run", "of")})


def _settled(claim: Claim, words: list[str], line: str, names: frozenset[str]) -> bool:
    """Whether a change is none, was made before, or is of something else that is named."""
    changes = [w for w in words if TECHNICAL.fullmatch(w)]
    if (
        (NEUTRAL.search(line) and not _is_prose(line))
        or (has_day(line) and not claim.amounts)
        or (changes and DATED.search(claim.about))
    ):
        return True
    rest = [w for w in words if (tells_change(w) or BESIDE.fullmatch(w) or w in WORDED) and not TECHNICAL.fullmatch(w)]
    named = all(a.counted and not a.unit and a.value >= LEAST_CERTIFICATE for a in claim.amounts)
    if (
        named
        and changes
        and all(map(CERTIFIED.fullmatch, changes))
        and not rest
        and not (CONSTANT.search(line) or UNDONE.search(line))
    ):
        return True
    if not (claim.amounts or rest) and changes and all(w.startswith(("zero", "null")) for w in changes):
        return True
    plain = any(a.unit and "/" not in a.unit for a in claim.amounts)
    if plain and any(map(CERTIFIED.fullmatch, changes)):  # "calibration: 100 N applied"
        return False
    if DONE.search(line) and not UNDONE.search(line) and not any(w in WORDED for w in words):
        return True
    if rest or not changes:
        return False
    if SWITCHED_ON.search(line) and all(map(SWITCHED.fullmatch, changes)):
        return True
    if not claim.amounts:
        return (
            len(changes) == len(words)
            or max(len(tokens(cell)) for cell in re.split(r"[;\t|]|,(?! )", line)) <= LONGEST_LABEL
        )
    if all(a.value in (0.0, 1.0) for a in claim.amounts):
        return True
    if all("/" in a.unit and not _is_ratio(a.unit) for a in claim.amounts):
        return True
    quantity = any(is_quantity(word, names) for word in words)
    others = OF_OTHERS.search(line if all(w.startswith(("gain", "verst")) for w in changes) else claim.about)
    return bool(others) and len(words) <= MOST_NAME_WORDS and not quantity


def _is_ratio(unit: str) -> bool:
    above, _, below = unit.partition("/")
    return registry.kind_of(above) == registry.kind_of(below.strip("()")) != "voltage"
