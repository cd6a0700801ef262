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


BOXES = Kind()
"""A sixth set, of containers alone, written after the reader was mended for the fifth."""
box = BOXES.add


def made(fill: Callable[[Any], None]) -> Callable[[Path], None]:
    """An HDF5 file that a function fills."""

    def write(path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            fill(file)

    return write


def measured(file: Any, names: tuple[str, ...] = ("time", "force", "position")) -> None:
    for name in names:
        file.create_dataset(name, data=NUMBERS[name]).attrs["units"] = UNITS[name]


def told(values: dict[str, Any], **of: dict[str, Any]) -> Callable[[Path], None]:
    """Force and position with further data sets, attributes of these, and attributes of the file."""

    def fill(file: Any) -> None:
        measured(file, ("force", "position"))
        for name, value in values.items():
            file.create_dataset(name, data=value)
        for name, attributes in of.items():
            (file if name == "file" else file[name]).attrs.update(attributes)

    return made(fill)


ASKED = {"refused": "rate|unit|Hz", "remedy": {"rate": 2000.0}}
box("HDF5, a step in ms", told({"dt": 0.5}, dt={"units": "ms"}), suffix=".h5", **ASKED)
box("HDF5, a step in us as an attribute", told({}, file={"dt": 500, "dt_unit": "us"}), suffix=".h5", **ASKED)
box(
    "HDF5, a rate in kHz beside its unit",
    told({}, file={"sampling_rate": 2.0, "sampling_rate_unit": "kHz"}),
    suffix=".h5",
    **ASKED,
)
box(
    "HDF5, times since a stamp",
    told({"time": TIME}, time={"units": "seconds since 2023-11-02 10:00:00"}),
    suffix=".h5",
    refused="unit|time",
    remedy={"units": {"time": "s"}},
)
box(
    "HDF5, ns since 1970",
    told({"time": 1698919200000000000 + (np.arange(N) * 500000)}, time={"units": "ns"}),
    suffix=".h5",
    atol_time=1e-6,
)
box(
    "HDF5, errors beside",
    told(
        {"time": TIME, "force_errors": 0.01 + 0 * FORCE, "position_errors": 0.01 + 0 * FORCE},
        time={"units": "s"},
        force_errors={"units": "N"},
        position_errors={"units": "mm"},
    ),
    suffix=".h5",
    refused="could each",
    remedy={"channels": {"force": "force", "position": "position"}},
)


def raw_and_scaled(file: Any) -> None:
    measured(file.create_group("scaled"))
    for name in ("force", "position"):
        file.create_dataset(f"raw/{name}", data=NUMBERS[name] / 100).attrs["units"] = "V"


box(
    "HDF5, raw and scaled",
    made(raw_and_scaled),
    suffix=".h5",
    refused="could each|time|unit",
    remedy={"channels": {"force": "scaled.force", "position": "scaled.position"}},
)


def with_fill(file: Any) -> None:
    measured(file)
    file["force"][10:12] = -9999.0
    file["force"].attrs["_FillValue"] = -9999.0


box("HDF5, a value for nothing", made(with_fill), suffix=".h5")
box("HDF5, rows and labels", told({"time": TIME}, time={"units": "s", "long_name": "elapsed"}), suffix=".h5")
box(
    "HDF5, force times ten by its exponent",
    told({"time": TIME}, time={"units": "s"}, force={"exponent": 1}),
    suffix=".h5",
    refused="exponent",
    remedy={"channels": {"force": {"column": "force", "scale": "1"}}},
)


def matlab(**values: Any) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        import scipy.io

        scipy.io.savemat(path, values)

    return write


box(
    "MATLAB, a rate in kHz by its name", matlab(fs_kHz=2.0, force_N=FORCE, position_mm=POSITION), suffix=".mat", **ASKED
)
box("MATLAB, a step in ms by its name", matlab(dt_ms=0.5, force_N=FORCE, position_mm=POSITION), suffix=".mat", **ASKED)
box(
    "MATLAB, a structure for each channel",
    matlab(
        time_s=TIME,
        ch=[{"name": "force", "unit": "N", "data": FORCE}, {"name": "position", "unit": "mm", "data": POSITION}],
    ),
    suffix=".mat",
    refused="unit|channel|struct|vectors|known",
)
box(
    "MATLAB, a matrix with names and units",
    matlab(
        data=np.stack([TIME, FORCE, POSITION], 1),
        names=np.array(["time", "force", "position"], object),
        units=np.array(["s", "N", "mm"], object),
    ),
    suffix=".mat",
    refused="unit|time|name",
)
box(
    "MATLAB, counts and their scales",
    matlab(time_s=TIME, force_N=np.round(FORCE * 1e3), force_scale=1e-3, position_mm=POSITION),
    suffix=".mat",
    refused="scale",
    remedy={"channels": {"force": {"column": "force_N", "scale": "0.001"}}},
)
box(
    "Parquet, stamps as whole numbers",
    parquet({"timestamp_us": 1698919200000000 + np.arange(N) * 500, "force (N)": FORCE, "position (mm)": POSITION}),
    suffix=".parquet",
    atol_time=1e-6,
)
box(
    "Parquet, holes",
    parquet({"time_s": TIME, "force_N": np.where(np.arange(N) == 9, np.nan, FORCE), "position_mm": POSITION}),
    suffix=".parquet",
)
box(
    "JSON, a rate with its unit",
    json.dumps(
        {"sample_rate": {"value": 2, "unit": "kHz"}, "force_N": FORCE.tolist(), "position_mm": POSITION.tolist()}
    ),
    suffix=".json",
    **ASKED,
)
box(
    "JSON, a step with its unit apart",
    json.dumps({"interval": 500, "interval_unit": "us", "force_N": FORCE.tolist(), "position_mm": POSITION.tolist()}),
    suffix=".json",
    **ASKED,
)
box(
    "JSON lines in gzip",
    gzip.compress(
        lines(
            lambda i: json.dumps({"time_s": float(t(i)), "force_N": float(f(i)), "position_mm": float(u(i))})
        ).encode()
    ),
    suffix=".jsonl.gz",
)
box(
    "JSON, traces of a plot",
    json.dumps(
        {
            "data": [
                {"name": "force [N]", "x": TIME.tolist(), "y": FORCE.tolist()},
                {"name": "position [mm]", "x": TIME.tolist(), "y": POSITION.tolist()},
            ]
        }
    ),
    suffix=".json",
    refused="JSON|table|list|unit|channel",
)
box(
    "xlsx, a rate in kHz in cells",
    sheet(
        [["Rate", 2, "kHz"], ["force [N]", "position [mm]", None], *[[FORCE[i], POSITION[i], None] for i in range(N)]]
    ),
    suffix=".xlsx",
    **ASKED,
)
box(
    "xlsx, formulas nobody computed",
    sheet(
        [
            ["time [s]", "force [N]", "position [mm]"],
            *[[f"=A{i + 1}+0.0005" if i else 0.0, FORCE[i], POSITION[i]] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    refused="formula|empty|time|rate|number",
)
box(
    "zip with a table of settings",
    zipped({"run.csv": PLAIN.encode(), "settings.csv": b"name,value\nmass,3.096\nlength,599\n"}),
    suffix=".zip",
    refused="settings|files|one",
)
