"""Numbers of things, as parts of sentences."""

from __future__ import annotations

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
