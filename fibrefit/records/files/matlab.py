"""MATLAB files: version 5 through SciPy, version 7.3 through HDF5."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core import units
from fibrefit.core.allowance import Allowance
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn, binary_column
from fibrefit.records.files.extras import damage_as_error, factors_among, with_stated_units
from fibrefit.records.files.hdf5 import ATTRIBUTES, STATED, UNITS, WORTH, load_hdf5
from fibrefit.records.files.matlab_sizes import count_declared
from fibrefit.records.grammar.facts import Facts, find_facts
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.words import kinds_named, score, tokens
from fibrefit.records.grammar.worth import contradicted, stated_worth
from fibrefit.records.thresholds import HEADER_DEPTH

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
#: Names of a vector, or last words of them, that say nothing; and last words of what tells of it beside it.
_BARE = ("data", "values", "value", "y")
_TITLES = ("name", "label", "title", "signalname", "channelname")
_ABOUT = ("header", "info", "properties", "attributes", "meta", "metadata")
#: Between such a word and what stands before it: ``Channel_1_Header``, ``forceUnit``.
_SIGNS = ("_", "", ".", " ")
#: A rate or a step that is written as a text.
_AMOUNT = re.compile(r"\s*([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*([kM]?Hz|[mun]?s)?\s*")


def read_matlab(path: Path, where: str, wanted: Collection[str]) -> Raw:
    """Columns of a MATLAB file.

    Vectors of equal length are columns, named by their variable (``force_N``), by a field of their structure, or by
    one of the structure beside them (``Channel_1_Header`` of ``Channel_1_Data``); the columns of a matrix are named by
    a list of as many names beside it. Units come from a suffix of the name, or from a field ``unit`` or ``units``
    beside the array. A scalar ``fs`` in Hz or ``dt`` in s tells the rate.

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
        If the file is damaged, declares or unpacks to more than a record can be, or holds no two vectors of one length.
    """
    with damage_as_error(where, "the file", "a MATLAB or HDF5 file", "Save it again."):
        tree, annotations, remarks = _load(path, Allowance(where, DataError))
    # A user may call a column by its name in the file, whatever is told beside it of its name.
    placed = [(at, replace(column, header=at) if at in wanted else column) for at, column in _columns(tree, "")]
    annotations = _said_of(annotations, placed)
    found = with_stated_units([column for _, column in placed], annotations)
    sizes = [column.numbers.values.size for column in found]
    long = [size for size in sizes if size >= 3]
    if not long:
        raise DataError(where, "no vectors of numbers", "a vector for each channel", "Save the channels as vectors.")
    timed = [c.numbers.values.size for c in found if score(c.name, "time") > 0 and c.numbers.values.size >= 3]
    named = [c.numbers.values.size for c in found if c.header in wanted]
    size = (named or timed or [max(sorted(set(long)), key=long.count)])[0]
    columns = [column for column in found if column.numbers.values.size == size]
    left = [place for place, column in placed if column.numbers.values.size not in (1, size)]
    others = [column for column in found if column.numbers.values.size not in (1, size)]
    if not named:
        _refuse_other_rates(columns, others, where)
    aside = [column.header for column in others]
    notes = [f"Vectors of another length are left out: {', '.join(aside[:6])}."] if aside else []
    return Raw(
        columns,
        _facts(tree, left),
        np.arange(1, size + 1),
        layout={"format": _FORMATS[path.suffix.casefold() in (".h5", ".hdf5", ".hdf", ".he5", ".nxs")], "rows": size},
        notes=[*notes, *remarks],
        annotations=[*annotations, *factors_among(others, len(columns))],
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


def _load(path: Path, allowed: Allowance) -> tuple[dict[str, Any], list[Annotation], list[str]]:
    with path.open("rb") as file:
        head = file.read(1024)
    if b"\x89HDF\r\n\x1a\n" in head:
        tree, annotations, notes = load_hdf5(path, allowed)
        return tree, [*annotations, *_annotations(tree)], notes
    import scipy.io  # a quarter of a second: only for version 5

    major, _ = scipy.io.matlab.matfile_version(path)
    if major == 1:
        count_declared(path, allowed)
    else:
        for _, shape, _ in scipy.io.whosmat(path):
            allowed.take(8 * math.prod(shape))
    loaded = scipy.io.loadmat(path, squeeze_me=True, struct_as_record=False, chars_as_strings=True)
    tree = {name: _of_scipy(value) for name, value in loaded.items() if not name.startswith("__")}
    return tree, list(_annotations(tree)), []


def _annotations(tree: Mapping[str, Any], prefix: str = "", of: str = "") -> Iterator[Annotation]:
    """Texts and single numbers among variables and fields; those that tell of one vector alone are said of it.

    What attributes of HDF5 say but for lists of texts is told by them, names and units of columns of a matrix by these.
    """
    told_of = _told_of(tree, prefix, of)
    names = [_names_beside(tree, key, min(tree[key].shape)) for key in tree if _is_matrix(tree[key])]
    for key, value in tree.items():
        place, mine = f"{prefix}{key}", told_of[key]
        if (key in tree.get(ATTRIBUTES, ()) and not isinstance(value, list)) or (
            isinstance(value, list)
            and (_plain(key) in UNITS or (all(isinstance(one, str) for one in value) and value in names))
        ):
            continue
        if isinstance(value, dict):
            yield from _annotations(value, f"{place}.", mine)
        for text in _texts_of(value):
            yield Annotation(f'"{place}"', " ".join(f"{key if mine else place} = {text}".split()), mine)


def _told_of(tree: Mapping[str, Any], prefix: str, of: str) -> dict[str, str]:
    """Place of the one vector of which each member of a node tells; empty where there is none, or are several."""
    vectors = [key for key in tree if _is_vector(tree[key])]
    alone = f"{prefix}{vectors[0]}" if len(vectors) == 1 and prefix else ""
    owners = {name: f"{prefix}{key}" for name, (key, _) in _owners(tree).items()}
    return {key: owners.get(key, of or ("" if isinstance(tree[key], dict) else alone)) for key in tree}


def _texts_of(value: Any) -> list[str]:
    """A text, the texts of a list, each once, or a single number; none of anything else."""
    if isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "iuf":
        return [f"{np.ravel(value)[0]:.12g}"]
    texts = value if isinstance(value, list) else [value]
    return [text for text in dict.fromkeys(one for one in texts if isinstance(one, str)) if text][:HEADER_DEPTH]


def _said_of(annotations: Iterable[Annotation], placed: Sequence[tuple[str, RawColumn]]) -> list[Annotation]:
    """Annotations with the heading of the column in place of its name in the file.

    Of a matrix, and of a table of fields, all columns may be meant.
    """
    headers: dict[str, list[str]] = {}
    for place, column in placed:
        whole, _, field = place.partition("(:")[0].rpartition(".")
        for name in filter(None, (whole, f"{whole}.{field}".strip("."))):
            headers.setdefault(name, []).append(column.header)
    said = [(one, headers.get(one.of)) for one in annotations]
    return [one if mine is None else replace(one, of=mine[0] if len(mine) == 1 else "") for one, mine in said]


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


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.size > 1


def _is_matrix(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 2


def _columns(tree: Mapping[str, Any], prefix: str) -> Iterator[tuple[str, RawColumn]]:
    """Vectors below a node with their places, with names and units from their neighbours."""
    by_key = {_plain(key): value for key, value in tree.items()}
    given = next((by_key[key] for key in UNITS if key in by_key), None)
    given = None if isinstance(given, str) and units.expression(given) is None else given
    if prefix and ATTRIBUTES not in tree and isinstance(given, list):  # of a structure, which keeps its fields in order
        sizes = [value.size for value in tree.values() if _is_vector(value)]
        vectors = [key for key in tree if _is_vector(tree[key]) and tree[key].size == max(sizes)]
        given = dict(zip(vectors, given, strict=True)) if len(vectors) == len(given) else given
    told: dict[str, dict[str, Any]] = {}
    for name, (key, word) in _owners(tree).items():
        told.setdefault(key, {}).update(tree[name] if isinstance(tree[name], dict) else {word: tree[name]})
    for key, value in tree.items():
        place = f"{prefix}{key}"
        if isinstance(value, dict):
            yield from _columns(value, f"{place}.")
        elif _is_vector(value):
            yield place, _vector(tree, prefix, key, given, told.get(key, {}))
        elif _is_matrix(value):
            units_of = _unit_of(given, key) if isinstance(given, dict) else given
            yield from _matrix(place, value, _names_beside(tree, key, min(value.shape)), units_of)


def _vector(tree: Mapping[str, Any], prefix: str, key: str, given: Any, told: Mapping[str, Any]) -> RawColumn:
    """A vector of a node with what is told of it: by texts and structures called as it is, or by fields beside it."""
    bare = bool(prefix) and key.casefold() in _BARE
    name = (_text_of(tree, _TITLES) or prefix.rstrip(".")) if bare else _stem(key) and _text_of(told, _TITLES)
    unit = given if isinstance(given, str) and not _is_other(key, given) else _unit_of(given, key)
    stated = [unit, _text_of(told, UNITS)]
    unit = next((_SINCE.sub("", one) for one in stated if one), None)
    column = _column(name or f"{prefix}{key}", unit, tree[key])
    single = {name: value for name, value in told.items() if not isinstance(value, dict)}
    worth = stated_worth(single | _beside(tree, "" if bare else key), tree[key])
    twice = contradicted([*stated, _named(column.header)[1], *tree.get(STATED, {}).get(key, ())])
    return replace(column, worth=tree.get(WORTH, {}).get(key, "") or worth, contradicted=twice)


def _owners(tree: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Texts and structures that are called as a vector beside them is, with that vector and their last word.

    Such as ``force_unit`` of ``force``, and ``Channel_1_Header`` of ``Channel_1_Data``.
    """
    known = {key.casefold(): key for key in tree}
    found: dict[str, tuple[str, str]] = {}
    for key in (key for key, value in tree.items() if _is_vector(value)):
        stem = _stem(key)
        starts = [(key.casefold(), (*_ABOUT, *UNITS)), *([(stem, (*_ABOUT, *UNITS, *_TITLES))] if stem else [])]
        for start, words in starts:
            for sign, word in product(_SIGNS, words):
                name = known.get(f"{start}{sign}{word}", key)
                if isinstance(tree[name], dict if word in _ABOUT else str):
                    found.setdefault(name, (key, word))
    return found


