"""What was understood of a file, in sentences for a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Mapping

import numpy as np

from fibrefit.core.declarations import ROLES
from fibrefit.core.formatting import format_number, format_quantity, printable
from fibrefit.records.clock.base import TimeBase, TimeGap
from fibrefit.records.columns.roles import PAIR, PAIRED, is_signal, with_gain
from fibrefit.records.grammar.phrases import count
from fibrefit.records.record import Record
from fibrefit.records.table import Column, Table

WIDTH = 80

#: Gaps named one by one; the rest are counted.
_GAPS_SHOWN = 3


def describe(what: Table | Record) -> list[str]:
    """Sentences on a table or a record.

    Parameters
    ----------
    what : Table or Record
        As read.

    Returns
    -------
    list of str
        Lines of at most 80 characters: layout, columns with unit and range, rate and where it comes from, gaps, what is
        masked and why, everything that was decided.
    """
    return _of_table(what) if isinstance(what, Table) else _of_record(what)


def _of_table(table: Table) -> list[str]:
    lines = _wrapped(f"{printable(table.path.name)}: {_layout(table)}")
    for number, base in enumerate(table.times):
        members = [column for column in table.columns if column.group == number]
        if len(table.times) > 1:
            lines += _wrapped(f"Group {number + 1} of {len(table.times)}:")
        lines += _wrapped(_times(base))
        lines += _lost(base)
        for column in members:
            role = next((r for r, place in table.roles.items() if table.columns[place] is column), None)
            lines += _wrapped(_column(column, role), indent=2)
    lines += _missing(table)
    for doubt in table.doubts.values():
        lines += _wrapped(f"In doubt: {doubt.got}. {doubt.do}")
    for note in table.notes:
        lines += _wrapped(note)
    return lines


def _missing(table: Table) -> list[str]:
    """Said where one of what is measured together was read and no column is the other, which may have another name."""
    missing = [role for role in PAIRED if role not in table.roles and role not in table.doubts]
    if len(missing) != 1 or PAIR[0] in table.roles:
        return []
    free = [column for number, column in enumerate(table.columns) if number not in table.roles.values()]
    moving = [column for column in free if column.header and _moves(column)]
    fits = [column.header for column in moving if column.si in (None, ROLES[missing[0]])]
    do = f' If one is, name it: {missing[0]} = "{printable(fits[0])}" under [channels].' if fits else ""
    signals = [(column.header, column.unit) for column in moving if column.unit and is_signal(column.unit)]
    for header, unit in signals[:1] if not fits else ():
        told = with_gain(missing[0], printable(header), unit)
        do = f' If "{printable(header)}" is its signal, state what it is worth: {told} under [channels].'
    still = [column.header for column in free if column not in moving and column.si == ROLES[missing[0]]]
    why = f' "{printable(still[0])}" has its unit and does not change.' if still and not fits else ""
    return _wrapped(f"No column is taken for the {missing[0]}.{why}{do}")


def _moves(column: Column) -> bool:
    values = column.values[column.valid]
    return values.size > 0 and bool(values.min() < values.max())


def _of_record(record: Record) -> list[str]:
    span = f"{format_quantity(record.duration, 's')} from {format_quantity(float(record.time[0]), 's')}"
    rate = f"{format_number(record.rate, 7)} Hz" if record.uniform else f"about {format_number(record.rate)} Hz, uneven"
    lines = _wrapped(f"{record.name}: {len(record)} samples, {span}, {rate}.")
    lines += _gaps(record.gaps)
    for role, values in record.channels.items():
        valid = record.valid[role]
        lines += _wrapped(f"{role}: {_range(values[valid], record.units[role])}; {_share(valid)}.", indent=2)
    for sentence in record.history:
        lines += _wrapped(sentence)
    return lines


def _layout(table: Table) -> str:
    layout = table.layout
    if layout.get("format") != "text":
        return f"{layout.get('format', 'binary')} file, {layout.get('rows', 0)} rows, {len(table.columns)} channels."
    header = f"header in line {layout['header_line']}" if layout.get("header_line") else "no header"
    unit_line = f", units in line {layout['unit_line']}" if layout.get("unit_line") else ""
    return (
        f"{layout['rows']} rows in lines {layout['first_row']} to {layout['last_row']}, {header}{unit_line}; "
        f"{layout['encoding']}, columns separated by {layout['delimiter']}, decimal {layout['decimal']}."
    )


def _times(base: TimeBase) -> str:
    usable = base.time[np.isfinite(base.time)]
    source = f"{base.source[0].upper()}{base.source[1:]}"
    if base.unit is None:
        return f"{source}: from {usable[0]:.6g} to {usable[-1]:.6g}, without a known unit."
    rate = f"{format_number(base.rate, 7)} Hz" if base.uniform else f"about {format_number(base.rate)} Hz, uneven"
    return f"{source}: {rate}, {usable.size} samples from {_instant(usable[0])} to {_instant(usable[-1])}."


def _instant(time: float) -> str:
    """A time in s; one that counts from 1970 to a tenth of a millisecond too."""
    return format_quantity(float(time), "s", max(6, len(str(int(abs(time)))) + 4))


def _lost(base: TimeBase) -> list[str]:
    lines = _gaps(base.gaps)
    for reason, rows in base.lost.items():
        lines += _wrapped(f"{count(len(rows), 'row')} without a usable time: {reason}.")
    return lines


def _gaps(gaps: tuple[TimeGap, ...]) -> list[str]:
    lines = []
    for gap in gaps[:_GAPS_SHOWN]:
        lines += _wrapped(f"Gap after {_instant(gap.after)}: {count(gap.missing, 'sample')} missing.")
    rest = gaps[_GAPS_SHOWN:]
    if rest:
        missing = sum(gap.missing for gap in rest)
        lines += _wrapped(f"{count(len(rest), 'further gap')} with {count(missing, 'sample')} missing.")
    return lines


def _column(column: Column, role: str | None) -> str:
    named = f'"{column.header}"' + (f" is the {role}" if role else "")
    unit = f"unit {column.unit}" if column.unit else "no unit"
    unit += f", from {column.zero:.15g}" if column.zero else ""
    unit += f", scaled by {column.scale.text}" if column.scale is not None else ""
    values = column.values[column.valid]
    return f"{named}: {unit}; {_range(values, column.si)}{_reasons(column.masked)}."


def _range(values: np.ndarray, si: str | None) -> str:
    if not values.size:
        return "no usable sample"
    low, high = float(values.min()), float(values.max())
    if si is None:
        return f"{low:.6g} to {high:.6g}"
    if low == high:
        return f"{format_quantity(low, si)} throughout"
    return f"{format_quantity(low, si)} to {format_quantity(high, si)}"


def _reasons(masked: Mapping[str, int]) -> str:
    if not masked:
        return ""
    return (
        f"; {sum(masked.values())} masked ("
        + ", ".join(f"{number} {reason}" for reason, number in masked.items())
        + ")"
    )


def _share(valid: np.ndarray) -> str:
    masked = int((~valid).sum())
    return f"{count(masked, 'sample')} masked" if masked else "all samples valid"


def _wrapped(sentence: str, indent: int = 0) -> list[str]:
    first = " " * indent
    return textwrap.wrap(
        sentence,
        WIDTH,
        initial_indent=first,
        subsequent_indent=first + "  ",
        break_long_words=True,
        break_on_hyphens=False,
    )
