"""Segments of LVM, testing machines, boards and data base clients, lines that tell a rate, scales in HDF5, MATLAB and JSON."""

from __future__ import annotations

import gzip
import io
import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import made, told
from tests.records.exports.containers import sheet, zipped
from tests.records.exports.laboratory import HEAD as LVM_HEAD
from tests.records.exports.laboratory import TAGS, lvm
from tests.records.exports.programs.workbooks_and_binary_files import book, mat

SEGMENTS_AND_TESTING_MACHINES = Kind()
add = SEGMENTS_AND_TESTING_MACHINES.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
ALL = {"channels": {"force": {"column": "force", "unit": "N"}, "position": {"column": "position", "unit": "mm"}}}
FIRST = lvm({**LVM_HEAD, "Multi_Headings": "Yes"}, TAGS, "X_Value\tForce\tPosition\tComment", lines(tfu("\t"), 30))
SECOND = "".join(
    f"{key}\t{value}\n" for key, value in (("Channels", "2"), ("Y_Unit_Label", "kN\tmm"), ("Delta_X", "0.0005\t0.0005"))
)

add(
    "LVM whose second segment has another unit",
    FIRST
    + "\n"
    + SECOND
    + "***End_of_Header***\nX_Value\tForce\tPosition\tComment\n"
    + "".join(f"{t(i)}\t{f(i, 1e-3, 6)}\t{u(i)}\n" for i in range(30, N)),
    suffix=".lvm",
    refused="segment|unit|header",
)
add(
    "LVM whose segments count anew",
    FIRST
    + "\n"
    + SECOND.replace("kN", "N")
    + "***End_of_Header***\nX_Value\tForce\tPosition\tComment\n"
    + "".join(f"{t(i - 30)}\t{f(i)}\t{u(i)}\n" for i in range(30, N)),
    suffix=".lvm",
    refused="segment|again|header|time",
)
add(
    "catman with a step of its own for each channel",
    "Force [N]\tPosition [mm]\t\ndt=500 us\tdt=1 ms\t\n" + lines(lambda i: fu("\t")(i) + "\t"),
    suffix=".asc",
    position=None,
    absent=("position",),
    refused="rate|dt|times",
)
add(
    "signals of a bus that were held",
    "Time [s];Force [N];Position [mm]\n" + lines(lambda i: f"{t(i)};{f(i)};" + (u(i) if i % 5 == 0 else "")),
    position=None,
    refused="missing|empty|position|rate",
)
add(
    "Zwick, slashes and a strain",
    "Prüfzeit / s;Standardkraft / kN;Traversenweg absolut / mm;Dehnung / %\n"
    + lines(lambda i: de(f"{t(i)};{f(i, 1e-3, 6)};{u(i)};0.01")),
    encoding="cp1252",
)
add(
    "Instron, pounds with thousands",
    '"Time","Extension","Load"\n"(s)","(in)","(lbf)"\n'
    + lines(lambda i: f'"{t(i)}","{POSITION[i] / 25.4:.10f}","{FORCE[i] / 4.4482216152605 * 1e3:,.6f}"'),
    force=FORCE * 1e3,
    rtol=1e-6,
    refused="thousands",
)
add(
    "Mecmesin, minutes",
    "Load(N)\tDisplacement(mm)\tTime(Min)\n" + lines(lambda i: f"{f(i)}\t{u(i)}\t{TIME[i] / 60:.12f}"),
    suffix=".txt",
    atol_time=1e-7,
)
add(
    "Imada, a rate without its name",
    "ZTA-500N,2000Hz,Peak: 15.9\nNo,Force[N],Disp[mm]\n" + lines(lambda i: f"{i + 1},{fu()(i)}"),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "units in a line behind a sign, remarks between",
    "time\tforce\tposition\n# load cell U9C, laser ILD\n# s\tN\tmm\n" + lines(tfu("\t")),
    suffix=".dat",
    refused="unit",
    remedy=NAMED,
)
add(
    "raw and filtered under two headings",
    "Time,Force,,Position,\n,raw,filtered,raw,filtered\ns,N,N,mm,mm\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] * 1.1:.4f},{f(i)},{POSITION[i] * 1.1:.5f},{u(i)}"),
    refused="could each|unit|heading|columns",
    remedy={
        "channels": {
            "time": {"column": "column 1", "unit": "s"},
            "force": {"column": "column 3", "unit": "N"},
            "position": {"column": "column 5", "unit": "mm"},
        }
    },
)
add(
    "the same force in two units",
    "time [s],Fz [lbf],Fz [N],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 4.4482216152605:.9f},{fu()(i)}"),
    refused="could each|Fz",
    rtol=1e-6,
    remedy={"channels": {"force": "Fz [N]"}},
)
add(
    "a row of largest values without a name",
    HEAD + lines(tfu()) + f"\n{TIME[-1]:.4f},{FORCE.max():.3f},{POSITION.max():.4f}\n",
)
add(
    "bare points before decimals",
    "stamp|force|position\n"
    + lines(lambda i: f"2023-11-02 10:00:00.{5 * i:03d}0000|{f(i)}|{u(i).replace('0.', '.', 1)}"),
    time=SLOW,
    options=ALL,
)
add(
    "names of a data base client",
    "name,time,force,position\n" + lines(lambda i: f"rig,{1698919200000000000 + 500000 * i},{fu()(i)}"),
    options=ALL,
    atol_time=1e-6,
)
add(
    "everything in quotes, epochs too",
    '"timestamp","force","position"\n' + lines(lambda i: f'"{1698919200000 + 5 * i}","{f(i)}","{u(i)}"'),
    time=SLOW,
    options=ALL,
    atol_time=1e-6,
)
add(
    "a board's microseconds and raw values",
    "us,hx711,enc\n" + lines(lambda i: f"{500 * i},{round(FORCE[i] * 1e3)},{round(POSITION[i] * 1e4)}"),
    refused="unit|channel|force",
    remedy={
        "channels": {
            "force": {"column": "hx711", "unit": "counts", "scale": "1 mN"},
            "position": {"column": "enc", "unit": "counts", "scale": "0.1 um"},
            "time": {"column": "us", "unit": "us"},
        }
    },
)
add(
    "readings a board marks with a letter",
    HEAD + lines(lambda i: f"{t(i)},{f(i)}{'!' if i in (20, 21) else ''},{u(i)}"),
    refused="number|!",
)
add(
    "a date and ms in two columns",
    "When,ms,force [N],position [mm]\n" + lines(lambda i: f"11/2/2023 10:00:00,{5 * i},{fu()(i)}"),
    time=SLOW,
    refused="time|ms",
)
add(
    "day, hour, minute, second apart",
    "DD,HH,MI,SS,force [N],position [mm]\n" + lines(lambda i: f"2,10,0,{5e-3 * i:.3f},{fu()(i)}"),
    time=SLOW,
    refused="time|rate|SS",
)
add(
    "offsets from UTC as whole hours",
    "stamp,force [N],position [mm]\n" + lines(lambda i: f"2023-11-02T10:00:00.{5 * i:03d}+01,{fu()(i)}"),
    time=SLOW,
    refused="time|rate",
)
add(
    "summer time ends, zone in a column",
    "stamp,zone,force [N],position [mm]\n"
    + lines(
        lambda i: (
            (
                datetime(2023, 10, 29, 2, 59, 59, 900000)
                + timedelta(milliseconds=5 * i)
                - timedelta(hours=0 if i < 20 else 1)
            ).isoformat(" ", "milliseconds")
            + f",{'CEST' if i < 20 else 'CET'},{fu()(i)}"
        )
    ),
    time=SLOW,
    refused="hour|back|again|summer",
)
for said, own in {
    "Sample rate: 2 kHz (per channel 1 kHz)": 1000.0,
    "Sampled at 1000 Hz, interpolated to 2000 Hz": 2000.0,
    "Resampled to 2000 Hz, original rate 10000 Hz": 2000.0,
    "Rate: 2000 Hz nominal, 1998.4 Hz actual": 1998.4,
    "Sampling Freq.: 2 kHz": 2000.0,
    "Messintervall: 500 µs": 2000.0,
    "Sample rate 2000 Hz, Averages 1": 2000.0,
    "Sampling rate 4000 Hz, two channels in turn": 2000.0,
    "Nyquist: 1000 Hz": 2000.0,
    "time between readings 0.5 ms": 2000.0,
}.items():
    add(
        f"rate: {said!r}",
        f"{said}\n" + FU + lines(fu()),
        time=np.arange(N) / own,
        refused="rate|Hz",
        remedy={"rate": own},
    )


