"""Rates in lines above, dates over the end of a month, whole newtons, states in words, names with brackets, footers."""

from __future__ import annotations

import json
from datetime import datetime, timedelta

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import made
from tests.records.exports.containers import parquet, sheet, zipped
from tests.records.exports.programs.workbooks_and_binary_files import book, mat

RATES_DATES_AND_BRACKETS = Kind()
add = RATES_DATES_AND_BRACKETS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
START = datetime(2024, 2, 29, 23, 59, 59, 900000)

for said, rate, german in (
    ("Sampling rate;2.500,0;Hz", 2500.0, True),
    ("Abtastintervall [ms];0,4", 2500.0, True),
    ("Fs: 10,000 S/s", 10000.0, False),
    ("Interval,250,us", 4000.0, False),
    ("acquisition.rate = 5000", 5000.0, False),
    ("Scan rate: 1e4 Hz", 10000.0, False),
    ("# sample time: 1.0e-4 s", 10000.0, False),
    ("Rate 4.0 kHz", 4000.0, False),
):
    add(
        f"rate: {said!r}",
        said + "\n" + ("Kraft [N];Weg [mm]\n" + lines(fu(";", de)) if german else FU + lines(fu())),
        time=np.arange(N) / rate,
        refused="rate|Hz|nterval",
        remedy={"rate": rate},
    )
