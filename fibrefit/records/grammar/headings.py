"""One heading of a column: its name and its unit, however the two are put together."""

from __future__ import annotations

import re
import unicodedata
from collections.abc import Sequence

from fibrefit.core import units
from fibrefit.records.grammar.words import kinds_named, tokens
from fibrefit.records.thresholds import LONGEST_HEADING

#: Control signs, and what terminals take for colours.
_CONTROL = re.compile(r"\x1b\[[0-9;]*[A-Za-z]|[\x00-\x08\x0b-\x1f\x7f]")

#: Words that end a name as often as they are units: a minimum, an input, a gain.
_ALSO_WORDS = frozenset(
    {
        "in",
        "min",
        "h",
        "g",
        "m",
        "s",
        "d",
        "A",
        "V",
        "N",
        "deg",
        "day",
        "count",
        "counts",
        "steps",
        "lb",
        "rad",
        "kp",
        "inc",
    }
)

_BRACKETS = tuple(re.compile(p) for p in (r"\[([^\[\]]*)\]", r"\(([^()]*)\)", r"<([^<>]*)>", r"\{([^{}]*)\}"))


#: A factor by which the numbers below are to be multiplied, or were; a letter that stands for a sign only before a
#: power of ten, as `x 2` and `Dev/2` are names.
_TEN = r"10\s*(?:\^|\*\*)\s*[+-]?\d+|1\s*[eE]\s*[+-]?\d+|10+|0[.,]0*1"
_FACTOR = re.compile(
    rf"(?<![^\s(\[])\(?x\s*(?:{_TEN})\)?(?=\s|$)|\(?\s*[*\u00d7\u00b7]\s*(?:{_TEN}|\d+(?:[.,]\d+)?)\)?(?=[\s\[(]|$)"
    rf"|(?<=[^\W\d_])\s*/\s*(?:{_TEN})(?=[\s\[(]|$)"
    rf"|(?<=\s)\(?(?:{_TEN})\s?x\)?(?=[\s\[(]|$)|(?<=[\])])\s*[eE][+-]?\d+$"
)

#: The same in words and as a ratio, a number below a quantity, and a sign that was turned.
_IN_WORDS = re.compile(
    r"\(?(?:factor|faktor|scaled?|skalierung|gain|multiplier|verst[a\u00e4]rkung)\s*(?:by\s*)?[=:]?\s*\d+(?:[.,]\d+)?\)?"
    r"|(?<![\d:.,])\(?(?:1\s*:\s*[1-9]\d{0,4}|[1-9]\d{0,4}\s*:\s*1)\)?(?![\d:.,])"
    r"|\(?\b(?:inverted|negated|reversed|inverse|inv\.|neg\.|invertiert|negiert|umgekehrt)\)?(?!\w)",
    re.IGNORECASE,
)
_BELOW = re.compile(r"(?<=[^\W\d_])\s*/\s*(?!1(?!\d))\d+(?:[.,]\d+)?(?=[\s\[(]|$)")

#: The same before a name: `10*F`, and a minus.
_BEFORE = re.compile(
    rf"(?:[-\u2212]|(?:{_TEN}|\d+(?:[.,]\d+)?)\s*[*\u00d7\u00b7]|(?:{_TEN})\s*x\s|\d+(?:[.,]\d+)?x(?=[^\W\d_]{{3}}))"
    r"\s*(?=[^\W\d])"
)

#: A unit that is so much of another one: `0.1 N`, `1/100 mm`, `mm/10`, `10^-2 mm`, `hundredths of mm`.
_NUMBER = r"\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?"
_POWER = r"10\s*(?:\^|\*\*)?\s*(?:[-\u2212]\s*|(?<=[\^*])\s*[+]?)\d+"
_SO_MUCH_OF = re.compile(
    rf"(?P<sign>[x*\u00d7\u00b7]?)\s*(?P<number>{_POWER}|{_NUMBER})(?:\s*[/:\u2044]\s*(?P<below>{_NUMBER}))?"
    r"\s*(?P<times>[x*\u00d7\u00b7]?)\s*(?P<unit>[^\W\d].*)"
)
_OVER_SO_MUCH = re.compile(rf"(?P<unit>[^\W\d_]+)\s*(?P<sign>[/:x*\u00d7\u00b7])\s*(?P<number>{_POWER}|{_NUMBER})")
_PARTS = {
    "tenth tenths zehntel dixieme dixiemes decima decimas decimo decimi desetina desetiny dziesiata": 0.1,
    "hundredth hundredths hundertstel centieme centiemes centesima centesimas centesimo centesimi setina setiny": 0.01,
    "thousandth thousandths tausendstel millieme milliemes milesima milesimas millesimo millesimi tisicina": 0.001,
}
_PART_OF = re.compile(r"(?P<part>[^\W\d_]+)(?:\s+(?:of(?: an?)?|de|di)\s+|[\s-]+)(?P<unit>[^\W\d_]+)")

