"""Archives, NumPy and Parquet files: what is one table in them, and what is refused by its name."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import lzma
import tarfile
import zipfile
from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.parquet as pq
import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

N = 60
TIME = np.arange(N) / 2000
FORCE = np.round(20.0 + 3.0 * np.sin(0.3 * np.arange(N)), 4)
POSITION = np.round(-3.0 + 0.01 * np.arange(N), 4)
LINES = "".join(f"{t},{f},{x}\n" for t, f, x in zip(TIME, FORCE, POSITION, strict=True))
PLAIN = f"time [s],force [N],position [mm]\n{LINES}".encode()
NAMED = {"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}
STAMPS = [datetime(2023, 11, 2, 10) + timedelta(microseconds=500 * i) for i in range(N)]


def check(path: Path, **options: Any) -> tuple[str, ...]:
    record = read_record(path, **options)
    np.testing.assert_allclose(record.time - record.time[0], TIME, rtol=0, atol=1e-9)
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], POSITION / 1e3, rtol=4e-16)
    return record.history


def tar(**files: bytes) -> bytes:
    made = io.BytesIO()
    with tarfile.open(fileobj=made, mode="w") as archive:
        for name, content in files.items():
            entry = tarfile.TarInfo(name)
            entry.size = len(content)
            archive.addfile(entry, io.BytesIO(content))
    return made.getvalue()


def zipped(**files: bytes) -> bytes:
    made = io.BytesIO()
    with zipfile.ZipFile(made, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return made.getvalue()


@pytest.mark.parametrize("pack", [bz2.compress, lzma.compress, gzip.compress])
def test_what_is_compressed_is_read(pack: Callable[[bytes], bytes], write: Callable) -> None:
    check(write(pack(PLAIN), "a.csv.packed"))
    check(write(pack(tar(**{"a.csv": PLAIN, "notes.txt": b"drop 7\n"})), "b.tar.packed"))
    with pytest.raises(DataError, match="the archive is damaged"):
        read_record(write(pack(PLAIN)[:-20], "c.csv.packed"))


def test_a_tar_archive_is_no_text(write: Callable) -> None:
    check(write(tar(**{"a.csv": PLAIN}), "a.tar"))
    with pytest.raises(DataError, match=r"an archive that holds 2 measurement files \(a.csv, b.csv\)"):
        read_record(write(tar(**{"a.csv": PLAIN, "b.csv": PLAIN}), "b.tar"))
    with pytest.raises(DataError, match="an archive in an archive"):
        read_record(write(zipped(**{"a.tar": tar(**{"a.csv": PLAIN})}), "c.zip"))


FOREIGN = {
    "an OpenDocument file": zipped(
        **{"mimetype": b"application/vnd.oasis.opendocument.spreadsheet", "content.xml": b""}
    ),
    r"a binary workbook \(.xlsb\)": zipped(**{"[Content_Types].xml": b"", "xl/workbook.bin": b""}),
    "a text document": zipped(**{"[Content_Types].xml": b"", "word/document.xml": b""}),
    "an Arrow or Feather file": b"ARROW1\0\0" + bytes(100),
    "a NetCDF 3 file": b"CDF\x02" + bytes(100),
    "a data base": b"SQLite format 3\0" + bytes(100),
}


@pytest.mark.parametrize("what", FOREIGN)
def test_foreign_files_are_called_what_they_are(what: str, write: Callable) -> None:
    with pytest.raises(DataError, match=what):
        read_record(write(FOREIGN[what], "a.bin"))


def saved(**arrays: Any) -> bytes:
    made = io.BytesIO()
    np.savez(made, **arrays)
    return made.getvalue()


NPZ: dict[str, dict[str, Any]] = {
    "vectors": NAMED,
    "vectors and a rate": {"fs": 2000.0, "force_N": FORCE, "position_mm": POSITION},
    "a matrix and names": {"data": np.c_[TIME, FORCE, POSITION], "columns": np.array(list(NAMED))},
    "a matrix and a note in JSON": {
        "data": np.c_[TIME, FORCE, POSITION],
        "meta": np.array(json.dumps({"columns": list(NAMED), "operator": "Novak"})),
    },
    "stamps": {**NAMED, "time_s": np.array(STAMPS, dtype="M8[us]")},
    "stamps in words": {**NAMED, "time_s": np.array([stamp.isoformat() for stamp in STAMPS])},
    "durations": {"time": (np.arange(N) * 500).astype("m8[us]"), "force_N": FORCE, "position_mm": POSITION},
}


@pytest.mark.parametrize("form", NPZ)
def test_npz(form: str, write: Callable) -> None:
    check(write(saved(**NPZ[form]), "a.npz"))


def test_npz_is_asked_about_as_other_files_are(write: Callable) -> None:
    with pytest.raises(DataError, match=r"force_gain = 10"):
        read_record(write(saved(**NAMED, force_gain=10.0), "a.npz"))
    objects = np.array([{}, {}], dtype=object)
    assert 'Python objects are left out: "notes".' in check(write(saved(**NAMED, notes=objects), "b.npz"))
    with pytest.raises(DataError, match="the NumPy file is damaged"):
        read_record(write(b"\x93NUMPY\x01\x00nothing", "c.npy"))


def test_npy(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", np.rec.fromarrays(list(NAMED.values()), names=list(NAMED)))
    check(tmp_path / "a.npy")
    np.save(tmp_path / "b.npy", np.c_[TIME, FORCE, POSITION])
    check(tmp_path / "b.npy", columns=["time [s]", "force [N]", "position [mm]"])


def test_an_array_that_declares_too_much_is_refused(write: Callable) -> None:
    made = io.BytesIO()
    np.lib.format.write_array_header_1_0(made, {"descr": "<f8", "fortran_order": False, "shape": (1 << 40,)})
    with pytest.raises(DataError, match="more than 1 GiB"):
        read_record(write(made.getvalue(), "a.npy"))


def parquet(path: Path, **columns: Any) -> Path:
    pq.write_table(pa.table(columns), path)
    return path


def test_parquet_with_times_that_are_no_numbers(tmp_path: Path) -> None:
    times: dict[str, list[Any]] = {
        "stamps in words": [stamp.isoformat() for stamp in STAMPS],
        "times of day": [stamp.time() for stamp in STAMPS],
        "a stamp is missing": [None, *STAMPS[1:]],
    }
    for name, values in times.items():
        path = parquet(tmp_path / f"{name}.parquet", time=values, force_N=FORCE, position_mm=POSITION)
        record = read_record(path)
        first = N - record.time.size
        np.testing.assert_allclose(record.time, TIME[first:] - TIME[first], atol=1e-9)
        np.testing.assert_array_equal(record.channels["force"], FORCE[first:])


def test_parquet_with_columns_in_columns_and_lists_in_a_row(tmp_path: Path) -> None:
    parts = [{"force_N": f, "position_mm": x} for f, x in zip(FORCE.tolist(), POSITION.tolist(), strict=True)]
    check(parquet(tmp_path / "a.parquet", time_s=TIME, sensors=parts))
    lists = {"fs_hz": [2000.0], "force_N": [FORCE.tolist()], "position_mm": [POSITION.tolist()]}
    check(parquet(tmp_path / "b.parquet", **lists))
    with pytest.raises(DataError, match=r"gain = 10"):
        read_record(parquet(tmp_path / "c.parquet", **lists, gain=[10.0]))
    with pytest.raises(DataError, match=r'"force_N" holds a list in each row.*Write each row to a file of its own'):
        read_record(parquet(tmp_path / "d.parquet", **{key: value * 2 for key, value in lists.items()}))


@pytest.mark.parametrize(
    ("encoding", "names"),
    [
        ("cp850", ["Zeit [s]", "Kraft [N]", "Weg [\u00b5m]"]),
        (
            "koi8_r",
            [
                "\u0412\u0440\u0435\u043c\u044f [\u0441]",
                "\u0421\u0438\u043b\u0430 [\u041d]",
                "\u041f\u0435\u0440\u0435\u043c\u0435\u0449\u0435\u043d\u0438\u0435 [\u043c\u043c]",
            ],
        ),
    ],
)
def test_alphabets_of_older_programs(encoding: str, names: list[str], write: Callable) -> None:
    micro = encoding == "cp850"
    lines = [f"{t},{f},{1e3 * x if micro else x:.4f}" for t, f, x in zip(TIME, FORCE, POSITION, strict=True)]
    record = read_record(write("\n".join([",".join(names), *lines, ""]).encode(encoding), "a.csv"))
    np.testing.assert_array_equal(record.channels["force"], FORCE)
    np.testing.assert_allclose(record.channels["position"], POSITION / 1e3, rtol=1e-12)


def test_a_member_of_a_negative_size_is_refused(write: Callable) -> None:
    head = bytearray(tar(**{"a.csv": b""})[:512])
    head[124:136] = b"\xff" * 10 + (0x10000 - 512).to_bytes(2, "big")  # minus one block: the head is read again
    head[148:156] = b" " * 8
    head[148:156] = f"{sum(head):06o}\0 ".encode()
    with pytest.raises(DataError, match="a negative size"):
        read_record(write(bytes(head) + bytes(1024), "a.tar"))


def test_endings_in_capitals_are_the_same(write: Callable) -> None:
    book = pytest.importorskip("openpyxl").Workbook()
    for row in (tuple(NAMED), *zip(*(column.tolist() for column in NAMED.values()), strict=True)):
        book.active.append(row)
    made = io.BytesIO()
    book.save(made)
    check(write(made.getvalue(), "A.XLSX"))
    check(write(zipped(**{"A.XLSX": made.getvalue()}), "a.zip"))
    check(write(saved(**NAMED), "A.NPZ"))


def test_packed_arrays_are_called_so_by_their_content(write: Callable) -> None:
    packed = zipped(**{"a.hdf5": b"\x89HDF\r\n\x1a\n" + bytes(100)})
    with pytest.raises(DataError, match='a packed file of another kind \\("a.hdf5"\\)'):
        read_record(write(packed, "a.zip"))


def test_texts_count_as_what_they_take_in_memory(write: Callable, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("fibrefit.core.limits.LARGEST", 1 << 16)
    with pytest.raises(DataError, match="unpacked or declared"):
        read_record(write(saved(**NAMED, words=np.full(2000, "a")), "a.npz"))
    check(write(saved(**NAMED), "b.npz"))
