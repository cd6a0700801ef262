"""Numbers of things, as parts of sentences."""

from __future__ import annotations

import re
from collections.abc import Collection, Sequence

#: Lines named one by one; the rest are counted.
_NAMED = 4

#: What answers a question about a rate.
GIVE_RATE = 'Give the sampling rate: sampling_rate = "2 kHz" under [files], or in the record.'


def count(number: int, noun: str) -> str:
    """``1 sample``, ``3 samples``.

    Parameters
    ----------
    number : int
        How many.
    noun : str
        In the singular; one that takes an s.

    Returns
    -------
    str
        Number and noun.
    """
    return f"{number} {noun}{'' if number == 1 else 's'}"


def line_numbers(numbers: Collection[int]) -> str:
    """``Line 7``, ``Lines 7, 9``, ``Lines 7, 9, 11, 12 and 30 more``.

    Parameters
    ----------
    numbers : collection of int
        At least one.

    Returns
    -------
    str
        Beginning of a sentence.
    """
    shown = ", ".join(str(number) for number in sorted(numbers)[:_NAMED])
    more = f" and {len(numbers) - _NAMED} more" if len(numbers) > _NAMED else ""
    return f"{'Line' if len(numbers) == 1 else 'Lines'} {shown}{more}"


def split_at(where: str, starts: Sequence[int]) -> str:
    """How a file of several recordings becomes a file of each, with a command that does it for a text.

    Parameters
    ----------
    where : str
        Name of the file; what stands behind a comma and a blank is left out.
    starts : sequence of int
        First line of each recording, in order.
    """
    name = where.split(", ")[0]
    stem, _, ending = name.rpartition(".")
    do = f"Split the file there: lines {starts[0]} to {starts[1] - 1}, and so on, each below the head"
    do += f', and name each in a [[records]]: file = "{stem}_1.csv".'
    if not re.fullmatch(r"[\w.-]+", name) or ending.casefold() not in ("csv", "txt", "dat", "asc", "tsv"):
        return do
    # All within brackets: it stays one command where a terminal breaks it into lines.
    cuts = ",".join(str(start - 1) for start in starts)
    command = f"[open(f'{stem}_{{i}}.csv','wb').writelines(l[:{starts[0] - 1}]+l[a:b]) for l in "
    command += f"[open('{name}','rb').readlines()] for c in [[{cuts},len(l)]] for i,(a,b) in enumerate(zip(c,c[1:]),1)]"
    return f'{do} At once: python -c "{command}"'


class Aside(str):
    """A note on how a file was read that gives no reason to doubt its numbers, such as on columns that no role has."""

    __slots__ = ()


def are(number: int) -> str:
    """``is`` for one, ``are`` for more."""
    return "is" if number == 1 else "are"


def not_understood(remarks: Sequence[tuple[str, str]]) -> list[str]:
    """Sentence on what a file says that is not understood and was taken to change no number; none for nothing.

    Parameters
    ----------
    remarks : sequence of (str, str)
        Place and text, in the order of the file.

    Returns
    -------
    list of str
        ``Not understood, and taken to change no number: line 3 "Sensor above".``
    """
    shown = "; ".join(f'{place} "{" ".join(text.split())[:60]}"' for place, text in remarks[:_NAMED])
    more = f"; and {len(remarks) - _NAMED} more" if len(remarks) > _NAMED else ""
    return [f"Not understood, and taken to change no number: {shown}{more}."] if remarks else []
