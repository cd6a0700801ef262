"""Files that are not what they seem: whose numbers stand in another file, or that are packed twice."""

from __future__ import annotations

import gzip
import io
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import h5py
import numpy as np
import pytest

from fibrefit.core.errors import DataError
from fibrefit.records import read_record

RECORD = Path(__file__).resolve().parents[2] / "configs" / "drop_series" / "drop_10mm_90deg.csv"
TABLE = np.loadtxt(RECORD, delimiter=",", skiprows=1)


def linked(file: Any) -> None:
    file["force [N]"] = h5py.ExternalLink("other.h5", "/force")


def virtual(file: Any) -> None:
    layout = h5py.VirtualLayout((len(TABLE),), "f8")
    layout[:] = h5py.VirtualSource("other.h5", "force", (len(TABLE),))
    file.create_virtual_dataset("force [N]", layout)


def raw(file: Any) -> None:
    file.create_dataset("force [N]", (len(TABLE),), "f8", external=[("other.raw", 0, 8 * len(TABLE))])


def own(file: Any) -> None:
    file["readings"] = TABLE[:, 1]
    file["force [N]"] = h5py.SoftLink("/readings")


def written(folder: Path, force: Callable[[Any], None]) -> Path:
    with h5py.File(folder / "other.h5", "w") as other:
        other["force"] = TABLE[:, 1]
    (folder / "other.raw").write_bytes(TABLE[:, 1].tobytes())
    path = folder / "one.h5"
    with h5py.File(path, "w") as file:
        file["time [s]"], file["position [mm]"] = TABLE[:, 0], TABLE[:, 2]
        force(file)
    return path


@pytest.mark.parametrize("force", [linked, virtual, raw])
def test_numbers_that_another_file_holds_are_not_read(tmp_path: Path, force: Callable[[Any], None]) -> None:
    """It may change, and no digest of it is kept; and it may be any file that the reader may read."""
    says = r'one.h5: "force \[N\]" is kept in another file, "other\.(h5|raw)"; expected one file.*Copy it into one file'
    with pytest.raises(DataError, match=says):
        read_record(written(tmp_path, force))


def test_links_within_a_file_are(tmp_path: Path) -> None:
    assert np.array_equal(read_record(written(tmp_path, own)).channels["force"], TABLE[:, 1])


def zipped(*entries: tuple[str, bytes]) -> bytes:
    packed = io.BytesIO()
    with zipfile.ZipFile(packed, "w") as archive:
        for name, content in entries:
            archive.writestr(name, content)
    return packed.getvalue()


@pytest.mark.parametrize(
    ("name", "pack"),
    [
        ("twice.zip", lambda text: zipped(("inner.zip", zipped(("drop.csv", text))))),
        ("twice.csv.gz", lambda text: gzip.compress(gzip.compress(text))),
        ("mixed.zip", lambda text: zipped(("drop.csv.gz", gzip.compress(text)))),
        ("mixed.gz", lambda text: gzip.compress(zipped(("drop.csv", text)))),
    ],
)
def test_what_is_packed_twice_is_not_taken_for_a_text(
    tmp_path: Path, name: str, pack: Callable[[bytes], bytes]
) -> None:
    """A text stored in an archive in an archive was read, with the inner archive's head as the name of a column."""
    (tmp_path / name).write_bytes(pack(RECORD.read_bytes()))
    with pytest.raises(DataError, match=r"an archive in an archive .*; expected one measurement file in it"):
        read_record(tmp_path / name)


def test_what_is_packed_once_is_read(tmp_path: Path) -> None:
    (tmp_path / "once.zip").write_bytes(zipped(("../../drop.csv", RECORD.read_bytes())))
    assert np.allclose(read_record(tmp_path / "once.zip").channels["force"], TABLE[:, 1])
    assert not (tmp_path.parent.parent / "drop.csv").exists()
