"""What the lines beside a table say of its numbers: claims, each with the words it is about and its own numbers.

A line is taken apart so that nothing in it is lost: every number stands in one claim, and every word either in the
claim it leads to or in one without a number. Its words, and the unit of its number, say what it bears on.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from fibrefit.core import units
from fibrefit.records.grammar.tokens import CLOCK

#: Numbers in words. One is none of them: "one" is as often a pronoun.
WORDED = {
    **dict(
        zip(
            ("two", "three", "four", "five", "six", "eight", "ten", "zwei", "drei", "vier", "zehn"),
            (2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0, 2.0, 3.0, 4.0, 10.0),
            strict=True,
        )
    ),
    **dict.fromkeys(("half", "halves", "halved", "halb", "halbe", "halben", "halbiert"), 0.5),
    **dict.fromkeys(
        ("double", "doubled", "doubles", "twice", "doppelt", "doppelte", "verdoppelt", "both", "pair"), 2.0
    ),
    **dict.fromkeys(("triple", "tripled", "dreifach"), 3.0),
    **dict.fromkeys(("tenth", "tenths", "zehntel"), 0.1),
    **dict.fromkeys(("hundredth", "hundredths", "hundertstel"), 0.01),
    **dict.fromkeys(("thousandth", "thousandths", "tausendstel"), 0.001),
    **dict.fromkeys(("tenfold", "zehnfach"), 10.0),
    **dict.fromkeys(("hundredfold", "hundredfache", "hundertfach"), 100.0),
    **dict.fromkeys(("thousandfold", "tausendfach"), 1000.0),
}

#: Days, hours and the like, which are no amounts; and names that end in a number, such as `U9C`, `S2M` or `CH1`.
_DAY = re.compile(
    r"\b\d{1,4}[-./]\d{1,2}[-./]\d{1,4}\b|\b\d{1,2}[-. ][A-Za-z]{3,9}[-. ]\d{2,4}\b"
    r"|\b\d{1,2}:\d{2}:\d{2}(?:\.\d+|,\d{3,6}\b)?"
    r"|\b\d{2}:\d{2}\b|\b\d{1,2} ?(?:[ap]m|Uhr)\b|\b(?:0?[1-9]|1[0-2])/(?:19|20)\d{2}\b"
)
_AMOUNT = re.compile(
    r"(?<![^\W_])(?P<sign>[x*\u00d7/]\s?(?=[\d.+-]))?(?P<number>[+-]?(?:\d+(?:[.,]\d+)?|\.\d+)(?:[eE][+-]?\d+)?)"
    r"(?:(?<!\d{4})\s*:\s*(?P<to>\d+(?:\.\d+)?)(?![\d:]))?(?P<times>\s?[x\u00d7](?![^\W_]))?"
    r"(?:\s*[\[(]?(?P<unit>N[ \u00b7*]m(?![^\W_])"
    r"|[^\W\d_][^\s;,\t\])=:]{0,14}(?:/\([^)]*\))?|[%\u2030\u00b0\"]C?|1/[^\W\d_]+)[\])]?)?"
)
#: Of a name with digits in it, whose digits are no amounts: `4be1c2a`, `KX-88`, `4711-9`, `2024-03-14T09:12:44Z`.
_NAME = re.compile(
    r"(?<![\w.,/+*-])(?:\d{4}-\d\d-\d\dT[\d:.]+Z?|10\.\d{4,}/\S+\d|\d+(?:\.\d+){2,}(?::\d+)?|\d+(?:\.\d+)+[ab]|[1-3]D|(?!0x)\d+[^\W\d_]+\d\w*(?:-\w+)*|\d{3,}(?:-\d+)+|\d\d(?:-\d\d+)+(?!\s?[^\W\d_%])"
    r"|[A-Z][A-Z\d]+(?:-[A-Z\d]+)*-\d+[A-Z\d]*|[A-Z]-\d{3,}|[A-Z][a-z]+-\d+)(?![\w.])"
)
_EXPONENT = re.compile(r"\d+e\d+", re.I)
_PREFIX = re.compile(r"\b(pre)-(?=[a-z])", re.I)
_JOINT = re.compile(r"(?<=[a-z]{2})(?=[A-Z][a-z]{2})")
_KEY = re.compile(r"\W*([^:=;,|\t\d]{3,60}):\s")
_PIECE = re.compile(r"[;|\t]|,(?=\D|$)|(?<=\D),|,(?=\s)|(?<=[^\W\d])\.\s|\s-\s")
_COMMA = re.compile(r"[;|\t]|,|(?<=[^\W\d])\.\s|\s-\s")


@dataclass(frozen=True, slots=True)
class Amount:
    """One number of a claim.

    Parameters
    ----------
    value : float
    unit : str
        As written behind it; empty where what stands there is no unit.
    factor : bool
        Whether a sign before or behind it says that something is multiplied or divided by it: ``x0.5``.
    ratio : bool
        Whether it is written as ``2:1``.
    counted : bool
        Whether it is written as digits alone, as names and counts are.
    """

    value: float
    unit: str = ""
    factor: bool = False
    ratio: bool = False
    counted: bool = False

    @property
    def kind(self) -> str | None:
        """Kind of quantity of the unit; None without one, or for one that is not known."""
        return units.kind_of(self.unit) if self.unit else None


@dataclass(frozen=True, slots=True)
class Claim:
    """Words of a line, and the numbers that follow them.

    Parameters
    ----------
    about : str
        The words, units of the numbers left out.
    amounts : tuple of Amount
        Its numbers, in their order.
    """

    about: str
    amounts: tuple[Amount, ...] = ()


def claims_of(line: str, mark: str = ".") -> Iterator[Claim]:
    """Claims of a line.

    Parameters
    ----------
    line : str
        As in the file.
    mark : str
        Decimal mark of the table: with a point, a comma between digits separates two numbers.
    """
    line = _NAME.sub(lambda m: m[0] if _EXPONENT.fullmatch(m[0]) else " ", line)
    line = _PREFIX.sub(r"\1", line)
    line = _JOINT.sub(" ", _DAY.sub(" ", line.replace('"', " ").replace("+/-", "\u00b1")))
    about: list[str] = []
    amounts: list[Amount] = []
    key = _KEY.match(line)
    lead = key[1].strip() if key else ""  # of a list behind it: "Scale factors: time 1, force 2"
    for piece in (_PIECE if mark == "," else _COMMA).split(line):
        found = list(_amounts(piece))
        words = _AMOUNT.sub(lambda m: "" if _is_unit(m["unit"]) else " " + (m["unit"] or ""), piece).strip(" #%*:=/")
        if amounts and _is_unit(words.strip("[]() ")):  # the unit in a cell of its own: "Offset;1.25;N"
            amounts = [a if a.unit else replace(a, unit=words.strip("[]() ")) for a in amounts]
            continue
        if re.search(r"[^\W\d_]", words):
            if amounts:
                yield _claim(about, amounts)
                about, amounts = [lead] if lead and not re.search("[:=]", piece) else [], []
            about.append(words)
        amounts += found
    if about or amounts:
        yield _claim(about, amounts)


def has_day(line: str) -> bool:
    """Whether a date or a time of day stands in a line."""
    return _DAY.search(line) is not None


def _claim(about: Sequence[str], amounts: Sequence[Amount]) -> Claim:
    """Claim in which numbers without a unit have the one in brackets before them: ``Sensitivity [mV/V]: 2``."""
    words = " ".join(about)
    inside = [unit for unit in re.findall(r"[\[(]([^\[\]()]{1,15})[\])]\W*$", words) if _is_unit(unit)]
    unit = inside[0] if len(inside) == 1 else ""
    return Claim(words, tuple(a if a.unit or a.factor else replace(a, unit=unit) for a in amounts))


def _amounts(piece: str) -> Iterator[Amount]:
    if CLOCK.fullmatch(piece.strip()):
        return
    for match in _AMOUNT.finditer(piece):
        value = float(match["number"].replace(",", "."))
        if match["to"]:
            value = value / (float(match["to"]) or 1.0)
        unit = "degC" if match["unit"] == "C" else match["unit"]
        unit = unit if _is_unit(unit) and not match["to"] else ""
        yield Amount(
            value,
            unit or "",
            bool(match["sign"] or match["times"] or match["to"]),
            bool(match["to"]),
            match["number"].isdigit(),
        )


def _is_unit(word: str | None) -> bool:
    """Whether a word behind a number is its unit; one of what is not known, such as pC/N, by its slash."""
    return bool(word) and (units.expression(word or "") is not None or "/" in (word or "") or word in ("%", "\u2030"))
