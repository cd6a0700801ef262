"""MATLAB files: version 5 through SciPy, version 7.3 through HDF5."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core import units
from fibrefit.core.allowance import Allowance
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn, binary_column
from fibrefit.records.files.extras import damage_as_error
from fibrefit.records.files.hdf5 import STATED, UNITS, WORTH, Hdf5
from fibrefit.records.files.matlab_sizes import count_declared
from fibrefit.records.grammar.facts import Facts, find_facts
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.words import score, tokens
from fibrefit.records.grammar.worth import contradicted, stated_worth

_FORMATS = ("MATLAB", "HDF5")

#: Fields of a structure that tell what an array beside them is.
_NAMES = (
    "colheaders",
    "columnnames",
    "columns",
    "names",
    "channelnames",
    "labels",
    "variablenames",
    "signals",
    "headers",
)
#: What netCDF writes behind the unit of times.
_SINCE = re.compile(r"\s+since\s.*", re.DOTALL)
#: Units that end the name of a rate or a step: `fs_kHz`.
_IN_NAMES = ("s", "ms", "us", "ns", "hz", "khz")
#: Names of a vector that say nothing.
_BARE = ("data", "values", "value", "y")


def read_matlab(path: Path, where: str, wanted: Collection[str]) -> Raw:
    """Columns of a MATLAB file.

    Vectors of equal length are columns, named by their variable (``force_N``) or by a field of their structure; the
    columns of a matrix are named by a list of names beside it. Units come from a suffix of the name, or from a field
    ``unit`` or ``units`` beside the array. A scalar ``fs`` in Hz or ``dt`` in s tells the rate.

    Parameters
    ----------
    path : Path
        The file.
    where : str
        Its name for messages.
    wanted : collection of str
        Headings the user named; the columns of a matrix without names can be named ``"data(:,2)"``.

    Returns
    -------
    Raw
        Columns of the length most vectors have.

    Raises
    ------
    DataError
        If the file is damaged, declares or unpacks to more than a record can be, or holds no two vectors of one length.
    """
    with damage_as_error(where, "the file", "a MATLAB or HDF5 file", "Save it again."):
        tree, annotations = _load(path, Allowance(where, DataError))
    found = list(_columns(tree, ""))
    sizes = [column.numbers.values.size for column in found]
    long = [size for size in sizes if size >= 3]
    if not long:
        raise DataError(where, "no vectors of numbers", "a vector for each channel", "Save the channels as vectors.")
    timed = [c.numbers.values.size for c in found if score(c.name, "time") > 0 and c.numbers.values.size >= 3]
    named = [c.numbers.values.size for c in found if c.header in wanted]
    size = (named or timed or [max(sorted(set(long)), key=long.count)])[0]
    columns = [column for column in found if column.numbers.values.size == size]
    others = [column for column in found if column.numbers.values.size not in (1, size)]
    if not named:
        _refuse_other_rates(columns, others, where)
    aside = [column.header for column in others]
    notes = [f"Vectors of another length are left out: {', '.join(aside[:6])}."] if aside else []
    return Raw(
        columns,
        _facts(tree),
        np.arange(1, size + 1),
        layout={"format": _FORMATS[path.suffix.casefold() in (".h5", ".hdf5", ".hdf", ".he5", ".nxs")], "rows": size},
        notes=notes,
        annotations=annotations,
    )


def _refuse_other_rates(columns: Sequence[RawColumn], others: Sequence[RawColumn], where: str) -> None:
    """Refuse vectors of another length that are called as a channel is which none of those kept is called."""
    for role in ("force", "position", "angle"):
        lost = next((c for c in others if score(c.name, role) > 2 and c.numbers.values.size > 2), None)
        if lost is None or any(score(c.name, role) > 2 for c in columns):
            continue
        got = f'vectors of different lengths ("{columns[0].header}": {columns[0].numbers.values.size}, '
        got += f'"{lost.header}": {lost.numbers.values.size})'
        do = (
            f"Save them at one rate, or name the channels of one length that are meant under [channels]; the {role} is "
        )
        raise DataError(where, got, "one length", f"{do}then left out.")


def _load(path: Path, allowed: Allowance) -> tuple[dict[str, Any], list[Annotation]]:
    with path.open("rb") as file:
        head = file.read(1024)
    if b"\x89HDF\r\n\x1a\n" in head:
        import h5py  # only for version 7.3

        with h5py.File(path, "r", locking=False) as file:
            # All of it is counted before any of it is read: many arrays can be too much where each of them is not.
            Hdf5(file, replace(allowed), reads=False).group(file)
            reader = Hdf5(file, allowed)
            return reader.group(file), reader.annotations
    import scipy.io  # a quarter of a second: only for version 5

    major, _ = scipy.io.matlab.matfile_version(path)
    if major == 1:
        count_declared(path, allowed)
    else:
        for _, shape, _ in scipy.io.whosmat(path):
            allowed.take(8 * math.prod(shape))
    loaded = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False, chars_as_strings=True)
    tree = {name: _of_scipy(value) for name, value in loaded.items() if not name.startswith("__")}
    return tree, list(_annotations(tree))


def _annotations(tree: Mapping[str, Any], prefix: str = "") -> Iterator[Annotation]:
    """Texts and single numbers among variables and fields; of those beside one vector alone, they are said of it."""
    vectors = [
        key for key, value in tree.items() if isinstance(value, np.ndarray) and value.ndim == 1 and value.size > 1
    ]
    of = f"{prefix}{vectors[0]}" if len(vectors) == 1 and prefix else ""
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _annotations(value, f"{prefix}{key}.")
        elif isinstance(value, str) or (
            isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "iuf"
        ):
            text = value if isinstance(value, str) else f"{np.ravel(value)[0]:.12g}"
            yield Annotation(f'"{prefix}{key}"', " ".join(f"{prefix}{key} = {text}".split()), of)


def _of_scipy(value: Any) -> Any:
    """Structures as dicts, lists of texts as lists, numbers as arrays."""
    if hasattr(value, "_fieldnames"):
        return {name: _of_scipy(getattr(value, name)) for name in value._fieldnames}
    if isinstance(value, str):
        return value
    array = np.asarray(value)
    if array.dtype.kind in "US":
        return [str(text).strip() for text in np.atleast_1d(array)]
    if array.dtype == object:
        items = [_of_scipy(item) for item in np.atleast_1d(array).ravel()]
        if all(isinstance(item, dict) for item in items) and items:
            return {f"{i + 1}": item for i, item in enumerate(items)}
        return items
    return array if array.dtype.kind in "biuf" else None


def _columns(tree: Mapping[str, Any], prefix: str) -> Iterator[RawColumn]:
    """Vectors below a node, with names and units from their neighbours."""
    by_key = {key.casefold().replace("_", ""): value for key, value in tree.items()}
    names = next((by_key[key] for key in _NAMES if isinstance(by_key.get(key), list)), None)
    given = next((by_key[key] for key in UNITS if key in by_key), None)
    given = None if isinstance(given, str) and units.expression(given) is None else given
    for key, value in tree.items():
        header = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _columns(value, f"{header}.")
        elif isinstance(value, np.ndarray) and value.ndim == 1 and value.size > 1:
            unit = given if isinstance(given, str) and not _is_other(key, given) else _unit_of(given, key)
            beside = next((said for name in UNITS if isinstance(said := tree.get(f"{key}_{name}"), str)), None)
            unit = (unit or beside) and _SINCE.sub("", unit or beside or "")
            worth = tree.get(WORTH, {}).get(key, "") or stated_worth(
                _beside(tree, "" if _is_bare(header) else key), value
            )
            column = _column(_name_of(by_key, prefix, header), unit, value)
            twice = contradicted([unit, _named(header)[1], *tree.get(STATED, {}).get(key, ())])
            yield replace(column, worth=worth, contradicted=twice)
        elif isinstance(value, np.ndarray) and value.ndim == 2:
            yield from _matrix(header, value, names, given)


def _is_other(key: str, unit: str) -> bool:
    """Whether the unit of a structure is not that of a vector in it: of the times beside the data."""
    return score(key, "time") > 0 and units.kind_of(unit) not in (None, "time")


def _is_bare(header: str) -> bool:
    """Whether a vector is only called `data` or `values`, as a field of the structure that is the channel."""
    return "." in header and header.rpartition(".")[2].casefold() in _BARE


def _beside(tree: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Single numbers of a structure that begin with the same word as a vector; all of them where it has no name."""
    single = {key: value for key, value in tree.items() if isinstance(value, np.ndarray) and value.size == 1}
    return {key: value for key, value in single.items() if not name or tokens(key)[:1] == tokens(name)[:1] != []}