#: A symbol over its unit as DIN 1313 has it, or in it, where the symbol is a unit by itself: ``s/mm`` and ``s in mm``
#: are a way, no product or quotient of units. What measures something as a whole is no such: ``m/s``, ``N/m``.
_SYMBOL_AND_UNIT = re.compile(r"([^\W\d_])(?:\s*/\s*|\s+in\s+)([^\W\d_]+)")

_SAID_BY_A_LETTER = ("time", "force", "length", "angle", "mass")

#: Kinds of quantity a record is made of.
PLAIN_KINDS = ("time", "force", "length", "angle", "voltage", "current")

#: Units that loggers print in capitals and databases in small letters; read only where the name says the same kind.
_OTHER_CASE = {"In": "in", "IN": "in", "Kp": "kp", "KP": "kp", "n": "N", "kn": "kN", "S": "s", "M": "m"} | {
    unit.upper(): unit for unit in ("ms", "us", "mm", "cm", "um", "deg")
}


def split_heading(text: str) -> tuple[str, str | None]:
    """Name and unit of a heading.

    ``time [s]``, ``F (N)``, ``F/N``, ``Kraft / N``, ``F in kN``, ``Force, N``, ``Force_N``, ``Weg mm``. A unit without
    a sign that sets it off is taken for one only where the name agrees with it.

    Parameters
    ----------
    text : str
        Heading as in the file.

    Returns
    -------
    tuple of str and (str or None)
        Name without the unit; unit as written, known or not, a factor of ten beside it included; None where there is
        none.
    """
    text = " ".join(unicodedata.normalize("NFKC", text).replace("\u03bc", "u").strip().strip('"').split())
    text = _CONTROL.sub("", text)
    if len(text) > LONGEST_HEADING:
        return text, None
    alone = text.removeprefix("in ")
    if units.expression(alone) is not None and not _is_symbol_and_unit(alone):
        of_time = units.kind_of(alone) == "time" and (alone not in _ALSO_WORDS or alone != text)
        return text, alone if of_time else None
    if (much := _so_much_in_brackets(text)) is not None:
        return much
    factor = _BEFORE.match(text) or _FACTOR.search(text) or _IN_WORDS.search(text) or _below(text)
    if factor is not None and (factor.start() > 0 or factor.re is _BEFORE):
        name, unit = split_heading(f"{text[: factor.start()]} {text[factor.end() :]}")
        # Whether it was applied or is still to be is not for us to say: the unit is one that nobody knows.
        sign = "-1*" if factor.group()[0] in "-\u2212" else factor.group().strip(" ()")
        return name, f"{sign} {unit or ''}".strip()
    for find in (_bracketed, _after_sign, _last_word, _after_underscore):
        found = find(text)
        if found is not None:
            return found
    return text, None


def _is_symbol_and_unit(text: str) -> bool:
    """Whether it is the symbol of a quantity and its unit, where both together would be a unit of nothing."""
    found = _SYMBOL_AND_UNIT.fullmatch(text)
    if found is None or units.kind_of(text) is not None:
        return False
    return units.kind_of(found[1]) in _SAID_BY_A_LETTER and units.kind_of(found[2]) in _SAID_BY_A_LETTER


def _below(text: str) -> re.Match[str] | None:
    """A number that a quantity is divided by, as in ``F/2``; that of a channel, as in ``AI/2``, divides nothing."""
    found = _BELOW.search(text)
    return found if found is not None and kinds_named(text[: found.start()]) else None


def known_unit(name: str, unit: str) -> str | None:
    """Unit in a known spelling, or None.

    Parameters
    ----------
    name : str
        Name of the column; it decides whether ``S`` means seconds.
    unit : str
        As written.

    Returns
    -------
    str or None
        A spelling `fibrefit.core.units` knows.
    """
    if "acc" in name.casefold() and unit == "g":
        return None  # a multiple of gravity, not a gram
    if units.expression(unit) is not None:
        return unit
    small = _OTHER_CASE.get(unit) or (unit.casefold() if len(unit) > 2 and units.expression(unit.casefold()) else None)
    return small if small is not None and units.kind_of(small) in kinds_named(name) else None


def unit_by_key(name: str, said: Sequence[str]) -> str | None:
    """Unit that a key of a column's name has, and no other: ``units: {force: N, position: mm}``.

    Parameters
    ----------
    name : str
        Name of the column, which has no unit of its own.
    said : sequence of str
        Lines above the table.
    """
    if not kinds_named(name) or len(name) > LONGEST_HEADING:
        return None
    value = r"[\"']?\s*[:=]\s*[\"']?([^\s;,\"'}\])]+)[\"'}\])]*\s*(?:[;,]|$)"
    key = re.compile(r"(?<![^\W_])" + re.escape(name) + value)
    found = {unit for line in said for unit in key.findall(line)}
    known = known_unit(name, found.pop()) if len(found) == 1 else None
    return known if known and units.kind_of(known) in kinds_named(name) else None


def _bracketed(text: str) -> tuple[str, str | None] | None:
    """Unit in brackets; square ones hold a unit even when it is not known, unless they hold a number."""
    for bracket in _BRACKETS:
        for match in reversed(list(bracket.finditer(text))):
            content = match.group(1).strip()
            name = " ".join((text[: match.start()] + " " + text[match.end() :]).split()).strip(" ,;:/_-") or content
            known = known_unit(name, content) if content and content != "1" else None
            square = bracket is _BRACKETS[0] and content and (not content[0].isdigit() or _is_amount(content))
            if known is not None or square:
                return name, known or content
    return None


