"""Content of HDF5 files, MATLAB 7.3 among them: counted, then read, and what attributes say beside it."""

from __future__ import annotations

import contextlib
import pickletools
import re
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.columns.raw import Annotation
from fibrefit.records.files.arrays.titles import (
    ATTRIBUTES,
    NAME_KEYS,
    STATED,
    TITLED,
    UNIT_KEYS,
    WORTH,
    listed_texts,
    place_beside,
    plain,
)
from fibrefit.records.files.arrays.values import complex_numbers, items_as_one, stamps_in
from fibrefit.records.files.extras import json_object, stated_in
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.words import kinds_named
from fibrefit.records.grammar.worth import shown_list, stated_worth
from fibrefit.records.thresholds import FEWEST_ROWS, HEADER_DEPTH

_UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units", "UNIT", "UNITS", "unit_string", "Einheit", "y_unit")
#: What netCDF packs numbers with; the last one tells which of them stands for none.
_PACKED = ("scale_factor", "add_offset", "_FillValue")
#: Longer names of arrays, which may have a unit behind them.
_TITLE_ATTRIBUTES = (
    "name",
    "label",
    "title",
    "long_name",
    "channel_name",
    "signal_name",
    "NAME",
    "Name",
    "Label",
    "TITLE",
)
#: A rate or a step in words.
_RATE_IN_WORDS = re.compile(r"\s*\d[\d.eE+-]*\s*(?:[kM]?Hz|[mun]?s)\s*")
#: Parts of a complex number as MATLAB names them.
_COMPLEX = ("real", "imag")
#: Bytes that a stamp takes in memory besides its letters.
_STAMP = 64
#: Bytes each item of an HDF5 file counts at least.
_ITEM = 1 << 14


def load_hdf5(path: Path, allowed: Allowance) -> tuple[dict[str, Any], list[Annotation], list[str], list[str]]:
    """Content of an HDF5 file, what its attributes say, notes on what was unpacked, and what is left out in words.

    Parameters
    ----------
    path : Path
    allowed : Allowance
        What it may take, counted before any of it is read: many arrays can be too much where each of them is not.
    """
    import h5py  # a tenth of a second: only for version 7.3

    with h5py.File(path, "r", locking=False) as file:
        _Hdf5(file, replace(allowed), reads=False).group(file)
        reader = _Hdf5(file, allowed)
        tree = reader.group(file)
        left = [f"Arrays of words are left out: {', '.join(reader.words[:6])}."] if reader.words else []
        return tree, reader.annotations, [*reader.unpacked, *left], reader.left_out


