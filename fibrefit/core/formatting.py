"""What a person reads: numbers with units, words, text that steers nothing; an object in two lines or a small table."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape
from typing import NamedTuple

SHOWN: dict[str, tuple[tuple[str, float], ...]] = {
    "s": (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)),
    "N": (("kN", 1e3), ("N", 1.0)),
    "m": (("m", 1.0), ("mm", 1e-3), ("um", 1e-6)),
    "kg": (("kg", 1.0), ("g", 1e-3)),
    "rad": (("deg", 0.017453292519943295),),
    "Hz": (("Hz", 1.0),),
    "m/s": (("m/s", 1.0), ("mm/s", 1e-3)),
    "N/m": (("kN/m", 1e3), ("N/m", 1.0)),
}
"""For people: the first unit whose value is at least 1 is shown, else the last."""


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
            cells = ("".join(f"<td>{escape(cell)}</td>" for cell in row) for row in self.rows)
            rows = "".join(f"<tr>{row}</tr>" for row in cells)
            parts.append(f"<table><thead><tr>{head}</tr></thead><tbody>{rows}</tbody></table>")
        return f"<div>{''.join(parts)}</div>"


class Shown:
    """An object that shows itself by its card, at a prompt and in a notebook."""

    __slots__ = ()

    def _card(self) -> Card:
        raise NotImplementedError

    def __repr__(self) -> str:
        return self._card().text()

    __str__ = __repr__

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


def shown_unit(value: float, si: str) -> tuple[str, float]:
    """Unit a person would choose for a value in SI.

    Parameters
    ----------
    value : float
        Size of the number, in `si`.
    si : str
        SI unit.

    Returns
    -------
    tuple of str and float
        The unit and what it is worth in `si`; the same pair suits the error bar of the value.
    """
    steps = SHOWN.get(si, ((si, 1.0),))
    fallback = min(steps, key=lambda step: abs(step[1] - (1e-3 if si == "m" else 1.0))) if value == 0 else steps[-1]
    return next((step for step in steps if abs(value) >= step[1] * (1 - 1e-12)), fallback)


def format_quantity(value: float, si: str, digits: int = 4) -> str:
    """Value with the unit a person would choose: ``34.21 kN/m``, ``13.8 mm``. ASCII only.

    Parameters
    ----------
    value : float
        In `si`.
    si : str
        SI unit; ``"-"`` for a pure number, which is shown bare.
    digits : int
        Significant digits.

    Returns
    -------
    str
        Text that `parse_quantity` reads back.
    """
    unit, worth = shown_unit(value, si)
    number = format_number(value / worth, digits)
    return number if unit == "-" else f"{number} {unit}"


def typeset_unit(unit: str) -> str:
    """A unit in the signs of print, or a quantity with one: ``µm``, ``N s/m``, ``m/s²``, ``45°``."""
    return unit.replace("um", "µm").replace("^2", "²").replace(" deg", "°").replace("deg", "°")


def format_number(value: float, digits: int = 4) -> str:
    """Number to some significant digits, without an exponent where it stays readable.

    Parameters
    ----------
    value : float
        Any number.
    digits : int
        Significant digits.

    Returns
    -------
    str
        E.g. ``"34210"`` for 34213.7 and four digits.
    """
    short = f"{value:.{digits}g}"
    if "e" not in short or not 1e-4 <= abs(value) < 1e7:
        return short
    return f"{float(short):.0f}" if abs(value) >= 1 else f"{float(short):.10f}".rstrip("0")


def format_share(share: float) -> str:
    """A share in percent; near the whole, to as many digits as tell it from the whole: ``99.94 %``.

    Parameters
    ----------
    share : float
        1 for the whole; below 0 where a model is worse than none.
    """
    percent = 100.0 * share
    for digits in (1, 2, 3, 4):
        if 100.0 - percent >= 2.0 * 10.0**-digits:
            return f"{percent:.{digits}f} %"
    return "over 99.999 %" if percent < 100.0 else "100 %"
