"""What in a text file speaks against reading its numbers as they stand: remarks, scales, cells that are no numbers."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import RawColumn
from fibrefit.records.grammar.dialect import Dialect
from fibrefit.records.grammar.facts import Facts, find_facts
from fibrefit.records.grammar.header import Header
from fibrefit.records.grammar.headings import PLAIN_KINDS
from fibrefit.records.grammar.tokens import kind_of_cell
from fibrefit.records.grammar.words import kinds_named, score, tokens
from fibrefit.records.grammar.worth import (
    ALWAYS_APPLIED,
    COMMON_FACTOR,
    OF_COUNTS,
    SCALE_LABEL,
    TO_DO,
    are_whole,
    contradicted,
    may_apply,
)
from fibrefit.records.options import ReadOptions
from fibrefit.records.thresholds import LONGEST_HEADING

#: A sentence on a unit, and a statement of a number.
_IN_UNIT = re.compile(
    r"([^\d\W][^\d:=;,\t]{2,40}?)\s+(?:(?:are|is|given|measured|sind|ist)\s+){0,2}in\s+([^\s,;.)]+)", re.I
)
_UNIT_OF = re.compile(
    r"([^\d\W][^\d:=;,\t]{1,40}?)[\s_.]+(?:units?|einheit)\W{0,2}\s*[:=;,\t]\s*\W?([^\s;,\])\"]+)", re.I
)
_BY_LETTER = re.compile(r"(?:^|[\s(\[])[x*\u00d7]\s?(\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)(?![\w.])")
_NUMBERS = re.compile(r"\d+(?:\.\d+)?(?:[eE][+-]?\d+)?")
_FAULT = re.compile(
    r"\b(?:fault\w*|errors?|invalid|bad|fail\w*|over(?:load|flow|range)\w*|disconnected|fehler\w*|st[o\u00f6]rung)\b",
    re.I,
)
_NO_FAULT = re.compile(r"\b(?:no|not|none|without|kein\w*|ohne|0)\b", re.I)
_UNIT_ALONE = re.compile(r"\W*(?:units?|einheit(?:en)?)\W{1,4}([^\s;,\"]+)\W*", re.I)
_STATED = re.compile(r"\W*([^=:;,\t]{2,60}?)\s*[=:;,\t]\s*([+-]?\d+(?:[.,]\d+)?(?:[eE][+-]?\d+)?)(?![\d.,:/-])")

#: Words of a remark inside a table after which its numbers may mean something else.
_OF_UNITS = re.compile(
    r"(?<![^\W\d_])(?:units?|einheit(?:en)?|jednotk[ay]|scale|scaling|factor|faktor|gain)(?![^\W\d_])", re.I
)


def with_remarks(
    facts: Facts, remarks: Sequence[tuple[int, str]], above: Sequence[str], dialect: Dialect, where: str
) -> Facts:
    """Facts with what remarks inside the table say against them.

    Parameters
    ----------
    facts : Facts
        What the lines above the table say.
    remarks : sequence of (int, str)
        Lines inside the table that are no rows, by their number.
    above : sequence of str
        Lines above the table: what stands there too is no news.
    dialect : Dialect
        Of the table.
    where : str
        File to name in messages.

    Raises
    ------
    DataError
        If a remark speaks of a unit or a scale, which may be another one from there on.
    """
    said = {line.strip() for line in above}
    for number, line in remarks:
        if line.strip() in said:
            continue
        if _OF_UNITS.search(line):
            do = "Split the file there, or remove the line if it changes nothing."
            raise DataError(
                f"{where}, line {number}", f'"{line.strip()[:60]}" inside the table', "one unit throughout", do
            )
        other = find_facts([line], dialect.mark)
        if facts.rate is not None and other.rates and other.rate != facts.rate:
            facts = replace(facts, doubt=f'"{facts.quoted}" above the table, and "{other.quoted}" in line {number}')
    return facts


def refuse_counts(
    columns: Sequence[RawColumn], above: Sequence[str], header: Header, options: ReadOptions, where: str
) -> None:
    """Refuse numbers under a line that may tell what one of them is worth, unless the user says it.

    Parameters
    ----------
    columns : sequence of RawColumn
        Of the table.
    above : sequence of str
        Lines above it.
    header : Header
        Its headings.
    options : ReadOptions
        What the user says.
    where : str
        File to name in the message.

    Raises
    ------
    DataError
        If there is such a line, and a column without a scale below it.
    """
    scaled = {c.column for c in options.declared(where).values() if c.scale is not None}
    for line in range((header.line or len(above)), len(above)):
        cells = [cell.strip().strip('"') for cell in re.split(r"[;,\t]", above[line])]
        if not SCALE_LABEL.fullmatch(cells[0]):
            continue
        worth = [cell for cell in cells[1:] if _changes(cell)]
        shift = len(cells) - len(header.names)  # of a label that stands before the first column
        counts = [c for c in columns if c.unit is not None and not c.clock and may_apply(cells[0], whole=_is_whole(c))]
        counts = [
            c for c in counts if not {c.header, c.name} & scaled and units.kind_of(c.unit or "") not in ("time", None)
        ]
        counts = [c for c in counts if not 0 < c.number + shift <= len(cells) or _changes(cells[c.number - 1 + shift])]
        if worth and counts:
            got = f'"{above[line].strip()[:60]}" beside numbers that may be before it'
            do = f'Say what one is worth: {{ column = "{counts[0].header}", scale = "{worth[0]}" }} under [channels]; '
            do += 'scale = "1" where the numbers are in their unit already.'
            raise DataError(f"{where}, line {line + 1}", got, "numbers in the units of their headings", do)


def refuse_told(
    columns: Sequence[RawColumn], around: Sequence[tuple[int, str]], header: Header, options: ReadOptions, where: str
) -> None:
    """Refuse numbers of which a line tells what is still to be done to them, or another unit than their heading.

    Parameters
    ----------
    columns, header, options, where
        As for `refuse_counts`.
    around : sequence of (int, str)
        Lines above and below the table, with their numbers.

    Raises
    ------
    DataError
        If there is such a line, and the user does not say what the numbers are.
    """
    declared = options.declared(where)
    said = {c.column for c in declared.values() if c.scale is not None or c.unit is not None} | set(options.units)
    plain = [c for c in columns if c.unit is not None and not c.clock and units.kind_of(c.unit) in PLAIN_KINDS]
    listed = _listed([one for one in around if one[0] != header.line], plain)
    for number, line in around:
        if number in (header.line, header.unit_line) or len(line) > LONGEST_HEADING:
            continue
        if COMMON_FACTOR.search(line):
            do = "Save the numbers instead of what is shown of them, as writematrix does."
            raise DataError(f"{where}, line {number}", f'"{line.strip()[:30]}" above a table', "plain numbers", do)
        about = [c for c in plain if not {c.header, c.name, f"column {c.number}"} & said and not _said_of(c, options)]
        if listed is not None and number == listed[0]:
            told = [c for c in about if c is listed[2]]
        elif OF_COUNTS.search(line) and any(map(_is_whole, about)):
            told = [c for c in about if _is_whole(c)] if any(map(_changes, _NUMBERS.findall(line))) else []
        elif TO_DO.search(line) or _is_formula(line, columns):
            told = [c for c in about if set(tokens(c.name)) & set(tokens(line))]
            told = told or [c for c in about if units.kind_of(c.unit or "") in kinds_named(line)] or about[-1:]
        else:
            said_here = _units_of(line)
            told = [c for c in about if _other_unit(c, said_here) or _own_scale(c, line)]
        if told and not any(c.scale for c in declared.values()):
            got = f'"{line.strip()[:60]}" beside numbers that may be before it'
            do = f'Say what one is worth: {{ column = "{told[0].header}", scale = "..." }} under [channels]; '
            do += 'scale = "1" where the numbers are in the unit of their heading already.'
            raise DataError(f"{where}, line {number}", got, "numbers in the units of their headings", do)


def _changes(cell: str) -> bool:
    """Whether a cell holds a number that would change what it is applied to."""
    return kind_of_cell(cell, ".") == "number" and float(cell) not in (0.0, 1.0)


def _listed(above: Sequence[tuple[int, str]], columns: Sequence[RawColumn]) -> tuple[int, str, RawColumn] | None:
    """Line of a list of the channels that tells a factor of one of them, and that channel; None where there is none."""
    labels: list[str] = []
    for number, line in above:
        cells = [cell.strip().strip('"') for cell in re.split(r"[;,\t|]", line)]
        own = next((c for c in columns if c.name and cells[0] in (c.name, c.header)), None)
        if own is None or len(cells) != len(labels):
            labels = cells if any(SCALE_LABEL.fullmatch(cell) for cell in cells) else labels
            continue
        for label, cell in zip(labels, cells, strict=True):
            if _changes(cell) and may_apply(label, whole=_is_whole(own)):
                return number, line, own
    return None


def _said_of(column: RawColumn, options: ReadOptions) -> bool:
    """Whether the user declares a unit by the role that a column has by its name."""
    return any(role in options.units and score(column.name, role) > 0 for role in ("force", "position", "angle"))


def _is_formula(line: str, columns: Sequence[RawColumn]) -> bool:
    """Whether a line multiplies a column, by its name, with a number."""
    if not any(sign in line for sign in "*/x\u00b7\u00d7"):
        return False
    words = set(tokens(line))
    by_letter = any(map(_changes, _BY_LETTER.findall(line)))
    for name in {c.name for c in columns if c.name and c.name in line}:
        own = re.escape(name)
        if by_letter and set(tokens(name)) & words:
            return True
        if re.search(rf"[\d)]\s*[*\u00b7\u00d7]\s*{own}(?!\w)|(?<!\w){own}\s*[*/]\s*\d", line):
            return True
    return False


def _units_of(line: str) -> list[tuple[set[str], str]]:
    """Units that a line states of all quantities of some kinds; of whatever has it where it names none."""
    alone = _UNIT_ALONE.fullmatch(line)
    if alone:
        return [({units.kind_of(alone[1]) or ""}, alone[1])]
    return [(kinds_named(words), unit) for words, unit in (*_IN_UNIT.findall(line), *_UNIT_OF.findall(line))]


def _other_unit(column: RawColumn, said: Sequence[tuple[set[str], str]]) -> bool:
    """Whether a line says that a column's quantity is in another unit than it has."""
    own = units.kind_of(column.unit or "")
    return any(
        own == units.kind_of(unit) and own in kinds and bool(contradicted([column.unit, unit])) for kinds, unit in said
    )


