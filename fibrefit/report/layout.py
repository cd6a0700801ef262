"""How a report stands on the terminal: sections, paragraphs, lists and tables in 80 columns."""

from __future__ import annotations

import math
import re
import textwrap
from collections.abc import Iterable, Sequence
from pathlib import PurePath

WIDTH = 80
ERROR_DIGITS = 2
"""Digits of an error bar that mean something."""
LONGEST_RECORD_NAME = 34
"""Letters of the name of a record that leave room for what stands beside it."""


def decimals_of(error: float) -> int:
    """Decimals to which an error bar means something, and whatever it is the error of."""
    return min(max(0, ERROR_DIGITS - 1 - math.floor(math.log10(error))), 12)


def titled(name: str, status: str = "") -> str:
    """What a report is of, shortened to leave room for its status at the right, with a line under both."""
    name = shortened(" ".join(name.split()), WIDTH - len(status) - 2) if status else name
    return f"{name}{status.upper():>{WIDTH - len(name)}}\n{'=' * WIDTH}" if status else f"{name}\n{'=' * WIDTH}"


def section(title: str, lines: Sequence[str]) -> str:
    """Lines under an underlined title; nothing where there are none."""
    return "\n".join([title, "-" * len(title), *lines]).rstrip() if lines else ""


def paragraph(text: str) -> str:
    """Text broken into lines."""
    return textwrap.fill(text, WIDTH, break_long_words=False, break_on_hyphens=False)


def items(texts: Iterable[str]) -> list[str]:
    """Each text as an item of a list."""
    return [_hanging(text, "- ") for text in texts]


def numbered(texts: Iterable[str]) -> list[str]:
    """Each text as an item of a list, counted from 1."""
    return [_hanging(text, f"{number}. ") for number, text in enumerate(texts, 1)]


def table(head: tuple[str, ...], rows: Sequence[tuple[str, ...]], right: set[int]) -> list[str]:
    """Lines of a table with columns as wide as their content, and an empty one.

    Parameters
    ----------
    rows : sequence of tuple of str
        Columns that are empty throughout are left out, all but the first.
    right : set of int
        Columns that are flush right.

    Returns
    -------
    list of str
        Empty where there are no rows.
    """
    used = [i for i in range(len(head)) if i == 0 or any(row[i] for row in rows)]
    if not rows:
        return []
    lines = [[row[i] for i in used] for row in (head, *rows)]
    widths = [max(len(line[column]) for line in lines) for column in range(len(used))]
    texts = []
    for line in lines:
        cells = [
            cell.rjust(width) if used[column] in right else cell.ljust(width)
            for column, (cell, width) in enumerate(zip(line, widths, strict=True))
        ]
        texts.append("  ".join(cells).rstrip())
    return [*texts, ""]


def shortened(name: str, width: int) -> str:
    """A name cut in its middle, where names of records differ least, if it is longer than `width`."""
    if len(name) <= width:
        return name
    kept = width - 3
    return f"{name[: kept - kept // 2]}...{name[len(name) - kept // 2 :]}"


def shortened_names(names: Iterable[str], width: int) -> dict[str, str]:
    """Each name in at most `width` letters, cut in its middle where no other has both ends, as far as that can be.

    An extension that all have goes first. The later the cut, the more is left of the beginning.
    """
    names = list(names)
    ends = {PurePath(name).suffix for name in names}
    bare = [name.removesuffix(*ends) for name in names] if len(ends) == 1 else names
    for head in range((width - 3) // 2, -1, -1):
        cut = [_with_whole_end(name, head, width) for name in bare]
        if all(sum(_may_be(one, name) for name in bare) == 1 for one in cut):
            return dict(zip(names, cut, strict=True))
    return {name: shortened(part, width) for name, part in zip(names, bare, strict=True)}


def _with_whole_end(name: str, head: int, width: int) -> str:
    """A name without its middle, whose end begins with a word where it has several."""
    if len(name) <= width:
        return name
    start = len(name) - (width - 3 - head)
    word = re.search(r"[ _.,-](.+)", name[start - 1 :])
    return f"{name[:head]}...{word.group(1) if word else name[start:]}"


def _may_be(cut: str, name: str) -> bool:
    begin, dots, end = cut.partition("...")
    return name.startswith(begin) and name.endswith(end) if dots else name == cut


def _hanging(text: str, lead: str) -> str:
    return textwrap.fill(
        text,
        WIDTH,
        initial_indent=lead,
        subsequent_indent=" " * len(lead),
        break_long_words=False,
        break_on_hyphens=False,
    )
