"""Containers with rates, steps, scales and errors beside their arrays."""

from __future__ import annotations

import gzip
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, f, lines, t, u
from tests.records.exports.containers import NUMBERS, PLAIN, UNITS, parquet, sheet, zipped

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