def _own_scale(column: RawColumn, line: str) -> bool:
    """Whether a line states a factor by a name that is that of a column, or of the quantity in it."""
    match = _STATED.match(line)
    if match is None or not ALWAYS_APPLIED.search(match[1]):
        return False
    value = match[2].replace(",", ".")
    named = set(tokens(match[1])) & set(tokens(column.name)) or units.kind_of(column.unit or "") in kinds_named(
        match[1]
    )
    return bool(named) and kind_of_cell(value, ".") == "number" and float(value) != 1.0


def _is_whole(column: RawColumn) -> bool:
    return are_whole(column.numbers.values)


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
    if unit is None or units.kind_of(unit) not in PLAIN_KINDS:
        return
    filled = [cell.strip() for cell in cells if cell.strip()]
    odd = [cell for cell in filled if kind_of_cell(cell, mark) == "text"]
    if sum(any(sign.isdigit() for sign in cell) for cell in odd) > 0.5 * len(odd):
        do, why = "Export plain numbers, negative ones with a minus before them.", ""
        if kind_of_cell(odd[0], "." if mark == "," else ",") == "number":
            if len(odd) < len(filled):
                return  # both marks in one column: told with the lines, further on
            do, why = "Export all columns with one decimal mark.", " under the decimal mark of the other columns"
        raise DataError(place, f'"{odd[0][:30]}" is no number{why}', f"numbers in {unit}", do)


def told_bad(cells: Sequence[str], mark: str) -> np.ndarray:
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
