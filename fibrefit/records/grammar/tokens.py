"""What one cell of a table is: a number, a time of day, a sign for a missing value, or text."""

from __future__ import annotations

import re
from collections.abc import Sequence

from fibrefit.records.thresholds import OTHER_MARKS

#: A number with a decimal point or a decimal comma. A trailing mark is read for points only: "12," is a separator.
#: Digits are never given back: a cell of a hundred thousand of them and a letter would be tried in all ways to part it.
NUMBER = {
    ".": re.compile(r"[+-]?(?:\d++\.?\d*+|\.\d++)(?:[eEdD][+-]?\d++)?"),
    ",": re.compile(r"[+-]?(?:\d++(?:,\d++)?|,\d++)(?:[eEdD][+-]?\d++)?"),
}

_GROUP = {".": "[,'\u2019 ]", ",": "[.'\u2019 ]"}

#: Digits in groups of three: 1.012,5 or 1'012.5.
THOUSANDS = {mark: re.compile(rf"[+-]?\d{{1,3}}(?:{group}\d{{3}})+(?:[{mark}]\d*)?") for mark, group in _GROUP.items()}

_MONTH = r"(?:jan|feb|m[aä]r|apr|ma[iy]|jun|jul|aug|sep|o[ck]t|nov|de[cz])[a-z]*\.?"
_DATE = (
    r"(?:\d{1,2}[./ -](?:"
    + _MONTH
    + r")[./ -]\d{4}|\d{1,2}[./-]\s?\d{1,2}[./-]\s?(?:\d{4}|\d{2})|\d{4}[./-]\d{1,2}[./-]\d{1,2})"
)
# Two digits behind a third colon may be hundredths, or frames of a film: they are no time that can be read in one way.
_TIME = r"\d{1,3}:\d{2}(?::\d{2}(?:[.,]\d+|:\d{3,})?|[.,]\d+)?"
_HALF = r"(?:\s?[aApP]\.?[mM]\.?)?"
_ZONE = r"(?:\s?(?P<zone>Z|[+-]\d{2}:?\d{2}))?"

#: Time of day, with or without a date or a number of days before it; or a date alone.
CLOCK = re.compile(
    rf"(?:(?P<days>\d{{1,5}}) days?,? )?(?:(?P<date>{_DATE})(?:[T\s]\s*|$))?"
    rf"(?:(?P<time>{_TIME})(?P<half>{_HALF}){_ZONE})?",
    re.IGNORECASE,
)
DATE = re.compile(_DATE, re.IGNORECASE)
#: What clocks west of Greenwich differ by, as it stands in a column of its own: no time before a trigger.
_OFFSET = re.compile(r"-\d{2}:\d{2}")

#: Date and time of day without signs between the parts: 20240512T142211.5.
COMPACT = re.compile(r"(\d{4})(\d{2})(\d{2})[T_ ](\d{2})(\d{2})(\d{2}(?:[.,]\d+)?)(.*)")

_HEXADECIMAL = re.compile(r"(?:0[xX])?[0-9A-Fa-f]{2,16}")

#: The same with nothing between them, told from any other number by what a date and a time of day may be.
_STAMP = re.compile(r"((?:19|20)\d\d)(0[1-9]|1[0-2])(0[1-9]|[12]\d|3[01])([01]\d|2[0-3])([0-5]\d)([0-5]\d(?:[.,]\d+)?)")

_NOT_A_NUMBER = (
    r"nan|[+-]?1[.,]#(?:ind|snan|qnan)\w*|[+-]?nan\(.*\)|n/?a|#n/?a|#nv|#wert!|#value!|#num!|#zahl!|#ref!|null|none|nil"
    r"|-+|\?+|x+|missing|invalid|ung[uü]ltig|neplatn\w*|err(?:or)?|#err\w*|fehler|chyba|bad|void"
    r"|no[ _]?(?:data|values?|readings?)|burnout|open|fault\w*|fail\w*|stale|time[ -]?out|disconnected|st[oö]rung"
    r"|gest[oö]rt|ausfall|def[ae]ut|not ?ready|no ?signal"
)
_OVERFLOW = (
    r"[+-]?inf(?:inity)?|[+-]?1[.,]#inf\w*|[+-]?(?:over|under)(?:flow|range|load)?|[+-]?ovl?d?|[+-]?ovfl|[+-]?o\.?l\.?"
    r"|[uü]berlauf|ueberlauf|[uü]bersteuert|p[rř]ete[cč]en[ií]|[+-]?sat(?:urated)?|clip(?:ped)?|\*+|#+|[+-]?∞|[<>]{2,}"
)
NOT_A_NUMBER = re.compile(_NOT_A_NUMBER, re.IGNORECASE)
OVERFLOW = re.compile(_OVERFLOW, re.IGNORECASE)

