"""Recorders, archives, sheets, serial monitors and files in parts; then five traps of overflow, keys, plugs and marks."""

from __future__ import annotations

import gzip
import json
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de, joined
from tests.records.exports.containers import hdf5, parquet, sheet, zipped
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

RECORDERS_AND_SERIAL_MONITORS = Kind()
START = datetime(2023, 6, 30, 15, 41, 7, 250000)


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    RECORDERS_AND_SERIAL_MONITORS.add(name, content, **drop.truth(**more))


d = Drop(1000.0, 96, 301)
add(
    "ordinary: FlexLogger, a clock and names with units in brackets",
    "Time,Load Cell (N),String Pot (mm)\n"
    + d.rows(lambda i: f"{(START + timedelta(milliseconds=i)).strftime('%m/%d/%Y %H:%M:%S.%f')},{d.f(i)},{d.x(i)}"),
    d,
)
d = Drop(256.0, 90, 302)
add(
    "ordinary: LVM without a column of times, a step in the header",
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\nMulti_Headings\tNo\nX_Columns\tNo\n"
    "Time_Pref\tRelative\nDate\t2023/06/30\nTime\t15:41:07,25\n***End_of_Header***\t\n\t\nChannels\t2\t\t\nSamples\t90\t90\t\n"
    "Date\t2023/06/30\t2023/06/30\t\nTime\t15:41:07,25\t15:41:07,25\t\nY_Unit_Label\tN\tmm\t\nX_Dimension\tTime\tTime\t\nX0\t0,0\t0,0\t\n"
    "Delta_X\t0,00390625\t0,00390625\t\n***End_of_Header***\t\t\t\nX_Value\tForce\tPosition\tComment\n"
    + d.rows(lambda i: de(f"\t{d.f(i, 6)}\t{d.x(i, 6)}\t")),
    d,
    suffix=".lvm",
)
d = Drop(2500.0, 88, 303)
add(
    "ordinary: header of a recorder with colons, rate in kS/s",
    "Recorder : GEN3i\nRecording : Drop007\nSample rate : 2.5 kS/s\nTrigger : manual\nChannels : 2\nForce [N];Position [mm]\n"
    + d.fx(";"),
    d,
    suffix=".asc",
)
d = Drop(100.0, 84, 304)
add(
    "ordinary: gzip of JSON lines with offsets",
    gzip.compress(
        d.rows(
            lambda i: json.dumps(
                {
                    "t": (START + timedelta(milliseconds=10 * i)).isoformat(timespec="milliseconds") + "+02:00",
                    "force [N]": float(d.force[i]),
                    "position [mm]": float(d.position[i]),
                }
            )
        ).encode()
    ),
    d,
    suffix=".jsonl.gz",
)
d = Drop(500.0, 92, 305)
add(
    "ordinary: zip with settings in JSON and a picture of the screen",
    zipped(
        {
            "settings.json": json.dumps({"device": "rig", "filter": None, "channels": ["force", "position"]}).encode(),
            "screen.bmp": b"BM" + bytes(range(256)),
            "data.csv": ("time [s];force [N];position [mm]\n" + d.tfx(";")).encode(),
        }
    ),
    d,
    suffix=".zip",
)
d = Drop(50.0, 75, 306)
add(
    "ordinary: sheet whose times are dates",
    sheet(
        [
            ["Timestamp", "Force (N)", "Position (mm)"],
            *([START + timedelta(milliseconds=20 * i), float(d.force[i]), float(d.position[i])] for i in range(75)),
        ]
    ),
    d,
    suffix=".xlsx",
)
d = Drop(4000.0, 100, 307)
add(
    "ordinary: HDF5 with times, units as attributes and a version",
    hdf5(
        {"data/t": d.time * 1e3, "data/F": d.force, "data/x": d.position},
        {"data/t": "ms", "data/F": "N", "data/x": "mm"},
        "units",
        schema="rig/2",
        run=12,
    ),
    d,
    suffix=".hdf5",
    options={"channels": {"force": "F", "position": "x"}},
)
d = Drop(1000.0, 95, 308)
add(
    "ordinary: Parquet, stamps in us, names with units",
    parquet(
        {
            "timestamp_us": np.int64(1688132467250000) + 1000 * np.arange(95, dtype=np.int64),
            "force_N": d.force,
            "position_mm": d.position,
            "seq": np.arange(95, dtype=np.int32) + 40211,
        }
    ),
    d,
    suffix=".parquet",
)
d = Drop(20000.0, 99, 309)
add(
    "ordinary: Keysight InfiniiVision, axis and units in two rows",
    "x-axis,1,2\nsecond,Volt,Volt\n"
    + d.rows(lambda i: f"{d.time[i] - 0.0025:+.6E},{d.force[i] / 10:+.6E},{d.position[i] / 2:+.6E}"),
    d,
    options={
        "channels": {
            "force": {"column": "column 2", "unit": "V", "scale": "10 N/V"},
            "position": {"column": "column 3", "unit": "V", "scale": "2 mm/V"},
        }
    },
    rtol=1e-5,
)
d = Drop(1000.0, 94, 310)
add(
    "ordinary: PicoLog, seconds, averages and names with the channel",
    '"","Force Ave. (N)","Position Ave. (mm)"\n' + d.rows(lambda i: f"{d.t(i, 3)},{d.f(i)},{d.x(i)}"),
    d,
    options={"channels": {"time": "column 1"}, "units": {"time": "s"}},
)
d = Drop(1000.0, 90, 311)
add(
    "ordinary: channels of a recorder in JSON beside bare numbers",
    d.fx(","),
    d,
    header=(
        "channels.json",
        json.dumps(
            {
                "sampling": {"rate_hz": 1000, "samples": 90},
                "channels": [{"id": 0, "label": "Force", "unit": "N"}, {"id": 1, "label": "Position", "unit": "mm"}],
            }
        ),
    ),
)
d = Drop(10.0, 120, 312)
HEAD = "Date,Time,Force [N],Position [mm]\n"


