"""Files of some kilobytes that ask for gigabytes. Each is made by a function of a path and the bytes it unpacks to."""

from __future__ import annotations

import gzip
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np

LINE = b"0.0005,1.25,3.5\n"
ROW = b"<row><c><v>1.25</v></c><c><v>2</v></c></row>"
SHEET = b'<worksheet xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"><sheetData>'
FAR = b'<row r="1"><c r="A1"><v>1</v></c></row><row r="1048576"><c r="XFD1048576"><v>1</v></c></row>'
BLOCK = 1 << 20
BILLION = 10**9
CELL, STRUCTURE, CHARACTERS, DOUBLES = 1, 2, 4, 6


def blocks(piece: bytes, size: int) -> list[bytes]:
    """One block, as often as it takes."""
    block = piece * (BLOCK // len(piece))
    return [block] * (size // len(block) + 1)


def text_gz(path: Path, size: int) -> None:
    with gzip.open(path, "wb", 1) as file:
        for block in blocks(LINE, size):
            file.write(block)


def _zipped(path: Path, members: dict[str, list[bytes]]) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, parts in members.items():
            entry = zipfile.ZipInfo(name)
            entry.compress_type = zipfile.ZIP_DEFLATED
            with archive.open(entry, "w", force_zip64=True) as file:
                for part in parts:
                    file.write(part)


def text_zip(path: Path, size: int) -> None:
    _zipped(path, {"a.csv": blocks(LINE, size)})


def _sheet(path: Path, parts: list[bytes]) -> None:
    import openpyxl

    plain = path.with_suffix(".plain")
    openpyxl.Workbook().save(plain)
    with zipfile.ZipFile(plain) as book:
        members = {name: [book.read(name)] for name in book.namelist()}
    members["xl/worksheets/sheet1.xml"] = [SHEET, *parts, b"</sheetData></worksheet>"]
    _zipped(path, members)
    plain.unlink()


def rows_xlsx(path: Path, size: int) -> None:
    _sheet(path, blocks(ROW, size))


def far_cell_xlsx(path: Path, size: int) -> None:
    """One cell in the last row and column; the reader fills up all before it."""
    _sheet(path, [FAR])


def entities_xlsx(path: Path, size: int) -> None:
    """Entities of entities, a billion signs in all."""
    _sheet(path, [])
    with zipfile.ZipFile(path) as book:
        members = {name: [book.read(name)] for name in book.namelist()}
    told = "".join(f'<!ENTITY e{i} "{f"&e{i - 1};" * 10}">' for i in range(1, 10))
    cell = b'<row r="1"><c r="A1" t="inlineStr"><is><t>&e9;</t></is></c></row></sheetData></worksheet>'
    sheet = f'<!DOCTYPE x [<!ENTITY e0 "9999999999">{told}]>'.encode() + SHEET + cell
    members["xl/worksheets/sheet1.xml"] = [sheet]
    _zipped(path, members)


def _element(kind: int, content: bytes, declared: int | None = None) -> bytes:
    size = len(content) if declared is None else declared
    return struct.pack("<II", kind, size) + content + b"\0" * (-len(content) % 8)


def _array(kind: int, dimensions: tuple[int, ...], values: bytes, size: int = 0) -> bytes:
    shape = struct.pack(f"<{len(dimensions)}i", *dimensions)
    parts = _element(6, struct.pack("<II", kind, 0)) + _element(5, shape) + _element(1, b"x") + values
    return struct.pack("<II", 14, len(parts) + size) + parts


def _matlab(path: Path, array: bytes, more: list[bytes]) -> None:
    deflate = zlib.compressobj(1)
    packed = b"".join([deflate.compress(array), *map(deflate.compress, more), deflate.flush()])
    head = b"MATLAB 5.0 MAT-file".ljust(124) + struct.pack("<HH", 0x0100, 0x4D49)
    path.write_bytes(head + _element(15, packed))


def doubles_mat(path: Path, size: int) -> None:
    number = size // 8
    _matlab(path, _array(DOUBLES, (number, 1), struct.pack("<II", 9, 8 * number), 8 * number), blocks(b"\0", size))


def data_beyond_its_shape_mat(path: Path, size: int) -> None:
    _matlab(path, _array(DOUBLES, (1, 1), struct.pack("<II", 9, size), size), blocks(b"\0", size))


def cells_mat(path: Path, size: int) -> None:
    _matlab(path, _array(CELL, (BILLION, 1), b""), [])


def structures_mat(path: Path, size: int) -> None:
    fields = struct.pack("<II", 4 << 16 | 5, 8) + _element(1, b"")
    _matlab(path, _array(STRUCTURE, (BILLION, 1), fields), [])


def characters_in_a_cell_mat(path: Path, size: int) -> None:
    _matlab(path, _array(CELL, (1, 1), _array(CHARACTERS, (1, BILLION), _element(4, b""))), [])


def cells_in_cells_mat(path: Path, size: int) -> None:
    array = _array(DOUBLES, (1, 1), _element(9, bytes(8)))
    for _ in range(2000):
        array = _array(CELL, (1, 1), array)
    _matlab(path, array, [])


def version_4_mat(path: Path, size: int) -> None:
    path.write_bytes(struct.pack("<5i", 0, BILLION, 1, 0, 2) + b"x\0" + bytes(64))


def arrays_h5(path: Path, size: int) -> None:
    with h5py.File(path, "w") as file:
        for name in ("time", "force"):
            file.create_dataset(name, (BILLION,), "f8", chunks=(10**6,), compression="gzip")


def many_arrays_h5(path: Path, size: int) -> None:
    """None of them too large by itself."""
    with h5py.File(path, "w") as file:
        for i in range(20):
            file.create_dataset(f"a{i}", (size // 160,), "f8", chunks=(10**5,))


def links_h5(path: Path, size: int) -> None:
    """Thirty groups, of which each names the one before twice: a thousand million ways to the first."""
    with h5py.File(path, "w") as file:
        below = file.create_group("g0")
        for i in range(1, 30):
            above = file.create_group(f"g{i}")
            above["a"] = above["b"] = below
            below = above


def equal_numbers_parquet(path: Path, size: int) -> None:
    import pyarrow
    from pyarrow import parquet

    rows = min(size // 16, 1 << 22)
    table = pyarrow.table({"time [s]": np.zeros(rows), "force [N]": np.ones(rows)})
    with parquet.ParquetWriter(path, table.schema, compression="zstd") as writer:
        for _ in range(size // (16 * rows) + 1):
            writer.write_table(table, row_group_size=rows)


def holes_csv(path: Path, size: int) -> None:
    """A file of two lines, and of 200 GB as the system counts; it takes no room on a disk."""
    with path.open("wb") as file:
        file.write(b"time [s],force [N]\n0,1\n")
        file.truncate(200 * BILLION)


def cells_csv(path: Path, size: int) -> None:
    with path.open("wb") as file:
        file.write(b"time [s],force [N]\n")
        for left in range(size, 0, -(1 << 20)):
            file.write(b"1,2\n" * (min(left, 1 << 20) // 4))


BOMBS: dict[str, Callable[[Path, int], None]] = {
    "a.csv.gz": text_gz,
    "a.zip": text_zip,
    "rows.xlsx": rows_xlsx,
    "far.xlsx": far_cell_xlsx,
    "entities.xlsx": entities_xlsx,
    "doubles.mat": doubles_mat,
    "beyond.mat": data_beyond_its_shape_mat,
    "cells.mat": cells_mat,
    "structures.mat": structures_mat,
    "characters.mat": characters_in_a_cell_mat,
    "deep.mat": cells_in_cells_mat,
    "four.mat": version_4_mat,
    "arrays.h5": arrays_h5,
    "many.h5": many_arrays_h5,
    "links.h5": links_h5,
    "equal.parquet": equal_numbers_parquet,
    "holes.csv": holes_csv,
    "cells.csv": cells_csv,
}