def _name_of(by_key: Mapping[str, Any], prefix: str, header: str) -> str:
    """Name of a vector: that of its structure where the vector is only called `data` or `values`."""
    if _is_bare(header):
        name = next(
            (by_key[key] for key in ("name", "label", "title", "signalname") if isinstance(by_key.get(key), str)), ""
        )
        return name or prefix.rstrip(".")
    return header


def _unit_of(given: Any, key: str) -> str | None:
    if isinstance(given, dict):
        unit = given.get(key)
        return unit if isinstance(unit, str) else None
    return None


def _matrix(header: str, value: np.ndarray, names: list[Any] | None, given: Any) -> Iterator[RawColumn]:
    """Columns of a matrix; one that is wider than long is lying on its side."""
    table = value if value.shape[0] >= value.shape[1] else value.T
    count = table.shape[1]
    titles = (
        [str(n) for n in names] if names and len(names) == count else [f"{header}(:,{i + 1})" for i in range(count)]
    )
    unit = list(given) if isinstance(given, list) and len(given) == count else [None] * count
    for i in range(count):
        yield _column(titles[i], unit[i] if isinstance(unit[i], str) else None, table[:, i])


def _column(header: str, unit: str | None, values: np.ndarray) -> RawColumn:
    name, found = _named(header)
    return binary_column(header, name, unit or found, values)