def row(i: int) -> str:
    now = datetime(2023, 6, 30, 23, 59, 55) + timedelta(milliseconds=100 * i)
    return f"{now.strftime('%Y-%m-%d,%H:%M:%S.%f')[:-5]},{d.f(i)},{d.x(i)}\n"


add(
    "ordinary: a file of its own after midnight",
    HEAD + "".join(map(row, range(50))),
    d,
    parts=(HEAD + "".join(map(row, range(50, 120))),),
)
d = Drop(80.0, 88, 313)
COUNTS = np.round(d.force / 0.0025).astype(int)
add(
    "ordinary: serial monitor, labels before values, raw counts with a zero",
    d.rows(lambda i: f"ms:{round(12.5 * i) + 3055} raw:{COUNTS[i] - 231400} pos:{d.x(i)}"),
    d,
    suffix=".txt",
    force=COUNTS * 0.0025,
    atol_time=7e-4,
    options={
        "channels": {
            "time": "ms",
            "force": {"column": "raw", "zero": -231400, "scale": "2.5 mN"},
            "position": {"column": "pos", "unit": "mm"},
        },
        "units": {"time": "ms"},
    },
)
d = Drop(100.0, 81, 314)
add(
    "ordinary: SPARKvue, a run above names with units, trailing commas",
    "Run 1,Run 1,Run 1,\nTime (s),Force (N),Position (m),\n"
    + d.rows(lambda i: joined((d.t(i, 2), d.f(i), d.x(i, 7, 1e-3), ""))),
    d,
)
d = Drop(2000.0, 86, 315)
add(
    "ordinary: testo of a bench, commas, UTF-8 with a mark, CRLF",
    "\ufeffPrüfstand;Seilfall 3\r\nAbtastrate;2000 Hz\r\n\r\nZeit in s;Kraft in N;Weg in mm\r\n"
    + d.rows(lambda i: de(f"{d.t(i)};{d.f(i)};{d.x(i)}"), "\r\n"),
    d,
)
d = Drop(1000.0, 90, 316)
RAW = np.round(d.force * 1500).astype(int)
add(
    "nasty: counts of a converter of 16 bits that run over at 32767",
    "t [ms],adc,position [mm]\n" + d.rows(lambda i: f"{i},{(RAW[i] + 32768) % 65536 - 32768},{d.x(i)}"),
    d,
    force=RAW / 1500,
    rtol=1e-6,
    options={"channels": {"force": {"column": "adc", "scale": "0.66666667 mN"}}},
    refused="runs over|wrap",
)
d = Drop(500.0, 90, 317)
add(
    "nasty: grams of force after a key was pressed",
    "Time [s],Force [N],Position [mm]\n"
    + d.rows(
        lambda i: (
            f"{d.t(i)},{d.f(i) if i < 40 else f'{d.force[i] / 9.80665e-3:.3f}'},{d.x(i)}"
            + ("\n# UNIT key pressed: gf" if i == 39 else "")
        )
    ),
    d,
    refused="gf",
)
d = Drop(500.0, 90, 318)
add(
    "nasty: two sensors plugged the other way round halfway, in two columns of names",
    "Time [s],A name,A,B name,B\n"
    + d.rows(
        lambda i: (
            f"{d.t(i)},force_N,{d.f(i)},position_mm,{d.x(i)}"
            if i < 45
            else f"{d.t(i)},position_mm,{d.x(i)},force_N,{d.f(i)}"
        )
    ),
    d,
    options={"channels": {"force": "A", "position": "B"}, "units": {"A": "N", "B": "mm"}},
    refused="name|force_N",
)
d = Drop(200.0, 90, 319)
add(
    "nasty: over range as 9.9E37, no reading as -999.0",
    "Time [s],Force [N],Position [mm]\n"
    + d.rows(
        lambda i: f"{d.t(i)},{'-999.0' if i in (3, 50) else d.f(i)},{'9.90000000E+37' if i in (8, 9) else d.x(i)}"
    ),
    d,
    refused="999",
)
d = Drop(200.0, 90, 320)
add(
    "nasty: pulled counts down, pushed counts up, from the fifth file mark on the other way",
    "Rate: 200 Hz\nforce [N],position [mm],mark\n"
    + d.rows(lambda i: f"{d.f(i, 3, 1 if i < 50 else -1)},{d.x(i)},{'normal' if i < 50 else 'inverse'}"),
    d,
    refused="inverse",
)
assert len(RECORDERS_AND_SERIAL_MONITORS) == 20