@dataclass(frozen=True)
class _Hdf5:
    """Content of an HDF5 file, counted before it is read: a name costs nothing, and links can lead round for ever.

    Parameters
    ----------
    file : h5py.File
    allowed : Allowance
    reads : bool
        Whether numbers are read; otherwise they are only counted.
    annotations : list of Annotation
        Filled with what attributes say, as the groups are read.
    words : list of str
        Filled with the names of arrays of words that are left out.
    unpacked : list of str
        Filled with sentences on arrays whose numbers were packed.
    left_out : list of str
        Filled with what is an object of MATLAB, or holds complex numbers.
    seen : set of int
        Where arrays lie in the file that have been read: what has two names is one.
    """

    file: Any
    allowed: Allowance
    reads: bool = True
    annotations: list[Annotation] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    unpacked: list[str] = field(default_factory=list)
    left_out: list[str] = field(default_factory=list)
    seen: set[int] = field(default_factory=set)

    def group(self, group: Any) -> dict[str, Any]:
        """Content of a group; what its attributes say stands beside it, under the names MATLAB users give to fields."""
        if (fields := _fields_of_structures(group)) is not None:
            items = {name: [self.item(self.file[reference]) for reference in found] for name, found in fields.items()}
            found = items_as_one(
                [dict(zip(items, values, strict=True)) for values in zip(*items.values(), strict=True)]
            )
            return found if isinstance(found, dict) else {}
        tree = _said(group)
        attributes = tree[ATTRIBUTES] = {*tree, WORTH, STATED, TITLED}
        self._tell(group.attrs, within=group.name.strip("/"))
        units_of = {}
        for name in group:
            if name.startswith("#"):
                continue
            item = self._own(group, name)
            if self._is_read(item):
                continue
            tree[name] = self.item(item)
            attributes.discard(name)
            stated = _units_stated(item)
            if stated:
                units_of[name] = stated[0]
                tree.setdefault(STATED, {})[name] = stated
            if hasattr(item, "items"):
                continue
            self._tell_of_numbers(item, tree, name)
            if title := _title_of(item, name):
                tree.setdefault(TITLED, {})[name] = title
            for key, value in _said(item).items():
                if isinstance(value, str) and plain(key) in UNIT_KEYS:
                    continue
                if (place := place_beside(tree, key, value)) is not None:
                    tree[place] = value
                    attributes.add(place)
        given = units_of or (_units_stated(group) or [""])[0]
        if given and not any(plain(key) in UNIT_KEYS for key in tree):
            tree["units"] = given
            attributes.add("units")
        return tree

    def _is_read(self, item: Any) -> bool:
        """Whether an array has been read under another name: links of NeXus lead to what an instrument holds."""
        import h5py

        if hasattr(item, "items"):
            return False
        place = h5py.h5o.get_info(item.id).addr
        known = place in self.seen
        self.seen.add(place)
        return known

    def _tell_of_numbers(self, item: Any, tree: dict[str, Any], name: str) -> None:
        """Keep what the attributes of an array say of its numbers, but for what was applied to them."""
        packing = _packing(item)
        own = {key: value for key, value in item.attrs.items() if key not in packing}
        self._tell(own, item.name.strip("/").replace("/", "."))
        found = tree[name]
        if isinstance(found, np.ndarray):
            tree.setdefault(WORTH, {})[name] = stated_worth(own, found)
            changed = [f"{key} = {packing.get(key, idle):g}" for key, idle in zip(_PACKED, (1.0, 0.0), strict=False)]
            if packing.get(_PACKED[0], 1.0) != 1.0 or packing.get(_PACKED[1], 0.0) != 0.0:
                self.unpacked.append(f'The numbers of "{name}" are unpacked: {", ".join(changed)}.')
        elif isinstance(found, dict) and item.dtype.names:
            whole = {key: stated_worth(own, value) for key, value in found.items() if value.dtype.kind in "iub"}
            if units_of := _units_of_fields(item):
                found["units"] = units_of
            names = {f"{key}_items": texts for key in found if (texts := _texts_pickled(item.attrs.get(f"{key}_kind")))}
            found |= {WORTH: whole, **names}
            found[ATTRIBUTES] = {"units", WORTH}

    def _tell(self, attributes: Any, of: str = "", within: str = "") -> None:
        """Keep the attributes of a group, or of one array, that are words, numbers, or short lists of these."""
        for key, value in attributes.items() if self.reads else ():
            array = np.asarray(value)
            single = array.size == 1 and array.dtype.kind in "OSUiufb"
            listed = 1 < array.size <= HEADER_DEPTH and array.dtype.kind in "iufb"
            if (single or listed) and not key.startswith("MATLAB"):
                place = f'attribute "{key}" of "{of}"' if of else f'attribute "{key}"'
                said = _text(array.ravel()[0]) if single else shown_list(array)
                for path, text in stated_in(key, said):
                    self.annotations.append(Annotation(place, " ".join(f"{within} {path} = {text}".split()), of))

    def _own(self, group: Any, name: str) -> Any:
        """What stands in the file itself: of another one, which may change or be anybody's, no digest is kept."""
        link = group.get(name, getlink=True)
        if elsewhere := getattr(link, "filename", ""):
            raise self._refusal(name, elsewhere)
        item = group[name]
        others = [] if hasattr(item, "items") else [file for file, *_ in item.external or ()]
        if not hasattr(item, "items") and item.is_virtual:
            others += [source.file_name for source in item.virtual_sources() if source.file_name != "."]
        if others:
            raise self._refusal(name, others[0])
        return item

    def _refusal(self, name: str, elsewhere: str) -> DataError:
        got = f'"{name}" is kept in another file, "{elsewhere}"'
        return DataError(self.allowed.where, got, "one file with all that was measured", "Copy it into one file.")

    def item(self, item: Any) -> Any:
        """The same for all else: texts of MATLAB are arrays of codes, and lists arrays of references."""
        self.allowed.take(_ITEM)
        if hasattr(item, "items"):
            return self.group(item)
        kind = _class_of(item)
        if item.attrs.get("MATLAB_empty", 0) or item.shape is None:
            return None
        if "MATLAB_object_decode" in item.attrs:
            self.left_out.append(object_of_matlab(item.name.strip("/"), "", kind))
            return None
        self.allowed.take(item.size * item.dtype.itemsize)
        holds = _held(item.dtype)
        if holds == "texts":
            return self._texts(item)
        if item.dtype.kind == "c" or item.dtype.names == _COMPLEX:
            self.left_out.append(complex_numbers(item.name.strip("/").replace("/", ".")))
            return None
        if not self.reads and holds != "references":
            return None
        array = np.asarray(item[()])
        if kind == "char":
            return "".join(map(chr, array.ravel(order="F")))
        if holds == "references":
            return items_as_one([self.item(self.file[reference]) for reference in array.ravel(order="F")])
        if array.dtype.names:
            return self._fields(item, array)
        if array.dtype.kind not in "biuf":
            return None
        array = _unpacked(array, _packing(item))
        # MATLAB stores columns first: a matrix comes out transposed.
        return np.squeeze(array.T if kind else array)

    def _fields(self, item: Any, array: np.ndarray) -> dict[str, Any]:
        """Fields of a table: numbers, and texts that are stamps."""
        packing, found = _packing(item), {}
        for name in array.dtype.names or ():
            values = array[name]
            if values.dtype.kind in "biuf":
                found[name] = _unpacked(values, packing)
            elif values.ndim == 1 and values.dtype.kind in "SO":
                stamps = stamps_in([_text(one) for one in values], f'{self.allowed.where}, "{name}"')
                found |= {} if stamps is None else {name: stamps}
        return found

    def _texts(self, item: Any) -> Any:
        """One text, a list of them, or stamps; what is longer than any list of names is a column of words."""
        found, first = item.asstr(errors="replace"), ""
        if item.ndim == 1 and item.size:
            first = str(found[0])
        if item.ndim == 1 and stamps_in([first] * FEWEST_ROWS, self.allowed.where) is not None:
            self.allowed.take(item.size * (_STAMP + len(first)))
            stamps = stamps_in([str(one) for one in found[()]], f"{self.allowed.where}, {item.name}")
            if stamps is not None:
                return stamps if self.reads else None
        if item.size > HEADER_DEPTH:
            self.words.append(item.name.strip("/").replace("/", "."))
            return None
        texts = []
        for place in np.ndindex(item.shape):
            texts.append(str(found[place]).strip())  # one by one: what they refer to may be the same, and long
            self.allowed.take(len(texts[-1]))
        return texts[0] if len(texts) == 1 else texts


