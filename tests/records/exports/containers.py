"""Archives, spreadsheets and binary tables around the same record."""

from __future__ import annotations

import gzip
import io
import json
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, f, lines, t, tfu, u

CONTAINERS = Kind()
add = CONTAINERS.add
PLAIN = "Time [s],Force [N],Position [mm]\n" + lines(tfu())


def zipped(files: dict[str, bytes]) -> bytes:
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def sheet(rows: list[list[Any]], more: list[list[Any]] | None = None) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import openpyxl

        book = openpyxl.Workbook()
        for row in rows:
            book.active.append(row)
        for row in more or ():
            (book["Info"] if "Info" in book.sheetnames else book.create_sheet("Info", 0)).append(row)
        book.save(path)

    return write


def parquet(
    columns: dict[str, np.ndarray], metadata: dict[str, dict[str, str]] | None = None
) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        fields = [
            pa.field(name, pa.array(values).type, metadata=(metadata or {}).get(name))
            for name, values in columns.items()
        ]
        pq.write_table(pa.table([pa.array(values) for values in columns.values()], schema=pa.schema(fields)), path)

    return write


def hdf5(
    sets: dict[str, np.ndarray], units: dict[str, str] | None = None, key: str = "units", **attributes: Any
) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            for name, values in sets.items():
                data = file.create_dataset(name, data=values)
                if units and name in units:
                    data.attrs[key] = units[name]
            for name, value in attributes.items():
                file.attrs[name] = value

    return write


NUMBERS = {"time": TIME, "force": FORCE, "position": POSITION}
UNITS = {"time": "s", "force": "N", "position": "mm"}
ROWS = [
    ["Time [s]", "Force [N]", "Position [mm]"],
    *([float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)),
]
add("gzip", gzip.compress(PLAIN.encode()), suffix=".csv.gz")
add("zip of one file", zipped({"run3.csv": PLAIN.encode()}), suffix=".zip")
add("zip with a readme", zipped({"readme.md": b"# run 3\nwords\n", "run3.csv": PLAIN.encode()}), suffix=".zip")
add("zip of two records", zipped({"a.csv": PLAIN.encode(), "b.csv": PLAIN.encode()}), suffix=".zip", refused="a.csv")
add(
    "zip in a folder",
    zipped({"data/run3.csv": PLAIN.encode(), "__MACOSX/data/._run3.csv": b"\x00\x05\x16\x07"}),
    suffix=".zip",
)
add("empty zip", zipped({}), suffix=".zip", refused="no file|empty|holds")
add("damaged gzip", gzip.compress(PLAIN.encode())[:200], suffix=".csv.gz", refused="damaged")
add("gzip of UTF-16", gzip.compress(PLAIN.encode("utf-16")), suffix=".csv.gz")
add("xlsx", sheet(ROWS), suffix=".xlsx")
add("xlsx with a units row", sheet([["Time", "Force", "Position"], ["s", "N", "mm"], *ROWS[1:]]), suffix=".xlsx")
add("xlsx with rows above", sheet([["Rig 3"], ["Operator", "Novak"], [], *ROWS]), suffix=".xlsx")
add("xlsx with a sheet before", sheet(ROWS, [["Rig", 3], ["Operator", "Novak"]]), suffix=".xlsx")
add("xlsx without times, rate above", sheet([["Sample rate", 2000, "Hz"], *[row[1:] for row in ROWS]]), suffix=".xlsx")
add(
    "Parquet with units in names",
    parquet({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}),
    suffix=".parquet",
)
add("Parquet with units in fields", parquet(NUMBERS, {k: {"unit": v} for k, v in UNITS.items()}), suffix=".parquet")
add(
    "Parquet with a timestamp",
    parquet(
        {
            "timestamp": (
                np.datetime64("2024-05-12T14:22:11", "ns") + (np.arange(N) * 500000).astype("timedelta64[ns]")
            ),
            "force [N]": FORCE,
            "position [mm]": POSITION,
        }
    ),
    suffix=".parquet",
)
add("HDF5 with unit attributes", hdf5(NUMBERS, UNITS, "unit"), suffix=".h5")
add("HDF5 with units attributes", hdf5(NUMBERS, UNITS, "units"), suffix=".hdf5")
add("HDF5 with Unit in bytes", hdf5(NUMBERS, {k: np.bytes_(v) for k, v in UNITS.items()}, "Unit"), suffix=".h5")
add(
    "HDF5 in a group",
    hdf5({f"run1/{k}": v for k, v in NUMBERS.items()}, {f"run1/{k}": v for k, v in UNITS.items()}),
    suffix=".h5",
)
add(
    "HDF5 with a rate attribute",
    hdf5({"force": FORCE, "position": POSITION}, UNITS, sampling_rate=2000.0),
    suffix=".h5",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "HDF5 with a rate in its name",
    hdf5({"force": FORCE, "position": POSITION}, UNITS, sampling_rate_Hz=2000.0),
    suffix=".h5",
)
add(
    "HDF5 matrix with column names",
    hdf5({"data": np.stack([TIME, FORCE, POSITION], 1)}, columns=["time [s]", "force [N]", "position [mm]"]),
    suffix=".h5",
    refused="data",
)