def _stem(key: str) -> str:
    """What stands before a last word that says nothing, in small letters: `channel_1` of `Channel_1_Data`."""
    name = key.casefold()
    return next((name.removesuffix(word).rstrip("_. ") for word in _BARE if name.endswith(word)), "")


def _plain(key: str) -> str:
    return key.casefold().replace("_", "")


def _text_of(said: Mapping[str, Any], words: Sequence[str]) -> str:
    """The first text that has one of some names."""
    by_key = {_plain(key): value.strip() for key, value in said.items() if isinstance(value, str)}
    return next((by_key[word] for word in words if by_key.get(word)), "")


def _is_other(key: str, unit: str) -> bool:
    """Whether the unit of a structure is not that of a vector in it: of the times beside the data."""
    return score(key, "time") > 0 and units.kind_of(unit) not in (None, "time")


def _beside(tree: Mapping[str, Any], name: str) -> dict[str, Any]:
    """Single numbers of a structure that begin with the same word as a vector; all of them where it has no name."""
    single = {key: value for key, value in tree.items() if isinstance(value, np.ndarray) and value.size == 1}
    return {key: value for key, value in single.items() if not name or tokens(key)[:1] == tokens(name)[:1] != []}


def _unit_of(given: Any, key: str) -> str | None:
    if isinstance(given, dict):
        unit = given.get(key)
        return unit if isinstance(unit, str) else None
    return None


