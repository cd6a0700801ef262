"""Columns of files that hold arrays by name: MATLAB, HDF5 and NumPy."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import islice, product
from typing import Any

import numpy as np

from fibrefit.core import units
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn, binary_column
from fibrefit.records.files.arrays.titles import (
    ATTRIBUTES,
    BARE,
    STATED,
    TITLED,
    UNIT_KEYS,
    WORTH,
    listed_texts,
    named,
    notes_in,
    plain,
    stem,
    titles_near,
    told_apart,
)
from fibrefit.records.files.arrays.values import deep_arrays, stamp_column, without_unfilled
from fibrefit.records.files.extras import factors_among, with_stated_units
from fibrefit.records.grammar.facts import Facts, find_facts
from fibrefit.records.grammar.headings import PLAIN_KINDS
from fibrefit.records.grammar.phrases import Aside, count
from fibrefit.records.grammar.words import kinds_named, score, tokens
from fibrefit.records.grammar.worth import contradicted, stated_worth
from fibrefit.records.thresholds import FEWEST_ROWS, HEADER_DEPTH

#: What netCDF writes behind the unit of times.
_SINCE = re.compile(r"\s+since\s.*", re.DOTALL)
#: Units that end the name of a rate or a step: `fs_kHz`.
_IN_NAMES = ("s", "ms", "us", "ns", "hz", "khz")
#: Last words of what tells of a vector beside it.
_TITLES = ("name", "label", "title", "signalname", "channelname")
_ABOUT = ("header", "info", "properties", "attributes", "meta", "metadata")
#: Between such a word and what stands before it: ``Channel_1_Header``, ``forceUnit``.
_SIGNS = ("_", "", ".", " ")
#: Names of a number that tells the size of the array beside it.
_SIZES = ("dimensions", "dims", "size", "length", "npoints", "numpoints")
#: Members that are shown of those that are left out.
_MOST_SHOWN = 6
#: A rate or a step that is written as a text.
_AMOUNT = re.compile(r"\s*([+-]?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?)\s*([kM]?Hz|[mun]?s)?\s*")


def columns_of_tree(tree: dict[str, Any], said: Sequence[Annotation], where: str, wanted: Collection[str]) -> Raw:
    """Columns of a file that holds arrays by name, in structures or groups.

    Vectors of equal length are columns, named by their variable (``force_N``), by a field of their structure, or by
    one of the structure beside them (``Channel_1_Header`` of ``Channel_1_Data``); the columns of a matrix are named by
    a list of as many names beside it, or around. Units come from a suffix of the name, or from a field ``unit`` or
    ``units`` beside the array. A scalar ``fs`` in Hz or ``dt`` in s tells the rate.

    Parameters
    ----------
    tree : dict
        Arrays, texts, lists of texts, and such trees, by name.
    said : sequence of Annotation
        What attributes say.
    where : str
        File to name in messages.
    wanted : collection of str
        Headings the user named; any column can be named by its place: ``"rec.force"``, ``"data(:,2)"``.

    Returns
    -------
    Raw
        Columns of the length most vectors have.

    Raises
    ------
    DataError
        If it holds no two vectors of one length.
    """
    annotations = [*said, *_annotations(tree, list(_titles_used([tree])))]
    # A user may call a column by its name in the file, whatever is told beside it of its name.
    placed = told_apart(list(_columns([tree], "")))
    placed = [(at, replace(column, header=at) if at in wanted else column) for at, column in placed]
    annotations = _said_of(annotations, placed)
    found = with_stated_units([column for _, column in placed], annotations)
    sizes = [column.numbers.values.size for column in found]
    long = [size for size in sizes if size >= FEWEST_ROWS]
    if not long:
        raise _no_vectors(tree, where)
    timed = [c.numbers.values.size for c in found if score(c.name, "time") > 0 and c.numbers.values.size in long]
    named_sizes = [c.numbers.values.size for c in found if c.header in wanted]
    size = (named_sizes or timed or [max(sorted(set(long)), key=long.count)])[0]
    columns = [column for column in found if column.numbers.values.size == size]
    left = [place for place, column in placed if column.numbers.values.size not in (1, size)]
    others = [column for column in found if column.numbers.values.size not in (1, size)]
    if not named_sizes:
        _refuse_other_rates(columns, others, where)
    columns = without_unfilled(columns)
    rows = columns[0].numbers.values.size
    return Raw(
        columns,
        _facts(tree, left),
        np.arange(1, rows + 1),
        layout={"rows": rows},
        notes=_left_out(tree, others, size - rows),
        annotations=[*annotations, *factors_among(others, len(columns))],
    )


def _left_out(tree: Mapping[str, Any], others: Sequence[RawColumn], unfilled: int) -> list[str]:
    """Sentences on what a file holds beside the columns that are read."""
    notes: list[str] = []
    if aside := [column.header for column in others]:
        notes.append(Aside(f"Vectors of another length are left out: {', '.join(aside[:_MOST_SHOWN])}."))
    if deep := deep_arrays(tree):
        notes.append(Aside(f"Arrays of more than two dimensions are left out: {', '.join(deep[:_MOST_SHOWN])}."))
    if unfilled:
        empty = f"The last {count(unfilled, 'row')} were never filled, and are left out: all is zero, the times too."
        notes.append(Aside(empty))
    return notes


def _no_vectors(tree: dict[str, Any], where: str) -> DataError:
    """Refusal of a file without vectors by what it holds."""
    deep = deep_arrays(tree)
    got = f"no vectors of numbers{f', but {deep[0]}' if deep else ''}"
    do = "Save the channels as vectors."
    if deep:
        do = "Save each recording to a file of its own, as vectors or as a matrix of samples by channels."
    return DataError(where, got, "a vector for each channel", do)


def _refuse_other_rates(columns: Sequence[RawColumn], others: Sequence[RawColumn], where: str) -> None:
    """Refuse vectors of another length that are called as a channel is which none of those kept is called."""
    lengths = f'vectors of different lengths ("{columns[0].header}": {columns[0].numbers.values.size}, '
    for role in ("force", "position", "angle"):
        lost = next((c for c in others if score(c.name, role) > 2 and c.numbers.values.size > 2), None)
        if lost is None or any(score(c.name, role) > 2 for c in columns):
            continue
        do = (
            f"Save them at one rate, or name the channels of one length that are meant under [channels]; the {role} is "
        )
        got = f'{lengths}"{lost.header}": {lost.numbers.values.size})'
        raise DataError(where, got, "one length", f"{do}then left out.")
    lost = next((column for column in others if column.numbers.values.size >= FEWEST_ROWS), None)
    if lost is not None and all(score(column.name, "time") > 0 for column in columns):
        do = "Save a time for each sample; or name the channels under [channels], and give the sampling rate."
        got = f'{lengths}"{lost.header}": {lost.numbers.values.size})'
        raise DataError(where, got, "a time for each sample", do)


def _annotations(
    tree: Mapping[str, Any], used: Sequence[list[str]], prefix: str = "", of: str = ""
) -> Iterator[Annotation]:
    """Texts and single numbers among variables and fields; those that tell of one vector alone are said of it.

    What attributes of HDF5 say but for lists of texts is told by them, names and units of columns of a matrix by these.
    """
    told_of = _told_of(tree, prefix, of)
    for key, value in tree.items():
        place, mine = f"{prefix}{key}", told_of[key]
        texts = listed_texts(key, value)
        if (key in tree.get(ATTRIBUTES, ()) and not isinstance(value, list)) or (
            texts and (plain(key) in UNIT_KEYS or texts in used)
        ):
            continue
        if plain(key) in _SIZES and _number(value) in _shapes(tree):
            continue
        if isinstance(value, dict):
            yield from _annotations(value, used, f"{place}.", mine)
        for text in _texts_of(value):
            yield Annotation(f'"{place}"', " ".join(f"{key if mine else place} = {text}".split()), mine)


def _shapes(tree: Mapping[str, Any]) -> set[int]:
    """Sizes of the arrays of a node along all their sides."""
    return {size for value in tree.values() if isinstance(value, np.ndarray) for size in value.shape}


def _told_of(tree: Mapping[str, Any], prefix: str, of: str) -> dict[str, str]:
    """Place of the one vector of which each member of a node tells; empty where there is none, or are several."""
    vectors = [key for key in tree if _is_vector(tree[key])]
    alone = f"{prefix}{vectors[0]}" if len(vectors) == 1 and prefix else ""
    owners = {name: f"{prefix}{key}" for name, (key, _) in _owners(tree).items()}
    return {key: owners.get(key, of or ("" if isinstance(tree[key], dict) else alone)) for key in tree}


def _number(value: Any) -> float | None:
    single = isinstance(value, np.ndarray) and value.size == 1 and value.dtype.kind in "iuf"
    return float(np.ravel(value)[0]) if single else None


def _texts_of(value: Any) -> list[str]:
    """A text, the texts of a list, each once, or a single number; none of anything else."""
    number = _number(value)
    if number is not None:
        return [f"{number:.12g}"]
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


def _is_vector(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 1 and value.size > 1


def _is_matrix(value: Any) -> bool:
    return isinstance(value, np.ndarray) and value.ndim == 2


def _titles_used(around: Sequence[Mapping[str, Any]]) -> Iterator[list[str]]:
    """Lists of texts that name the columns of a matrix at or below a node."""
    for key, value in around[0].items():
        if isinstance(value, dict):
            yield from _titles_used([value, *around])
        elif _is_matrix(value):
            yield titles_near(around, key, min(value.shape))[0]


def _columns(around: Sequence[Mapping[str, Any]], prefix: str) -> Iterator[tuple[str, RawColumn]]:
    """Vectors below a node, which stands before those around it, with their places, names and units."""
    tree = around[0]
    by_key = {plain(key): value for key, value in tree.items()}
    given = next((by_key[key] for key in UNIT_KEYS if key in by_key), None)
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
            yield from _columns([value, *around], f"{place}.")
        elif _is_vector(value):
            column = _vector(around, prefix, key, given, told.get(key, {}))
            yield from ((place, column),) if column is not None else ()
        elif _is_matrix(value):
            names, listed = titles_near(around, key, min(value.shape))
            units_of = _unit_of(given, key) if isinstance(given, dict) else given
            yield from _matrix(place, value, names, units_of or listed)


def _vector(
    around: Sequence[Mapping[str, Any]], prefix: str, key: str, given: Any, told: Mapping[str, Any]
) -> RawColumn | None:
    """A vector of a node with what is told of it: by texts and structures called as it is, or by fields beside it."""
    tree = around[0]
    bare = bool(prefix) and key.casefold() in BARE
    name = _bare_name(around, prefix) if bare else stem(key) and _text_of(told, _TITLES)
    header = name or tree.get(TITLED, {}).get(key) or f"{prefix}{key}"
    if tree[key].dtype.kind == "M":
        return stamp_column(header, named(header)[0], tree[key])
    unit = given if isinstance(given, str) and not _is_other(key, given) else _unit_of(given, key)
    stated = [unit, _text_of(told, UNIT_KEYS), *(_unit_in_notes(tree) if bare else ())]
    unit = next((_SINCE.sub("", one) for one in stated if one), None)
    column = _column(header, unit, tree[key])
    single = {name: value for name, value in told.items() if not isinstance(value, dict)}
    worth = stated_worth(single | _beside(tree, "" if bare else key), tree[key])
    twice = contradicted([*stated, named(column.header)[1], *tree.get(STATED, {}).get(key, ())])
    return replace(column, worth=tree.get(WORTH, {}).get(key, "") or worth, contradicted=twice)


def _bare_name(around: Sequence[Mapping[str, Any]], prefix: str) -> str:
    """What a vector is called whose own name says nothing: by its node, or by the note beside that."""
    own = _text_of(around[0], _TITLES)
    if own or kinds_named(prefix.rstrip(".").rpartition(".")[2]) or len(around) < 2:
        return own or prefix.rstrip(".")
    inside = (value for value in around[1].values() if isinstance(value, dict))
    nodes = list(islice((value for value in inside if any(map(_is_vector, value.values()))), 2))
    if len(nodes) > 1:  # at the second: a file may have thousands
        return prefix.rstrip(".")
    told = [text for note in notes_in(around[1]) if (text := _text_of(note, _TITLES))]
    return told[0] if len(told) == 1 else prefix.rstrip(".")


def _unit_in_notes(tree: Mapping[str, Any]) -> list[str]:
    """Units that notes in the node of one vector state: ``quantity.label``."""
    found = [_text_of(note, UNIT_KEYS) or _text_of(note, _TITLES) for note in notes_in(tree)]
    return [unit for unit in found if units.kind_of(unit) in PLAIN_KINDS]


def _owners(tree: Mapping[str, Any]) -> dict[str, tuple[str, str]]:
    """Texts and structures that are called as a vector beside them is, with that vector and their last word.

    Such as ``force_unit`` of ``force``, and ``Channel_1_Header`` of ``Channel_1_Data``.
    """
    known = {key.casefold(): key for key in tree}
    found: dict[str, tuple[str, str]] = {}
    for key in (key for key, value in tree.items() if _is_vector(value)):
        short = stem(key)
        starts: list[tuple[str, tuple[str, ...]]] = [(key.casefold(), (*_ABOUT, *UNIT_KEYS))]
        starts += [(short, (*_ABOUT, *UNIT_KEYS, *_TITLES))] if short else []
        for start, words in starts:
            for sign, word in product(_SIGNS, words):
                name = known.get(f"{start}{sign}{word}", key)
                if isinstance(tree[name], dict if word in _ABOUT else str):
                    found.setdefault(name, (key, word))
    return found


def _text_of(said: Mapping[str, Any], words: Sequence[str]) -> str:
    """The first text that has one of some names."""
    by_key = {plain(key): value.strip() for key, value in said.items() if isinstance(value, str)}
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
    name, found = named(header)
    return binary_column(header, name, unit or found, values)


def _facts(tree: Mapping[str, Any], left: Collection[str]) -> Facts:
    """Rate from a scalar `fs` or `dt`, in SI as MATLAB users keep them, that is not of a vector that is left out."""
    found = [(f"{key} = {value}", unit) for key, value, unit in _scalars(tree, left) if tokens(key)[-1:] != ["samples"]]
    hints = {line: [f"{line} {unit}" for unit in ((said,) if said else ("Hz", "s"))] for line, said in found}
    tell = {line: [hint for hint in tried if find_facts([hint]).rates] for line, tried in hints.items()}
    # Beside a rate no other number is given a unit that it has not: it may be one of points.
    return find_facts(one for line in hints for one in ((tell[line] or [line]) if any(tell.values()) else hints[line]))


def _scalars(
    tree: Mapping[str, Any], left: Collection[str], prefix: str = "", of: str = ""
) -> Iterator[tuple[str, float, str]]:
    """Single numbers with their names and the units that are stated of them, beside them or in the name."""
    given = next((value for key, value in tree.items() if key.casefold() in UNIT_KEYS), None)
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
