"""What binary files say of their arrays in lists: factors of several columns, units in the order of fields."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

N = 100
TIME = np.arange(N) / 1000
FORCE = 20.0 + np.sin(0.3 * np.arange(N))
POSITION = np.cos(0.3 * np.arange(N))
SAID = {"columns": ["force", "position"], "units": ["N", "mm"]}

Hdf5 = Callable[[Callable[[Any], None]], Path]


@pytest.fixture
def hdf5(tmp_path: Path) -> Hdf5:
    def _write(fill: Callable[[Any], None]) -> Path:
        with h5py.File(tmp_path / "a.h5", "w") as file:
            file.attrs["sampling_rate"] = 1000.0
            fill(file)
        return tmp_path / "a.h5"

    return _write


def array(file: Any, name: str, values: np.ndarray, said: Mapping[str, Any]) -> None:
    item = file.create_dataset(name, data=values)
    for key, value in said.items():
        item.attrs[key] = value


def vectors(file: Any, **of_force: Any) -> None:
    array(file, "force", FORCE, {"units": "N"} | of_force)
    array(file, "position", POSITION, {"units": "mm"})


def packed() -> np.ndarray:
    return np.round(np.c_[FORCE / 0.01, POSITION / 0.001]).astype("i2")


def test_factors_of_the_columns_of_a_matrix_are_asked_about_each_for_its_column(hdf5: Hdf5) -> None:
    path = hdf5(lambda file: array(file, "data", packed(), SAID | {"scale_factor": [0.01, 0.001]}))
    with pytest.raises(DataError) as refused:
        read_record(path)
    assert '(scale_factor: 0.01) may still have to be applied to "force"' in str(refused.value)
    assert '(scale_factor: 0.001) may still have to be applied to "position"' in str(refused.value)
    scaled = {"force": ("force", "0.01"), "position": ("position", "0.001")}
    record = read_record(path, channels={role: {"column": name, "scale": s} for role, (name, s) in scaled.items()})
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=0.005)
    np.testing.assert_allclose(record.channels["position"], POSITION / 1e3, atol=5e-7)


@pytest.mark.parametrize(("gain", "asked"), [([2.0, 3.0], True), ([1.0, 1.0], False)])
def test_a_list_of_gains_is_asked_about_unless_all_are_one(gain: list[float], asked: bool, hdf5: Hdf5) -> None:
    path = hdf5(lambda file: array(file, "data", np.c_[FORCE, POSITION], SAID | {"gain": gain}))
    if not asked:
        np.testing.assert_array_equal(read_record(path).channels["force"], FORCE)
        return
    with pytest.raises(DataError, match=r'\(gain: 2\) may still have to be applied to "force"'):
        read_record(path)


def test_a_polynomial_of_a_vector_is_asked_about(hdf5: Hdf5) -> None:
    path = hdf5(lambda file: vectors(file, calibration=[0.0, 2.0]))
    with pytest.raises(DataError, match=r'column "force": calibration = \[0, 2\] beside numbers'):
        read_record(path)


@pytest.mark.parametrize(
    "said",
    [{"valid_range": [0.0, 100.0]}, {"actual_range": [-1.0, 2.0]}, {"limits": [0, 100]}, {"chunk_shape": [100, 200]}],
    ids=lambda said: next(iter(said)),
)
def test_lists_that_are_of_something_else_are_not_asked_about(said: dict[str, Any], hdf5: Hdf5) -> None:
    np.testing.assert_array_equal(read_record(hdf5(lambda file: vectors(file, **said))).channels["force"], FORCE)


def fields(force: str) -> np.ndarray:
    table = np.zeros(N, [("t", "f8"), ("F", force), ("x", "f8")])
    table["t"], table["F"], table["x"] = TIME, FORCE * (100.0 if force == "i2" else 1.0), POSITION
    return table


def test_a_factor_of_a_table_of_fields_is_asked_about(hdf5: Hdf5) -> None:
    said = {"units": ["s", "N", "mm"], "scale_factor": 0.01}
    with pytest.raises(DataError, match=r'"data.F": scale_factor = 0.01 beside numbers that may be before it'):
        read_record(hdf5(lambda file: array(file, "data", fields("i2"), said)))


def test_units_of_fields_are_read_in_their_order_and_what_stands_for_none_is_masked(hdf5: Hdf5) -> None:
    table = fields("f8")
    table["F"][7] = -99.0
    record = read_record(hdf5(lambda f: array(f, "data", table, {"units": ["s", "N", "mm"], "_FillValue": -99.0})))
    np.testing.assert_allclose(record.channels["position"], POSITION / 1e3)
    assert not record.valid["force"][7]
    assert record.valid["force"].sum() == N - 1


def test_what_is_unpacked_is_told(hdf5: Hdf5) -> None:
    def fill(file: Any) -> None:
        array(file, "force", np.round(FORCE / 0.01).astype("i2"), {"units": "N", "scale_factor": 0.01})
        array(file, "position", POSITION, {"units": "mm"})

    record = read_record(hdf5(fill))
    np.testing.assert_allclose(record.channels["force"], FORCE, atol=0.0051)
    assert 'The numbers of "force" are unpacked: scale_factor = 0.01, add_offset = 0.' in record.history


def test_a_single_unit_is_that_of_all_columns_of_its_matrix(hdf5: Hdf5) -> None:
    def fill(file: Any) -> None:
        array(file, "force", np.c_[FORCE, 2.0 * FORCE], {"units": "kN"})

    np.testing.assert_allclose(read_record(hdf5(fill)).channels["force_2"], 2000.0 * FORCE)


MATRIX = {
    "data": np.c_[TIME, FORCE, POSITION],
    "names": np.array(["time_s", "force_N", "position_mm"], dtype=object),
}


def test_a_vector_of_factors_beside_the_data_is_asked_about(tmp_path: Path, hdf5: Hdf5) -> None:
    scipy.io.savemat(tmp_path / "a.mat", MATRIX | {"gain": [1.0, 2.0, 1.0]})
    with pytest.raises(DataError, match=r'"gain = \[1, 2, 1\]" \(gain: 2\) may still have to be applied to "force_N"'):
        read_record(tmp_path / "a.mat")

    def fill(file: Any) -> None:
        vectors(file)
        file["gains"] = [2.0, 1.0]

    with pytest.raises(DataError, match=r'"gains = \[2, 1\]" \(gains: 2\) may still have to be applied to "force"'):
        read_record(hdf5(fill))


@pytest.mark.parametrize("beside", [{"gain": [1.0, 1.0, 1.0]}, {"corners": [1.0, 2.0]}], ids=lambda b: next(iter(b)))
def test_vectors_that_change_nothing_are_left_out(beside: dict[str, Any], tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", MATRIX | beside)
    record = read_record(tmp_path / "a.mat")
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    assert f"Vectors of another length are left out: {next(iter(beside))}." in record.history


def test_units_of_a_structure_are_read_in_the_order_of_its_fields(tmp_path: Path) -> None:
    listed = np.array(["s", "N", "mm"], dtype=object)
    scipy.io.savemat(tmp_path / "a.mat", {"rec": {"t": TIME, "F": FORCE, "x": POSITION, "units": listed}})
    np.testing.assert_allclose(read_record(tmp_path / "a.mat").channels["position"], POSITION / 1e3)


def test_the_unit_in_the_name_of_a_matrix_is_that_of_its_columns(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"time_s": TIME, "force_kN": np.c_[FORCE, FORCE, 2.0 * FORCE]})
    record = read_record(tmp_path / "a.mat", channels={"force": "force_kN(:,3)"})
    np.testing.assert_allclose(record.channels["force"], 2000.0 * FORCE)


@pytest.mark.parametrize("owner", ["file", "force"])
def test_a_list_of_texts_is_accounted_for(owner: str, hdf5: Hdf5) -> None:
    def fill(file: Any, said: str) -> None:
        vectors(file)
        (file if owner == "file" else file["force"]).attrs["remarks"] = ["rig 3", said]

    with pytest.raises(DataError, match="multiply the force by 2"):
        read_record(hdf5(lambda file: fill(file, "multiply the force by 2")))
    record = read_record(hdf5(lambda file: fill(file, "rope from the shop")))
    np.testing.assert_array_equal(record.channels["force"], FORCE)
