"""Content of HDF5 files, MATLAB 7.3 among them: counted, then read, and what attributes say beside it."""

from __future__ import annotations

import contextlib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np

from fibrefit.core.allowance import Allowance
from fibrefit.core.errors import DataError
from fibrefit.records.columns.raw import Annotation
from fibrefit.records.files.extras import stated_in
from fibrefit.records.grammar.worth import shown_list, stated_worth
from fibrefit.records.thresholds import HEADER_DEPTH

_UNIT_ATTRIBUTES = ("unit", "units", "Unit", "Units", "UNIT", "UNITS", "unit_string", "Einheit", "y_unit")
#: What netCDF packs numbers with; the last one tells which of them stands for none.
_PACKED = ("scale_factor", "add_offset", "_FillValue")
#: Bytes each item of an HDF5 file counts at least.
_ITEM = 1 << 14
#: Where a group keeps what attributes say of the numbers of its members; no name in a file is it.
WORTH = "\0worth"
#: The same for all that is said of their units.
STATED = "\0stated"
#: Which of its members are what attributes say.
ATTRIBUTES = "\0attributes"
UNITS = ("units", "unit", "einheit", "einheiten", "columnunits", "channelunits", "yunit")


def load_hdf5(path: Path, allowed: Allowance) -> tuple[dict[str, Any], list[Annotation], list[str]]:
    """Content of an HDF5 file, what its attributes say, and notes on what was unpacked and left out.

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
        return tree, reader.annotations, [*reader.unpacked, *left]


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
    """

    file: Any
    allowed: Allowance
    reads: bool = True
    annotations: list[Annotation] = field(default_factory=list)
    words: list[str] = field(default_factory=list)
    unpacked: list[str] = field(default_factory=list)

    def group(self, group: Any) -> dict[str, Any]:
        """Content of a group; what its attributes say stands beside it, under the names MATLAB users give to fields."""
        tree = _said(group)
        attributes = tree[ATTRIBUTES] = {*tree, WORTH, STATED}
        self._tell(group.attrs, within=group.name.strip("/"))
        units_of = {}
        for name in group:
            if name.startswith("#"):
                continue
            item = self._own(group, name)
            tree[name] = self.item(item)
            attributes.discard(name)
            stated = [_text(item.attrs[key]) for key in _UNIT_ATTRIBUTES if key in item.attrs]
            if stated and stated[0]:
                units_of[name] = stated[0]
                tree.setdefault(STATED, {})[name] = stated
            if hasattr(item, "items"):
                continue
            self._tell_of_numbers(item, tree, name)
            for key, value in _said(item).items():
                if isinstance(value, str) and key.casefold().replace("_", "") in UNITS:
                    continue
                while key in tree and not np.array_equal(tree[key], value):
                    key += " "  # the same of another array, and not the same number: kept beside the first
                tree[key] = value
                attributes.add(key)
        if units_of and not any(key.casefold().replace("_", "") in UNITS for key in tree):
            tree["units"] = units_of
            attributes.add("units")
        return tree

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
            units = next((value for key, value in _said(item).items() if key.casefold() in UNITS), ())
            if isinstance(units, list) and len(units) == len(item.dtype.names):
                found["units"] = dict(zip(item.dtype.names, units, strict=True))
            found[WORTH] = whole
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
        said = item.attrs.get("MATLAB_class", b"")
        kind = said.decode() if isinstance(said, bytes) else ""
        if item.attrs.get("MATLAB_empty", 0) or item.shape is None:
            return None
        self.allowed.take(item.size * item.dtype.itemsize)
        holds = _held(item.dtype)
        if holds == "texts":
            return self._texts(item)
        if not self.reads and holds != "references":
            return None
        array = np.asarray(item[()])
        if kind == "char":
            return "".join(map(chr, array.ravel(order="F")))
        if holds == "references":
            return [self.item(self.file[reference]) for reference in array.ravel(order="F")]
        if array.dtype.names:
            numbers = [name for name in array.dtype.names if array[name].dtype.kind in "biuf"]
            return {name: _unpacked(array[name], _packing(item)) for name in numbers}
        if array.dtype.kind not in "biuf":
            return None
        array = _unpacked(array, _packing(item))
        # MATLAB stores columns first: a matrix comes out transposed.
        return np.squeeze(array.T if kind else array)

    def _texts(self, item: Any) -> Any:
        """One text, or a list of them; what is longer than any list of names is a column of words, and no numbers."""
        if item.size > HEADER_DEPTH:
            self.words.append(item.name.strip("/").replace("/", "."))
            return None
        found, texts = item.asstr(errors="replace"), []
        for place in np.ndindex(item.shape):
            texts.append(str(found[place]).strip())  # one by one: what they refer to may be the same, and long
            self.allowed.take(len(texts[-1]))
        return texts[0] if len(texts) == 1 else texts


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
    """Attributes that tell a rate or the names of columns."""
    said: dict[str, Any] = {}
    for key, value in item.attrs.items():
        array = np.asarray(value)
        if array.ndim == 0 and array.dtype.kind in "iuf":
            said[key] = array
        elif array.ndim == 1 and array.dtype.kind in "OSU" and all(isinstance(text, str | bytes) for text in array):
            said[key] = [_text(text) for text in array]
        elif isinstance(value, str | bytes) and key.endswith(("_unit", "_units")):
            said[key] = _text(value)
    return said


def _text(value: Any) -> str:
    value = value[0] if isinstance(value, np.ndarray) and value.size else value
    return value.decode(errors="replace") if isinstance(value, bytes) else str(value)
