"""JSON in the forms that programs write: by columns, by rows, by an index, by channels; and what is no one table."""

from __future__ import annotations

import json
from collections.abc import Callable
from time import process_time
from typing import Any

import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

N = 60
TIME = [i / 2000 for i in range(N)]
FORCE = [round(20.0 + 3.0 * float(np.sin(0.3 * i)), 4) for i in range(N)]
POSITION = [round(-3.0 + 0.01 * i, 4) for i in range(N)]
NAMES = ["time_s", "force_N", "position_mm"]
ROWS = [list(row) for row in zip(TIME, FORCE, POSITION, strict=True)]
LISTS = dict(zip(NAMES, (TIME, FORCE, POSITION), strict=True))
OBJECTS = [dict(zip(NAMES, row, strict=True)) for row in ROWS]
UNITS = {"time": "s", "force": "N", "position": "mm"}

READ: dict[str, Any] = {
    "by columns and index": {name: {str(i): v for i, v in enumerate(values)} for name, values in LISTS.items()},
    "by index": {str(i): row for i, row in enumerate(OBJECTS)},
    "names, index and rows": {"columns": NAMES, "index": list(range(N)), "data": ROWS},
    "fields and rows": {
        "schema": {"fields": [{"name": name, "type": "number"} for name in NAMES], "primaryKey": ["index"]},
        "data": OBJECTS,
    },
    "names, units and rows": {"columns": list(UNITS), "units": list(UNITS.values()), "rows": ROWS},
    "a series in lists of one": {"results": [{"series": [{"name": "drop", "columns": NAMES, "values": ROWS}]}]},
    "two channels in a list": {
        "sample_rate_hz": 2000,
        "channels": [{"name": "F", "unit": "N", "samples": FORCE}, {"name": "x", "unit": "mm", "samples": POSITION}],
    },
    "lists in an object beside others": {"time_s": TIME, "sensors": {"force_N": FORCE, "position_mm": POSITION}},
    "labels beside lists": {**LISTS, "tags": ["drop", "steel", "cold"]},
    "stamps in a list": {**LISTS, "time_s": [f"2023-11-02T10:15:00.{5 * i:04d}" for i in range(N)]},
}


def check(path: Any, **options: Any) -> list[str]:
    record = read_record(path, **options)
    np.testing.assert_allclose(record.time, TIME, atol=1e-12)
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], np.array(POSITION) / 1e3, rtol=4e-16)
    return list(record.history)


@pytest.mark.parametrize("form", READ)
def test_all_forms_hold_the_same_table(form: str, write: Callable) -> None:
    check(write(json.dumps(READ[form]), "a.json"))


def test_a_row_a_line_within_one_list(write: Callable) -> None:
    check(write("[\n" + ",\n".join(map(json.dumps, OBJECTS)) + "\n]", "a.json"))


def test_rows_without_names_are_named_by_the_user(write: Callable) -> None:
    path = write(json.dumps(ROWS), "a.json")
    check(path, columns=["time [s]", "force [N]", "position [mm]"])
    with pytest.raises(DataError, match="3 columns without headings"):
        read_record(path)


def test_a_list_in_each_row_is_a_column_for_each_of_its_values(write: Callable) -> None:
    rows = [{"t_s": t, "force_N": f, "position_mm": [x, 0.0]} for t, f, x in ROWS]
    path = write(json.dumps(rows), "a.json")
    with pytest.raises(DataError, match=r'"position.1 \[mm\]" and "position.2 \[mm\]" could each be the position'):
        read_record(path)
    check(path, channels={"position": "position.1 [mm]"})


def test_a_list_of_gains_beside_lists_is_asked_about(write: Callable) -> None:
    with pytest.raises(DataError, match=r'gain = \[1, 10, 1\]" \(gain: 10\) may still have to be applied to "force_N"'):
        read_record(write(json.dumps({**LISTS, "gain": [1, 10, 1]}), "a.json"))
    check(write(json.dumps({**LISTS, "gain": [1, 1, 1]}), "b.json"))


def test_a_scale_among_fields_is_asked_about(write: Callable) -> None:
    fields = [{"name": name, "unit": unit} for name, unit in UNITS.items()]
    check(write(json.dumps({"fields": fields, "values": ROWS}), "a.json"))
    fields[1]["scale"] = 0.1  # type: ignore[assignment]
    with pytest.raises(DataError, match=r'"force.scale = 0.1"'):
        read_record(write(json.dumps({"fields": fields, "values": ROWS}), "b.json"))


def test_a_channel_that_some_rows_lack_is_masked_there(write: Callable) -> None:
    rows = [{k: v for k, v in row.items() if k != "position_mm" or not i % 4} for i, row in enumerate(OBJECTS)]
    record = read_record(write("\n".join(map(json.dumps, rows)), "a.jsonl"))
    assert record.valid["position"].sum() == N // 4
    np.testing.assert_allclose(record.channels["position"][::4], np.array(POSITION[::4]) / 1e3)


def test_a_few_objects_beside_the_rows_are_named(write: Callable) -> None:
    events = [{"t": 0.01, "what": "release"}, {"t": 0.02, "what": "rebound"}, {"t": 0.03, "what": "rest"}]
    history = check(write(json.dumps({"events": events, "rows": OBJECTS}), "a.json"))
    assert 'Other lists of objects are left out: "events" (3 objects).' in history


REFUSED = {
    "two tables": ({"run1": OBJECTS, "run2": OBJECTS}, r'several tables: "run1" \(60 rows\), "run2" \(60 rows\)'),
    "two recordings": ({"run1": LISTS, "run2": LISTS}, r'"time_s" in "run1" and in "run2"; expected one recording'),
    "packets": (
        [{"t0_s": 0.01 * k, "force_N": FORCE[:20], "position_mm": POSITION[:20]} for k in range(4)],
        r'rows that hold 20 values each of "force_N", "position_mm"; expected one value a row',
    ),
    "pairs": (
        {"series": [{"name": name, "data": [[t, v] for t, v in zip(TIME, FORCE, strict=True)]} for name in "Fx"]},
        r'JSON without a table \("series"\)',
    ),
}


@pytest.mark.parametrize("form", REFUSED)
def test_what_is_no_one_table_is_refused_by_its_cause(form: str, write: Callable) -> None:
    document, message = REFUSED[form]
    text = "\n".join(map(json.dumps, document)) if isinstance(document, list) else json.dumps(document)
    with pytest.raises(DataError, match=message):
        read_record(write(text, "a.json"))


def test_lines_that_are_nested_too_deeply_are_refused(write: Callable) -> None:
    lines = [json.dumps(one) for one in OBJECTS]
    lines[7] = lines[7][:-1] + ', "a": ' + '{"a":' * 600 + "1" + "}" * 601
    with pytest.raises(DataError, match="nested too deeply"):
        read_record(write("\n".join(lines), "a.jsonl"))


def test_tabs_and_ends_of_lines_in_texts_part_no_cells(write: Callable) -> None:
    check(write(json.dumps({"note": ["a\tb\nc"] * N, **LISTS}), "a.json"))


def test_many_names_take_no_square_of_their_number(write: Callable) -> None:
    inside = {f"sensor{i}": {"serial": i, f"own{i}": i} for i in range(4000)}
    rows = [{**one, f"extra{i}": 1} for i, one in enumerate(OBJECTS * 60)]
    began = process_time()
    with pytest.raises(DataError):
        read_record(write(json.dumps({"about": inside, "rows": rows}), "a.json"))
    assert process_time() - began < 5.0