def _named(header: str) -> tuple[str, str | None]:
    """Name and unit of a vector, by its own name."""
    name, found = split_heading(header.rpartition(".")[2] if "." in header else header)
    if found is None and units.expression(name.rpartition("_")[2] or "?") is not None and "_" in name:
        name, _, found = name.rpartition("_")
    return name, found


def _facts(tree: Mapping[str, Any]) -> Facts:
    """Rate from a scalar `fs` or `dt`, in SI as MATLAB users keep them."""
    found = [(key, f"{key} = {float(value)}", unit) for key, value, unit in _scalars(tree)]
    hints = [
        f"{line} {unit}"
        for key, line, said in found
        if tokens(key)[-1:] != ["samples"]
        for unit in ((said,) if said else ("Hz", "s"))
    ]
    return find_facts(hints)


def _scalars(tree: Mapping[str, Any]) -> Iterator[tuple[str, Any, str]]:
    """Single numbers with their names and the units that are stated of them, beside them or in the name."""
    given = next((value for key, value in tree.items() if key.casefold() in UNITS), None)
    for key, value in tree.items():
        if isinstance(value, dict):
            yield from _scalars(value)
        elif isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf":
            words = key.casefold().split("_") if "_" in key else tokens(key)  # tokens would part kHz
            beside = next(
                (tree[name] for name in (f"{key}_unit", f"{key}_units", f"{key[:1]}_unit") if name in tree), None
            )
            named = words[-1] if len(words) > 1 and words[-1] in _IN_NAMES else ""
            yield key, value, beside if isinstance(beside, str) else _unit_of(given, key) or named