def mat(path: Path) -> None:
    import scipy.io

    scipy.io.savemat(path, {"t_s": TIME, "F_N": FORCE, "x_mm": POSITION})


def npz(path: Path) -> None:
    with path.open("wb") as file:
        np.savez(file, time_s=TIME, force_N=FORCE, position_mm=POSITION)


add("MATLAB 5", mat, suffix=".mat")
add("npz", npz, suffix=".npz", refused="CSV|numpy|npz|archive")
add(
    "JSON lines",
    lines(lambda i: json.dumps({"time_s": float(t(i)), "force_N": float(f(i)), "position_mm": float(u(i))})),
    suffix=".jsonl",
)
add(
    "JSON lines with a line of words before",
    json.dumps({"rig": 3, "operator": "N."})
    + "\n"
    + lines(lambda i: json.dumps({"time [s]": float(t(i)), "force [N]": float(f(i)), "position [mm]": float(u(i))})),
    suffix=".jsonl",
)
add(
    "JSON lines, nested",
    lines(lambda i: json.dumps({"ts": float(t(i)), "values": {"force": float(f(i)), "position": float(u(i))}})),
    suffix=".ndjson",
    options={"units": {"time": "s", "force": "N", "position": "mm"}, "channels": {"time": "ts"}},
)
add(
    "JSON lines with ISO stamps",
    lines(
        lambda i: json.dumps(
            {
                "timestamp": f"2024-05-12T14:22:{11 + i / 2000:07.4f}Z",
                "force_N": float(f(i)),
                "position_mm": float(u(i)),
            }
        )
    ),
    suffix=".jsonl",
)
add(
    "JSON lines with a missing key",
    lines(
        lambda i: json.dumps(
            {"time_s": float(t(i)), "force_N": float(f(i))} | ({"position_mm": float(u(i))} if i != 20 else {})
        )
    ),
    suffix=".jsonl",
)
add(
    "JSON array of rows",
    json.dumps([{"time_s": float(t(i)), "force_N": float(f(i)), "position_mm": float(u(i))} for i in range(N)]),
    suffix=".json",
)
add(
    "JSON of columns",
    json.dumps({"time_s": TIME.tolist(), "force_N": FORCE.tolist(), "position_mm": POSITION.tolist()}),
    suffix=".json",
)
add(
    "JSON lines cut short",
    lines(lambda i: json.dumps({"time_s": float(t(i)), "force_N": float(f(i)), "position_mm": float(u(i))}))[:-20],
    suffix=".jsonl",
    refused="line 60|cut",
)
