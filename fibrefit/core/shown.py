"""What is shown: text of files and names that steers nothing; an object in two lines, or as a small table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple


class Card(NamedTuple):
    """What an object says of itself.

    Parameters
    ----------
    title : str
        One line: what it is.
    line : str
        One more: what matters most of it.
    head : tuple of str
        Of the table that a notebook shows; empty for none.
    """

    title: str
    line: str
    head: Sequence[str] = ()
    rows: Iterable[Sequence[str]] = ()

    def text(self) -> str:
        """Two lines."""
        return f"{self.title}\n  {self.line}"

    def html(self) -> str:
        """The same with the table; no style but the notebook's own."""
        parts = [f"<strong>{escape(self.title)}</strong><br>{escape(self.line)}"]
        if self.head:
            head = "".join(f'<th scope="col">{escape(cell)}</th>' for cell in self.head)
            rows = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in self.rows)
            parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>")
        return f"<div>{''.join(parts)}</div>"


class Shown:
    """An object that shows itself by its card, at a prompt and in a notebook."""

    __slots__ = ()

    def _card(self) -> Card:
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._card().text()

    def __str__(self) -> str:
        return self._card().text()

    def _repr_html_(self) -> str:
        return self._card().html()


def from_to(before: float, after: float, form: str) -> str:
    """Where a number went: ``falls from 3.10 to 1.30``; nowhere where both read alike.

    Parameters
    ----------
    before, after : float
    form : str
        Format specification of both.
    """
    first, last = format(before, form), format(after, form)
    if first == last:
        return f"stays at {last}"
    return f"{'falls' if after < before else 'rises'} from {first} to {last}"


def in_words(words: Iterable[str]) -> str:
    """``a, b and c``; nothing of nothing."""
    *others, last = words if (words := list(words)) else [""]
    return " and ".join(filter(None, (", ".join(others), last)))


def _cell(text: str) -> str:
    return f"<td>{escape(text)}</td>"


def printable(text: str) -> str:
    """Text without what no encoding has: bytes of a file's name that are no text, and NUL.

    Parameters
    ----------
    text : str
        Such as the name of a file.
    """
    return text.encode("utf-8", "backslashreplace").decode("utf-8").replace("\0", "\\0")


def harmless(text: str) -> str:
    r"""Text with every character that would steer a terminal written as its escape, such as ``\x1b``.

    Parameters
    ----------
    text : str
        Lines and tabs stay.
    """
    return text.translate(_STEERING)


_STEERING = {
    code: ascii(chr(code))[1:-1]
    for code in (
        *(code for code in range(0x20) if chr(code) not in "\n\t"),
        *range(0x7F, 0xA0),
        # Marks of line and paragraph, and those that turn the direction of writing.
        *(0x061C, 0x200E, 0x200F, *range(0x2028, 0x202F), *range(0x2066, 0x206A)),
    )
}
"""Control characters (C0 without line feed and tab, DEL, C1) and the marks of direction of Unicode."""


def or_others(name: str, alike: Iterable[Sequence[str]]) -> str:
    """A name with those that records do not tell from it: ``guide.viscous_friction (or drive.play)``.

    Parameters
    ----------
    alike : iterable of sequence of str
        Names that are not distinguished.
    """
    others = [other for names in alike if name in names for other in names if other != name]
    return f"{name} (or {', or '.join(dict.fromkeys(others))})" if others else name
