"""How MATLAB and HDF5 files call their arrays: lists around a matrix, cells, structures, links, attributes, stamps."""

from __future__ import annotations

import json
import pickle
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from fibrefit.core.errors import DataError
from fibrefit.records import read_record
from fibrefit.records.files.arrays.titles import place_beside
from fibrefit.records.thresholds import HEADER_DEPTH

N = 100
TIME = np.arange(N) / 2000
FORCE = 20.0 + np.sin(0.3 * np.arange(N))
POSITION = np.cos(0.3 * np.arange(N))
VALUES = {"time": TIME, "force": FORCE, "position": POSITION}
UNITS = {"time": "s", "force": "N", "position": "mm"}
MATRIX = np.c_[TIME, FORCE, POSITION]
STAMPS = [(datetime(2023, 11, 2, 10) + timedelta(microseconds=500 * i)).isoformat() for i in range(N)]


def check(path: Path, **options: Any) -> tuple[str, ...]:
    record = read_record(path, **options)
    np.testing.assert_allclose(record.time - record.time[0], TIME, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], POSITION / 1e3, rtol=4e-16)
    return record.history


def cells(*items: Any) -> np.ndarray:
    held = np.empty(len(items), dtype=object)
    held[:] = items
    return held


def structures(*items: dict[str, Any]) -> np.ndarray:
    held = np.zeros((1, len(items)), dtype=[(key, object) for key in items[0]])
    for i, item in enumerate(items):
        for key, value in item.items():
            held[0, i][key] = value
    return held


def signal(name: str, unit: str, values: np.ndarray) -> dict[str, Any]:
    axis = {"start_value": 0.0, "increment": 5e-4, "number_of_values": float(N)}
    of_values = {"values": values, "quantity": {"label": unit}}
    return {"x_values": axis, "y_values": of_values, "function_record": {"name": name, "type": "time"}}


MATLAB: dict[str, dict[str, Any]] = {
    "channels in cells": {"data": cells(*VALUES.values()), "names": cells(*VALUES), "units": cells(*UNITS.values())},
    "names in one text": {"data": MATRIX, "header": "time [s], force [N], position [mm]"},
    "names in a structure beside": {
        "data": MATRIX,
        "info": {"channels": cells(*VALUES), "units": cells(*UNITS.values()), "operator": "Novak"},
    },
    "names here and units there": {
        "data": MATRIX,
        "names": cells(*VALUES),
        "meta": {"units": cells(*UNITS.values())},
    },
    "a structure a row": {
        "rec": structures(*({"t_s": a, "F_N": b, "x_mm": c} for a, b, c in MATRIX)),
    },
    "notes around bare values": {"S0": signal("Force", "N", FORCE), "S1": signal("Position", "mm", POSITION)},
    "one time and two signals of a model": {
        "out": {"time": TIME, "signals": {"values": MATRIX[:, 1:], "dimensions": 2.0, "label": "F [N], x [mm]"}},
    },
    "room that was never filled": {
        f"{name}_{UNITS[name]}": np.r_[values, np.zeros(50)] for name, values in VALUES.items()
    },
}


@pytest.mark.parametrize("form", MATLAB)
def test_matlab(form: str, tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", MATLAB[form])
    check(tmp_path / "a.mat")


def test_of_a_matrix_no_list_names_the_columns_that_has_another_length(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"data": MATRIX, "info": {"channels": cells("force", "position")}})
    with pytest.raises(DataError, match=r'none of "data\(:,1\)"'):
        read_record(tmp_path / "a.mat")


def test_rows_of_zeros_are_left_out_where_the_times_are_zero_too(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", MATLAB["room that was never filled"])
    assert any("The last 50 rows were never filled" in line for line in check(tmp_path / "a.mat"))
    later = {
        "t_s": np.arange(N) / 2000,
        "F_N": np.r_[FORCE[:-20], np.zeros(20)],
        "x_mm": np.r_[POSITION[:-20], np.zeros(20)],
    }
    scipy.io.savemat(tmp_path / "b.mat", later)
    assert read_record(tmp_path / "b.mat").time.size == N


def test_more_than_two_dimensions_are_named(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"data": np.stack([MATRIX] * 4)})
    with pytest.raises(DataError, match='no vectors of numbers, but "data" of 4 x 100 x 3 numbers'):
        read_record(tmp_path / "a.mat")
    scipy.io.savemat(tmp_path / "b.mat", {"time_s": TIME, "F_N": FORCE, "x_mm": POSITION, "film": np.ones((2, 3, 4))})
    assert any('"film" of 2 x 3 x 4 numbers' in line for line in check(tmp_path / "b.mat"))


