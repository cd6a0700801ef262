"""Clocks of films and of twelve hours, whole numbers and what a count is worth, headings in odd characters and places."""

from __future__ import annotations

import json
from datetime import timedelta
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import made
from tests.records.exports.containers import hdf5, parquet, sheet
from tests.records.exports.programs.workbooks_and_binary_files import book, mat

CLOCKS_COUNTS_AND_HEADINGS = Kind()
add = CLOCKS_COUNTS_AND_HEADINGS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
WHOLE = [round(FORCE[i] * 1e3) for i in range(N)]
COUNTED = "time [s],force [N],position [mm]\n" + lines(lambda i: f"{t(i)},{WHOLE[i]},{u(i)}")
WORTH = {"channels": {"force": {"column": "force [N]", "scale": "0.001"}}}

# Clocks
add(
    "frames of a film in the stamps",
    "timecode," + FU + lines(lambda i: f"10:00:{i // 25:02d}:{i % 25:02d},{fu()(i)}"),
    time=np.arange(N) / 25,
    refused="time|frame|stamp|rate|step",
)
add(
    "minutes, seconds and thousandths",
    "elapsed (mm:ss:ms)," + FU + lines(lambda i: f"00:00:{5 * i:03d},{fu()(i)}"),
    time=SLOW,
    refused="time|rate|unit|stamp|is no number",
)
add(
    "thousandths without their zeros",
    "time," + FU + lines(lambda i: f"10:00:00.{5 * i},{fu()(i)}"),
    time=SLOW,
    refused="back|increase|time|digit",
)
add(
    "seconds and microseconds put together by a point",
    "time [s]," + FU + lines(lambda i: f"12.{500 * i},{fu()(i)}"),
    refused="back|increase|time|digit",
)
add(
    "twelve hours without am and pm over one o'clock",
    "time,"
    + FU
    + lines(lambda i: (f"12:59:59.{900 + 5 * i:03d}" if i < 20 else f"1:00:00.{5 * (i - 20):03d}") + f",{fu()(i)}"),
    time=SLOW,
    refused="back|hour|time",
)
add(
    "steps of the clock in a heading of days",
    "Time [days]," + FU + lines(lambda i: f"{5e-3 * i / 86400:.13f},{fu()(i)}"),
    time=SLOW,
    atol_time=1e-7,
)
add("a fraction as the time", "time [s]," + FU + lines(lambda i: f"{i}/2000,{fu()(i)}"), refused="number|time|table")
add(
    "times in hundredths, told by the heading",
    "time (1/100 s)," + FU + lines(lambda i: f"{i / 20:.2f},{fu()(i)}"),
    refused="unit|1/100|time",
)
add(
    "two sensors with a time each, numbered",
    "t1 [s],F1 [N],t2 [s],F2 [N]\n" + lines(lambda i: f"{t(i)},{f(i)},{t(i)},{FORCE[i] * 0.9:.4f}"),
    force=None,
    position=None,
)
# Whole numbers and what they are worth
add("a resolution above whole newtons", "Resolution: 0.001 N\n" + COUNTED, refused="esolution", remedy=WORTH)
add("a count's worth above whole newtons", "1 count = 0.001 N\n" + COUNTED, refused="count", remedy=WORTH)
add(
    "a line of calibration above whole newtons",
    "Calibration: y = 0.001 x + 0\n" + COUNTED,
    refused="alibration|y = ",
    remedy=WORTH,
)
add(
    "a range of 16 bits above whole newtons",
    "Full scale: 32.767 N = 32767\n" + COUNTED,
    refused="ull scale|32767",
    remedy=WORTH,
)
add("a resolution above decimals", "Resolution: 0.001 N\n" + HEAD + lines(tfu()))
add(
    "a decimal place in a column",
    "time [s],force [N],force decimals,position [mm]\n" + lines(lambda i: f"{t(i)},{WHOLE[i]},3,{u(i)}"),
    refused="decimals",
    remedy=WORTH,
)
add(
    "an exponent in a column",
    "time [s],force [N],force exponent,position [mm]\n" + lines(lambda i: f"{t(i)},{WHOLE[i]},-3,{u(i)}"),
    refused="exponent",
    remedy=WORTH,
)
# Headings
add(
    "three forces under one heading",
    "Time,Force,Force,Force,Position\n,left,right,sum,\ns,N,N,N,mm\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] * 0.4:.4f},{FORCE[i] * 0.6:.4f},{f(i)},{u(i)}"),
    refused="could each|unit|heading|columns",
    remedy=None,
)
add("names below the numbers", lines(tfu()) + "time [s],force [N],position [mm]\n", refused="heading|columns")
add(
    "units behind a sign at the end of the heading",
    "time,force,position  # s, N, mm\n" + lines(tfu()),
    refused="unit|heading|columns",
)
add("a blank that takes no room", "time\u200b [s],force\u200b [N],position\u200b [mm]\n" + lines(tfu()))
add("blanks that do not break", "Time\u00a0[s];Force\u00a0[N];Position\u00a0[mm]\n" + lines(tfu(";")))
add(
    "digits as wide as letters of Japan",
    HEAD + lines(lambda i: tfu()(i).translate({48 + k: 0xFF10 + k for k in range(10)})),
    refused="number|digit|table",
)
add("labels of rows without a name", HEAD + lines(lambda i: f"P{i:03d},{tfu()(i)}"), refused="heading|cells|columns")
add("percent in the cells", "time [s],force [N],position [mm],duty\n" + lines(lambda i: f"{tfu()(i)},{i % 100}%"))
add("a unit that cannot be", "time [s],force [N/A],position [mm]\n" + lines(tfu()), refused="N/A|unit")
add(
    "kN in the name, in the middle",
    "time_s,force_kN_filtered,position_mm\n" + lines(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i)}"),
    refused="unit",
    remedy={"units": {"force": "kN"}},
)
add(
    "a name that ends in a unit by chance",
    "time_s,force_in,position_mm\n" + lines(tfu()),
    refused="unit",
    remedy={"units": {"force": "N"}},
)
add("two rows of units", "time,force,position\ns,N,mm\nms,kN,um\n" + lines(tfu()), refused="unit|line 3|twice")
add(
    "headings in lower German, commas in all",
    "zeit in ms;kraft in n;weg in mm\n" + lines(lambda i: de(f"{t(i, 1e3, 1)};{f(i)};{u(i)}")),
    refused="unit",
)
add(
    "thousands of mm",
    "time [s],force [N],position [mm/1000]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i, 1e3, 1)}"),
    refused="unit|1000|factor",
)


