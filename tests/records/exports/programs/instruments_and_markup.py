"""Meters, force plates and controllers with wanted and actual values; tables in YAML, XML, Python and C; polarity, ranges and offsets told above."""

from __future__ import annotations

import json
import pickle
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import made
from tests.records.exports.containers import hdf5, parquet, sheet
from tests.records.exports.programs.workbooks_and_binary_files import mat

INSTRUMENTS_AND_MARKUP = Kind()
add = INSTRUMENTS_AND_MARKUP.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
START = datetime(2023, 11, 2, 10)


def stamp(i: int) -> str:
    return (START + timedelta(milliseconds=5 * i)).strftime("%m/%d/%Y,%H:%M:%S")


# Instruments
add(
    "bench meter, date, time and a fraction of the second",
    "Index,Reading,Unit,Date,Time,Fractional Seconds\n"
    + lines(lambda i: f"{i + 1},{FORCE[i] / 100:.5f},Volt DC,{stamp(i)},{5e-3 * i:.6f}"),
    time=SLOW,
    position=None,
    options={"channels": {"force": {"column": "Reading", "unit": "V", "scale": "100 N/V"}}},
    refused="time|Fractional",
)
add(
    "logger of last and mean values",
    '"Time (s)","Force Last (N)","Force Ave. (N)","Position Last (mm)"\n'
    + lines(lambda i: f"{t(i)},{f(i)},{FORCE[i] - 0.01:.3f},{u(i)}"),
    refused="could each",
    remedy={"channels": {"force": "Force Last (N)"}},
)
add(
    "display of a load cell",
    "SENSIT Log\nSerial,123456\nPeak,15.9,N\nValley,9.1,N\nSample,Relative Time (s),Tracking (N)\n"
    + lines(lambda i: f"{i + 1},{t(i)},{f(i)}"),
    position=None,
)
add(
    "a unit in a column of its own",
    "Time;Track;Units\n" + lines(lambda i: f"{t(i)};{f(i)};N"),
    position=None,
    options={"channels": {"force": "Track"}},
    refused="unit",
    remedy={"units": {"time": "s"}},
)
add(
    "force plate without headings or times",
    lines(lambda i: f"0.1,0.2,{f(i)},1.0,2.0,0.3"),
    position=None,
    refused="heading|columns",
    remedy={
        "columns": ("Fx [N]", "Fy [N]", "Fz [N]", "Mx [Nm]", "My [Nm]", "Mz [Nm]"),
        "rate": 2000.0,
        "channels": {"force": "Fz [N]"},
    },
)
add(
    "muscle recorder, a time for each sensor",
    "X[s],Force (N),X[s],Travel (mm)\n"
    + lines(lambda i: f"{t(i)},{f(i)}," + (f"{i / 1000:.4f},{u(i)}" if i < 30 else ",")),
    position=None,
    refused="different times",
)
add(
    "patch clamp's text",
    'ATF\t1.0\n2\t3\n"AcquisitionMode=Gap Free"\n"Comment="\n"Time (s)"\t"Force (N)"\t"Travel (mm)"\n'
    + lines(tfu("\t")),
    suffix=".atf",
)
add(
    "channels one below the other",
    '"CHANNEL"\t"1"\n"Waveform"\n"Force"\n"N"\n2000\n' + lines(lambda i: f(i)) + '\n"CHANNEL"\t"2"\n"Waveform"\n'
    '"Position"\n"mm"\n2000\n' + lines(lambda i: u(i)),
    suffix=".txt",
    position=None,
    refused="table|heading|columns|second",
)
add(
    "a recorder's marker lines",
    "*HEADER\n*DATE 02.11.2023\n*COLUMNS t[s] F[N] x[mm]\n*DATA\n" + lines(tfu(" ")),
    suffix=".txt",
    refused="heading|columns|unit",
    remedy={"columns": ("t [s]", "F [N]", "x [mm]")},
)
add(
    "a tester's block of results",
    "Specimen;A12\nFmax;15.9;N\ndL at Fmax;1.2;mm\nE;210;GPa\n\nTime;Force;Travel\ns;N;mm\n" + lines(tfu(";")),
)
add(
    "names, units and types of a controller",
    "Name;t;F_ist;x_ist\nTyp;REAL;REAL;REAL\nEinheit;s;N;mm\n" + lines(lambda i: f"{i + 1};{tfu(';')(i)}"),
    options={"channels": {"force": "F_ist", "position": "x_ist"}},
)
add(
    "a soll and an ist",
    "t [s];F_soll [N];F_ist [N];x_soll [mm];x_ist [mm]\n"
    + lines(lambda i: de(f"{t(i)};{12 + i % 3};{f(i)};{i % 4};{u(i)}")),
)
add(
    "demand and feedback",
    "time [s],Force Demand [N],Force Feedback [N],Position Feedback [mm]\n"
    + lines(lambda i: f"{t(i)},{12 + i % 3},{f(i)},{u(i)}"),
)
add(
    "actual and command by letters",
    "time [s],F_c [N],F_a [N],position [mm]\n" + lines(lambda i: f"{t(i)},{12 + i % 3},{f(i)},{u(i)}"),
    refused="could each",
    remedy={"channels": {"force": "F_a [N]"}},
)
# Text
add(
    "lists of YAML",
    lines(lambda i: f"- {{t: {t(i)}, F: {f(i)}, x: {u(i)}}}"),
    suffix=".yaml",
    options={"units": {"t": "s", "F": "N", "x": "mm"}},
    refused="table|YAML|number|key|unit",
)
add(
    "dictionaries of Python",
    lines(lambda i: str({"time_s": float(TIME[i]), "force_N": float(FORCE[i]), "position_mm": float(POSITION[i])})),
    suffix=".log",
    refused="JSON|table|number|key",
)
add(
    "rows of XML",
    "<log>\n" + lines(lambda i: f'<row t="{t(i)}" F="{f(i)}" x="{u(i)}"/>') + "</log>\n",
    suffix=".xml",
    refused="table|XML|number|heading|key",
)
add(
    "an array of C",
    "float drop[60][3] = {\n" + lines(lambda i: f"  {{{tfu(', ')(i)}}},") + "};\n",
    suffix=".h",
    refused="table|number|heading|columns",
)
add(
    "pandas, names told apart",
    "time [s],force [N],force [N].1,position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{FORCE[i] * 0.9:.4f},{u(i)}"),
    refused="could each|unit",
    remedy={"channels": {"force": "force [N]"}},
)
add(
    "a polarity told above",
    "Force polarity: inverted\n" + HEAD + lines(lambda i: f"{t(i)},{-FORCE[i]:.3f},{u(i)}"),
    refused="polarity|sign|inverted",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "-1"}}},
)
add("an inverted pendulum told above", "Inverted pendulum, run 3\n" + HEAD + lines(tfu()))
add(
    "a factor by the letter x",
    "CH1: Force N x0.5\nCH2: Position mm x1\ntime [s],CH1 [N],CH2 [mm]\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] * 2:.3f},{u(i)}"),
    options={"channels": {"force": "CH1 [N]", "position": "CH2 [mm]"}},
    refused="x0.5|factor",
)
add(
    "the worth of a volt told above",
    "Load cell: 200 N/V\ntime [s],load [V],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 200:.6f},{u(i)}"),
    refused="unit|scale|V",
    remedy={"channels": {"force": {"column": "load [V]", "scale": "200 N/V"}}},
    rtol=1e-4,
)
add("the worth of a volt told above newtons", "Load cell: 200 N/V\n" + HEAD + lines(tfu()))
add("a range and a class", "Range: 0-200 N, class 0.5\nAmplifier gain 1000\nBridge 2 mV/V\n" + HEAD + lines(tfu()))
add("an offset taken off", "Offset force: 3.2 N (subtracted)\n" + HEAD + lines(tfu()))
add("a time axis that begins at 5", "Start: 5 s\ntime [s]," + FU + lines(lambda i: f"{5 + TIME[i]:.4f},{fu()(i)}"))
add(
    "a time base in a line",
    "Time base: ms\ntime," + FU + lines(lambda i: f"{t(i, 1e3, 1)},{fu()(i)}"),
    refused="unit",
    remedy={"units": {"time": "ms"}},
)
add("a record of single numbers", "fs = 2000 Hz\nforce [N]\n" + lines(f), position=None)
add(
    "readings in two lines each",
    "time [s],force [N]\nposition [mm]\n" + lines(lambda i: f"{t(i)},{f(i)}\n{u(i)}"),
    refused="table|head|cells|line|table",
    position=None,
)
add("a last row cut in its number", HEAD + lines(tfu(), 59) + tfu()(59)[:-3])
add(
    "times of whole ms, two rows each",
    "time [ms]," + FU + lines(lambda i: f"{i // 2},{fu()(i)}"),
    refused="rate|ms",
    remedy={"rate": 2000.0},
)
add("samples that were asked for and did not come", HEAD + lines(lambda i: f"{t(i)},," if i in (20, 21) else tfu()(i)))
# Containers
add(
    "pickled",
    pickle.dumps({"time": TIME.tolist(), "force": FORCE.tolist()}),
    suffix=".pkl",
    refused="binary|pickle|CSV",
)
add(
    "sound",
    b"RIFF\x24\x08\x00\x00WAVEfmt \x10\x00\x00\x00" + bytes(range(256)) * 8,
    suffix=".wav",
    refused="binary|WAV|CSV",
)
add("old netCDF", b"CDF\x01" + bytes(range(256)) * 8, suffix=".nc", refused="binary|netCDF|HDF5|CSV")
add(
    "HDF5, a name with its unit and none beside",
    hdf5({"Time (ms)": TIME * 1e3, "Force (kN)": FORCE / 1e3, "Position (um)": POSITION * 1e3}),
    suffix=".h5",
)
add(
    "HDF5, whole newtons and a serial number",
    made(
        lambda file: [
            file.create_dataset(n, data=v).attrs.update({"unit": unit, "serial": 123456})
            for n, v, unit in (("time", TIME, "s"), ("force", FORCE, "N"), ("position", POSITION, "mm"))
        ]
    ),
    suffix=".h5",
)
add(
    "MATLAB, volts and their worth",
    mat(t_s=TIME, U_V=FORCE / 100, x_mm=POSITION),
    suffix=".mat",
    options={"channels": {"force": {"column": "U_V", "unit": "V", "scale": "100 N/V"}}},
)
add(
    "Parquet, wide and with a constant",
    parquet(
        {
            "time_s": TIME,
            "force_N": FORCE,
            "position_mm": POSITION,
            "temperature_degC": np.full(N, 21.5),
            "run": np.full(N, 7),
        }
    ),
    suffix=".parquet",
)
add(
    "JSON, metadata beside rows",
    json.dumps(
        {
            "meta": {"rig": 3, "force_unit": "kN"},
            "rows": [{"time_s": TIME[i], "force": FORCE[i] / 1e3, "position_mm": POSITION[i]} for i in range(N)],
        }
    ),
    suffix=".json",
    refused="unit",
    remedy={"units": {"force": "kN"}},
)
add(
    "JSON lines, ms since 1970 as texts",
    lines(lambda i: json.dumps({"ts": str(1698919200000 + 5 * i), "force_N": FORCE[i], "position_mm": POSITION[i]})),
    suffix=".jsonl",
    time=SLOW,
    atol_time=1e-6,
    refused="time|unit",
    remedy={"channels": {"time": {"column": "ts", "unit": "ms"}}},
)
add(
    "xlsx, dates and a column of ms",
    sheet(
        [
            ["Date", "ms", "Force [N]", "Position [mm]"],
            *[[START, 5 * i, float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    time=SLOW,
    refused="time|ms",
)
add(
    "xlsx, factors in the row below the units",
    sheet(
        [
            ["Time", "Force", "Position"],
            ["s", "N", "mm"],
            ["Factor", 2.0, 1.0],
            *[[float(TIME[i]), float(FORCE[i] / 2), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    refused="Factor|factor",
    remedy={"channels": {"force": {"column": "Force", "scale": "2"}}},
)


def raw_and_time(file: Any) -> None:
    file.create_dataset("t", data=TIME).attrs["unit"] = "s"
    file.create_dataset("force_raw", data=np.round(FORCE * 1e3).astype("i4")).attrs["unit"] = "counts"
    file.create_dataset("force", data=FORCE).attrs["unit"] = "N"
    file.create_dataset("position", data=POSITION).attrs["unit"] = "mm"


add("HDF5, counts beside newtons", made(raw_and_time), suffix=".h5")
