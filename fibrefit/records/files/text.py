"""Text files of any logger: layout by vote, header by score, columns by what their cells are."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.paths import read_plain_file
from fibrefit.records.clock.wall_clock import parse_clock, refuse_unpadded
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn
from fibrefit.records.columns.said import annotations_beside, listed_channels, unread_cells
from fibrefit.records.columns.states import without_bad
from fibrefit.records.files.decode import Text, decode
from fibrefit.records.files.doubts import (
    refuse_common_factor,
    refuse_figures,
    refuse_signs_apart,
    stated_bad,
    with_remarks,
)
from fibrefit.records.files.keyed import (
    BESIDE,
    has_time,
    header_beside,
    requoted,
    stated_separator,
    step_beside,
    with_dates,
    with_thousandths,
    without_arrows,
)
from fibrefit.records.grammar.configuration import statements
from fibrefit.records.grammar.dialect import NAMES, Dialect, vote
from fibrefit.records.grammar.digits import cut_short, masked_with
from fibrefit.records.grammar.facts import find_facts
from fibrefit.records.grammar.header import STATEMENT, Header, find_header, header_cells, with_keyed_units
from fibrefit.records.grammar.headings import bracketed_units, split_heading
from fibrefit.records.grammar.no_table import no_table
from fibrefit.records.grammar.numbers import Numbers, parse_column
from fibrefit.records.grammar.phrases import Aside, are, count, line_numbers
from fibrefit.records.grammar.rows import Rows, find_rows
from fibrefit.records.grammar.tokens import compact_stamps, hexadecimal, kind_of_cell
from fibrefit.records.grammar.words import is_remark
from fibrefit.records.grammar.worth import contradicted, stated_unit
from fibrefit.records.options import ReadOptions
from fibrefit.records.thresholds import FEWEST_PAGES, FEWEST_ROWS

_WORD = re.compile(r"[^\W\d_]{3}")


def read_text(text: Text, where: str, options: ReadOptions) -> Raw:
    """Columns of a text file.

    Parameters
    ----------
    text : Text
        Its lines.
    where : str
        File to name in messages.
    options : ReadOptions
        What the user says.

    Returns
    -------
    Raw
        Its columns of numbers.

    Raises
    ------
    DataError
        If the layout is not understood, or can be read in two ways.
    """
    lines, delimiter = stated_separator(text.lines, options.delimiter)
    lines, beside_rows = header_beside(requoted(without_arrows(lines)))
    lines, stated = step_beside(lines)
    beside_rows = beside_rows or stated
    voted = vote(lines, delimiter=delimiter, mark=options.decimal or text.decimal)
    if voted is None:
        raise no_table(lines, where)
    dialect, kinds = voted
    rows = find_rows(lines, dialect, kinds, where, ended=text.ended)
    above = _unbroken(lines[: rows.first - 1])
    empty = [not any(cell.strip() for cell in cells) for cells in rows.cells]
    beside = [*statements(_lines_of(options.header), dialect.delimiter), *beside_rows]
    header = _header(above or beside, dialect, empty, options, where, lines[rows.first - 1])
    keyed = with_keyed_units(header, [*above, *beside, *text.units])
    joined = with_dates(with_thousandths(rows.cells, kinds, keyed, rows.dialect.mark), kinds)
    columns, notes, aside = _columns(rows, joined, kinds, keyed, where)
    clocks = {column.number: rows.cells[column.number - 1] for column in columns if column.clock}
    inside, remarks = unread_cells(columns, rows.numbers, clocks)
    around = [*enumerate(above, 1), *((i, lines[i - 1]) for i in rows.below)]
    refuse_common_factor(around, where)
    read = replace(rows, cells=joined)  # what stands with a clock is no remark
    if len(rows.numbers) < FEWEST_ROWS:
        raise DataError(where, f"only {count(len(rows.numbers), 'row')} of numbers", f"at least {FEWEST_ROWS} samples")
    said = [*beside, *(words for _, words in text.beside)]
    said += [*_statements(above, header, dialect), *_unused(header, rows, empty, above)]
    skipped = [(i, lines[i - 1]) for i in rows.skipped]
    annotations = annotations_beside([*around, *skipped, *_words_inside(rows, lines)], header, read, columns, aside)
    return Raw(
        columns=columns,
        facts=with_remarks(find_facts(said, dialect.mark), skipped, dialect, options.rate),
        lines=rows.numbers,
        rows=[lines[i - 1] for i in rows.numbers],
        placed=not rows.unplaced and _breaks_are_regular(rows),
        layout=_layout(text, rows, header),
        notes=[*text.notes, *notes, *remarks, *_line_notes(rows, lines)],
        aside=aside,
        annotations=[*annotations, *inside, *_elsewhere(text, beside, columns)],
    )


def _elsewhere(text: Text, header: Sequence[str], columns: Sequence[RawColumn]) -> list[Annotation]:
    """What is said outside the lines of the table: in a header of its own, on other sheets."""
    said = [*(("its header", line) for line in header), *text.beside]
    return [*(Annotation(place, words) for place, words in said), *listed_channels(said, columns)]


def _words_inside(rows: Rows, lines: Sequence[str]) -> list[tuple[int, str]]:
    """Lines inside a table that are no rows and say something, and words behind rows."""
    return [*((i, lines[i - 1]) for i in rows.unplaced if _WORD.search(lines[i - 1])), *rows.remarks]


def _lines_of(named: str | Path | None) -> list[str]:
    """Lines of a file with the header of another."""
    if named is None:
        return []
    path = Path(named)
    return decode(read_plain_file(path, "a file with the header of the records", DataError), path.name).lines


def _statements(above: Sequence[str], header: Header, dialect: Dialect) -> list[str]:
    """Lines above a table; of lines of headings those cells that say something by themselves: ``tInc = 5e-4``.

    What a statement says, its value and its unit are not all words.
    """
    found: list[str] = []
    for i, line in enumerate(above, 1):
        cells = dialect.split(line) or []
        words = len(cells) == dialect.width and all(
            kind_of_cell(cell, dialect.mark) == "text" for cell in cells[:BESIDE]
        )
        if i == header.line or (words and cells[BESIDE:]):
            cells = [cell.strip() for cell in re.split(r"[,;\t]", line)]
            line = "; ".join(c for c in cells if re.search(r"[=:]\s*[\d.+-]", c) or STATEMENT.fullmatch(c))
        elif found and re.fullmatch(r"[^:=]*[^\W\d][^:=]*[:=]\s*", found[-1]) and len(set(cells)) == 1:
            line = f"{found[-1]} {cells[0]}"  # the same of each channel, below its key
        found.append(line)
    return found


def _unused(header: Header, rows: Rows, empty: Sequence[bool], above: Sequence[str]) -> list[str]:
    """Statements in headings of columns that hold nothing: ``Increment`` above ``5.0e-04``, as scopes write it."""
    if header.line is None:
        return []
    below = [header_cells(line, rows.dialect, empty) for line in above[header.line :]]
    return [
        f"{name} = {cells[i]}"
        for cells in below
        if cells is not None
        for i, name in enumerate(header.names)
        if empty[i] and name and cells[i]
    ]


def _unbroken(above: Sequence[str]) -> list[str]:
    """Lines above a table, with line ends inside quotes taken out; the lines that joined one are left empty."""
    joined = list(above)
    start = -1
    for i, line in enumerate(above):
        if start >= 0:
            joined[start] += " " + line
            joined[i] = ""
        if line.count('"') % 2:
            start = i if start < 0 else -1
    # A quote that never closes is a stray sign, not a frame.
    return joined if start < 0 else list(above)


def _header(
    above: Sequence[str], dialect: Dialect, empty: Sequence[bool], options: ReadOptions, where: str, sample: str
) -> Header:
    """Header of the table, or names the user gave; refused where there are neither."""
    width = dialect.width
    used = width - 1 if width > 1 and empty[-1] else width
    if options.columns:
        if empty[0] and len(options.columns) == width - sum(empty):  # rows that begin with a separator
            named = iter(options.columns)
            return Header(tuple("" if none else next(named) for none in empty), (None,) * width, None, None)
        if len(options.columns) not in (used, width):
            _refuse_two_readings(sample, dialect, len(options.columns), where)
            got = f"{count(used, 'column')}, and {len(options.columns)} {are(len(options.columns))} named"
            raise DataError(where, got, "one name for each column", "")
        names = (*options.columns, *[""] * (width - len(options.columns)))
        return Header(names, (None,) * width, None, None)
    header = find_header(above, dialect, empty, options.wanted)
    if header is not None:
        if empty[-1]:
            _refuse_shifted(header, above, where)
        return header
    counts = [n for line in above if (n := _count_words(line, dialect)) > 1 or (n == 1 and width == 2)]
    for words in counts[::-1]:
        _refuse_two_readings(sample, dialect, words, where)
    if dialect.delimiter == "," and dialect.mark == "." and "." not in sample:
        _refuse_two_readings(sample, dialect, width // 2, where)
    if any(re.fullmatch(r"column \d+", name, re.IGNORECASE) for name in options.wanted):
        return Header(tuple(f"column {i + 1}" for i in range(width)), (None,) * width, None, None)
    do = 'Name the columns in order: columns = ["time [s]", "force [N]", "position [mm]"] under [files].'
    several = [(i, line) for i, line in enumerate(above, 1) if _count_words(line, dialect) > 1]
    if counts and several:
        at, text = max(several, key=lambda found: (_count_words(found[1], dialect), found[0]))
        got = f"{count(used, 'column')} of numbers, and no line above has {count(used, 'heading')}: "
        got += f'line {at} has {_count_words(text, dialect)} ("{text.strip()[:60]}")'
        raise DataError(where, got, "a heading for each column", f"Correct the header, or name the columns. {do}")
    raise DataError(where, f"{count(used, 'column')} without headings", "a line with a heading for each column", do)


def _refuse_shifted(header: Header, above: Sequence[str], where: str) -> None:
    """Refuse headings of which the last one names a quantity, where rows end in a separator and nothing is below it."""
    last = header.names[-1]
    if not last or is_remark(last) or (split_heading(last)[1] or header.units[-1]) is None:
        return
    line = header.line or 1
    got = (
        f'{len(header.names)} headings ("{above[line - 1].strip()[:60]}"), and rows of {len(header.names) - 1} numbers '
    )
    got += f'that end in a separator: nothing stands below "{last}"'
    do = 'Headings may be shifted: correct the line, or name the columns in order, files.columns = ["time [s]", ...].'
    raise DataError(f"{where}, line {line}", got, "a heading for each column", do)


def _count_words(line: str, dialect: Dialect) -> int:
    """Cells of a line, if they are words throughout."""
    cells = [cell for cell in dialect.split(line) or [] if cell.strip()]
    return len(cells) if all(kind_of_cell(cell, ".") == "text" for cell in cells) else 0


def _refuse_two_readings(sample: str, dialect: Dialect, names: int, where: str) -> None:
    """Refuse a comma that may separate columns or decimals."""
    cells = [cell.strip() for cell in sample.split(",")]
    if (
        dialect.delimiter != ","
        or names < 1
        or len(cells) <= names
        or not all(re.fullmatch(r"[+-]?\d+", c) for c in cells)
    ):
        return
    reading = f"as {len(cells)} whole numbers ({'  '.join(cells)})"
    if len(cells) == 2 * names:
        pairs = "  ".join(f"{a},{b}" for a, b in zip(cells[::2], cells[1::2], strict=True))
        reading += f" or as {names} with a decimal comma ({pairs})"
    else:
        reading += f", or as {names} with decimal commas in some of them"
    do = "Export it again with semicolons or tabs between the columns, or with decimal points."
    raise DataError(where, f'"{sample.strip()}" can be read {reading}', "one reading", do)


def _columns(
    rows: Rows, joined: Sequence[tuple[str, ...]], kinds: Sequence[str], header: Header, where: str
) -> tuple[list[RawColumn], list[str], dict[int, str]]:
    """Columns of numbers, notes, and what the other columns hold."""
    aside: dict[int, str] = {}
    columns: list[RawColumn] = []
    notes: list[str] = []
    bad: list[tuple[str, np.ndarray]] = []
    words: list[tuple[str, Sequence[str]]] = []
    last = len(rows.cells) - 1
    for i, cells in enumerate(joined):
        title = header.names[i]
        name, unit = split_heading(title)
        twice = contradicted([unit, header.units[i], *bracketed_units(title)])
        name, unit = header.told.get(i, name), unit or header.units[i]
        shown = title or f"column {i + 1}"
        kind = kinds[i] if kinds[i] != "empty" and any(cells) else _kind_of_sparse(cells, rows.dialect.mark)
        place = f'{where}, column "{shown}"'
        if kind == "number" and (stamps := compact_stamps(cells)):
            kind, cells = "clock", tuple(stamps)
        if kind in ("number", "text") and hexadecimal(cells, rows.dialect.mark):
            kind = "hexadecimal"
        if kind == "clock" and has_time(cells):
            columns.append(replace(_clock_column(title, name, cells, place, notes), number=i + 1))
        elif kind == "number":
            numbers = parse_column(cells, rows.dialect.mark, rows.numbers, place)
            if rows.cut and i == last and cut_short(numbers):
                end = np.arange(len(cells)) == len(cells) - 1
                numbers = masked_with(numbers, end, "cut short")
            own = RawColumn(title, name, unit, numbers, resolution=numbers.resolution, number=i + 1, contradicted=twice)
            columns.append(own)
        elif title or kind != "empty":
            if kind == "text":
                refuse_unpadded(cells, place)  # two digits behind a third colon are text
                refuse_figures(cells, unit, rows.dialect.mark, place)
                words.append((place, cells))
                bad.append((name, stated_bad(cells, rows.dialect.mark)))
                beside = stated_unit(cells, rows.numbers, place)
                if beside and columns and columns[-1].number == i and not (columns[-1].unit or columns[-1].clock):
                    columns[-1] = replace(columns[-1], unit=beside)
            what = _HOLDS[kind]
            used = _is_part_of_clock(rows.cells, joined, i)
            told = "is read with the clock beside it" if used else f"{what} and is left out"
            notes.append(Aside(f'Column "{shown}" {told}.'))
            example = next((f', such as "{cell.strip()[:30]}"' for cell in cells if cell.strip()), "")
            aside[i + 1] = f'"{shown}" {what}{example}'
    refuse_signs_apart(words, columns)
    return without_bad(columns, bad, notes), notes, aside


def _is_part_of_clock(cells: Sequence[Sequence[str]], joined: Sequence[Sequence[str]], i: int) -> bool:
    """Whether what a column holds was put before the times of the column behind it, or behind those before it."""
    first = cells[i][0].strip()
    before = bool(first) and i + 1 < len(joined) and joined[i + 1][0].startswith(f"{first} ")
    return before or (any(cells[i]) and not any(joined[i]))


_HOLDS = {
    "empty": "is empty",
    "clock": "holds dates only",
    "text": "holds text",
    "hexadecimal": "holds hexadecimal numbers",
}


def _kind_of_sparse(cells: Sequence[str], mark: str) -> str:
    """Kind of a column that is empty at the end of the table."""
    found = [kind_of_cell(cell, mark) for cell in cells if cell.strip()]
    if not found:
        return "empty"
    return max(("number", "clock", "text"), key=found.count)


def _clock_column(title: str, name: str, cells: Sequence[str], where: str, notes: list[str]) -> RawColumn:
    clock = parse_clock(cells, where)
    notes.extend(clock.notes)
    notes.append(Aside(f"The first sample was taken at {clock.start}."))
    numbers = Numbers.of_array(clock.seconds)
    return RawColumn(title, name, None, numbers, clock=True, start=clock.origin, resolution=clock.resolution)


def _breaks_are_regular(rows: Rows) -> bool:
    """Whether lines between rows say nothing of missing ones: there are none, or as many after every row or page."""
    steps = np.diff(rows.numbers)
    if not rows.skipped:
        return not rows.blank or int(np.ptp(steps)) == 0
    breaks = np.flatnonzero(steps > 1)
    if not breaks.size:
        return True
    alike = int(np.ptp(np.diff(breaks, prepend=-1))) == 0 and int(np.ptp(steps[breaks])) == 0
    return alike and breaks.size >= FEWEST_PAGES


def _layout(text: Text, rows: Rows, header: Header) -> dict[str, Any]:
    return {
        "format": "text",
        "encoding": text.encoding,
        "delimiter": NAMES.get(rows.dialect.delimiter, rows.dialect.delimiter),
        "decimal": "comma" if rows.dialect.mark == "," else "point",
        "header_line": header.line,
        "unit_line": header.unit_line,
        "first_row": rows.first,
        "last_row": rows.last,
        "rows": len(rows.numbers),
        "unreadable_lines": list(rows.unplaced),
        "lines_between": list(rows.skipped),
    }


def below_note(numbers: Sequence[int], first: str) -> str:
    """Sentence on lines below a table, which are left out.

    Parameters
    ----------
    numbers : sequence of int
        Their numbers in the file.
    first : str
        The first of them.
    """
    return f'{line_numbers(numbers)} below the table {are(len(numbers))} left out ("{first.strip()[:30]}").'


def _line_notes(rows: Rows, lines: Sequence[str]) -> list[str]:
    notes = []
    if rows.unplaced:
        left_out = f"and {are(len(rows.unplaced))} left out"
        notes.append(f"{line_numbers(rows.unplaced)} cannot be split into {rows.dialect.width} cells {left_out}.")
    if rows.stray:
        notes.append(f"{line_numbers(rows.stray)} above the table: numbers, taken for part of the header.")
    if rows.below:
        notes.append(below_note(rows.below, lines[rows.below[0] - 1]))
    if rows.cut:
        notes.append("The file ends without an end of line: its last value may be cut short.")
    return notes
