"""Workbooks, zip archives, HDF5, Parquet, JSON and MATLAB files, with units, rates and scales in cells, attributes and fields."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, f, lines, tfu
from tests.records.exports.boxes import made, told
from tests.records.exports.containers import parquet, sheet, zipped

WORKBOOKS_AND_BINARY_FILES = Kind()
box = WORKBOOKS_AND_BINARY_FILES.add
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
ROWS = [[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)]


def book(fill: Any):
    def write(path: Path) -> None:
        import openpyxl

        made = openpyxl.Workbook()
        fill(made)
        made.save(path)

    return write


def merged(made: Any) -> None:
    page = made.active
    page.append(["Time", "Force", None, "Position"])
    page.append(["s", "V", "N", "mm"])
    for i in range(N):
        page.append([TIME[i], FORCE[i] / 100, FORCE[i], POSITION[i]])
    page.merge_cells("B1:C1")


box(
    "xlsx, one heading over two columns",
    book(merged),
    suffix=".xlsx",
    refused="could each|heading|force|unit",
    remedy={"channels": {"force": {"column": "column 3", "unit": "N"}}},
)


def formulas(made: Any) -> None:
    page = made.active
    page.append(["Time [s]", "U [V]", "Force [N]", "Position [mm]"])
    for i in range(N):
        page.append([TIME[i], FORCE[i] / 100, f"=B{i + 2}*100", POSITION[i]])


box("xlsx, formulas that nobody computed", book(formulas), suffix=".xlsx", refused="formula|empty|force|computed")


def of_day(made: Any) -> None:
    page = made.active
    page.append(["Time", "Force [N]", "Position [mm]"])
    for i in range(N):
        page.append([(0.25 + i * 0.005 / 86400), FORCE[i], POSITION[i]])
        page.cell(page.max_row, 1).number_format = "hh:mm:ss.000"


box(
    "xlsx, a clock shown from a fraction of the day",
    book(of_day),
    suffix=".xlsx",
    time=np.arange(N) * 0.005,
    refused="time|unit",
    atol_time=1e-5,
)


def three(made: Any) -> None:
    made.active.title = "Setup"
    for row in (["Load cell", "S2M", 200, "N"], ["Laser", "ILD", 25, "mm"], ["Rate", "", 2000, "Hz"]):
        made.active.append(row)
    page = made.create_sheet("Statistics")
    page.append(["", "Force [N]", "Position [mm]"])
    page.append(["mean", 12.5, 0.1])
    page.append(["max", 15.5, 1.2])
    page = made.create_sheet("Data")
    page.append(["Time [s]", "Force [N]", "Position [mm]"])
    for row in ROWS:
        page.append(row)


box("xlsx, set-up, statistics and data", book(three), suffix=".xlsx", refused="sheet")
box(
    "xlsx, numbers as texts with points",
    sheet([["Time [s]", "Force [N]", "Position [mm]"], *[[f"{a:.4f}", f"{b:.3f}", f"{c:.4f}"] for a, b, c in ROWS]]),
    suffix=".xlsx",
)
box(
    "xlsx, a table beside the table",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]", None, "Run", "Peak [N]"],
            *[[*row, None, *([k + 1, 15.0 + k] if k < 3 else [])] for k, row in enumerate(ROWS)],
        ]
    ),
    suffix=".xlsx",
    refused="could each|force|heading",
    remedy={"channels": {"force": "Force [N]"}},
)
box(
    "xlsx, a row of totals",
    sheet([["Time [s]", "Force [N]", "Position [mm]"], *ROWS, ["Mean", float(FORCE.mean()), float(POSITION.mean())]]),
    suffix=".xlsx",
)
box(
    "xlsx, units only in a remark below the names",
    sheet([["Time", "Force", "Position"], ["(in seconds)", "(in newtons)", "(in mm)"], *ROWS]),
    suffix=".xlsx",
    refused="unit",
    remedy=NAMED,
)
box(
    "xlsx, stamps with ms",
    sheet(
        [
            ["Stamp", "Force [N]", "Position [mm]"],
            *[[datetime(2023, 11, 2, 10) + timedelta(milliseconds=5 * i), *ROWS[i][1:]] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    time=np.arange(N) * 0.005,
    refused="time|rate",
    atol_time=1e-5,
)
TEXT = ("time,force,position\n" + lines(tfu())).encode()
box(
    "zip, units beside in a file of JSON",
    zipped({"drop.csv": TEXT, "drop.json": json.dumps({"units": {"force": "kN"}}).encode()}),
    suffix=".zip",
    refused="unit|holds|files",
)
box(
    "zip, a set-up as a table",
    zipped(
        {
            "drop.csv": b"time [s],force [N],position [mm]\n" + lines(tfu()).encode(),
            "setup.csv": b"key,value\nrate,2000\n",
        }
    ),
    suffix=".zip",
    refused="drop.csv|setup.csv",
)


def fields(unit_f: str, factor: float, **more: Any):
    def fill(file: Any) -> None:
        for name, values, unit in (
            ("time", TIME, "s"),
            ("force", FORCE * factor, unit_f),
            ("position", POSITION, "mm"),
        ):
            file.create_dataset(name, data=values).attrs["unit"] = unit
        for key, value in more.items():
            file["force"].attrs[key] = value

    return made(fill)


box("HDF5, unit and units that differ", fields("N", 1, units="kN"), suffix=".h5", refused="unit")
box(
    "HDF5, a conversion in words",
    fields("N", 0.5, conversion="multiply by 2"),
    suffix=".h5",
    refused="conver|multipl|scale",
    remedy={"channels": {"force": {"column": "force", "scale": "2"}}},
)
box("HDF5, a range and a filter noted", fields("N", 1, range_max=200.0, filter_hz=200.0, bits=16), suffix=".h5")
box(
    "HDF5, turned round by an attribute",
    fields("N", -1, polarity=-1),
    suffix=".h5",
    refused="polarity|sign",
    remedy={"channels": {"force": {"column": "force", "scale": "-1"}}},
)
box(
    "HDF5, stages of a series",
    made(
        lambda file: [
            file.create_dataset(f"{name}/{k:03d}", data=values[k * 20 : k * 20 + 20])
            for k in range(3)
            for name, values in (("time_s", TIME), ("force_N", FORCE), ("position_mm", POSITION))
        ]
    ),
    suffix=".h5",
    refused="could each|time|unit|length|two",
)


def matrix(file: Any) -> None:
    data = file.create_dataset("data", data=np.stack([TIME, FORCE / 1e3, POSITION], 1))
    data.attrs["columns"] = ["time", "force", "position"]
    data.attrs["units"] = ["s", "kN", "mm"]


box("HDF5, a matrix with names and units beside", made(matrix), suffix=".h5", refused="data|matrix|column|two")


def rows_of_channels(file: Any) -> None:
    data = file.create_dataset("channels", data=np.stack([FORCE, POSITION]))
    data.attrs.update({"names": "force,position", "units": "N,mm", "sample_rate_hz": 2000.0})


box("HDF5, a channel a row", made(rows_of_channels), suffix=".h5", refused="channels|matrix|column|row")
box(
    "HDF5, a start and a step",
    told({}, file={"t0": 0.0, "dt": 0.0005}),
    suffix=".h5",
    refused="rate|dt",
    remedy={"rate": 2000.0},
)
box(
    "HDF5, the rate of a sensor's output",
    told({}, file={"output_data_rate": 2000.0, "lowpass_hz": 500.0}),
    suffix=".h5",
    refused="rate",
    remedy={"rate": 2000.0},
)
box(
    "HDF5, times of the force alone",
    told({"force_time": TIME, "position_time": TIME + 2.5e-4}, force_time={"units": "s"}, position_time={"units": "s"}),
    suffix=".h5",
    refused="could each|time|two",
    remedy=None,
)
box(
    "Parquet, a name and a field that differ",
    parquet({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}, {"force_N": {"unit": "kN"}}),
    suffix=".parquet",
    refused="unit|kN",
)
box(
    "Parquet, microseconds as whole numbers",
    parquet({"t_us": (np.arange(N) * 500).astype("i8"), "force_N": FORCE, "position_mm": POSITION}),
    suffix=".parquet",
)


def with_index(path: Path) -> None:
    import pandas as pd

    index = pd.to_datetime("2023-11-02") + pd.to_timedelta(np.arange(N) * 500, unit="us")
    pd.DataFrame({"force_N": FORCE, "position_mm": POSITION}, index=index).to_parquet(path)


box("Parquet, stamps as the index of pandas", with_index, suffix=".parquet")


def decimals(path: Path) -> None:
    from decimal import Decimal

    import pyarrow as pa
    import pyarrow.parquet as pq

    pq.write_table(
        pa.table({"time_s": TIME, "force_N": [Decimal(f(i)) for i in range(N)], "position_mm": POSITION}), path
    )


box("Parquet, decimal numbers", decimals, suffix=".parquet", refused="decimal|number|text|type")
box(
    "JSON lines, a unit that changes",
    lines(
        lambda i: json.dumps(
            {
                "time_s": i / RATE,
                "force": FORCE[i] if i < 30 else FORCE[i] / 1e3,
                "force_unit": "N" if i < 30 else "kN",
                "position_mm": POSITION[i],
            }
        )
    ),
    suffix=".jsonl",
    refused="unit",
)
box(
    "JSON lines, events between",
    lines(
        lambda i: (
            json.dumps({"event": "trigger", "time_s": i / RATE})
            + "\n"
            + json.dumps({"time_s": i / RATE, "force_N": FORCE[i], "position_mm": POSITION[i]})
            if i == 20
            else json.dumps({"time_s": i / RATE, "force_N": FORCE[i], "position_mm": POSITION[i]})
        )
    ),
    suffix=".jsonl",
    refused="event|time|line|twice",
)
box(
    "JSON lines, NaN and null",
    lines(
        lambda i: json.dumps(
            {
                "time_s": i / RATE,
                "force_N": None if i == 20 else float("nan") if i == 21 else FORCE[i],
                "position_mm": POSITION[i],
            }
        )
    ),
    suffix=".jsonl",
)
box(
    "JSON lines, a scale in each line",
    lines(
        lambda i: json.dumps(
            {"time_s": i / RATE, "force_N": round(FORCE[i] * 1000), "force_scale": 0.001, "position_mm": POSITION[i]}
        )
    ),
    suffix=".jsonl",
    refused="scale",
    remedy={"channels": {"force": {"column": "force_N", "scale": "0.001"}}},
)
box(
    "JSON, series with units and a step",
    json.dumps(
        {
            "dt_ms": 0.5,
            "force": {"unit": "kN", "values": (FORCE / 1e3).tolist()},
            "position": {"unit": "mm", "values": POSITION.tolist()},
        }
    ),
    suffix=".json",
    refused="unit|rate|JSON|values|dt",
)


def mat(**values: Any):
    def write(path: Path) -> None:
        import scipy.io

        scipy.io.savemat(path, values)

    return write


box(
    "MATLAB, a matrix and its names",
    mat(data=np.stack([TIME, FORCE, POSITION], 1), names=np.array(["t_s", "F_N", "x_mm"], dtype=object)),
    suffix=".mat",
    refused="data|matrix|names|column",
)
box(
    "MATLAB, a rate called Fs",
    mat(Fs=2000.0, F_N=FORCE, x_mm=POSITION),
    suffix=".mat",
    refused="rate|Fs",
    remedy={"rate": 2000.0},
)
box(
    "MATLAB, a step called Ts in ms",
    mat(Ts_ms=0.5, F_N=FORCE, x_mm=POSITION),
    suffix=".mat",
    refused="rate|Ts",
    remedy={"rate": 2000.0},
)
box(
    "MATLAB, a gain beside the counts",
    mat(t_s=TIME, F_N=np.round(FORCE * 1e3), F_gain=1e-3, x_mm=POSITION),
    suffix=".mat",
    refused="gain|scale",
    remedy={"channels": {"force": {"column": "F_N", "scale": "0.001"}}},
)
