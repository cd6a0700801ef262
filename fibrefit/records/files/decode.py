"""Bytes to text: the encodings loggers and spreadsheets write, without a guess that could change a digit."""

from __future__ import annotations

import contextlib
import re
from dataclasses import dataclass

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.grammar.words import kinds_named, tokens
from fibrefit.records.thresholds import CONTROLS, NARROW_ZEROS, WHOLE_WORDS, WIDE_ZEROS, ZEROS

_NEWER_NETCDF = 'Save it as NetCDF 4: xarray.load_dataset(...).to_netcdf(..., engine="h5netcdf").'
#: How files that are no text begin, and what to do with them.
FOREIGN = {
    b"\xd0\xcf\x11\xe0": ("an old spreadsheet", "Save the sheet as CSV."),
    b"%PDF": ("a PDF", "Export the measured values as CSV."),
    b"\x89PNG": ("a picture", "Export the measured values as CSV."),
    b"ARROW1": ("an Arrow or Feather file", "Save it as Parquet: pandas.read_feather(...).to_parquet(...)."),
    b"CDF\x01": ("a NetCDF 3 file", _NEWER_NETCDF),
    b"CDF\x02": ("a NetCDF 3 file", _NEWER_NETCDF),
    b"SQLite format 3": ("a data base", "Export the table of measured values as CSV."),
}

#: Bytes that are letters of Czech in cp1250 and rare signs in cp1252.
_CZECH = frozenset(b"\x8a\x8d\x8e\x9a\x9d\x9e\xc8\xcc\xcf\xd8\xd9\xe8\xec\xef\xf2\xf8\xf9")

#: What can be read, for messages.
READABLE = "text, .xlsx, .parquet, .h5, .mat, .npz, .tdms or .mf4"

#: Alphabets of two bytes a sign, the stricter first. Digits are the same in all of them.
_EAST_ASIAN = ("cp932", "gbk", "euc_kr", "big5")

#: Alphabets of older programs: of consoles, and of those in Cyrillic letters.
_OF_CONSOLES = ("cp850", "cp852")
_CYRILLIC = ("koi8_r", "cp866")

#: Bytes at the start of a file that tell its alphabet.
_HEAD = 65536

_CONTROLS = bytes(set(range(1, 32)) - set(b"\t\n\r\x0b\x0c\x1a"))


#: Signs without width: marks of byte order, also of a file that was joined to another, and of the direction of writing.
_UNSEEN = dict.fromkeys((0xFEFF, 0x200B, 0x200E, 0x200F, 0x061C, *range(0x202A, 0x202F), *range(0x2066, 0x206A)))


@dataclass(frozen=True, slots=True)
class Text:
    """Text of a file.

    Parameters
    ----------
    lines : list of str
        Lines without their ends.
    encoding : str
        Name of the encoding.
    ended : bool
        Whether the last line had an end; without one its last value may be cut short.
    notes : tuple of str
        What had to be decided.
    beside : tuple of (str, str)
        What the file says outside these lines, such as on another sheet: where, and what.
    units : tuple of str
        Of these, units of columns by their names: ``force = kN``.
    decimal : str or None
        Decimal mark, where the file holds numbers instead of their texts.
    """

    lines: list[str]
    encoding: str
    ended: bool
    notes: tuple[str, ...] = ()
    beside: tuple[tuple[str, str], ...] = ()
    units: tuple[str, ...] = ()
    decimal: str | None = None


def decode(data: bytes, where: str) -> Text:
    """Text of a file, whatever its encoding.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        File to name in messages.

    Returns
    -------
    Text
        Its lines.

    Raises
    ------
    DataError
        If the file is empty or no text.
    """
    if not data.strip(b"\x00\r\n\t \x1a\xff\xfe"):
        raise DataError(where, "the file is empty", "a table of measured values", "Export it again.")
    for start, (what, do) in FOREIGN.items():
        if data.startswith(start):
            raise DataError(where, f"{what}, not text", READABLE, do)
    text, encoding, notes = _decoded(data, where)
    text = text.translate(_UNSEEN).rstrip("\x1a")
    text = text.replace("\r\n", "\n").replace("\r", "\n")
    lines = text.split("\n")
    ended = lines[-1] == ""
    return Text(lines[:-1] if ended else lines, encoding, ended, notes)


