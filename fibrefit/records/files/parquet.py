"""Parquet files, through pyarrow: units from the fields' metadata, stamps as times."""

from __future__ import annotations

import datetime
import io
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Allowance
from fibrefit.records.columns.raw import Annotation, Raw, RawColumn, binary_column
from fibrefit.records.files.arrays.values import stamp_column, stamps_in
from fibrefit.records.files.extras import damage_as_error, json_object, stated_in, with_stated_units
from fibrefit.records.grammar.facts import find_facts
from fibrefit.records.grammar.headings import split_heading
from fibrefit.records.grammar.phrases import Aside
from fibrefit.records.grammar.worth import contradicted, stated_worth

#: Letters of a property at the beginning of which a rate may stand.
_LONGEST = 60
_UNIT_KEYS = ("unit", "units", "Unit", "Units", "unit_string")


def read_parquet(data: bytes, where: str) -> Raw:
    """Columns of a Parquet file.

    Parameters
    ----------
    data : bytes
        The whole file.
    where : str
        Its name for messages.

    Returns
    -------
    Raw
        All columns of numbers and of stamps.

    Raises
    ------
    DataError
        If the file is damaged, or holds no column of numbers.
    """
    from pyarrow import parquet

    with damage_as_error(where, "the Parquet file"):
        _refuse_large(parquet.read_metadata(io.BytesIO(data)), where)
        table = parquet.read_table(io.BytesIO(data))
        table, single = _opened(table)
        named = [(field, table.column(i)) for i, field in enumerate(table.schema)]
        columns = [_column(field, values, i + 1, where) for i, (field, values) in enumerate(named)]
        stated = (f"{path} = {text[:_LONGEST]}" for _, path, text in _stated(table.schema.metadata))
        facts = find_facts([*stated, *single])
    kept = [column for column in columns if column is not None]
    if not kept or table.num_rows < 3:
        lists = [f'; "{name}" holds a list in each row' for name, kind in _kinds(table) if "list" in kind]
        got = f"no column of at least 3 numbers{lists[0] if lists else ''}"
        do = "Write each row to a file of its own, with a number a row." if lists else ""
        raise DataError(where, got, "a column for each measured quantity", do)
    aside = {i + 1: f'"{field.name}" holds {field.type}' for i, (field, _) in enumerate(named) if columns[i] is None}
    notes: list[str] = [Aside(f"Columns left out: {', '.join(aside.values())}.")] if aside else []
    layout = {"format": "Parquet", "rows": table.num_rows}
    annotations = [*_annotations(table.schema), *(Annotation("column beside lists", line) for line in single)]
    numbers = np.arange(1, table.num_rows + 1)
    kept = with_stated_units(kept, annotations)
    return Raw(kept, facts, numbers, layout=layout, notes=notes, aside=aside, annotations=annotations)


def _kinds(table: Any) -> list[tuple[str, str]]:
    return [(field.name, str(field.type)) for field in table.schema]


def _opened(table: Any) -> tuple[Any, list[str]]:
    """A table without columns within columns, and where its one row holds lists of one length, a row for each value.

    What that row holds besides is given as statements.
    """
    while any(kind.startswith("struct") for _, kind in _kinds(table)):
        table = table.flatten()
    lists = [name for name, kind in _kinds(table) if "list" in kind]
    sizes = {len(table.column(name)[0].as_py() or ()) for name in lists} if table.num_rows == 1 else set()
    if len(sizes) != 1:
        return table, []
    others = [f"{name} = {table.column(name)[0].as_py()}" for name, _ in _kinds(table) if name not in lists]
    values = [table.column(name).combine_chunks().flatten() for name in lists]
    fields = [table.schema.field(name).with_type(one.type) for name, one in zip(lists, values, strict=True)]
    import pyarrow

    return pyarrow.table(values, schema=pyarrow.schema(fields, metadata=table.schema.metadata)), others


def _annotations(schema: Any) -> list[Annotation]:
    """What the metadata of the file and of its fields say, but for what programs keep there for themselves.

    What is stated under the name of a column is said of that one: ``{"units": {"force": "N"}}``.
    """
    said = [("", schema.metadata), *((field.name, field.metadata) for field in schema)]
    found = [
        Annotation(
            f'metadata "{key}"{of and f" of {of}"}', " ".join(f"{path} = {text}".split()), of or path.rpartition(".")[2]
        )
        for of, metadata in said
        for key, path, text in _stated(metadata)
    ]
    return [one if one.of in schema.names else replace(one, of="") for one in found]


def _stated(metadata: Mapping[bytes, bytes] | None) -> Iterator[tuple[str, str, str]]:
    """Key, path and value of what metadata state, what users of Pandas add to its frames among it."""
    said = {_text(key): _text(value) for key, value in (metadata or {}).items()}
    own = json_object(said.get("pandas", "")).get("attributes")
    added = json_object(said.get("PANDAS_ATTRS", "")) or (own if isinstance(own, dict) else {})
    said |= {key: value if isinstance(value, str) else json.dumps(value) for key, value in added.items()}
    if added:
        said.pop("PANDAS_ATTRS", None)
    for key, value in said.items():
        if not key.startswith(("ARROW", "pandas", "PARQUET")):
            yield from ((key, *one) for one in stated_in(key, value))


def _text(said: bytes) -> str:
    return said.decode(errors="replace")


def _refuse_large(metadata: Any, where: str) -> None:
    """Refuse by what the file declares: a page of a few bytes may stand for a million equal numbers."""
    groups = [metadata.row_group(i) for i in range(metadata.num_row_groups)]
    packed = sum(group.column(i).total_uncompressed_size for group in groups for i in range(group.num_columns))
    Allowance(where, DataError).take(max(8 * metadata.num_rows * metadata.num_columns, packed))


def _texts(values: np.ndarray) -> list[Any]:
    """Values as texts where they are times of day, which NumPy has no kind for."""
    return [one.isoformat() if isinstance(one, datetime.time) else one for one in values]


def _column(field: Any, values: Any, number: int, where: str) -> RawColumn | None:
    name, unit = split_heading(field.name)
    metadata = {_text(key): _text(value) for key, value in (field.metadata or {}).items()}
    stated = [*(metadata[key] for key in _UNIT_KEYS if metadata.get(key)), unit]
    unit = stated[0]
    array = np.asarray(values.to_numpy())
    if array.dtype.kind == "O" and (stamps := stamps_in(_texts(array), f'{where}, column "{field.name}"')) is not None:
        array = stamps
    if array.dtype.kind == "M":
        found = stamp_column(field.name, name, array)
        return None if found is None else replace(found, number=number)
    if array.dtype.kind == "m":
        array, unit = array / np.timedelta64(1, "ns") * 1e-9, "s"
    if array.dtype.kind == "O":  # decimals, or text
        try:
            array = array.astype(float)
        except (TypeError, ValueError):
            return None
    if array.dtype.kind not in "iuf":
        return None
    column = binary_column(field.name, name, unit, array)
    return replace(column, number=number, worth=stated_worth(metadata, array), contradicted=contradicted(stated))
