"""How a table separates its columns and writes its decimals, by a vote over its last rows."""

from __future__ import annotations

import csv
from collections import Counter
from dataclasses import dataclass

from fibrefit.records.grammar.tokens import kind_of_cell, shapes_of
from fibrefit.records.thresholds import FEWEST_TEXTS, VOTERS

WHITESPACE = " "
#: Of these, what separates cells that may hold blanks, such as a number and its unit.
BETWEEN_CELLS = ("\t", ";", ",")
NAMES = {"\t": "tab", ";": "semicolon", ",": "comma", "|": "bar", WHITESPACE: "blanks"}


_WORTH = {"number": 1.0, "clock": 1.0, "thousands": 0.5, "not a number": 0.25, "overflow": 0.25, "text": -1.0}


@dataclass(frozen=True, slots=True)
class Dialect:
    """Delimiter and decimal mark, and how many cells a row has.

    Parameters
    ----------
    delimiter : str
        One character; a blank stands for any run of blanks.
    mark : str
        Decimal mark, ``"."`` or ``","``.
    width : int
        Cells of a row, a trailing delimiter's empty one included.
    """

    delimiter: str
    mark: str
    width: int = 0

    def split(self, line: str) -> list[str] | None:
        """Cells of a line; None where its quotes do not close.

        Parameters
        ----------
        line : str
            A line of the file.

        Returns
        -------
        list of str or None
            Cells without quotes.
        """
        if self.delimiter == WHITESPACE:
            return line.replace('"', "").split() if line.count('"') % 2 == 0 else None
        if '"' not in line:
            return line.split(self.delimiter)
        if line[0] == line[-1] == '"':  # all cells in quotes: many times faster than the general way
            cells = line[1:-1].split(f'"{self.delimiter}"')
            if line.count('"') == 2 * len(cells):
                return cells
        try:
            return next(csv.reader([line], delimiter=self.delimiter, strict=True, skipinitialspace=True), [])
        except csv.Error:
            return None


def vote(
    lines: list[str], *, delimiter: str | None = None, mark: str | None = None
) -> tuple[Dialect, list[str]] | None:
    """Dialect in which the last rows of a file are a table of numbers.

    Parameters
    ----------
    lines : list of str
        Lines of the file.
    delimiter, mark : str or None
        Known beforehand, from the header or from the user.

    Returns
    -------
    tuple of Dialect and list of str, or None
        The dialect with its width, and the kind of each column: ``"number"``, ``"clock"``, ``"text"`` or ``"empty"``;
        None where no dialect gives a table.
    """
    tail = Counter(shapes_of([line for line in lines[-4 * VOTERS :] if line.strip()][-VOTERS:]))
    best, best_score = None, 0.0
    for candidate in _candidates(tail, delimiter, mark):
        rows = _voting_rows(tail, candidate)
        score, width = _score(rows)
        if score > best_score:
            best, best_score = Dialect(candidate.delimiter, candidate.mark, width), score
    return None if best is None else (best, _column_kinds(tail, best))


def _candidates(tail: Counter[str], delimiter: str | None, mark: str | None) -> list[Dialect]:
    """Dialects worth trying, the likelier first where two would split alike."""
    found = []
    tabs = sum(number for line, number in tail.items() if "\t" in line) > tail.total() / 2
    quotes = any('"' in line for line in tail)
    # Separators that do not occur split alike: one of them stands for all.
    present = [sign for sign in NAMES if any(sign in line for line in tail)]
    absent = [sign for sign in NAMES if sign not in present][:1]
    for separator in (*present, *absent) if delimiter is None else (delimiter,):
        if separator == WHITESPACE and tabs and delimiter is None:
            continue
        for decimal in (".", ",") if mark is None else (mark,):
            # A comma that separates can be a decimal mark only inside quotes.
            if decimal != separator or quotes:
                found.append(Dialect(separator, decimal))
    return found


def _voting_rows(tail: Counter[str], dialect: Dialect) -> list[tuple[int, float, int]]:
    """Width and worth of each kind of row that holds a number, and how many of them there are."""
    rows = []
    for line, number in tail.items():
        kinds = [kind_of_cell(cell, dialect.mark) for cell in dialect.split(line) or []]
        worth = sum(_WORTH.get(kind, 0.0) for kind in kinds)
        if worth > 0 and ("number" in kinds or "clock" in kinds or "thousands" in kinds):
            rows.append((len(kinds), worth, number))
    return rows


def _score(rows: list[tuple[int, float, int]]) -> tuple[float, int]:
    counts: Counter[int] = Counter()
    for width, _, number in rows:
        counts[width] += number
    if counts.total() < 2:
        return 0.0, 0
    # Of two widths that occur equally often the wider is the row with nothing cut off.
    width = max(counts, key=lambda w: (counts[w], w))
    return sum(number * worth for w, worth, number in rows if w == width), width


def _column_kinds(tail: Counter[str], dialect: Dialect) -> list[str]:
    """Kind of each column from the rows of the right width that hold a number."""
    tallies: list[Counter[str]] = [Counter() for _ in range(dialect.width)]
    for line, number in tail.items():
        cells = dialect.split(line) or []
        kinds = [kind_of_cell(cell, dialect.mark) for cell in cells]
        if len(cells) == dialect.width and {"number", "clock", "thousands"} & set(kinds):
            for tally, kind in zip(tallies, kinds, strict=True):
                tally[kind] += number
    return [_column_kind(tally) for tally in tallies]


def _column_kind(tally: Counter[str]) -> str:
    numbers = tally["number"] + tally["thousands"] + tally["not a number"] + tally["overflow"]
    clocks, texts = tally["clock"], tally["text"]
    if numbers + clocks == 0 and texts < FEWEST_TEXTS * tally.total():
        return "empty"
    if clocks > max(numbers, texts):
        return "clock"
    return "number" if numbers > texts or not texts else "text"