add(
    "over the end of February",
    "stamp,"
    + FU
    + lines(lambda i: (START + timedelta(milliseconds=5 * i)).isoformat(" ", "milliseconds") + f",{fu()(i)}"),
    time=SLOW,
)
add(
    "day first, over the end of February",
    "Datum;Zeit;Kraft [N];Weg [mm]\n"
    + lines(
        lambda i: (START + timedelta(milliseconds=5 * i)).strftime("%d.%m.%Y;%H:%M:%S,%f")[:-3] + f";{fu(';', de)(i)}"
    ),
    time=SLOW,
)
add(
    "summer time begins in Berlin, with offsets",
    "stamp,"
    + FU
    + lines(
        lambda i: (
            (
                datetime(2024, 3, 31, 1, 59, 59, 900000)
                + timedelta(milliseconds=5 * i)
                + timedelta(hours=0 if i < 20 else 1)
            ).isoformat("T", "milliseconds")
            + f"{'+01:00' if i < 20 else '+02:00'},{fu()(i)}"
        )
    ),
    time=SLOW,
)
add(
    "a counter, a rate and a lost row",
    "Rate: 2000 Hz\nno.," + FU + "".join(f"{i},{fu()(i)}\n" for i in range(N) if i != 17),
)
add(
    "times in us, force in mN, place in um",
    "t_us,F_mN,x_um\n" + lines(lambda i: f"{500 * i},{f(i, 1e3, 1)},{u(i, 1e3, 1)}"),
)
add(
    "a setpoint and its deviation beside",
    "time [s],force [N],force setpoint [N],force deviation [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)},12.0,{FORCE[i] - 12:.3f},{u(i)}"),
)
add(
    "two heading rows, the second the units with a name",
    "Time,Force,Position\nUnit: s,Unit: N,Unit: mm\n" + lines(tfu()),
)
add("a gain of an amplifier in the head", "Amplifier: gain 200, filter 500 Hz\n" + HEAD + lines(tfu()))
add(
    "whole newtons and a filter in the head",
    "Filter: 200 Hz\n" + "time [s],force [N],position [mm]\n" + lines(lambda i: f"{t(i)},{round(FORCE[i])},{u(i)}"),
    force=np.round(FORCE),
)
add(
    "whole newtons, the range in the head",
    "Load cell 500 N\ntime [s],force [N],position [mm]\n" + lines(lambda i: f"{t(i)},{round(FORCE[i])},{u(i)}"),
    force=np.round(FORCE),
)
add(
    "kp and cm",
    "t [s];F [kp];x [cm]\n" + lines(lambda i: f"{t(i)};{FORCE[i] / 9.80665:.9f};{u(i, 0.1, 5)}"),
    rtol=1e-6,
)
add(
    "a text of the state that names no fault",
    "time [s],force [N],phase,position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)},{'loading' if i % 20 < 10 else 'unloading'},{u(i)}"),
)
add(
    "a state of faults beside all",
    "time [s],force [N],position [mm],status\n"
    + lines(lambda i: f"{t(i)}," + (f"0.000,{u(i)},sensor fault" if i in (20, 21) else f"{fu()(i)},ok")),
    refused="fault|status",
)
add("a colon in the names", "t: [s];F: [N];x: [mm]\n" + lines(tfu(";")))
add("units in square brackets after a dot", "time.[s],force.[N],position.[mm]\n" + lines(tfu()))
add("names of a controller with brackets", "Time [s],Axis[1].Force [N],Axis[1].Pos [mm]\n" + lines(tfu()))
add(
    "names of variables with brackets and no unit",
    "t_s,F[0],x[0]\n" + lines(tfu()),
    refused="unit",
    options={"channels": {"force": "F[0]", "position": "x[0]"}},
    remedy={"units": {"force": "N", "position": "mm"}},
)
add("a footer with the number of rows", HEAD + lines(tfu()) + "Rows: 60\nDuration: 0.03 s\n")
add(
    "a footer with a factor",
    HEAD + lines(lambda i: f"{t(i)},{FORCE[i] / 4:.5f},{u(i)}") + "Load values to be multiplied by 4\n",
    refused="multipl",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "4"}}},
)
add(
    "xlsx, a units row in brackets",
    sheet(
        [
            ["Zeit", "Kraft", "Weg"],
            ["[ms]", "[kN]", "[µm]"],
            *[[float(TIME[i] * 1e3), float(FORCE[i] / 1e3), float(POSITION[i] * 1e3)] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
)


def two(made_book):
    made_book.active.title = "Run 1"
    for page, scale in ((made_book.active, 1.0), (made_book.create_sheet("Run 2"), 0.9)):
        page.append(["Time [s]", "Force [N]", "Position [mm]"])
        for i in range(N):
            page.append([float(TIME[i]), float(FORCE[i] * scale), float(POSITION[i])])


add("xlsx, a run on each sheet", book(two), suffix=".xlsx", refused="sheet")
add(
    "zip with two runs in folders",
    zipped({"a/run.csv": (HEAD + lines(tfu())).encode(), "b/run.csv": (HEAD + lines(tfu())).encode()}),
    suffix=".zip",
    refused="a/run.csv",
)
add(
    "HDF5, a rate in kHz by its attribute's name",
    made(
        lambda file: [
            file.create_dataset(n, data=v).attrs.update({"units": unit, "sampling_rate_khz": 2.0})
            for n, v, unit in (("force", FORCE, "N"), ("position", POSITION, "mm"))
        ]
    ),
    suffix=".h5",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "MATLAB, names with units in brackets are not possible",
    mat(time_ms=TIME * 1e3, force_kN=FORCE / 1e3, position_um=POSITION * 1e3, fs_Hz=2000.0),
    suffix=".mat",
)
add(
    "Parquet, a unit in each field",
    parquet(
        {"t": TIME * 1e3, "F": FORCE / 1e3, "x": POSITION * 1e3},
        {"t": {"unit": "ms"}, "F": {"unit": "kN"}, "x": {"unit": "um"}},
    ),
    suffix=".parquet",
)
add(
    "JSON, a unit in each list",
    json.dumps(
        {
            "t_ms": (TIME * 1e3).tolist(),
            "F_kN": (FORCE / 1e3).tolist(),
            "x_um": (POSITION * 1e3).tolist(),
            "comment": "x",
        }
    ),
    suffix=".json",
)
add(
    "JSON lines, the rate in each line",
    lines(lambda i: json.dumps({"fs": 2000, "i": i, "force_N": FORCE[i], "position_mm": POSITION[i]})),
    suffix=".jsonl",
    refused="rate|time",
    remedy={"rate": 2000.0},
)