def labelled(made: Any) -> None:
    page = made.active
    page.append(["Drop 7", None, None, None])
    page.append(["No", "Time", "Force", "Position"])
    page.append([None, "(ms)", "(kN)", "(mm)"])
    for i in range(N):
        page.append([f"S{i + 1}", TIME[i] * 1e3, FORCE[i] / 1e3, POSITION[i]])


add("xlsx, labels before the rows", book(labelled), suffix=".xlsx")
add(
    "xlsx, units in the cells",
    sheet([["Time", "Force", "Position"], *[[f"{t(i)} s", f"{f(i)} N", f"{u(i)} mm"] for i in range(N)]]),
    suffix=".xlsx",
    refused="unit|number",
)
add(
    "xlsx with macros",
    book(
        lambda made: [
            made.active.append(row)
            for row in (
                ["Time [s]", "Force [N]", "Position [mm]"],
                *[[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)],
            )
        ]
    ),
    suffix=".xlsm",
)


def in_zip(path: Path) -> None:
    import openpyxl

    made, buffer = openpyxl.Workbook(), io.BytesIO()
    made.active.append(["Time [s]", "Force [N]", "Position [mm]"])
    for i in range(N):
        made.active.append([float(TIME[i]), float(FORCE[i]), float(POSITION[i])])
    made.save(buffer)
    path.write_bytes(zipped({"run.xlsx": buffer.getvalue()}))