def test_times_of_blocks_are_no_times_of_samples(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"time_s": TIME[::10], "ch0": FORCE, "ch1": POSITION})
    with pytest.raises(DataError, match=r'"time_s": 10, "ch0": 100\); expected a time for each sample'):
        read_record(tmp_path / "a.mat")


def hdf5(fill: Callable[[Any], None], path: Path, **options: Any) -> Path:
    with h5py.File(path, "w", **options) as file:
        fill(file)
    return path


def put(file: Any, place: str, values: Any, **said: Any) -> Any:
    item = file.create_dataset(place, data=values)
    for key, value in said.items():
        item.attrs[key] = value
    return item


def of_version_7(fill: Callable[[Any], None], path: Path) -> Path:
    hdf5(fill, path, userblock_size=512)
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file")
    return path


def kept(file: Any, name: str, value: Any) -> Any:
    """A number or a text as MATLAB 7.3 keeps it."""
    if isinstance(value, str):
        return put(file, name, np.array([[ord(c)] for c in value], dtype="u2"), MATLAB_class=np.bytes_("char")).ref
    return put(file, name, np.atleast_2d(value), MATLAB_class=np.bytes_("double")).ref


def test_an_array_of_structures_of_version_7(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file.create_group("ch").attrs["MATLAB_class"] = np.bytes_("struct")
        for key, values in {"name": VALUES, "unit": UNITS.values(), "data": VALUES.values()}.items():
            refs = [[kept(file, f"#refs#/{key}{i}", value)] for i, value in enumerate(values)]
            file["ch"].create_dataset(key, data=np.array(refs, dtype=h5py.ref_dtype))

    check(of_version_7(fill, tmp_path / "a.mat"))


def test_cells_of_version_7(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        for key, values in {"names": [f"{n} [{u}]" for n, u in UNITS.items()], "data": VALUES.values()}.items():
            refs = [[kept(file, f"#refs#/{key}{i}", value)] for i, value in enumerate(values)]
            put(file, key, np.array(refs, dtype=h5py.ref_dtype), MATLAB_class=np.bytes_("cell"))

    check(of_version_7(fill, tmp_path / "a.mat"))


def test_an_object_of_matlab_is_refused_as_one(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        said = {"MATLAB_class": np.bytes_("timetable"), "MATLAB_object_decode": np.int32(3)}
        put(file, "T", np.array([[3707764736, 2, 1, 1, 1, 1]], dtype="u4"), **said)

    with pytest.raises(DataError, match=r'"T" is an object of MATLAB \(timetable\).*t = seconds\(T.Time\)'):
        read_record(of_version_7(fill, tmp_path / "a.mat"))


def links(file: Any) -> None:
    for name, values in VALUES.items():
        put(file, f"entry/instrument/{name}", values, units=UNITS[name])
        file[f"entry/data/{name}"] = file[f"entry/instrument/{name}"]
    file["latest"] = h5py.SoftLink("/entry/data")


def table(file: Any) -> None:
    names = [f"{name}_{unit}" for name, unit in UNITS.items()]
    rows = np.zeros(N, [("index", "i8"), ("values_block_0", "f8", (3,))])
    rows["index"], rows["values_block_0"] = np.arange(N), MATRIX
    put(file, "df/table", rows, values_block_0_kind=np.bytes_(pickle.dumps(names, 0)))


def fields(file: Any, **said: Any) -> None:
    rows = np.zeros(N, [(name, "f8") for name in VALUES])
    for name, values in VALUES.items():
        rows[name] = values
    put(file, "run", rows, **said)


def stamped(file: Any) -> None:
    rows = np.zeros(N, [("timestamp", "S26"), ("force_N", "f8"), ("position_mm", "f8")])
    rows["timestamp"], rows["force_N"], rows["position_mm"] = [s.encode() for s in STAMPS], FORCE, POSITION
    put(file, "log", rows)


def further_out(file: Any) -> None:
    file.attrs.update(ChannelNames=["force", "position"], ChannelUnits=["N", "mm"], SampleRate=2000.0)
    file.attrs["SampleRateUnit"] = "Hz"
    put(file, "raw/data", MATRIX[:, 1:])


def each(**keys: str) -> Callable[[Any], None]:
    """Arrays with attributes of their name and their unit under some keys."""

    def fill(file: Any) -> None:
        for i, (name, values) in enumerate(VALUES.items()):
            told = {"name": name.title(), "unit": UNITS[name], "both": f"{name.title()} [{UNITS[name]}]"}
            put(file, f"ch{i}", values, **{key: told[what] for key, what in keys.items()})

    return fill


def of_groups(file: Any) -> None:
    for name, values in VALUES.items():
        put(file, f"{name}/data", values)
        file[name].attrs["unit"] = UNITS[name]


def words(file: Any) -> None:
    put(file, "time", np.array(STAMPS, dtype=h5py.string_dtype()))
    put(file, "force", FORCE, units="N")
    put(file, "position", POSITION, units="mm")


def step(file: Any) -> None:
    file.attrs["time_step"] = "500 us"
    put(file, "force", FORCE, units="N")
    put(file, "position", POSITION, units="mm")


def scope(file: Any) -> None:
    file.attrs.update(XInc=5e-4, NumPoints=N)
    put(file, "force", FORCE, units="N")
    put(file, "position", POSITION, units="mm")


HDF5: dict[str, Callable[[Any], None]] = {
    "one array under several names": links,
    "a table of pandas": table,
    "units of fields by their names": lambda file: fields(file, time_unit="s", force_unit="N", position_units="mm"),
    "units of fields by their numbers": lambda file: fields(
        file, FIELD_0_UNITS="s", FIELD_1_UNITS="N", FIELD_2_UNITS="mm"
    ),
    "stamps in a field": stamped,
    "stamps in words": words,
    "names and units at the root": further_out,
    "names in an attribute of one text": lambda file: put(
        file, "d", MATRIX, channels="time [s],force [N],position [mm]"
    ),
    "names in an attribute of JSON": lambda file: put(
        file, "d", MATRIX, meta=json.dumps({"columns": list(UNITS), "units": list(UNITS.values())})
    ),
    "a name and a unit of each": each(name="name", unit="unit"),
    "a longer name with a unit": each(long_name="both"),
    "units of the groups": of_groups,
    "a step in words": step,
    "a step beside a number of points": scope,
}


@pytest.mark.parametrize("form", HDF5)
def test_hdf5(form: str, tmp_path: Path) -> None:
    check(hdf5(HDF5[form], tmp_path / "a.h5"))


def test_words_that_are_no_stamps_are_left_out(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        scope(file)
        put(file, "phase", np.array(["10:15:00", *["fall"] * (N - 1)], dtype=h5py.string_dtype()))

    check(hdf5(fill, tmp_path / "a.h5"))


def test_columns_that_are_called_alike_have_their_place_before_their_name(tmp_path: Path) -> None:
    def fill(file: Any) -> None:
        file.attrs.update(channel_names=["force_N", "position_mm"], fs_Hz=2000.0)
        put(file, "run1", MATRIX[:, 1:])
        put(file, "run2", 2.0 * MATRIX[:, 1:])

    path = hdf5(fill, tmp_path / "a.h5")
    with pytest.raises(DataError, match=r'"run1.force_N" and "run2.force_N" could each be the force'):
        read_record(path)
    record = read_record(path, channels={"force": "run2.force_N", "position": "run2.position_mm"})
    np.testing.assert_array_equal(record.channels["force"], 2.0 * FORCE)


def test_an_attribute_of_very_many_arrays_is_kept_as_often_as_it_is_looked_at() -> None:
    tree: dict[str, Any] = {}
    for number in range(3 * HEADER_DEPTH):
        if (place := place_beside(tree, "gain", np.float64(number))) is not None:
            tree[place] = np.float64(number)
    assert list(tree.values()) == list(range(HEADER_DEPTH))
    assert place_beside({"gain": np.float64(1.0), "gain ": np.float64(2.0)}, "gain", np.float64(2.0)) == "gain "