# Containers
def durations(made: Any) -> None:
    page = made.active
    page.append(["Elapsed", "Force [N]", "Position [mm]"])
    for i in range(N):
        page.append([timedelta(milliseconds=5 * i), FORCE[i], POSITION[i]])
        page.cell(page.max_row, 1).number_format = "[h]:mm:ss.000"


add("xlsx, durations beyond a day", book(durations), suffix=".xlsx", time=SLOW, atol_time=1e-6)
add(
    "xlsx, texts among numbers",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]"],
            *[[float(TIME[i]), de(f(i)) if i % 9 == 4 else float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    refused="decimal|number|mark",
)
add(
    "xlsx, errors and truths",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]", "Valid"],
            *[
                [float(TIME[i]), "#DIV/0!" if i == 20 else float(FORCE[i]), float(POSITION[i]), i != 20]
                for i in range(N)
            ],
        ]
    ),
    suffix=".xlsx",
)
add(
    "HDF5, units of all in one text",
    hdf5({"time": TIME, "force": FORCE / 1e3, "position": POSITION}, column_units=json.dumps({"force": "kN"})),
    suffix=".h5",
    refused="unit",
    remedy={"units": {"time": "s", "force": "kN", "position": "mm"}},
)
add(
    "HDF5, one column each",
    made(
        lambda file: [
            file.create_dataset(n, data=v[:, None]).attrs.update({"unit": unit})
            for n, v, unit in (("time", TIME, "s"), ("force", FORCE, "N"), ("position", POSITION, "mm"))
        ]
    ),
    suffix=".h5",
)
add(
    "HDF5, a step and its unit beside each",
    made(
        lambda file: [
            file.create_dataset(n, data=v).attrs.update(
                {"y_unit": unit, "unit": unit, "x_increment": 0.5, "x_unit": "ms"}
            )
            for n, v, unit in (("force", FORCE, "N"), ("position", POSITION, "mm"))
        ]
    ),
    suffix=".h5",
    refused="rate|increment|unit",
    remedy={"rate": 2000.0},
)


def devices(file: Any) -> None:
    for group, name, values, unit, step in (
        ("ai", "force", FORCE, "N", 1 / RATE),
        ("enc", "position", POSITION, "mm", 1e-3),
    ):
        file.create_dataset(f"{group}/time", data=np.arange(N) * step).attrs["unit"] = "s"
        file.create_dataset(f"{group}/{name}", data=values).attrs["unit"] = unit


add(
    "HDF5, two devices of two rates",
    made(devices),
    suffix=".h5",
    position=None,
    absent=("position",),
    refused="different times|could each",
)
add(
    "MATLAB, a structure with units in a list",
    mat(
        data={
            "time": TIME * 1e3,
            "force": FORCE / 1e3,
            "position": POSITION * 1e3,
            "units": np.array(["ms", "kN", "um"], dtype=object),
        }
    ),
    suffix=".mat",
    refused="unit",
    remedy={"units": {"time": "ms", "force": "kN", "position": "um"}},
)
add(
    "Parquet, a counter and a rate in the metadata of a field",
    parquet(
        {"sample": np.arange(N), "force": FORCE, "position": POSITION},
        {"force": {"unit": "N", "rate": "2000"}, "position": {"unit": "mm"}},
    ),
    suffix=".parquet",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "JSON lines with a mark at their beginning",
    "\ufeff" + lines(lambda i: json.dumps({"time_s": TIME[i], "force_N": FORCE[i], "position_mm": POSITION[i]})),
    suffix=".ndjson",
)
add(
    "JSON, a number of samples beside",
    json.dumps({"n": 60, "rate_hz": 2000, "force_N": FORCE.tolist(), "position_mm": POSITION.tolist()}),
    suffix=".json",
)
