"""Which layout of its own a text has, told by its ends, and the same text as a table."""

from __future__ import annotations

import re

from fibrefit.records.files.decode import Text, decode
from fibrefit.records.layouts.long_form import channels_in_turn, refuse_long_form
from fibrefit.records.layouts.units_behind import places_of_units, with_units_apart
from fibrefit.records.layouts.universal import from_universal, is_universal
from fibrefit.records.thresholds import FEWEST_ROWS

_WORDS = re.compile(r"[^\W\d_eE]")
#: Bytes at either end of a file that tell its layout.
_ENDS = 8192


def in_usual_layout(data: bytes, where: str) -> Text | None:
    """Text of a file whose layout is its own, as a table; None for all others, which are not decoded here.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        File to name in messages.

    Raises
    ------
    DataError
        If the file is not understood, or its channels stand below each other.
    """
    if is_universal(_lines(data[:_ENDS])):
        return from_universal(decode(data, where), where)
    tail = _lines(data[-_ENDS:])[1 if len(data) > _ENDS else 0 :]
    if not any(map(_WORDS.search, [line for line in tail if line.strip()][-FEWEST_ROWS:])):
        return None  # numbers alone, as in most files
    if channels_in_turn(tail) is not None:
        refuse_long_form(decode(data, where).lines, where)
    return with_units_apart(decode(data, where), where) if places_of_units(tail) is not None else None


def _lines(part: bytes) -> list[str]:
    """Lines of a part of a file, whose signs beyond ASCII do not matter here."""
    return part.replace(b"\x00", b"").replace(b"\r\n", b"\n").decode("utf-8", "replace").replace("\r", "\n").split("\n")