def _decoded(data: bytes, where: str) -> tuple[str, str, tuple[str, ...]]:
    wide = _wide_encoding(data)
    if wide:
        return data.decode(wide, errors="replace"), wide.upper(), ()
    controls = len(data) - len(data.translate(None, _CONTROLS))
    if controls > max(8, CONTROLS * len(data)) or data.count(0) > ZEROS * len(data):
        raise DataError(where, "binary data, not text", READABLE, "Export the values as CSV.")
    try:
        return data.decode("utf-8"), "UTF-8", ()
    except UnicodeDecodeError:
        pass
    text = data.decode("utf-8", errors="replace")
    broken = text.count("\ufffd")
    whole = sum(1 for char in text if char > "\x7f") - broken
    if data.startswith(b"\xef\xbb\xbf") or whole > broken:
        return text, "UTF-8", (f"{broken} character{'s are' if broken > 1 else ' is'} not valid UTF-8.",)
    encoding = _of_known_words(data)
    text = data.decode(encoding, errors="replace")
    if "\ufffd" in text:  # bytes that are no sign of this alphabet
        for wide in _EAST_ASIAN:
            with contextlib.suppress(UnicodeDecodeError):
                return data.decode(wide), wide, ()
    return text, encoding, ()


def _of_known_words(data: bytes) -> str:
    """Alphabet in which most words with high bytes are known; where they are in none or several, the likeliest."""
    pairs, cyrillic = _is_in_pairs(data), _is_cyrillic(data)
    likely = "cp1251" if cyrillic else "gbk" if pairs else "cp1250" if _CZECH & set(data) else "cp1252"
    others = _EAST_ASIAN if pairs else ("cp1250", "cp1252", *(_CYRILLIC if cyrillic else _OF_CONSOLES))
    return max((likely, *(other for other in others if other != likely)), key=lambda one: _known_words(data, one))


def _known_words(data: bytes, encoding: str) -> int:
    """How many words with high bytes name a quantity or a unit, read in an alphabet; -1 where it cannot be."""
    try:
        text = data[: max(data.rfind(b"\n", 0, _HEAD), 0) or len(data)].decode(encoding)
    except UnicodeDecodeError:
        return -1 if encoding in _EAST_ASIAN else 0
    words = {word for word in re.findall(r"[^\W\d_]+", text) if not word.isascii()}
    known = sum(bool(kinds_named(word)) or units.expression(word) is not None for word in words)
    # What is a unit only without its accents is less: "\u0107m" is no centimetre, where "\u00b5m" may be meant.
    return 2 * known + sum(units.expression("".join(tokens(word))) is not None for word in words)


def _is_in_pairs(data: bytes) -> bool:
    """Whether high bytes stand in pairs throughout, and some in two at once, as signs of two bytes do."""
    runs = [len(run) for run in re.findall(rb"[\x80-\xff]+", data[:_HEAD])]
    return max(runs, default=0) >= 4 and not any(length % 2 for length in runs)


def _is_cyrillic(data: bytes) -> bool:
    """Whether words are made of high bytes throughout; elsewhere letters with accents stand alone or in pairs."""
    words = re.findall(rb"[A-Za-z\x80-\xff]{3,}", data[:_HEAD])
    high = [word for word in words if max(word) > 0x7F]
    whole = [word for word in high if min(word) >= 0xC0]
    return len(whole) > WHOLE_WORDS * len(high) and len(whole) > 0


def _wide_encoding(data: bytes) -> str | None:
    """Encoding with two or four bytes a character, from its mark or from where the zero bytes stand."""
    if data.startswith((b"\xff\xfe\x00\x00", b"\x00\x00\xfe\xff")):
        return "utf-32"
    if data.startswith((b"\xff\xfe", b"\xfe\xff")):
        return "utf-16"
    head = data[:4096]
    zeros_even, zeros_odd = head[::2].count(0), head[1::2].count(0)
    half = max(1, len(head) // 2)
    if zeros_odd > WIDE_ZEROS * half and zeros_even < NARROW_ZEROS * half:
        return "utf-16-le"
    if zeros_even > WIDE_ZEROS * half and zeros_odd < NARROW_ZEROS * half:
        return "utf-16-be"
    return None
