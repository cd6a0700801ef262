"""Damage to measurement files, of kinds that can be noticed in principle.

What is left out, because no reader can notice it:

- a digit that turns into another digit, or a digit before the decimal mark or a sign that is lost from a noisy reading
  (12.5 becomes 2.5: such a sample may have been measured);
- a lost decimal where the number of decimals varies from row to row anyway;
- a changed unit or number in the header (kN to N, 500 us to 50 us);
- a lost or doubled row where neither a time nor a number of samples says how many rows there were;
- bytes lost from inside one row to inside a later one, which leave one row that looks whole.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

FREE, FIXED = True, False


@dataclass
class Sheet:
    """A file as characters, each with a mark whether its loss or change can be noticed.

    Parameters
    ----------
    head : list of str
        Lines above the table. `names` of them hold the headings.
    cells : list of list of str
        The table.
    delimiter, mark, end : str
        Between cells, before decimals, after lines.
    names : int
        Line of `head` with the headings; -1 where there is none.
    timeless : bool
        Whether rows are counted, not timed, be it that their times are too coarse to tell them apart.
    steady : bool
        Whether every column has a fixed number of decimals.
    encoding : str
        Of the file.
    options : dict
        How to read it.
    quote : str
        Around cells.
    """

    name: str
    head: list[str]
    cells: list[list[str]]
    delimiter: str
    mark: str
    end: str = "\n"
    names: int = 0
    timeless: bool = False
    steady: bool = True
    clock: bool = False
    encoding: str = "utf-8"
    options: dict = field(default_factory=dict)
    quote: str = ""

    def text(self) -> tuple[list[str], list[bool]]:
        """Characters, and whether a change to each can be noticed."""
        chars: list[str] = []
        free: list[bool] = []

        def put(text: str, flag: bool) -> None:
            chars.extend(text)
            free.extend([flag] * len(text))

        for line in self.head:
            put(line, FIXED)
            put(self.end, FIXED)
        for row in self.cells:
            for k, cell in enumerate(row):
                put(self.delimiter if k else "", FREE)
                put(self.quote, FREE)
                self._put_cell(cell, k, put)
                put(self.quote, FREE)
            put(self.end, FIXED if self.timeless else FREE)
        return chars, free

    def _put_cell(self, cell: str, k: int, put: Callable[[str, bool], None]) -> None:
        if k == 0 and not self.timeless:
            put(cell, self.steady or self.clock)
            return
        whole, mark, decimals = cell.partition(self.mark)
        put(whole, FIXED)
        put(mark, FREE)
        put(decimals, FREE if self.steady else FIXED)

    def bytes(self) -> bytes:
        """The undamaged file."""
        return "".join(self.text()[0]).encode(self.encoding)


Damage = Callable[[Sheet, np.random.Generator], bytes]


def _edited(sheet: Sheet, rng: np.random.Generator, edit: Callable[[list[str], int], None]) -> bytes:
    """File with one to three noticeable characters edited, from the end so that places stay right."""
    chars, free = sheet.text()
    places = rng.choice(np.flatnonzero(free), size=int(rng.integers(1, 4)), replace=False)
    for place in sorted(map(int, places), reverse=True):
        edit(chars, place)
    return "".join(chars).encode(sheet.encoding, errors="replace")


def truncate(sheet: Sheet, rng: np.random.Generator) -> bytes:
    content = sheet.bytes()
    return content[: int(rng.integers(1, len(content)))]


def drop_characters(sheet: Sheet, rng: np.random.Generator) -> bytes:
    def edit(chars: list[str], place: int) -> None:
        del chars[place]

    return _edited(sheet, rng, edit)


def double_characters(sheet: Sheet, rng: np.random.Generator) -> bytes:
    def edit(chars: list[str], place: int) -> None:
        chars.insert(place, chars[place])

    return _edited(sheet, rng, edit)


def overwrite_characters(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """With anything but a digit."""
    junk = "abcxyzEe#$%&!?/\\()=_~^'\"\t ;:,.|-+\x00\x07\x1b\xe9\xb5"

    def edit(chars: list[str], place: int) -> None:
        chars[place] = junk[int(rng.integers(len(junk)))]

    return _edited(sheet, rng, edit)


def raw_bytes(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """Overwrite noticeable characters with bytes of no encoding."""
    marker = "\ue000"

    def edit(chars: list[str], place: int) -> None:
        chars[place] = marker

    damaged = _edited(Sheet(**{**sheet.__dict__, "encoding": "utf-8"}), rng, edit)
    other = damaged.decode("utf-8").replace(marker, "\ufffd").encode(sheet.encoding, errors="replace")
    return other.replace("\ufffd".encode(sheet.encoding, errors="ignore") or b"?", bytes([int(rng.integers(128, 256))]))


def drop_rows(sheet: Sheet, rng: np.random.Generator) -> bytes:
    start, count = int(rng.integers(0, len(sheet.cells) - 8)), int(rng.integers(1, 6))
    return _with_cells(sheet, sheet.cells[:start] + sheet.cells[start + count :])


def double_rows(sheet: Sheet, rng: np.random.Generator) -> bytes:
    start, count = int(rng.integers(0, len(sheet.cells) - 8)), int(rng.integers(1, 6))
    return _with_cells(sheet, sheet.cells[: start + count] + sheet.cells[start:])


def swap_rows(sheet: Sheet, rng: np.random.Generator) -> bytes:
    cells = list(sheet.cells)
    i = int(rng.integers(0, len(cells) - 1))
    cells[i], cells[i + 1] = cells[i + 1], cells[i]
    return _with_cells(sheet, cells)


def swap_marks(sheet: Sheet, rng: np.random.Generator) -> bytes:
    other = "," if sheet.mark == "." else "."
    cells = [list(row) for row in sheet.cells]
    for _ in range(int(rng.integers(1, 4))):
        i, k = int(rng.integers(len(cells))), int(rng.integers(len(cells[0])))
        cells[i][k] = cells[i][k].replace(sheet.mark, other)
    return _with_cells(sheet, cells)


def bad_tokens(sheet: Sheet, rng: np.random.Generator) -> bytes:
    tokens = ["-1.#IND", "Overflow", "1E+10", "", "NaN", "****", "#N/A", "OVLD", "-9999", "n/a", "9.9E37", "?", "--"]
    cells = [list(row) for row in sheet.cells]
    for _ in range(int(rng.integers(1, 5))):
        i, k = int(rng.integers(len(cells))), int(rng.integers(len(cells[0])))
        cells[i][k] = tokens[int(rng.integers(len(tokens)))]
    return _with_cells(sheet, cells)


def junk_lines(sheet: Sheet, rng: np.random.Generator) -> bytes:
    width, d = len(sheet.cells[0]), sheet.delimiter
    junk = ["### logger restarted ###", "overrun", "-----", "", d.join(["x"] * width), d.join(["1"] * (width + 1))]
    junk += [
        sheet.head[sheet.names] if sheet.head else "a",
        "\x00\x00\x00",
        d.join(["7"] * (width - 1)),
        d * (width + 2),
    ]
    lines = sheet.bytes().decode(sheet.encoding).split(sheet.end)
    for _ in range(int(rng.integers(1, 4))):
        lines.insert(int(rng.integers(len(sheet.head), len(lines))), junk[int(rng.integers(len(junk)))])
    return sheet.end.join(lines).encode(sheet.encoding)


def header_cells(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """Delete a heading with its delimiter, or only its words, or the line."""
    if not sheet.head or sheet.names < 0:
        return truncate(sheet, rng)
    head = list(sheet.head)
    cells = head[sheet.names].split(sheet.delimiter)
    kind, k = int(rng.integers(3)), int(rng.integers(len(cells)))
    if kind == 0:
        del cells[k]
    elif kind == 1:
        cells[k] = ""
    head[sheet.names] = sheet.delimiter.join(cells)
    if kind == 2:
        del head[sheet.names]
    return Sheet(**{**sheet.__dict__, "head": head}).bytes()


def header_letters(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """Drop letters of the names in the header; not those of units and numbers."""
    if not sheet.head or sheet.names < 0:
        return truncate(sheet, rng)
    line = sheet.head[sheet.names]
    inside, places = 0, []
    for i, char in enumerate(line):
        inside += (char == "[") - (char == "]")
        if not inside and char not in "]" and not char.isdigit():
            places.append(i)
    place = places[int(rng.integers(len(places)))]
    head = list(sheet.head)
    head[sheet.names] = line[:place] + line[place + 1 :]
    return Sheet(**{**sheet.__dict__, "head": head}).bytes()


def flip_quotes(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """Put or remove quotes around cells, in pairs or singly."""
    cells = [list(row) for row in sheet.cells]
    for _ in range(int(rng.integers(1, 5))):
        i, k = int(rng.integers(len(cells))), int(rng.integers(len(cells[0])))
        cells[i][k] = ['"{}"', '"{}', '{}"'][int(rng.integers(3))].format(cells[i][k])
    return _with_cells(sheet, cells)


def mix_line_ends(sheet: Sheet, rng: np.random.Generator) -> bytes:
    lines = sheet.bytes().decode(sheet.encoding).split(sheet.end)
    ends = ["\n", "\r\n", "\r"]
    return "".join(line + ends[int(rng.integers(3))] for line in lines[:-1]).encode(sheet.encoding)


def zero_block(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """Whole lines overwritten with zero bytes, as after a power failure."""
    lines = sheet.bytes().decode(sheet.encoding).split(sheet.end)
    i = int(rng.integers(len(sheet.head), len(lines) - 1))
    lines[i] = "\x00" * len(lines[i])
    return sheet.end.join(lines).encode(sheet.encoding)


def glue_delimiters(sheet: Sheet, rng: np.random.Generator) -> bytes:
    """Drop or double delimiters of some rows."""
    lines = sheet.bytes().decode(sheet.encoding).split(sheet.end)
    for _ in range(int(rng.integers(1, 4))):
        i = int(rng.integers(len(sheet.head), len(lines) - 1))
        new = "" if rng.random() < 0.5 else 2 * sheet.delimiter
        lines[i] = lines[i].replace(sheet.delimiter, new, 1)
    return sheet.end.join(lines).encode(sheet.encoding)


def _with_cells(sheet: Sheet, cells: list[list[str]]) -> bytes:
    return Sheet(**{**sheet.__dict__, "cells": cells}).bytes()


#: Kinds that keep the number of rows, or make its change visible without times.
ANY: tuple[Damage, ...] = (
    truncate,
    drop_characters,
    double_characters,
    overwrite_characters,
    raw_bytes,
    swap_marks,
    bad_tokens,
    header_cells,
    header_letters,
    flip_quotes,
    mix_line_ends,
    glue_delimiters,
)
#: Kinds that only times can reveal.
TIMED: tuple[Damage, ...] = (drop_rows, double_rows, swap_rows, junk_lines, zero_block)


def _lvm_head(n: int) -> list[str]:
    head = ["LabVIEW Measurement", "Separator\tTab", "Decimal_Separator\t,", "X_Columns\tNo", "***End_of_Header***", ""]
    head += ["Channels\t2", f"Samples\t{n}\t{n}", "Y_Unit_Label\tNewtons\tMillimeters", "X0\t0,0\t0,0"]
    return [*head, "Delta_X\t5,0E-4\t5,0E-4", "***End_of_Header***", "X_Value\tKraft\tWeg\tComment"]


def sheets(n: int = 60) -> list[Sheet]:
    """Undamaged files in several layouts, a drop with a bounce and some noise in each."""
    rng = np.random.default_rng(20240512)
    time = np.arange(n) / 2000.0
    force = 12.5 + 40 * np.abs(np.sin(2 * np.pi * 40 * time)) + 0.4 * rng.standard_normal(n)
    position = -9.8 + 12 * np.sin(2 * np.pi * 20 * time) + 0.02 * rng.standard_normal(n)
    table = [[f"{t:.4f}", f"{f:.3f}", f"{u:.4f}"] for t, f, u in zip(time, force, position, strict=True)]
    comma = [[cell.replace(".", ",") for cell in row] for row in table]
    clock = [
        [f"12.05.2014 14:22:{11 + i / 2000:07.4f}".replace(":11.", ":11,"), *row[1:]] for i, row in enumerate(comma)
    ]
    short = [[f"{float(cell):g}" for cell in row] for row in table]
    exponents = [[f"{float(cell):.6E}" for cell in row] for row in table]
    four = [[*row, f"{0.01 * i:.3f}"] for i, row in enumerate(table)]
    milliseconds = [[f"{i / 2:.1f}", *row[1:]] for i, row in enumerate(table)]
    coarse = [[f"{i // 2 / 1000:.3f}", *row[1:]] for i, row in enumerate(table)]
    catman = ["HBM export", "Project\tRope", "T0 = 12.05.2014 14:22:11", "", "Zeit 1 [s]\tF_Seil [N]\tWeg_WA [mm]"]
    catman += ["Range\t0..200 N\t0..100 mm", "Filter\tBessel\tBessel", "\u00b5 \u00b0\t\t"]
    return [
        Sheet("plain", ["time [s],force [N],position [mm]"], table, ",", "."),
        Sheet("Excel, German", ["Zeit [s];Kraft [N];Weg [mm]"], comma, ";", ",", "\r\n", encoding="cp1252"),
        Sheet("units row", ["Zeit;Kraft;Weg", "s;N;mm"], comma, ";", ","),
        Sheet("catman", catman, comma, "\t", ",", "\r\n", names=4, encoding="cp1252"),
        Sheet("quoted", ['"Time","Load","Extension"', '"(s)","(N)","(mm)"'], table, ",", ".", quote='"'),
        Sheet("quoted commas", ['"t [s]","F [N]","u [mm]"'], comma, ",", ",", quote='"'),
        Sheet("blanks", ["# time [s]  force [N]  position [mm]"], table, " ", "."),
        Sheet("UTF-16", ["Zeit [s]\tKraft [N]\tWeg [mm]"], comma, "\t", ",", encoding="utf-16"),
        Sheet("clock", ["Datum Uhrzeit;Kraft [N];Weg [mm]"], clock, ";", ",", clock=True),
        Sheet(
            "no times", ["# fs = 2000 Hz", "F [N];u [mm]"], [row[1:] for row in comma], ";", ",", names=1, timeless=True
        ),
        Sheet("short numbers", ["t [s],F [N],u [mm]"], short, ",", ".", steady=False),
        Sheet("exponents", ["t [s],F [N],u [mm]"], exponents, ",", ".", steady=False),
        Sheet("LVM", _lvm_head(n), [["", *row[1:]] for row in comma], "\t", ",", names=-1, timeless=True),
        Sheet("milliseconds", ["Time [ms],F [N],u [mm]"], milliseconds, ",", "."),
        Sheet("coarse times", ["fs = 2000 Hz", "t [s];F [N];u [mm]"], coarse, ";", ".", names=1, timeless=True),
        Sheet("drive", ["time [s],force [N],position [mm],drive [mm]"], four, ",", "."),
    ]
