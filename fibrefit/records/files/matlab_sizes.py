"""What a MATLAB 5 file declares and unpacks to, found without keeping any of it.

The file is a sequence of elements, each with a tag of kind and size; an array is an element of elements: flags,
dimensions, name, and then values or further arrays. Compressed elements are deflated streams of the same.
"""

from __future__ import annotations

import math
import struct
import zlib
from pathlib import Path
from typing import IO

from fibrefit.core.limits import Allowance

DIMENSIONS, ARRAY, COMPRESSED = 5, 14, 15
HEADER = 128
DEEPEST = 32
"""Structures within structures: those that measure have two or three, and a reader in C has no room for thousands."""
_PART = 1 << 16


def count_declared(path: Path, allowed: Allowance) -> None:
    """Take from an allowance what the arrays of a file are declared with, and what they unpack to.

    Raises
    ------
    FibrefitError
        If it is too much, of the class of the allowance.
    ValueError
        If the file ends before its elements do, or has too many levels.
    """
    with path.open("rb") as file:
        head = file.read(HEADER)
        order = "<" if head[-2:] == b"IM" else ">"
        while len(tag := file.read(8)) == 8:
            kind, size = struct.unpack(f"{order}II", tag)
            place = file.tell()
            if kind == COMPRESSED:
                stream = _Stream(_Inflated(file, size), order, allowed)
                _element(stream, 0)
            elif kind == ARRAY:
                _array(_Stream(file, order, allowed), size, 0)
            file.seek(place + size)


class _Inflated:
    """A compressed element, a little at a time."""

    def __init__(self, file: IO[bytes], size: int) -> None:
        self._file, self._left, self._packed = file, size, b""
        self._inflate = zlib.decompressobj()

    def read(self, size: int) -> bytes:
        """Up to `size` bytes; none at the end."""
        while not self._inflate.eof:
            if not self._packed:
                self._packed = self._file.read(min(_PART, self._left))
                self._left -= len(self._packed)
            given = self._inflate.decompress(self._packed, size)
            had, self._packed = self._packed, self._inflate.unconsumed_tail
            if given or not had:
                return given
        return b""


class _Stream:
    """Bytes that are read and counted."""

    def __init__(self, file: IO[bytes] | _Inflated, order: str, allowed: Allowance) -> None:
        self._file, self.order, self.allowed = file, order, allowed

    def read(self, size: int) -> bytes:
        parts, left = [], size
        while left and (part := self._file.read(left)):
            self.allowed.take(len(part))
            parts.append(part)
            left -= len(part)
        if left:
            raise ValueError("an element is cut short")
        return b"".join(parts)

    def skip(self, size: int) -> None:
        while size:
            size -= len(self.read(min(size, _PART)))

    def numbers(self, data: bytes, kind: str) -> tuple[int, ...]:
        return struct.unpack(f"{self.order}{len(data) // 4}{kind}", data)


def _element(stream: _Stream, level: int) -> tuple[int, bytes, int]:
    """Read one element: its kind, its content where that is short and no array, and the bytes it took."""
    tag = stream.read(8)
    kind, size = stream.numbers(tag, "I")
    if kind >> 16:  # four bytes at most, in the tag itself
        return kind & 0xFFFF, tag[4 : 4 + min(kind >> 16, 4)], 8
    if kind == ARRAY:
        _array(stream, size, level)
        return kind, b"", 8 + size
    padding = -size % 8
    content = stream.read(size) if kind == DIMENSIONS and size <= _PART else b""
    stream.skip(size - len(content) + padding)
    return kind, content, 8 + size + padding


def _array(stream: _Stream, size: int, level: int) -> None:
    """Go through the elements of an array; the second tells its dimensions."""
    if level > DEEPEST:
        raise ValueError(f"more than {DEEPEST} levels")
    number = 0
    while size > 0:
        kind, content, taken = _element(stream, level + 1)
        if number == 1 and kind == DIMENSIONS:
            stream.allowed.take(8 * math.prod(max(n, 0) for n in stream.numbers(content, "i")))
        size -= taken
        number += 1