def _names_beside(tree: Mapping[str, Any], key: str, count: int) -> list[str]:
    """Names of the columns of a matrix: a list of as many texts beside it; empty where there is none, or several.

    One that is called a list of names comes before others, and one that is called as the matrix is before all others:
    ``block0_items`` of ``block0_values``.
    """
    lists = {_plain(name): [str(text) for text in value] for name, value in tree.items() if isinstance(value, list)}
    lists = {name: texts for name, texts in lists.items() if len(texts) == count}
    called = next((lists[name] for name in _NAMES if name in lists), [])
    if called:
        return called
    others = {*UNITS, *map(_plain, tree.get(ATTRIBUTES, ()))}
    names = {name: texts for name, texts in lists.items() if name not in others and _are_names(texts)}
    stem = _plain(_stem(key))
    near = {name: texts for name, texts in names.items() if stem and name.startswith(stem)} or names
    found = list(near.values())
    return found[0] if found and all(texts == found[0] for texts in found) else []


def _are_names(texts: Sequence[str]) -> bool:
    """Whether texts name columns: they differ, some name a quantity or tell a unit, and they are not units alone."""
    named = any(kinds_named(name) or unit for name, unit in map(_named, texts))
    return named and len(set(texts)) == len(texts) and any(units.expression(text) is None for text in texts)


