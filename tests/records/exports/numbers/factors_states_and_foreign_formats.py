"""Factors above and below a table, states beside readings, durations and clocks that jump, and files of formats that are not read."""

from __future__ import annotations

import io
import json
from datetime import datetime
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import made
from tests.records.exports.containers import parquet, zipped
from tests.records.exports.programs.workbooks_and_binary_files import book, mat

FACTORS_STATES_AND_FOREIGN_FORMATS = Kind()
add = FACTORS_STATES_AND_FOREIGN_FORMATS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
START = datetime(2023, 11, 2, 10)
BOTH = {"channels": {"force": "force [N]", "position": "position [mm]"}}

# What stands above and below
add(
    "a list of channels with their factors",
    "Channel;Unit;Factor;Offset\nForce;N;2.5;0.0\nPosition;mm;1;0\n\nTime [s];Force [N];Position [mm]\n"
    + lines(lambda i: f"{t(i)};{FORCE[i] / 2.5:.5f};{u(i)}"),
    refused="factor|scale|worth|table",
    remedy={"channels": {"force": {"column": "Force [N]", "scale": "2.5"}}},
)
add(
    "a footnote on the unit",
    HEAD.replace("[N]", "[N]*") + lines(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i)}") + "\n* force in kN\n",
    refused="kN|unit",
    remedy={"channels": {"force": {"column": "force [N]*", "unit": "kN"}}},
)
add(
    "a unit with thousands in words",
    "time [s],force [thousand N],position [mm]\n" + lines(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i)}"),
    refused="unit|thousand",
)
add(
    "a unit with its power behind",
    "time [s],force [N e-3],position [mm]\n" + lines(lambda i: f"{t(i)},{f(i, 1e3, 0)},{u(i)}"),
    refused="unit|e-3|factor",
)
add(
    "a number before the unit",
    "time [s],force (10 N),position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f},{u(i)}"),
    refused="unit|10 N|factor",
)
add(
    "a factor behind the unit in brackets",
    "time [s],force (N x 1000),position [mm]\n" + lines(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i)}"),
    refused="unit|1000|factor|scale",
)
add(
    "units of one line for all columns",
    "Units: s, N, mm\ntime,force,position\n" + lines(tfu()),
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add("a unit by its key, another in the heading", "Load unit = kN\n" + HEAD + lines(tfu()), refused="kN|unit")
add(
    "test frequency of a fatigue machine",
    "Frequency: 5 Hz\nAmplitude: 2 mm\n" + FU + lines(fu()),
    refused="rate|frequency",
    remedy={"rate": 2000.0},
)
add("the data rate of a line", "Data rate: 9600 baud\n" + FU + lines(fu()), refused="rate", remedy={"rate": 2000.0})
add(
    "the crosshead's rate",
    "Test rate: 5 mm/min\nData points: 60\n" + FU + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "frames of a camera",
    "fps: 2000\nframe," + FU + lines(lambda i: f"{i},{fu()(i)}"),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "a spectrum and not a record",
    "Sample rate: 2000 Hz\nFrequency [Hz],force [N],position [mm]\n"
    + lines(lambda i: f"{i * 16.0:.1f},{abs(FORCE[i]):.3f},{abs(POSITION[i]):.4f}"),
    refused="frequen|spectr|time",
)
add(
    "a curve of force over travel",
    "Sample rate: 2000 Hz\ncycle,peak force [N],valley force [N]\n"
    + lines(lambda i: f"{i},{FORCE[i] + 5:.3f},{FORCE[i]:.3f}"),
    position=None,
    refused="could each|cycle|force",
    remedy={"channels": {"force": "valley force [N]"}},
)
# Rows
add(
    "a state beside each force, faults read as nothing",
    "time [s],force [N],force state,position [mm]\n"
    + lines(lambda i: f"{t(i)}," + ("0.000,FAULT" if i in (20, 21, 40) else f"{f(i)},OK") + f",{u(i)}"),
    refused="FAULT|state",
)
add(
    "a quality of OPC beside each force",
    "time [s];force [N];quality;position [mm]\n"
    + lines(lambda i: f"{t(i)};" + ("0.000;Bad" if i in (20, 21) else f"{f(i)};Good") + f";{u(i)}"),
    refused="Bad|quality",
)
add(
    "the missing number told above",
    "# NODATA = 1.0E+20\n" + HEAD + lines(lambda i: f"{t(i)},{'1.0E+20' if i in (20, 21) else f(i)},{u(i)}"),
)
add("rows of a heartbeat between", HEAD + lines(lambda i: tfu()(i) + ("\nHEARTBEAT 17" if i % 20 == 9 else "")))
add(
    "a log that was opened twice",
    HEAD + lines(tfu(), 30) + "\n--- reopened ---\n" + HEAD + "".join(f"{tfu()(i)}\n" for i in range(30, N)),
)
add("values that end in a semicolon and a blank", HEAD.replace(",", "; ") + lines(lambda i: tfu("; ")(i) + "; "))
add(
    "a single row of headings twice as wide",
    "time [s],,force [N],,position [mm],\n" + lines(lambda i: f"{t(i)},ok,{f(i)},ok,{u(i)},ok"),
    refused="3 are numbers",
)
# Clocks
add(
    "differences of times of pandas",
    ",force [N],position [mm]\n" + lines(lambda i: f"0 days 00:00:00.{5 * i:03d}000,{fu()(i)}"),
    time=SLOW,
    refused="time|rate",
)
add("time spans of .NET", "elapsed," + FU + lines(lambda i: f"00:00:00.{5 * i:03d}0000,{fu()(i)}"), time=SLOW)
add(
    "durations of ISO", "elapsed," + FU + lines(lambda i: f"PT0.{5 * i:03d}S,{fu()(i)}"), time=SLOW, refused="time|rate"
)
add(
    "stamps with milliseconds behind a colon",
    "stamp," + FU + lines(lambda i: f"2023-11-02 10:00:00:{5 * i:03d},{fu()(i)}"),
    time=SLOW,
    refused="time|rate",
)
add(
    "ms since midnight, over midnight",
    "ms of day," + FU + lines(lambda i: f"{(86399900 + 5 * i) % 86400000},{fu()(i)}"),
    refused="time|back|unit|rate",
)
add(
    "a clock that was set back by 3 ms",
    "stamp," + FU + lines(lambda i: "2023-11-02 10:00:00." + f"{5 * i - (3 if i >= 30 else 0):03d},{fu()(i)}"),
    time=np.where(np.arange(N) >= 30, SLOW - 0.003, SLOW),
    refused="time|step",
)
add(
    "a second in which a second was put in",
    "stamp,"
    + FU
    + lines(
        lambda i: (
            (f"2016-12-31 23:59:59.{900 + 5 * i:03d}" if i < 20 else f"2016-12-31 23:59:60.{5 * (i - 20):03d}")
            + f",{fu()(i)}"
        )
    ),
    time=SLOW,
    refused="time|60|clock|rate",
)
add(
    "seconds and a fraction as two whole numbers",
    "time_s,time_us,force_N,position_mm\n" + lines(lambda i: f"{12 + i // 40},{25000 * (i % 40)},{fu()(i)}"),
    time=np.arange(N) * 0.025,
    refused="time|could each",
)
# Files of other kinds
add(
    "sheet of a free office",
    zipped(
        {
            "mimetype": b"application/vnd.oasis.opendocument.spreadsheet",
            "content.xml": b"<office/>",
            "styles.xml": b"<x/>",
        }
    ),
    suffix=".ods",
    refused="ods|OpenDocument|spreadsheet|CSV",
)
add(
    "an old workbook",
    b"\xd0\xcf\x11\xe0\xa1\xb1\x1a\xe1" + bytes(range(256)) * 16,
    suffix=".xls",
    refused="xls|Excel|CSV|binary",
)


def npy(path: Path) -> None:
    buffer = io.BytesIO()
    np.save(buffer, np.stack([TIME, FORCE, POSITION], 1))
    path.write_bytes(buffer.getvalue())


add("an array of numpy", npy, suffix=".npy", refused="npy|numpy|CSV|binary")


def database(path: Path) -> None:
    import sqlite3

    path.unlink(missing_ok=True)  # one that was damaged is no data base to go on with
    with sqlite3.connect(path) as file:
        file.execute("create table drop_7 (time_s real, force_N real, position_mm real)")
        file.executemany(
            "insert into drop_7 values (?, ?, ?)",
            [(float(TIME[i]), float(FORCE[i]), float(POSITION[i])) for i in range(N)],
        )


add("a data base", database, suffix=".sqlite", refused="sqlite|SQLite|data ?base|CSV|binary")


def feather(path: Path) -> None:
    import pyarrow as pa
    from pyarrow import feather as file

    file.write_feather(pa.table({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}), path)


add("an Arrow file", feather, suffix=".feather", refused="Arrow|feather|Parquet|binary|CSV")


def steps(file: Any) -> None:
    for name, values, unit, step in (("force", FORCE, "N", 5e-4), ("position", POSITION, "mm", 1e-3)):
        file.create_dataset(name, data=values).attrs.update({"unit": unit, "dt": step})


add(
    "HDF5, a step of its own for each",
    made(steps),
    suffix=".h5",
    position=None,
    absent=("position",),
    refused="rate|dt|step|times",
)


def shared(file: Any) -> None:
    for name, values, unit in (("force", FORCE, "N"), ("position", POSITION, "mm")):
        file.create_dataset(name, data=values).attrs.update({"unit": unit, "dt": 5e-4, "t0": 0.0})


add("HDF5, one step for each, the same", made(shared), suffix=".h5", refused="rate|dt", remedy={"rate": 2000.0})
add(
    "HDF5, units as texts beside",
    made(
        lambda file: (
            [
                file.create_dataset(n, data=v)
                for n, v in (("time", TIME), ("force", FORCE / 1e3), ("position", POSITION))
            ]
            + [
                file.create_dataset("force_unit", data="kN"),
                file.create_dataset("time_unit", data="s"),
                file.create_dataset("position_unit", data="mm"),
            ]
        )
    ),
    suffix=".h5",
    refused="unit",
    remedy={"units": {"time": "s", "force": "kN", "position": "mm"}},
)
add(
    "MATLAB, two rates",
    mat(fs_force=2000.0, fs_position=1000.0, force_N=FORCE, position_mm=POSITION),
    suffix=".mat",
    refused="rate|time",
)
add(
    "MATLAB, a series with its units",
    mat(
        force={"Time": TIME, "Data": FORCE / 1e3, "Units": "kN"},
        position={"Time": TIME, "Data": POSITION, "Units": "mm"},
    ),
    suffix=".mat",
    refused="unit|time|could each",
    remedy={"units": {"time": "s"}},
)
add(
    "Parquet, stamps with a zone",
    parquet(
        {
            "stamp": (np.datetime64("2023-11-02T10:00:00", "ns") + (np.arange(N) * 500000).astype("timedelta64[ns]")),
            "force_kN": FORCE / 1e3,
            "position_um": POSITION * 1e3,
        }
    ),
    suffix=".parquet",
)
add(
    "Parquet, a scale in a column",
    parquet(
        {"time_s": TIME, "force_N": np.round(FORCE * 1e3), "force_factor": np.full(N, 1e-3), "position_mm": POSITION}
    ),
    suffix=".parquet",
    refused="factor",
    remedy={"channels": {"force": {"column": "force_N", "scale": "0.001"}}},
)
add(
    "JSON lines, a channel a line",
    lines(
        lambda i: (
            json.dumps({"t": TIME[i], "ch": "force", "v": FORCE[i], "unit": "N"})
            + "\n"
            + json.dumps({"t": TIME[i], "ch": "position", "v": POSITION[i], "unit": "mm"})
        )
    ),
    suffix=".jsonl",
    refused="unit|time|channel|same|ch",
)
add(
    "JSON, a table with its schema",
    json.dumps(
        {
            "schema": {"fields": [{"name": "time_s", "type": "number"}]},
            "data": [{"time_s": TIME[i], "force_N": FORCE[i], "position_mm": POSITION[i]} for i in range(N)],
        }
    ),
    suffix=".json",
)
add(
    "JSON lines, texts with units",
    lines(lambda i: json.dumps({"time": f"{t(i)} s", "force": f"{f(i)} N", "position": f"{u(i)} mm"})),
    suffix=".jsonl",
    refused="unit|number",
)


def number_formats(made: Any) -> None:
    page = made.active
    page.append(["Time [s]", "Force", "Position [mm]"])
    for i in range(N):
        page.append([TIME[i], FORCE[i] / 1e3, POSITION[i]])
        page.cell(page.max_row, 2).number_format = '0.000 "kN"'


add(
    "xlsx, the unit in the format of a cell",
    book(number_formats),
    suffix=".xlsx",
    refused="unit",
    remedy={"channels": {"force": {"column": "Force", "unit": "kN"}}},
)


def percentages(made: Any) -> None:
    page = made.active
    page.append(["Time [s]", "Force [N]", "Position [mm]"])
    for i in range(N):
        page.append([TIME[i], FORCE[i], POSITION[i]])
    page.column_dimensions["B"].hidden = True
    page.freeze_panes = "A2"
    page.append([])
    page.append(["", "=AVERAGE(B2:B61)", "=MAX(C2:C61)"])


add("xlsx, a hidden column and sums below", book(percentages), suffix=".xlsx")
