"""What in a text file speaks against reading its numbers as they stand: remarks inside, cells that are no numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.grammar.dialect import Dialect
from fibrefit.records.grammar.facts import Facts, find_facts, frequencies_in
from fibrefit.records.grammar.headings import PLAIN_KINDS
from fibrefit.records.grammar.tokens import clean, kind_of_cell
from fibrefit.records.thresholds import FOLDED, SAME_RATE

#: What MATLAB shows above a matrix whose numbers it shows divided by it.
_COMMON_FACTOR = re.compile(r"^\W*\d(?:\.\d+)?e[+-]?\d+\s*\*\W*$", re.I)
_FAULT = re.compile(
    r"\b(?:fault\w*|errors?|invalid|bad|fail\w*|over(?:load|flow|range)\w*|disconnected|fehler\w*|st[o\u00f6]rung)\b",
    re.I,
)
_NO_FAULT = re.compile(r"\b(?:no|not|none|without|kein\w*|ohne|0)\b", re.I)


def with_remarks(facts: Facts, remarks: Sequence[tuple[int, str]], dialect: Dialect, rate: float | None) -> Facts:
    """Facts with what remarks inside the table say against their rate.

    Parameters
    ----------
    facts : Facts
        What the lines above the table say.
    remarks : sequence of (int, str)
        Lines inside the table that are no rows, by their number.
    dialect : Dialect
        Of the table.
    rate : float or None
        What the user gives, in Hz.
    """
    for number, line in remarks:
        rates = [*find_facts([line], dialect.mark).rates, *frequencies_in(line, dialect.mark)]
        known = rate or facts.rate
        if rates and known and all(abs(one / known - 1.0) > SAME_RATE for one in rates):
            facts = replace(facts, changes=f'"{line.strip()[:60]}" in line {number}')
    return facts


def refuse_common_factor(lines: Sequence[tuple[int, str]], where: str) -> None:
    """Refuse a table as MATLAB displays it, below a factor of all its numbers.

    Parameters
    ----------
    lines : sequence of (int, str)
        Around the table, with their numbers.
    where : str
        File to name in the message.

    Raises
    ------
    DataError
        If such a line stands there.
    """
    for number, line in lines:
        if _COMMON_FACTOR.search(line):
            do = "Save the numbers instead of what is shown of them, as writematrix does."
            raise DataError(f"{where}, line {number}", f'"{line.strip()[:30]}" above a table', "plain numbers", do)


def refuse_figures(cells: Sequence[str], unit: str | None, mark: str, place: str) -> None:
    """Refuse text with figures in it below a unit: a quantity that was printed in a way of its own is not left out.

    Parameters
    ----------
    cells : sequence of str
        A column.
    unit : str or None
        Of its heading.
    mark : str
        Decimal mark of the table.
    place : str
        File and column to name in the message.

    Raises
    ------
    DataError
        If most of its text holds figures.
    """
    filled = [cell.strip() for cell in cells if cell.strip()]
    if unit is None or units.kind_of(unit) not in PLAIN_KINDS:
        return
    odd = [cell for cell in filled if kind_of_cell(cell, mark) == "text"]
    if sum(any(sign.isdigit() for sign in cell) for cell in odd) > 0.5 * len(odd):
        do, why = "Export plain numbers, negative ones with a minus before them.", ""
        if kind_of_cell(odd[0], "." if mark == "," else ",") == "number":
            if len(odd) < len(filled):
                return  # both marks in one column: reported with the lines, further on
            do, why = "Export all columns with one decimal mark.", " under the decimal mark of the other columns"
        raise DataError(place, f'"{odd[0][:30]}" is no number{why}', f"numbers in {unit}", do)


def refuse_signs_apart(words: Sequence[tuple[str, Sequence[str]]], columns: Sequence[RawColumn]) -> None:
    """Refuse numbers without signs that touch zero wherever a column of two words changes, as where it has their signs.

    Parameters
    ----------
    words : sequence of (str, sequence of str)
        Columns of words, each with its place for messages.
    columns : sequence of RawColumn
        Those of numbers.

    Raises
    ------
    DataError
        With the column of words and that of numbers.
    """
    for place, cells in words:
        kinds = sorted({clean(cell) for cell in set(cells)})
        first = np.array([clean(cell) == kinds[0] for cell in cells])
        turns = np.flatnonzero(first[1:] != first[:-1])
        for column in columns if len(kinds) == 2 and turns.size > 1 else ():
            values = column.numbers.values / (np.fmax.reduce(column.numbers.values) or 1.0)
            touches = np.fmin(values[turns], values[turns + 1])
            tops = np.fmax.reduce(values[first]), np.fmax.reduce(values[~first])
            if np.fmin.reduce(values) >= 0.0 and np.fmax.reduce(touches) < FOLDED < 0.5 * min(tops):
                got = f'"{kinds[0]}" and "{kinds[1]}" that take turns where "{column.header}" touches zero'
                raise DataError(place, got, "numbers with their signs", "Put the sign before each number.")


def stated_bad(cells: Sequence[str], mark: str) -> np.ndarray:
    """Rows that a column of words calls bad, invalid or out of range, where it calls most others something else.

    Parameters
    ----------
    cells : sequence of str
        The column.
    mark : str
        Decimal mark of the table.

    Returns
    -------
    (n_rows,) bool array
        None of them true where it names no bad rows.
    """
    known = {cell: _state(cell, mark) for cell in set(cells)}
    kinds = [known[cell] for cell in cells]
    bad = np.array(
        [
            kind in ("not a number", "overflow") and cell.strip(" -?") != ""
            for kind, cell in zip(kinds, cells, strict=True)
        ]
    )
    return bad if 2 * int(bad.sum()) < kinds.count("text") + int(bad.sum()) else np.zeros(len(kinds), bool)


def _state(cell: str, mark: str) -> str:
    """Kind of a cell of a column of states: one that speaks of a fault, and of no lack of one, is no number."""
    return "not a number" if _FAULT.search(cell) and not _NO_FAULT.search(cell) else kind_of_cell(cell, mark)
