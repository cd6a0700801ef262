"""NumPy files, .npy and .npz: arrays by name."""

from __future__ import annotations

import io
import math
import zipfile
from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.columns.raw import Raw
from fibrefit.records.files.arrays.tree import columns_of_tree
from fibrefit.records.files.arrays.values import complex_numbers, stamps_in
from fibrefit.records.files.extras import damage_as_error, json_object
from fibrefit.records.grammar.phrases import Aside
from fibrefit.records.options import ReadOptions, with_unused
from fibrefit.records.thresholds import HEADER_DEPTH

_MAGIC = b"\x93NUMPY"
_SECOND = np.timedelta64(1, "s")
#: Bytes that a text takes in memory besides its letters.
_TEXT = 64


def read_numpy(data: bytes, where: str, options: ReadOptions) -> Raw:
    """Columns of a NumPy file, as `columns_of_tree` finds them.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        Its name for messages.
    options : ReadOptions
        What the user says, such as the names of the columns of a matrix that is alone.

    Returns
    -------
    Raw
        Columns of the length most vectors have.

    Raises
    ------
    DataError
        If the file is damaged, declares more than a record can be, or holds no two vectors of one length.
    """
    tree: dict[str, Any] = {}
    objects, left = [], []
    with damage_as_error(where, "the NumPy file", do="Save it again."):
        allowed = Allowance(where, DataError)
        for name, content in _members(data, allowed):
            array = _array(content, allowed)
            if array is None:
                objects.append(f'"{name}"')
            elif array.dtype.names:
                left += [complex_numbers(one) for one in array.dtype.names if array.dtype[one].kind == "c"]
                tree |= _fields(name, array, where)
            else:
                left += [complex_numbers(name)] if array.dtype.kind == "c" else []
                tree |= _variable(name, array, where)
    alone = len(tree) == 1
    if options.columns and alone:
        tree["names"] = list(options.columns)
    try:
        raw = columns_of_tree(tree, [], where, options.wanted)
    except DataError as error:
        if not left:
            raise
        do = 'Save real arrays: np.savez("a.npz", t=t, force=force.real).'
        raise DataError(where, left[0], "a real array for each channel", do) from error
    told = [Aside(f"{one}: it is left out.") for one in left]
    told += [Aside(f"Python objects are left out: {', '.join(objects)}.")] if objects else []
    raw = replace(raw, layout={"format": "NumPy", **raw.layout}, notes=[*raw.notes, *told])
    return with_unused(raw, options, *(["columns"] if alone else []))


def _members(data: bytes, allowed: Allowance) -> Iterator[tuple[str, bytes]]:
    if data.startswith(_MAGIC):
        yield "data", data
        return
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        for entry in archive.infolist():
            allowed.take(entry.file_size)
            yield entry.filename.removesuffix(".npy"), archive.read(entry)


def _array(content: bytes, allowed: Allowance) -> np.ndarray | None:
    """An array; None for one of Python objects, which are never made from a file."""
    file = io.BytesIO(content)
    version = np.lib.format.read_magic(file)
    read_header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, _, dtype = read_header(file)
    if dtype.hasobject:
        return None
    # A text of any length is one of Python as soon as it is read.
    allowed.take(math.prod(shape) * (dtype.itemsize + (_TEXT if dtype.kind in "SU" else 0)))
    return np.lib.format.read_array(io.BytesIO(content), allow_pickle=False)


def _fields(name: str, table: np.ndarray, where: str) -> dict[str, Any]:
    """Fields of a table by their names: of a file with one array alone at its top."""
    fields = table.dtype.names or ()
    found: dict[str, Any] = {}
    for field in fields:
        found |= _variable(field, table[field], where)
    return found if name == "data" else {name: found}


def _variable(name: str, array: np.ndarray, where: str) -> dict[str, Any]:
    """A variable under its name: numbers and stamps, durations in s, texts as a list; nothing of anything else."""
    kind = array.dtype.kind
    if kind == "m":
        return {name: np.squeeze(array / _SECOND), f"{name}_unit": "s"}
    if kind in "SU":
        texts = _texts(array)
        if array.ndim == 0 and (said := json_object(texts[0])):
            return {name: {key: _noted(value) for key, value in said.items()}}
        stamps = stamps_in(texts, f'{where}, "{name}"') if array.ndim == 1 else None
        listed = {name: texts[0] if array.ndim == 0 else texts} if len(texts) <= HEADER_DEPTH else {}
        return listed if stamps is None else {name: stamps}
    return {name: np.squeeze(array)} if kind in "biufM" else {}


def _noted(value: Any) -> Any:
    """A value of a note in JSON as arrays have it: numbers as arrays, texts and lists of them as they are."""
    if isinstance(value, dict):
        return {key: _noted(one) for key, one in value.items()}
    return np.asarray(value) if np.asarray(value).dtype.kind in "if" else value


def _texts(array: np.ndarray) -> Sequence[str]:
    texts = np.char.decode(array, "utf-8", "replace") if array.dtype.kind == "S" else array
    return [str(text) for text in np.ravel(texts)]