def _so_much_in_brackets(text: str) -> tuple[str, str] | None:
    """Name and unit of a heading with one unit in brackets, and that so much of another: ``Displ (1/100 mm)``."""
    found = [m for bracket in _BRACKETS for m in bracket.finditer(text) if so_much_of(m.group(1).strip())]
    if len(found) != 1 or bracketed_units(text):
        return None
    name = " ".join((text[: found[0].start()] + " " + text[found[0].end() :]).split()).strip(" ,;:/_-")
    return name or found[0].group(1).strip(), found[0].group(1).strip()


def so_much_of(text: str) -> tuple[float, str] | None:
    """How much of which unit a unit is, where it is a part or a multiple of a time, a force, a length or an angle.

    A whole number before a unit, ``500 N``, may as well be a range, but of a time: ``100 ns``. None for all others.

    Parameters
    ----------
    text : str
        As written, e.g. ``"1/100 mm"``.
    """
    found = _SO_MUCH_OF.fullmatch(text) or _OVER_SO_MUCH.fullmatch(text) or _PART_OF.fullmatch(text)
    kind = units.kind_of(found["unit"].strip()) if found else None
    if found is None or kind not in ("time", "force", "length", "angle"):
        return None
    if found.re is _PART_OF:
        words = tokens(found["part"])
        factor = next((part for names, part in _PARTS.items() if words and words[0] in names.split()), 1.0)
    else:
        factor = _amount(found["number"]) / (_amount(found["below"] or "1") if found.re is _SO_MUCH_OF else 1.0)
        factor = 1.0 / factor if found["sign"] in ("/", ":") else factor
        signed = found["sign"] or (found.re is _SO_MUCH_OF and found["times"]) or re.match(_POWER, found["number"])
        factor = 1.0 if factor > 1.0 and not signed and kind != "time" else factor
    return None if factor == 1.0 else (factor, found["unit"].strip())


def _amount(text: str) -> float:
    """Number as written, a power of ten included; 1 for one that is nothing."""
    power = re.fullmatch(r"10\s*(?:\^|\*\*)?\s*([-\u2212+]?)\s*(\d+)", text)
    if power and (power[1] or not text.isdigit()):
        return 10.0 ** (-int(power[2]) if power[1] in ("-", "\u2212") and power[1] else int(power[2]))
    return float(text.replace(",", ".")) or 1.0


def bracketed_units(text: str) -> list[str]:
    """All units in brackets of a heading, of which one only can be that of its column.

    Parameters
    ----------
    text : str
        Heading as in the file.
    """
    if len(text) > LONGEST_HEADING:
        return []
    inside = [match.group(1).strip() for bracket in _BRACKETS for match in bracket.finditer(text)]
    return [unit for unit in inside if units.expression(unit) is not None]


def _is_amount(content: str) -> bool:
    """Whether it is a number with a unit, such as "0.01 mm": what one number is worth, or a range."""
    number = re.match(r"\d+(?:[.,]\d+)?\s*(?=[^\W\d])", content)
    return number is not None and units.expression(content[number.end() :]) is not None


def _after_sign(text: str) -> tuple[str, str | None] | None:
    """Unit after a slash, a comma, a colon or the word `in`."""
    last = text.rpartition(" ")[2]
    whole = "/" in last and last != text and units.expression(last) is not None  # "speed m/s"
    for match in re.finditer(r"\s*[/,:;|]\s*|\s+in\s+", text[: -len(last)] if whole else text):
        name, unit = text[: match.start()], text[match.end() :].strip("() ")
        unit = re.sub(r"\s+\([^()]*\)?$", "", unit)  # "F in N (filtered)"
        if name and unit and (" in " in match.group() or not re.search(r"[=\d]$", name)):
            known = known_unit(name, unit)
            if known is not None and not re.fullmatch(r"[\d.,\s-]+", unit):
                return name, known
    return None


def _last_word(text: str) -> tuple[str, str | None] | None:
    """Unit as the last word, where the words before it stand for the same kind of quantity."""
    match = re.fullmatch(r"(.*[^\W\d_]\S*)[\s_]+([^\s_]+)", text)
    if match is None:
        return None
    name, unit = match.groups()
    short = len(name) == 1 and len(unit) == 1 and (name, unit) not in {("t", "s"), ("F", "N")}
    known = None if short or "=" in name else known_unit(name, unit)
    if known is None or units.kind_of(known) not in kinds_named(name):
        return None
    return name, known


def _after_underscore(text: str) -> tuple[str, str | None] | None:
    """Unit after an underscore, where the name before it says nothing and the unit is no word: ``x_um``."""
    name, sign, unit = text.rpartition("_")
    known = None if unit in _ALSO_WORDS or not name.strip("_ ") else known_unit(name, unit)
    if not sign or known is None or units.kind_of(known) not in PLAIN_KINDS or kinds_named(name):
        return None
    return name, known