def object_of_matlab(name: str, _system: str, kind: str) -> str:
    """What an object of MATLAB is, in words.

    Parameters
    ----------
    name : str
        Of its variable.
    kind : str
        Its class.
    """
    return f'"{name}" is an object of MATLAB ({kind}), which only MATLAB reads'


def _fields_of_structures(group: Any) -> dict[str, Any] | None:
    """References of the fields of an array of structures, as MATLAB 7.3 keeps it; None where a group is none.

    Cells are references too, and are said to be cells.
    """
    items = [group[name] for name in group]
    if not items or _class_of(group) != "struct" or any(hasattr(item, "items") for item in items):
        return None
    if any(_held(item.dtype) != "references" or _class_of(item) for item in items) or len({i.size for i in items}) > 1:
        return None
    return {name: group[name][()].ravel(order="F") for name in group}


def _class_of(item: Any) -> str:
    said = item.attrs.get("MATLAB_class", b"")
    return said.decode() if isinstance(said, bytes) else ""


def _units_stated(item: Any) -> list[str]:
    """Units that attributes state, or else the one in brackets behind a longer name."""
    stated = [_text(item.attrs[key]) for key in _UNIT_ATTRIBUTES if key in item.attrs]
    stated = [unit for unit in stated if unit] if stated and stated[0] else []
    titles = [_text(item.attrs[key]) for key in _TITLE_ATTRIBUTES if key in item.attrs]
    return stated or [unit for title in titles if (unit := split_heading(title)[1])]


