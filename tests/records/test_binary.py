"""MATLAB, TDMS and MDF4 hold the same samples as text; a missing package names its extra."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest
import scipy.io

from fibrefit.core.errors import DataError
from fibrefit.records import read_record, read_table

N = 100
TIME = np.arange(N) / 2000
FORCE = 12.5 + 0.001 * np.arange(N)
POSITION = -0.25 - 0.0001 * np.arange(N)
DECLARED = {"time": "s", "force": "N", "position": "mm"}

#: One rounding of the conversion to SI.
LAST_BITS = 4e-16


def check(path: Path, **options: Any) -> None:
    record = read_record(path, **options)
    np.testing.assert_allclose(record.time, TIME, rtol=0, atol=1e-12)
    assert record.rate == pytest.approx(2000.0)
    np.testing.assert_allclose(record.channels["force"], FORCE, rtol=LAST_BITS)
    np.testing.assert_allclose(record.channels["position"], POSITION / 1e3, rtol=LAST_BITS)


def texts(*values: str) -> np.ndarray:
    return np.array(values, dtype=object)


MATLAB: dict[str, tuple[dict[str, Any], dict[str, Any]]] = {
    "vectors with units": ({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}, {}),
    "vectors": ({"t": TIME, "F": FORCE, "u": POSITION}, {"units": DECLARED}),
    "columns": ({"t": TIME[:, None], "F": FORCE[None, :], "u": POSITION[:, None]}, {"units": DECLARED}),
    "matrix with names": (
        {
            "data": np.c_[TIME, FORCE, POSITION],
            "names": texts("time", "force", "position"),
            "units": texts("s", "N", "mm"),
        },
        {},
    ),
    "structure": (
        {"rec": {"data": np.c_[TIME, FORCE, POSITION], "colheaders": texts("time [s]", "force [N]", "position [mm]")}},
        {},
    ),
    "structures and a rate": (
        {"force": {"data": FORCE, "unit": "N"}, "position": {"data": POSITION, "unit": "mm"}, "fs": 2000.0},
        {},
    ),
    "matrix on its side": (
        {"data": np.c_[TIME, FORCE, POSITION].T},
        {"units": DECLARED, "channels": {"time": "data(:,1)", "force": "data(:,2)", "position": "data(:,3)"}},
    ),
    "other lengths beside": (
        {"time_s": TIME, "force_N": FORCE, "position_mm": POSITION, "calibration": np.arange(7.0), "note": "a text"},
        {},
    ),
}


@pytest.mark.parametrize("name", MATLAB)
def test_matlab_5(name: str, tmp_path: Path) -> None:
    variables, options = MATLAB[name]
    scipy.io.savemat(tmp_path / "a.mat", variables)
    check(tmp_path / "a.mat", **options)


def test_matlab_73(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in (("time_s", TIME), ("force_N", FORCE), ("position_mm", POSITION)):
            file.create_dataset(name, data=values[None, :])
    with path.open("r+b") as stream:
        stream.write(b"MATLAB 7.3 MAT-file")
    check(path)


def test_matlab_73_with_names_in_a_cell_array(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        group, refs = file.create_group("rec"), file.create_group("#refs#")
        group.create_dataset("data", data=np.c_[TIME, FORCE, POSITION].T)
        for key, words in (("names", ("time", "force", "position")), ("units", ("s", "N", "mm"))):
            cells = []
            for word in words:
                text = refs.create_dataset(key + word, data=np.array([[ord(c)] for c in word], dtype="u2"))
                text.attrs["MATLAB_class"] = np.bytes_("char")
                cells.append([text.ref])
            group.create_dataset(key, data=np.array(cells, dtype=h5py.ref_dtype))
    check(path)


def test_references_and_texts_are_told_apart(tmp_path: Path) -> None:
    path = tmp_path / "a.h5"
    with h5py.File(path, "w") as file:
        for name, values in (("time_s", TIME), ("force_N", FORCE), ("position_mm", POSITION)):
            file.create_dataset(name, data=values)
        file["title"] = "Drop 7"
        file["step"] = [f"step {i}" for i in range(500)]
        file.create_dataset("ragged", (2,), dtype=h5py.vlen_dtype("f8"))
        file.create_dataset("nothing", data=h5py.Empty("f8"))
        file.create_dataset("regions", (2,), dtype=h5py.regionref_dtype)
    check(path)
    assert "Arrays of words are left out: step." in read_record(path).history


def test_of_two_rates_that_of_the_vectors_that_are_read(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    channels = {"Kraft": ("N", FORCE, 2000.0), "Weg": ("mm", POSITION, 2000.0), "Temp": ("C", FORCE[:10], 200.0)}
    variables: dict[str, Any] = {}
    for k, (name, (unit, values, rate)) in enumerate(channels.items()):
        variables[f"Channel_{k}_Header"] = {"SignalName": name, "Unit": unit, "SampleFrequency": rate}
        variables[f"Channel_{k}_Data"] = values
    scipy.io.savemat(path, variables)
    check(path)
    assert "Vectors of another length are left out: Temp." in read_record(path).history


def test_a_vector_is_named_as_in_the_file_or_as_is_told_of_it(tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    told = {"force": {"name": "Seil", "unit": "N", "data": FORCE}, "position": {"unit": "mm", "data": POSITION}}
    scipy.io.savemat(path, {**told, "fs": 2000.0})
    for name in ("Seil", "force.data"):
        check(path, channels={"force": name, "position": "position"})


def test_a_few_results_on_another_sheet_are_named(tmp_path: Path) -> None:
    openpyxl = pytest.importorskip("openpyxl")
    path = tmp_path / "a.xlsx"
    book = openpyxl.Workbook()
    book.active.title = "Data"
    book.active.append(["time [s]", "force [N]", "position [mm]"])
    for i in range(600):
        book.active.append([i / 2000, 12.5 + 0.001 * i, -0.25 - 0.0001 * i])
    results = book.create_sheet("Results")
    for i in range(6):
        results.append([i + 1, 50.0 + i])
    book.save(path)
    history = read_record(path).history
    assert 'Read from the sheet "Data".' in history
    assert 'Rows of numbers on other sheets are left out: "Results" (6 rows).' in history
    results.append([7, 56.0])
    book.save(path)
    with pytest.raises(DataError, match=r'tables on 2 sheets \("Data", "Results"\)'):
        read_record(path)


def test_nan_is_masked(tmp_path: Path) -> None:
    force = FORCE.copy()
    force[[3, 4]] = np.nan, np.inf
    scipy.io.savemat(tmp_path / "a.mat", {"time_s": TIME, "force_N": force})
    column = read_table(tmp_path / "a.mat").column("force_N")
    assert dict(column.masked) == {"not a number": 1, "overflow": 1}


def test_single_precision_times(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"time_s": (TIME + 100).astype("f4"), "force_N": FORCE})
    record = read_record(tmp_path / "a.mat")
    assert record.uniform
    assert record.rate == pytest.approx(2000.0)


@pytest.mark.parametrize("length", [50, 200, 700])
def test_damaged_matlab(length: int, tmp_path: Path) -> None:
    path = tmp_path / "a.mat"
    scipy.io.savemat(path, {"time_s": TIME, "force_N": FORCE})
    path.write_bytes(path.read_bytes()[:length])
    with pytest.raises(DataError, match="the file is damaged"):
        read_record(path)


def test_matlab_without_vectors(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"a": 1.0, "b": "text"})
    with pytest.raises(DataError, match="no vectors of numbers"):
        read_record(tmp_path / "a.mat")


@pytest.mark.extra("nptdms")
def test_tdms_with_rates(tmp_path: Path) -> None:
    import nptdms

    path = tmp_path / "a.tdms"
    fast = {"wf_increment": 5e-4, "wf_start_offset": 0.0}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment(
            [
                nptdms.ChannelObject("fast", "Kraft", FORCE, properties={**fast, "unit_string": "N"}),
                nptdms.ChannelObject("fast", "Weg", POSITION, properties={**fast, "unit_string": "mm"}),
                nptdms.ChannelObject("slow", "Temp", FORCE[:10], properties={"wf_increment": 0.1, "unit_string": "°C"}),
            ]
        )
    check(path)
    assert "Left out, sampled at 10 Hz: Temp." in read_record(path).history


@pytest.mark.extra("nptdms")
def test_tdms_with_times(tmp_path: Path) -> None:
    import nptdms

    path = tmp_path / "a.tdms"
    names = {"Time [s]": TIME, "Force [N]": FORCE, "Position [mm]": POSITION}
    with nptdms.TdmsWriter(path) as writer:
        writer.write_segment([nptdms.ChannelObject("all", name, values) for name, values in names.items()])
    check(path)
    path.write_bytes(path.read_bytes()[:40])
    with pytest.raises(DataError, match="no channel of numbers|TDMS file is damaged"):
        read_record(path)


@pytest.mark.extra("asammdf")
def test_mdf(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    import asammdf

    path = tmp_path / "a.mf4"
    with asammdf.MDF(version="4.10") as file:
        file.append(
            [asammdf.Signal(FORCE, TIME, name="Kraft", unit="N"), asammdf.Signal(POSITION, TIME, name="Weg", unit="mm")]
        )
        file.append([asammdf.Signal(FORCE[:10], TIME[:10] * 100, name="Temp", unit="C")])
        file.save(path, overwrite=True)
    check(path)
    assert "Channels of other groups are left out: Temp." in read_record(path).history
    path.write_bytes(path.read_bytes()[:300])
    with pytest.raises(DataError, match="the MDF file is damaged"):
        read_record(path)
    assert "Traceback" not in capfd.readouterr().err


@pytest.mark.parametrize(
    ("start", "package", "extra"), [(b"TDSm", "nptdms", "tdms"), (b"MDF     4.10", "asammdf", "mdf")]
)
def test_a_missing_package_names_its_extra(
    start: bytes, package: str, extra: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    real = importlib.import_module

    def without(name: str, *rest: Any) -> Any:
        if name == package:
            raise ImportError(name)
        return real(name, *rest)

    monkeypatch.setattr(importlib, "import_module", without)
    (tmp_path / "a.bin").write_bytes(start)
    with pytest.raises(DataError, match=rf"needs the package {package}.*pip install 'fibrefit\[{extra}\]'"):
        read_record(tmp_path / "a.bin")


def test_what_is_stated_of_text_changes_nothing_in_arrays_and_is_told(tmp_path: Path) -> None:
    scipy.io.savemat(tmp_path / "a.mat", {"time_s": TIME, "force_N": FORCE, "position_mm": POSITION})
    notes = read_record(tmp_path / "a.mat", columns=("a", "b", "c"), header=tmp_path / "a.ini").notes
    assert "What is stated of columns and header changed nothing: the file has a layout of its own." in notes
    np.savez(tmp_path / "b.npz", data=np.c_[TIME, FORCE, POSITION])
    named = read_record(tmp_path / "b.npz", columns=("time [s]", "force [N]", "position [mm]"))
    assert not any("changed nothing" in one for one in named.notes)
    np.savez(tmp_path / "c.npz", time_s=TIME, force_N=FORCE, position_mm=POSITION)
    notes = read_record(tmp_path / "c.npz", columns=("time [s]", "force [N]", "position [mm]")).notes
    assert "What is stated of columns changed nothing: the file has a layout of its own." in notes
