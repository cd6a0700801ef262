"""``result.h5`` reads back, opens in xarray, and holds no types that a reader has to guess."""

from __future__ import annotations

from pathlib import Path

import h5py
import numpy as np
import pytest
import xarray

from fibrefit.core import limits
from fibrefit.core.errors import DataError
from fibrefit.store import read_result, write_result
from fibrefit.study.summaries.part import Variable
from fibrefit.study.summaries.results import Provenance

PROVENANCE = Provenance(
    created="2026-11-20T12:00:00+00:00",
    versions={"numpy": "2.4"},
    inputs={"ä.csv": "ab" * 32},
    resolved_study='name = "Füße"\n' + "# long\n" * 20_000,
    seed=7,
)
RNG = np.random.default_rng(0)
GROUPS = {
    "posterior": {
        "stiffness": Variable(RNG.normal(size=(4, 600)), ("chain", "draw"), "N/m", "Stiffness of the fibre."),
        "friction": Variable(RNG.normal(size=(4, 600)), ("chain", "draw"), "N"),
        "draw": Variable(np.arange(100, 700), ("draw",)),
    },
    "observed_data": {
        "force": Variable(np.array([[1.0, np.nan], [2.0, 3.0]]), ("record", "sample"), "N"),
        "valid": Variable(np.array([[True, False], [True, True]]), ("record", "sample")),
        "record": Variable(np.array(["a.csv", "ä.csv"]), ("record",)),
        "rate": Variable(np.array(2000.0), (), "Hz"),
    },
}


@pytest.fixture
def path(tmp_path: Path) -> Path:
    write_result(tmp_path / "result.h5", "fibrefit/posterior/1", GROUPS, PROVENANCE)
    return tmp_path / "result.h5"


def test_it_reads_back(path: Path) -> None:
    groups, attributes = read_result(path)
    assert attributes == {"schema": "fibrefit/posterior/1", "created": PROVENANCE.created, "seed": 7}
    for name, variables in GROUPS.items():
        for key, variable in variables.items():
            found = groups[name][key]
            np.testing.assert_array_equal(found.values, variable.values)
            assert (found.dims, found.unit, found.doc) == (variable.dims, variable.unit, variable.doc)
    assert groups["posterior"]["chain"].values.tolist() == [0, 1, 2, 3]
    assert groups["provenance"]["resolved_study"].values == PROVENANCE.resolved_study
    assert groups["provenance"]["inputs"].values == f"{'ab' * 32}  ä.csv"


def test_it_opens_in_xarray(path: Path) -> None:
    with xarray.open_dataset(path, group="posterior", engine="h5netcdf") as posterior:
        assert posterior.stiffness.dims == ("chain", "draw")
        assert posterior.stiffness.attrs["units"] == "N/m"
        assert posterior.draw.values[0] == 100
        np.testing.assert_array_equal(posterior.friction, GROUPS["posterior"]["friction"].values)
    with xarray.open_dataset(path, group="observed_data", engine="h5netcdf") as observed:
        assert observed.record.values.tolist() == ["a.csv", "ä.csv"]
        assert observed.valid.dtype == bool
        assert observed.force.sel(record="ä.csv").values.tolist() == [2.0, 3.0]


def test_types_are_explicit(path: Path) -> None:
    with h5py.File(path, "r") as file:
        assert file["posterior/stiffness"].dtype == np.dtype("<f8")
        assert file["posterior/draw"].dtype == np.dtype("<i8")
        assert file["observed_data/valid"].dtype == np.dtype("<i1")
        assert h5py.check_string_dtype(file["observed_data/record"].dtype).encoding == "utf-8"
        assert "seed" not in file["posterior"].attrs


def test_a_reader_does_not_disturb_a_writer(path: Path) -> None:
    with h5py.File(path, "r", locking=False):
        write_result(path, "fibrefit/posterior/1", {}, PROVENANCE)
    assert set(read_result(path)[0]) == {"provenance"}


@pytest.mark.parametrize(
    ("variables", "error", "says"),
    [
        ({"a": Variable(np.zeros(3), ())}, ValueError, "0 dimensions named, 1 found"),
        ({"a": Variable(np.zeros(3), ("x",)), "b": Variable(np.zeros(2), ("x",))}, ValueError, "x is 2 here and 3"),
        ({"a": Variable(np.array([{}, 1], dtype=object), ("x",))}, TypeError, "cannot be stored"),
        ({"a": Variable(np.array([1j]), ("x",))}, TypeError, "cannot be stored"),
    ],
)
def test_what_cannot_be_stored_leaves_no_file(
    tmp_path: Path, variables: dict[str, Variable], error: type[Exception], says: str
) -> None:
    with pytest.raises(error, match=says):
        write_result(tmp_path / "result.h5", "x", {"group": variables}, PROVENANCE)
    assert not list(tmp_path.iterdir())


def test_what_is_no_hdf5(tmp_path: Path) -> None:
    (tmp_path / "result.h5").write_text("no")
    with pytest.raises(DataError, match=r"result\.h5"):
        read_result(tmp_path / "result.h5")


def test_arrays_that_are_only_declared_are_refused(tmp_path: Path) -> None:
    with h5py.File(tmp_path / "result.h5", "w") as file:
        file.create_group("fit").create_dataset("force", (10**9,), "f8", chunks=(10**6,))
    with pytest.raises(DataError, match="more than 1 GiB unpacked or declared"):
        read_result(tmp_path / "result.h5")


def test_what_a_long_series_filled_is_read_again(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Beyond what any file may unpack to, a file may unpack to some times what it holds: it is no bomb."""
    path, noise = tmp_path / "result.h5", np.random.default_rng(1).standard_normal(100_000)
    write_result(path, "fibrefit/fit/1", {"fit": {"force": Variable(noise, ("time",))}}, PROVENANCE)
    monkeypatch.setattr(limits, "LARGEST", 1000)
    np.testing.assert_array_equal(read_result(path)[0]["fit"]["force"].values, noise)
    nothing = {"fit": {"force": Variable(np.zeros(5_000_000), ("time",))}}
    write_result(path, "fibrefit/fit/1", nothing, PROVENANCE)
    with pytest.raises(DataError, match="unpacked or declared"):
        read_result(path)


def test_names_with_slashes_are_names(tmp_path: Path) -> None:
    """As those of a value of one record, whose name is a path."""
    named = {"posterior": {name: Variable(np.arange(3.0), ("draw",)) for name in ("a[data/b.csv]", "50 %2F", "c")}}
    path = tmp_path / "slashes.h5"
    write_result(path, "fibrefit/posterior/1", named, PROVENANCE)
    groups, _ = read_result(path)
    assert set(groups["posterior"]) == {*named["posterior"], "draw"}