def _title_of(item: Any, name: str) -> str:
    """What an attribute calls an array whose own name names no quantity; empty where it does, or none is there."""
    titles = [_text(item.attrs[key]) for key in _TITLE_ATTRIBUTES if key in item.attrs]
    told = (title for title in titles if kinds_named(split_heading(title)[0]))
    return "" if kinds_named(split_heading(name)[0]) else next(told, "")


def _units_of_fields(item: Any) -> dict[str, str]:
    """Units of the fields of a table: of a list of as many, or each in an attribute called as its field is."""
    names, said = item.dtype.names, _said(item)
    listed = next((value for key, value in said.items() if plain(key) in UNIT_KEYS), ())
    if isinstance(listed, list) and len(listed) == len(names):
        return dict(zip(names, listed, strict=True))
    keys = {
        name: (f"{name}_unit", f"{name}_units", f"FIELD_{i}_UNITS", f"FIELD_{i}_UNIT") for i, name in enumerate(names)
    }
    found = {name: next((item.attrs[key] for key in of if key in item.attrs), "") for name, of in keys.items()}
    return {name: _text(unit) for name, unit in found.items() if isinstance(unit, str | bytes) and unit}


def _texts_pickled(said: Any) -> list[str]:
    """Texts of a list that Pandas pickles into an attribute; what is pickled is gone through, and never run."""
    if not isinstance(said, bytes):
        return []
    with contextlib.suppress(ValueError):
        return [arg for code, arg, _ in pickletools.genops(said) if isinstance(arg, str) and "UNICODE" in code.name]
    return []


def _held(dtype: Any) -> str:
    """What an array holds that are no numbers: texts, or references to other items; else nothing."""
    import h5py

    if h5py.check_string_dtype(dtype) is not None:
        return "texts"
    return "references" if h5py.check_ref_dtype(dtype) is h5py.Reference else ""


def _packing(item: Any) -> dict[str, float]:
    """What an array was packed with by its attributes: of a table of fields the number for nothing alone.

    A factor of a table is of one of its fields, and a list of factors of no array by these conventions.
    """
    packing = {}
    for key in _PACKED[2:] if item.dtype.names else _PACKED:
        if key in item.attrs and np.size(item.attrs[key]) == 1:
            with contextlib.suppress(TypeError, ValueError):
                packing[key] = float(np.ravel(item.attrs[key])[0])
    return packing


def _unpacked(array: np.ndarray, packing: Mapping[str, float]) -> np.ndarray:
    """Numbers that were packed by the conventions of netCDF: a factor, an offset, and a number for nothing."""
    if not packing:
        return array
    missing = array == packing["_FillValue"] if "_FillValue" in packing else np.zeros(array.shape, dtype=bool)
    return np.where(missing, np.nan, array * packing.get("scale_factor", 1.0) + packing.get("add_offset", 0.0))


def _said(item: Any) -> dict[str, Any]:
    """Attributes that tell a rate or the names of columns, those in an object of JSON too."""
    said: dict[str, Any] = {}
    for key, value in item.attrs.items():
        array = np.asarray(value)
        if array.ndim == 0 and array.dtype.kind in "iuf":
            said[key] = array
        elif array.ndim == 1 and array.dtype.kind in "OSU" and all(isinstance(text, str | bytes) for text in array):
            said[key] = [_text(text) for text in array]
        elif isinstance(value, str | bytes):
            text = _text(value)
            if key.endswith(("_unit", "_units")) or _RATE_IN_WORDS.fullmatch(text):
                said[key] = text
            elif plain(key) in NAME_KEYS and (texts := listed_texts(key, text)):
                said[key] = texts
            said |= {name: texts for name, texts in json_object(text).items() if _are_texts(texts) and name not in said}
    return said


def _are_texts(value: Any) -> bool:
    return isinstance(value, list) and len(value) > 1 and all(isinstance(one, str) for one in value)


def _text(value: Any) -> str:
    value = value[0] if isinstance(value, np.ndarray) and value.size else value
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