_SPACES = "\u2007\u2009\u202f\xa0"
_PLAIN = str.maketrans({"\u2212": "-", "\u2013": "-", "\uff0b": "+"} | dict.fromkeys(_SPACES, " "))


_DIGITS = str.maketrans("123456789", "0" * 9)


def shapes_of(texts: Sequence[str]) -> list[str]:
    """Texts with a 0 for every digit: of what kind cells and lines are does not hang on which digit stands where.

    Thousands of rows have some tens of shapes. Texts with ``#`` stay as they are: ``1.#INF`` is no ``0.#INF``.

    Parameters
    ----------
    texts : sequence of str
        Lines or cells, without line ends.

    Returns
    -------
    list of str
        One for each.
    """
    joined = "\n".join(texts)
    shapes = joined.translate(_DIGITS).split("\n") if texts else []
    if "#" in joined:
        return [text if "#" in text else shape for text, shape in zip(texts, shapes, strict=True)]
    return shapes


def clean(cell: str) -> str:
    """Cell without surrounding blanks, with plain minus signs and plain spaces.

    Parameters
    ----------
    cell : str
        As in the file.

    Returns
    -------
    str
        The same characters otherwise.
    """
    text = cell.translate(_PLAIN).strip()
    if text[8:9] in ("T", "_") and (match := COMPACT.fullmatch(text)):
        year, month, day, hour, minute, second, zone = match.groups()
        return f"{year}-{month}-{day}T{hour}:{minute}:{second}{zone}"
    return text[0] + text[1:].lstrip() if text[:1] in "+-" and text[1:2] == " " else text


def compact_stamps(cells: Sequence[str]) -> list[str] | None:
    """Dates and times of day whose parts stand side by side, set apart; None where a column holds anything else.

    As a number ``20240512142211.0005`` has more digits than a float.

    Parameters
    ----------
    cells : sequence of str
        Of a column.
    """
    if not cells or _STAMP.fullmatch(cells[0].strip()) is None:
        return None
    found = [_STAMP.fullmatch(cell.strip()) for cell in cells]
    parts = [match.groups() for match in found if match is not None]
    return [f"{y}-{m}-{d}T{h}:{n}:{s}" for y, m, d, h, n, s in parts] if len(parts) == len(cells) else None


def hexadecimal(cells: Sequence[str], mark: str) -> bool:
    """Whether a column holds hexadecimal numbers: some of them would pass for decimal ones, ``2E8`` for 200 million.

    Parameters
    ----------
    cells : sequence of str
        Of a column.
    mark : str
        Decimal mark.
    """
    present = [text for text in (cell.strip() for cell in cells) if text]
    if not present or not all(_HEXADECIMAL.fullmatch(text) and not NOT_A_NUMBER.fullmatch(text) for text in present):
        return False
    letters = sum(NUMBER[mark].fullmatch(text) is None for text in present)
    return letters > max(2, OTHER_MARKS * len(present)) and len({*map(len, present)}) <= 2


def clock_of(text: str) -> re.Match[str] | None:
    """A clock reading taken apart, without the minus of one before a trigger; None for anything else.

    Parameters
    ----------
    text : str
        As from `clean`.
    """
    plain = text[1:] if text[:1] == "-" and ":" in text and not _OFFSET.fullmatch(text) else text
    return CLOCK.fullmatch(plain) if plain[:1].isdigit() else None


def kind_of_cell(cell: str, mark: str) -> str:
    """Kind of a cell under a decimal mark.

    Parameters
    ----------
    cell : str
        As in the file, without quotes.
    mark : str
        ``"."`` or ``","``.

    Returns
    -------
    str
        ``"number"``, ``"empty"``, ``"clock"``, ``"thousands"``, ``"not a number"``, ``"overflow"`` or ``"text"``.
    """
    text = clean(cell)
    if not text:
        return "empty"
    if NUMBER[mark].fullmatch(text):
        return "number"
    if THOUSANDS[mark].fullmatch(text):
        return "thousands"
    if clock_of(text):
        return "clock"
    if NOT_A_NUMBER.fullmatch(text):
        return "not a number"
    return "overflow" if OVERFLOW.fullmatch(text) else "text"
