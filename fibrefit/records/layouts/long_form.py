"""Tables in long form: a row for each channel at each time, its name in a column of words."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Sequence
from itertools import pairwise

from fibrefit.core.errors import DataError
from fibrefit.records.grammar.dialect import BETWEEN_CELLS, Dialect
from fibrefit.records.grammar.tokens import kind_of_cell
from fibrefit.records.thresholds import FEWEST_ROWS, LAYOUT_LINES, MOST_IN_TURN, NAMED_ALIKE

#: What a command may name as it stands, whatever shell it is given to.
_PLAIN = re.compile(r"[\w .,:;()\[\]{}/%°²+*=-]+")


def channels_in_turn(lines: Sequence[str]) -> tuple[Dialect, int, int, int, list[str]] | None:
    """Channels whose readings stand below each other at the same times; None where none do.

    Parameters
    ----------
    lines : sequence of str
        The last ones of a file.

    Returns
    -------
    tuple of (Dialect, int, int, int, list of str), or None
        How the cells are separated, the columns of the names, the times and the readings, and the names.
    """
    filled = [line for line in lines[-LAYOUT_LINES:] if line.strip()]
    for separator in BETWEEN_CELLS:
        split = [Dialect(separator, ".").split(line) or [] for line in filled]
        width = Counter(map(len, split)).most_common(1)[0][0] if split else 0
        rows = [[cell.strip() for cell in cells] for cells in split if len(cells) == width][1:]
        for i in range(width) if width > 2 and len(rows) > FEWEST_ROWS * 2 else ():
            names = list(dict.fromkeys(cells[i] for cells in rows))
            found = (
                _in_groups(rows, i, len(names))
                if 1 < len(names) <= MOST_IN_TURN and all(map(_is_name, names))
                else None
            )
            if found is not None:
                return Dialect(separator, ".", width), i, *found, names
    return None


def _is_name(cell: str) -> bool:
    return cell[:1].isalpha() and all(kind_of_cell(cell, mark) == "text" for mark in ".,")


def _in_groups(rows: Sequence[Sequence[str]], names: int, number: int) -> tuple[int, int] | None:
    """Columns of the times, the same for all channels of a group, and of the readings, which differ; None for none."""
    turns = [before[names] == after[names] for before, after in zip(rows, rows[number:], strict=False)]
    if sum(turns) < NAMED_ALIKE * len(turns) or not turns:
        return None
    others = [i for i in range(len(rows[0])) if i != names]
    for start in range(number):
        groups = [rows[k : k + number] for k in range(start, len(rows) - number + 1, number)]
        if any(len({cells[names] for cells in group}) < number for group in groups):
            continue
        shared = [i for i in others if all(len({cells[i] for cells in group}) == 1 for group in groups)]
        times = [i for i in shared if len({group[0][i] for group in groups}) > 1]
        apart = [i for i in others if i not in shared and all(kind_of_cell(c[i], ".") != "text" for c in rows)]
        apart += [
            i for i in others if i not in (*shared, *apart) and all(kind_of_cell(c[i], ",") != "text" for c in rows)
        ]
        if times and apart and not any(_runs_on([cells[i] for cells in rows]) for i in apart):
            return max(times, key=lambda i: len({group[0][i] for group in groups})), apart[0]
    return None


def _runs_on(cells: Sequence[str]) -> bool:
    """Whether cells increase from row to row, and do not count these: each row was sampled at a time of its own."""
    try:
        steps = {after - before for before, after in pairwise(float(cell.replace(",", ".")) for cell in cells)}
    except ValueError:  # readings of a clock
        return all(before < after for before, after in pairwise(cells))
    return min(steps) > 0.0 and steps != {1.0}


def refuse_long_form(lines: Sequence[str], where: str) -> None:
    """Refuse channels below each other: which readings belong together is told by their names alone.

    Parameters
    ----------
    lines : sequence of str
        Of a file.
    where : str
        File to name in the message.

    Raises
    ------
    DataError
        If there are such channels, with a command that gives a column to each.
    """
    found = channels_in_turn(lines)
    if found is None:
        return
    dialect, names, times, readings, called = found
    head = next((cells for line in lines if len(cells := dialect.split(line) or []) == dialect.width), [])
    titles = [cell.strip() for cell in head]
    shown = " and ".join(f'"{name[:30]}"' for name in called[:3])
    got = f"readings of {shown} stand below each other, at the same times"
    do = "Export them with a column for each."
    file = where.partition(",")[0]
    first = next((i for i, line in enumerate(lines) if line.strip()), 0)
    if titles and (dialect.split(lines[first]) or []) == head and all(map(_PLAIN.fullmatch, (file, *titles))):
        mark = ",decimal=','" if dialect.delimiter != "," and any("," in line for line in lines[-FEWEST_ROWS:]) else ""
        sign = {"\t": "\\t"}.get(dialect.delimiter, dialect.delimiter)
        table = f"p.read_csv('{file}',sep='{sign}'{mark}).pivot(index='{titles[times]}',columns='{titles[names]}',"
        table += f"values='{titles[readings]}').to_csv('{file.rpartition('.')[0]}_wide.csv')"
        do += f' At once: python -c "import pandas as p; {table}"'
    raise DataError(f'{where}, column "{titles[names] if titles else names + 1}"', got, "a column for each channel", do)
