"""``result.h5``: groups named as ArviZ names them, dimensions as NetCDF-4 has them."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from fibrefit.core import limits
from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.core.paths import write_whole
from fibrefit.study.summaries.part import Groups, Variable
from fibrefit.study.summaries.results import Provenance

if TYPE_CHECKING:
    import h5py  # where a file is written or read; who only names arrays does without

SMALL = 1024
"""Arrays below this size are not worth compressing."""
PACKED = 32
"""Times its own size that a file may unpack to where that is beyond what any file may: arrays are filled up to the
length of the longest record, and what fills them up packs to nothing."""


def write_result(path: Path, schema: str, groups: Groups, provenance: Provenance) -> None:
    """Write ``result.h5``, whole or not at all.

    Parameters
    ----------
    path : pathlib.Path
        File to write or replace.
    schema : str
        Schema of the summary beside it, e.g. ``"fibrefit/fit/1"``.
    groups : mapping
        Group name to variable name to `Variable`.
    provenance : Provenance
        Kept in a group of its own, since text that long does not fit into attributes.

    Raises
    ------
    ValueError
        If dimensions of a group contradict each other.
    TypeError
        If a variable holds anything but numbers, booleans or text.
    """
    import h5py

    texts = {
        "resolved_study": provenance.resolved_study,
        "versions": "\n".join(f"{name} {version}" for name, version in provenance.versions.items()),
        # The layout of sha256sum, so that it can check them.
        "inputs": "\n".join(f"{digest}  {name}" for name, digest in provenance.inputs.items()),
    }
    origin = {name: Variable(np.array(text, dtype=object)) for name, text in texts.items()}
    # In memory first: where a disk is full, HDF5 ends the process when it closes the file.
    with h5py.File(path.name, "w", driver="core", backing_store=False) as file:
        file.attrs["schema"] = schema
        file.attrs["created"] = provenance.created
        if provenance.seed is not None:
            file.attrs["seed"] = np.int64(provenance.seed)
        for name, variables in {**groups, "provenance": origin}.items():
            _write_group(file.create_group(name), variables)
        file.flush()
        content = file.id.get_file_image()
    write_whole(path, content)


def read_result(path: Path) -> tuple[dict[str, dict[str, Variable]], dict[str, Any]]:
    """Content of a ``result.h5``.

    Parameters
    ----------
    path : pathlib.Path
        File to read; it is not locked, so that network disks and a writer beside us do not matter.

    Returns
    -------
    groups : dict
        Group name to variable name to `Variable`; what is asked for and not there is a `DataError` that says so.
    attributes : dict
        Of the file: ``schema``, ``created``, ``seed``.

    Raises
    ------
    DataError
        If it cannot be read as HDF5, or declares more than any result holds.
    """
    import h5py

    if os.path.lexists(path) and not os.path.isfile(path):
        raise DataError(str(path), "no plain file", "a result.h5 of fibrefit", "")
    try:
        with h5py.File(path, "r", locking=False) as file:
            allowed = Allowance(str(path), DataError, max(limits.LARGEST, PACKED * path.stat().st_size))

            def count(name: str, item: Any) -> None:
                if isinstance(item, h5py.Dataset):
                    allowed.take((item.size or 0) * item.dtype.itemsize)

            file.visititems(count)
            groups = {
                name: _Stored(
                    str(path),
                    "array",
                    {key.replace("%2F", "/").replace("%25", "%"): _read_variable(one) for key, one in group.items()},
                )
                for name, group in file.items()
            }
            stated = file.attrs.items()
            attributes = {name: one.item() if isinstance(one, np.generic) else one for name, one in stated}
            return _Stored(str(path), "group", groups), attributes
    except OSError as error:
        raise DataError(str(path), str(error).splitlines()[0], "a result.h5 of fibrefit", "") from None
    except (AttributeError, TypeError, ValueError, LookupError, RuntimeError):  # groups and arrays in other places
        raise DataError(str(path), "HDF5 of another layout", "a result.h5 of fibrefit", "") from None


class _Stored(dict[str, Any]):
    """What a file holds, by name; what it lacks, as results of other versions or damaged ones do, is a `DataError`."""

    def __init__(self, where: str, what: str, content: Mapping[str, Any]) -> None:
        super().__init__(content)
        self._where, self._what = where, what

    def __missing__(self, name: str) -> Any:
        got = f'a result.h5 without the {self._what} "{name}"'
        do = "Make the result again with this version."
        raise DataError(self._where, got, "one with all its arrays", do)


def _write_group(group: h5py.Group, variables: Mapping[str, Variable]) -> None:
    sizes: dict[str, int] = {}
    for name, variable in variables.items():
        shape = np.shape(variable.values)
        if len(shape) != len(variable.dims):
            raise ValueError(f"{group.name}/{name}: {len(variable.dims)} dimensions named, {len(shape)} found")
        for dim, size in zip(variable.dims, shape, strict=True):
            if sizes.setdefault(dim, size) != size:
                raise ValueError(f"{group.name}/{name}: dimension {dim} is {size} here and {sizes[dim]} elsewhere")
    for dim, size in sizes.items():
        coordinate = variables.get(dim) or Variable(np.arange(size), (dim,), doc="Index.")
        _write_variable(group, dim, coordinate).make_scale(dim)
    for name, variable in variables.items():
        if name not in sizes:
            dataset = _write_variable(group, name, variable)
            for axis, dim in enumerate(variable.dims):
                dataset.dims[axis].attach_scale(group[dim])


def _write_variable(group: h5py.Group, name: str, variable: Variable) -> h5py.Dataset:
    import h5py

    values, text = np.asarray(variable.values), h5py.string_dtype("utf-8")
    # Explicit, since HDF5's own defaults change.
    kind: Any = {"f": "<f8", "i": "<i8", "u": "<i8", "b": "<i1", "U": text}.get(values.dtype.kind)
    if kind is None and values.dtype == object and all(isinstance(value, str) for value in values.flat):
        kind = text
    if kind is None:
        raise TypeError(f"{group.name}/{name}: values of type {values.dtype} cannot be stored")
    packed = {"compression": "gzip", "compression_opts": 4, "shuffle": True} if values.size >= SMALL else {}
    # HDF5 takes a slash, as in the path of a record, for a group.
    escaped = name.replace("%", "%25").replace("/", "%2F")
    dataset = group.create_dataset(escaped, data=values.astype(kind), dtype=kind, **packed)
    dataset.attrs["units"] = variable.unit
    if variable.doc:
        dataset.attrs["long_name"] = variable.doc
    if values.dtype.kind == "b":
        dataset.attrs["dtype"] = "bool"  # as xarray marks them: NetCDF has no booleans
    return dataset


def _read_variable(dataset: h5py.Dataset) -> Variable:
    import h5py

    is_text = h5py.check_string_dtype(dataset.dtype) is not None
    values = np.asarray(dataset.asstr()[()] if is_text else dataset[()])
    if dataset.attrs.get("dtype") == "bool":
        values = values.astype(bool)
    if dataset.is_scale:
        dims: tuple[str, ...] = (dataset.name.rpartition("/")[2],)
    else:
        dims = tuple(axis[0].name.rpartition("/")[2] for axis in dataset.dims)
    return Variable(values, dims, dataset.attrs.get("units", "-"), dataset.attrs.get("long_name", ""))