def _matrix(place: str, value: np.ndarray, names: Sequence[str], given: Any) -> Iterator[tuple[str, RawColumn]]:
    """Columns of a matrix; one that is wider than long is lying on its side."""
    table = value if value.shape[0] >= value.shape[1] else value.T
    count = table.shape[1]
    places = [f"{place}(:,{i + 1})" for i in range(count)]
    listed = list(given) if isinstance(given, list) and len(given) == count else [None] * count
    for i, title in enumerate(names or places):
        unit = given if isinstance(given, str) and not _is_other(title, given) else listed[i]
        yield places[i], _column(title, unit if isinstance(unit, str) else None, table[:, i])


def _column(header: str, unit: str | None, values: np.ndarray) -> RawColumn:
    name, found = _named(header)
    return binary_column(header, name, unit or found, values)


def _named(header: str) -> tuple[str, str | None]:
    """Name and unit of a vector, by its own name."""
    header, sign, place = header.rpartition("(:,")  # which column of a matrix
    header, behind = (header, sign + place) if sign else (place, "")
    name, found = split_heading(header.rpartition(".")[2] if "." in header else header)
    if found is None and units.expression(name.rpartition("_")[2] or "?") is not None and "_" in name:
        name, _, found = name.rpartition("_")
    return name + behind, found


def _facts(tree: Mapping[str, Any], left: Collection[str]) -> Facts:
    """Rate from a scalar `fs` or `dt`, in SI as MATLAB users keep them, that is not of a vector that is left out."""
    found = [(key, f"{key} = {value}", unit) for key, value, unit in _scalars(tree, left)]
    hints = [
        f"{line} {unit}"
        for key, line, said in found
        if tokens(key)[-1:] != ["samples"]
        for unit in ((said,) if said else ("Hz", "s"))
    ]
    return find_facts(hints)


def _scalars(
    tree: Mapping[str, Any], left: Collection[str], prefix: str = "", of: str = ""
) -> Iterator[tuple[str, float, str]]:
    """Single numbers with their names and the units that are stated of them, beside them or in the name."""
    given = next((value for key, value in tree.items() if key.casefold() in UNITS), None)
    told_of = _told_of(tree, prefix, of)
    for key, value in ((key, value) for key, value in tree.items() if told_of[key] not in left):
        number, unit = _amount(value)
        if isinstance(value, dict):
            yield from _scalars(value, left, f"{prefix}{key}.", told_of[key])
        elif number is not None:
            words = key.casefold().split("_") if "_" in key else tokens(key)  # tokens would part kHz
            beside = next(
                (tree[name] for name in (f"{key}_unit", f"{key}_units", f"{key[:1]}_unit") if name in tree), None
            )
            named = words[-1] if len(words) > 1 and words[-1] in _IN_NAMES else ""
            yield key, number, unit or (beside if isinstance(beside, str) else _unit_of(given, key) or named)


def _amount(value: Any) -> tuple[float | None, str]:
    """A single number, which may be written as a text with a unit behind it; None for anything else."""
    if isinstance(value, np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf":
        return float(value), ""
    match = _AMOUNT.fullmatch(value) if isinstance(value, str) else None
    return (None, "") if match is None else (float(match[1]), match[2] or "")
