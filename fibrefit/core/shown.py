"""How an object shows itself: two lines at a prompt, a small table in a notebook."""

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
    rows : sequence of sequence of str
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


def _cell(text: str) -> str:
    return f"<td>{escape(text)}</td>"