add("zip of a workbook", in_zip, suffix=".zip", refused="zip|workbook|unpack")
add(
    "gzip of tabs with a mark",
    gzip.compress(
        (
            "\ufeffZeit [ms]\tKraft [N]\tWeg [mm]\r\n"
            + lines(lambda i: de(f"{t(i, 1e3, 1)}\t{f(i)}\t{u(i)}"), end="\r\n")
        ).encode()
    ),
    suffix=".tsv.gz",
)


def raw_counts(**said: Any):
    def fill(file: Any) -> None:
        for name, values, unit in (
            ("time", TIME, "s"),
            ("force", np.round(FORCE * 1e3).astype("i4"), "N"),
            ("position", POSITION, "mm"),
        ):
            file.create_dataset(name, data=values).attrs["unit"] = unit
        file["force"].attrs.update(said)

    return made(fill)


SCALED = {"channels": {"force": {"column": "force", "scale": "0.001"}}}
add(
    "HDF5, newtons per count",
    raw_counts(newton_per_count=1e-3),
    suffix=".h5",
    refused="per_count|per count",
    remedy=SCALED,
)
add("HDF5, a factor as a text", raw_counts(scale="0.001"), suffix=".h5", refused="scale", remedy=SCALED)
add(
    "HDF5, coefficients of a line",
    raw_counts(coefficients=np.array([0.0, 1e-3])),
    suffix=".h5",
    refused="coeff",
    remedy=SCALED,
)
add(
    "HDF5, a period in us",
    told({}, file={"sample_period_us": 500}),
    suffix=".h5",
    refused="rate|period",
    remedy={"rate": 2000.0},
)
add("HDF5, times in msec", told({"time": TIME * 1e3}, time={"units": "msec"}), suffix=".h5", refused="unit")
add(
    "MATLAB, rows and not columns",
    mat(t_ms=TIME[None] * 1e3, F_kN=FORCE[None] / 1e3, x_mm=POSITION[None]),
    suffix=".mat",
)
add(
    "MATLAB, calibration constants beside",
    mat(t_s=TIME, force_V=FORCE / 100, force_cal_N_per_V=100.0, position_mm=POSITION),
    suffix=".mat",
    refused="V|scale|cal",
    remedy={"channels": {"force": {"column": "force_V", "scale": "100 N/V"}}},
)
add(
    "JSON, a rate in words",
    json.dumps({"sampleRate": "2 kHz", "force_N": FORCE.tolist(), "position_mm": POSITION.tolist()}),
    suffix=".json",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "JSON lines by topics",
    lines(
        lambda i: json.dumps(
            {
                "topic": "rig/force" if i % 2 == 0 else "rig/position",
                "t": i / RATE,
                "value": FORCE[i] if i % 2 == 0 else POSITION[i],
            }
        )
    ),
    suffix=".jsonl",
    refused="unit|channel|force|topic|value",
)
