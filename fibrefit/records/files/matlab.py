"""MATLAB files: versions 4 and 5 through SciPy, version 7.3 through HDF5."""

from __future__ import annotations

import math
from collections.abc import Collection
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.columns.raw import Annotation, Raw
from fibrefit.records.files.arrays.tree import columns_of_tree
from fibrefit.records.files.arrays.values import complex_numbers, items_as_one
from fibrefit.records.files.extras import damage_as_error
from fibrefit.records.files.hdf5 import load_hdf5, object_of_matlab
from fibrefit.records.files.matlab_sizes import count_declared
from fibrefit.records.grammar.phrases import Aside

_DO = 'Save times and values as real vectors: t = seconds(T.Time); F = real(T.force); save("a.mat", "t", "F").'
_OF_HDF5 = (".h5", ".hdf5", ".hdf", ".he5", ".nxs", ".nc")


def read_matlab(path: Path, where: str, wanted: Collection[str]) -> Raw:
    """Columns of a MATLAB or HDF5 file, as `columns_of_tree` finds them.

    Parameters
    ----------
    path : Path
        The file.
    where : str
        Its name for messages.
    wanted : collection of str
        Headings the user named; any column can be named by its place: ``"rec.force"``, ``"data(:,2)"``.

    Returns
    -------
    Raw
        Columns of the length most vectors have.

    Raises
    ------
    DataError
        If the file is damaged, declares or unpacks to more than a record can be, holds objects of MATLAB or complex
        numbers alone, or no two vectors of one length.
    """
    with damage_as_error(where, "the file", "a MATLAB or HDF5 file", "Save it again."):
        tree, said, notes, left = _load(path, Allowance(where, DataError))
    try:
        raw = columns_of_tree(tree, said, where, wanted)
    except DataError as error:
        if not left:
            raise
        raise DataError(where, left[0], "a vector of real numbers for each channel", _DO) from error
    layout = {"format": "HDF5" if path.suffix.casefold() in _OF_HDF5 else "MATLAB", **raw.layout}
    notes = [*raw.notes, *notes, *(Aside(f"{one}: it is left out.") for one in left)]
    return replace(raw, layout=layout, notes=notes)


def _load(path: Path, allowed: Allowance) -> tuple[dict[str, Any], list[Annotation], list[str], list[str]]:
    """Content of a file, what attributes say, notes, and what of it is left out in words."""
    with path.open("rb") as file:
        head = file.read(1024)
    if b"\x89HDF\r\n\x1a\n" in head:
        return load_hdf5(path, allowed)
    import scipy.io  # a quarter of a second: only for version 5

    major, _ = scipy.io.matlab.matfile_version(path)
    if major == 1:
        count_declared(path, allowed)
    else:
        for _, shape, _ in scipy.io.whosmat(path):
            allowed.take(8 * math.prod(shape))
    loaded = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False, chars_as_strings=True)
    found = {name: value for name, value in loaded.items() if not name.startswith("__")}
    left = [object_of_matlab(*map(_text, value.ravel()[0])) for value in found.values() if _is_opaque(value)]
    return {name: _of_scipy(value, name, left) for name, value in found.items()}, [], [], left


def _is_opaque(value: Any) -> bool:
    """Whether a variable is an object, which SciPy gives as its name, the system it is of, and its class."""
    return isinstance(value, np.ndarray) and (value.dtype.names or ())[:3] == ("s0", "s1", "s2")


def _text(value: Any) -> str:
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)


def _of_scipy(value: Any, name: str, left: list[str]) -> Any:
    """Structures as dicts, lists of texts as lists, numbers as arrays; what is complex joins what is left out."""
    if hasattr(value, "_fieldnames"):
        return {key: _of_scipy(getattr(value, key), f"{name}.{key}", left) for key in value._fieldnames}
    if isinstance(value, str):
        return value
    array = np.asarray(value)
    if array.dtype.kind in "US":
        return [str(text).strip() for text in np.atleast_1d(array)]
    if array.dtype == object:
        return items_as_one([_of_scipy(item, name, left) for item in np.atleast_1d(array).ravel()])
    if array.dtype.kind == "c":
        left.append(complex_numbers(name))
    return array if array.dtype.kind in "biuf" else None
