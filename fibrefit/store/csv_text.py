"""Tables as CSV text that a spreadsheet reads as what it is."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Iterable, Sequence

from fibrefit.core.formatting import harmless

#: A cell that begins so is a formula to a spreadsheet, which may run commands.
FORMULA = re.compile(r"[=+\-@\t\n\uFF0B\uFF0D\uFF1D\uFF20]")
NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|[+-]?(inf|nan)")


def csv_text(rows: Iterable[Sequence[str]]) -> str:
    """Rows as CSV.

    Parameters
    ----------
    rows : iterable of sequence of str
        Text that a spreadsheet would take for a formula gets an apostrophe before it, and what would steer a terminal
        is written as its escape; numbers stay.

    Returns
    -------
    str
        Lines that end with a line feed.
    """
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([neutral(cell) for cell in row] for row in rows)
    return text.getvalue()


def headed(name: str, unit: str) -> str:
    """Heading of a column: its name, and its unit if it has one."""
    return name if unit == "-" else f"{name} [{unit}]"


def neutral(cell: str) -> str:
    """A cell that no spreadsheet computes, and that steers no terminal on which it is printed."""
    shown = harmless(cell)
    return f"'{shown}" if FORMULA.match(shown) and not NUMBER.fullmatch(shown) else shown


def as_named(cell: str) -> str:
    """What a cell was before it was made neutral: without the apostrophe, where it has one for that."""
    bare = cell.removeprefix("'")
    return bare if bare != cell and neutral(bare) == cell else cell
