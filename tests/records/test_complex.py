"""Complex numbers in files of arrays: which part was meant is not guessed, and what is left out is told."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import h5py
import numpy as np
import pytest
import scipy.io

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

N = 100
TIME = np.arange(N) / 2000
FORCE = 20.0 + np.sin(0.3 * np.arange(N))
REAL = {"time_s": TIME, "force_N": FORCE, "position_mm": np.cos(0.3 * np.arange(N))}


def as_npz(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    np.savez(path.with_suffix(".npz"), **arrays)
    return path.with_suffix(".npz")


def as_fields(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    np.save(path.with_suffix(".npy"), np.rec.fromarrays(list(arrays.values()), names=list(arrays)))
    return path.with_suffix(".npy")


def as_matlab(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    scipy.io.savemat(path.with_suffix(".mat"), arrays)
    return path.with_suffix(".mat")


def as_structure(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    scipy.io.savemat(path.with_suffix(".mat"), {"rec": arrays})
    return path.with_suffix(".mat")


def as_hdf5(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    with h5py.File(path.with_suffix(".h5"), "w") as file:
        for name, values in arrays.items():
            file[name] = values
    return path.with_suffix(".h5")


def as_matlab_7_3(path: Path, arrays: dict[str, np.ndarray]) -> Path:
    """MATLAB names the parts of a complex number otherwise than h5py does."""
    with h5py.File(path.with_suffix(".mat"), "w") as file:
        for name, values in arrays.items():
            kept = values
            if np.iscomplexobj(values):
                kept = np.rec.fromarrays([values.real, values.imag], names=["real", "imag"])
            file.create_dataset(name, data=np.atleast_2d(kept)).attrs["MATLAB_class"] = np.bytes_("double")
    return path.with_suffix(".mat")


FORMS = [as_npz, as_fields, as_matlab, as_structure, as_hdf5, as_matlab_7_3]


@pytest.mark.parametrize("written", FORMS)
def test_a_further_array_of_complex_numbers_is_told(written: Callable, tmp_path: Path) -> None:
    record = read_record(written(tmp_path / "a", {**REAL, "spectrum": np.fft.fft(FORCE)}))
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    told = [note for note in record.history if "complex" in note]
    assert len(told) == 1
    assert 'spectrum" holds complex numbers, where readings are real: it is left out.' in told[0]


@pytest.mark.parametrize("written", FORMS)
def test_of_a_force_of_complex_numbers_no_part_is_taken(written: Callable, tmp_path: Path) -> None:
    filtered = np.fft.ifft(np.fft.fft(FORCE))
    record = read_record(written(tmp_path / "a", {**REAL, "force_N": filtered}))
    assert "force" not in record.channels
    assert any('force_N" holds complex numbers' in note for note in record.history)


@pytest.mark.parametrize("written", FORMS)
def test_nothing_but_complex_numbers_is_refused_as_that(written: Callable, tmp_path: Path) -> None:
    with pytest.raises(DataError, match="holds complex numbers"):
        read_record(written(tmp_path / "a", {"force_N": FORCE + 0j, "position_mm": FORCE + 0j}))
