"""Factors, signs and dividers in headings, two rates, several runs."""

from __future__ import annotations

import gzip
import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.containers import hdf5, parquet, sheet
from tests.records.exports.desks import FU, HEAD, SLOW

FACTORS_IN_HEADINGS = Kind()
add = FACTORS_IN_HEADINGS.add
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
ASKED = "factor|scale|unit|sign|heading|worth"


def forces(heading: str, factor: float, digits: int = 4) -> str:
    return f"time [s],{heading},position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] * factor:.{digits}f},{u(i)}")


add("half the force", forces("F/2 [N]", 0.5), refused=ASKED)
add("an inverted force", forces("force inverted [N]", -1), refused=ASKED + "|invert")
add("a factor in words", forces("force [N] (factor 0.1)", 10), refused=ASKED)
add("a unit times ten", forces("force [N·10]", 0.1), refused=ASKED)
add("a unit with a superscript", forces("force [N·10⁻³]", 1e3, 0), refused=ASKED)
add("a divider", forces("force 1:10 [N]", 0.1), refused=ASKED + "|1:10")
add("kg m/s^2", forces("force [kg m/s^2]", 1), refused="unit")
add("percent of the range", forces("force [% FS]", 0.5), refused="unit")
add(
    "names as R writes them",
    "Time..s.,Force..N.,Position..mm.\n" + lines(tfu()),
    refused="unit|time",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add("names as MATLAB writes them", "Time_s_,Force_N_,Position_mm_\n" + lines(tfu()), refused="unit", remedy=NAMED)
add("names in pairs", "\"('Time', 's')\",\"('Force', 'N')\",\"('Position', 'mm')\"\n" + lines(tfu()), refused="unit")
add("names in one word", "timeSeconds,forceN,positionMm\n" + lines(tfu()), refused="unit|time", remedy=NAMED)
add(
    "units in words behind underscores",
    "time_seconds,force_newton,position_millimeter\n" + lines(tfu()),
    refused="unit",
)
add(
    "minutes behind an underscore",
    "time_min,force_N,position_mm\n" + lines(lambda i: f"{TIME[i] / 60:.10f},{fu()(i)}"),
    refused="unit|time",
    atol_time=1e-7,
)
add(
    "units said in a sentence",
    "Forces in kN, displacements in mm, times in s\nTime,Force,Position\n"
    + lines(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i)}"),
    refused="unit",
)
add(
    "two axes",
    "time [s],force [N],x [mm],y [mm]\n" + lines(lambda i: f"{tfu()(i)},{POSITION[i] * 0.1:.5f}"),
    refused="could each",
    remedy={"channels": {"position": "x [mm]"}},
)
add(
    "wanted before measured",
    "time [s],force setpoint [N],force [N],position demand [mm],position [mm]\n"
    + lines(lambda i: f"{t(i)},12,{f(i)},0,{u(i)}"),
)
add(
    "errors beside",
    "time [s],force [N],force error [N],position [mm],following error [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)},0.01,{u(i)},0.002"),
)
add(
    "raw above tared",
    "Time,Force,,Position,\n[s],raw [V],tared [N],raw [V],tared [mm]\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] / 100:.5f},{f(i)},{POSITION[i] / 10:.5f},{u(i)}"),
    refused="unit|could each|heading",
)

# Rates and clocks
TWO_RATES = (
    "# fs = 2000 Hz\n" + FU + lines(fu(), 30) + "# fs = 1000 Hz\n" + "".join(fu()(i) + "\n" for i in range(30, N))
)
add(
    "a rate that changes below",
    TWO_RATES,
    time=np.r_[TIME[:30], TIME[29] + np.arange(1, 31) / 1000],
    refused="rate|line 33|second",
)
add(
    "a unit that changes below, in a remark",
    HEAD + lines(tfu(), 30) + "# force unit: kN\n" + "".join(f"{t(i)},{f(i, 1e-3, 6)},{u(i)}\n" for i in range(30, N)),
    refused="unit|line 32|jump|decimal",
)
add(
    "a rate of all channels together",
    "Aggregate sample rate: 4000 Hz\nChannels: 2\n" + FU + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
add("a rate per minute", "Sampling: 120000 samples/min\n" + FU + lines(fu()), refused="rate", remedy={"rate": 2000.0})
add(
    "every second value kept",
    "Sampling rate: 4000 Hz\nStored: every 2nd value\n" + FU + lines(fu()),
    refused="rate|Hz",
    remedy={"rate": 2000.0},
)
add("one sample every", "1 sample every 0.5 ms\n" + FU + lines(fu()), refused="rate", remedy={"rate": 2000.0})
add("the unit before the rate", "Sampling rate [kHz]: 2\n" + FU + lines(fu()), refused="rate", remedy={"rate": 2000.0})
add(
    "a counter of every tenth sample",
    "# fs = 2000 Hz\nsample," + FU + lines(lambda i: f"{10 * i},{fu()(i)}"),
    time=SLOW,
    refused="rate|sample|count",
)
add(
    "hours, minutes and seconds as the unit",
    "elapsed [h:m:s]," + FU + lines(lambda i: f"0:00:{i / RATE:07.4f},{fu()(i)}"),
)
add(
    "a zone by its letters",
    "time," + FU + lines(lambda i: f"2023-11-02 10:00:{i / RATE:07.4f} CET,{fu()(i)}"),
    refused="time|rate",
)
add(
    "a day of the week",
    "time," + FU + lines(lambda i: f"Thu 02.11.2023 10:00:{i / RATE:07.4f},{fu()(i)}"),
    refused="time|rate",
)
add(
    "a month by its name",
    '"time",' + FU + lines(lambda i: f'"Nov 2, 2023 10:00:{i / RATE:07.4f} AM",{fu()(i)}'),
    refused="time|rate",
)
add(
    "Japanese stamps",
    "時刻," + FU + lines(lambda i: f"2023年11月02日 10時00分{i / RATE:07.4f}秒,{fu()(i)}"),
    refused="time|rate|unit",
)
add(
    "ms and us after points",
    "time," + FU + lines(lambda i: f"10:00:00.{i // 2:03d}.{500 * (i % 2):03d},{fu()(i)}"),
    refused="time|rate|clock",
)
add(
    "seconds and nanoseconds",
    "secs,nsecs,force_N,position_mm\n" + lines(lambda i: f"1698919200,{500000 * i},{fu()(i)}"),
    refused="time|nsecs|unit",
)
add(
    "ticks of a tenth of a microsecond",
    "Ticks," + FU + lines(lambda i: f"{638345232000000000 + 5000 * i},{fu()(i)}"),
    refused="time|rate|unit|digits",
)
add(
    "week and second of GPS",
    "GPSWeek,GPSTOW [s]," + FU + lines(lambda i: f"2286,{381618 + i / RATE:.4f},{fu()(i)}"),
    atol_time=1e-6,
)
add("stamps of single precision", "time [s]," + FU + lines(lambda i: f"1.698919e+09,{fu()(i)}"), refused="time|rate")
add(
    "h, m and s between", "time," + FU + lines(lambda i: f"10h00m{i / RATE:07.4f}s,{fu()(i)}"), refused="time|rate|unit"
)

# Rows
add(
    "signs that touch",
    "  time[s] force[N]   x[mm]\n"
    + lines(
        lambda i: (
            f"{t(i):>9}{f(i):>9}{u(i):>8}".replace(" -0.", "-10.") if i % 7 == 3 else f"{t(i):>9}{f(i):>9}{u(i):>9}"
        )
    ),
    refused="cells|line|number|column|table",
)
add(
    "blanks for what is missing",
    "  time[s] force[N]   x[mm]\n" + lines(lambda i: f"{t(i):>9}{'' if i in (20, 21) else f(i):>9}{u(i):>9}"),
    suffix=".txt",
)
add(
    "remarks with commas",
    "time [s],force [N],position [mm],remark\n" + lines(lambda i: tfu()(i) + (",start, by hand" if i == 20 else ",")),
)
add(
    "a remark over two lines",
    "time [s],force [N],position [mm],remark\n" + lines(lambda i: tfu()(i) + (',"start\nby hand"' if i == 20 else ",")),
)
add(
    "units again in the middle",
    "time,force,position\ns,N,mm\n" + lines(tfu(), 30) + "s,N,mm\n" + "".join(tfu()(i) + "\n" for i in range(30, N)),
    refused="head|unit|line 33",
)
add(
    "two sensors in turn",
    "id,time [s],force [N]\n" + lines(lambda i: f"1,{t(i)},{f(i)}\n2,{t(i)},{FORCE[i] / 2:.4f}"),
    position=None,
    refused="time|twice|same|id",
)
add("apostrophes before numbers", HEAD + lines(lambda i: f"{t(i)},'{f(i)},{u(i)}"), refused="number")
add(
    "a table of reStructuredText",
    "====== ======= ===========\ntime_s force_N position_mm\n====== ======= ===========\n"
    + lines(tfu(" "))
    + "====== ======= ===========\n",
    suffix=".rst",
)
add("a fence of Markdown", "# Drop 3\n\n```csv\n" + HEAD + lines(tfu()) + "```\n", suffix=".md")
add(
    "lines quoted in a mail",
    "> " + HEAD + lines(lambda i: "> " + tfu()(i)),
    suffix=".txt",
    refused="number|heading|table|column|time",
)
add(
    "lines of a log",
    lines(lambda i: f"INFO daq: t={t(i)} F={f(i)} x={u(i)}"),
    suffix=".log",
    options={"units": {"t": "s", "F": "N", "x": "mm"}},
    refused="table|key|column|cells",
)
add(
    "pairs with decimal commas",
    lines(lambda i: de(f"t={t(i)};F={f(i)};x={u(i)}")),
    suffix=".log",
    options={"units": {"t": "s", "F": "N", "x": "mm"}},
    refused="table|decimal|number|cells",
)
add(
    "rows of a program's list",
    lines(lambda i: f"[{tfu(', ')(i)}],"),
    suffix=".txt",
    refused="table|JSON|column|number|heading",
)

# Containers


def run(path: Path, names: tuple[str, ...], **attributes: Any) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        for k, name in enumerate(names):
            for what, values, unit in (("time", TIME, "s"), ("force", FORCE, "N"), ("position", POSITION, "mm")):
                data = file.create_dataset(f"{name}/{what}", data=values * (1 if what == "time" else 1 - 0.1 * k))
                data.attrs.update({"unit": unit, **(attributes if what == "force" else {})})


add("HDF5, two runs", lambda path: run(path, ("run1", "run2")), suffix=".h5", refused="could each|two|time")
add(
    "HDF5, the sensitivity of a sensor noted",
    lambda path: run(path, ("run1",), sensitivity=2.1, serial=1234),
    suffix=".h5",
)
add("HDF5, an amplifier's gain of one", lambda path: run(path, ("run1",), gain=1.0), suffix=".h5")
add(
    "HDF5, readings to be calibrated",
    lambda path: run(path, ("run1",), calibration_factor=2.0),
    suffix=".h5",
    refused="calibration",
    remedy={"channels": {"force": {"column": "run1.force", "scale": "1"}}},
)
add(
    "HDF5, the step of a waveform",
    hdf5({"force": FORCE, "position": POSITION}, {"force": "N", "position": "mm"}, wf_increment=0.0005),
    suffix=".h5",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "Parquet, counts with a scale",
    parquet(
        {"time_s": TIME, "force_N": np.round(FORCE * 1e3).astype("i4"), "position_mm": POSITION},
        {"force_N": {"scale": "0.001"}},
    ),
    suffix=".parquet",
    refused="scale",
    remedy={"channels": {"force": {"column": "force_N", "scale": "0.001"}}},
)


def with_slopes(path: Path) -> None:
    import scipy.io

    channel = {"data": np.round(FORCE * 1e3), "unit": "N", "slope": 1e-3, "name": "force"}
    scipy.io.savemat(path, {"time_s": TIME, "ch1": channel, "position_mm": POSITION})


add("MATLAB, a channel with its slope", with_slopes, suffix=".mat", refused="slope")
START = datetime(2023, 11, 2, 10)
add(
    "xlsx, stamps in a table set in",
    sheet(
        [
            [],
            [],
            [None, None, "Time", "Force [N]", "Position [mm]"],
            *[[None, None, START + timedelta(seconds=5e-3 * i), FORCE[i], POSITION[i]] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    time=SLOW,
    refused="time|rate",
)
add(
    "gzip of two parts",
    gzip.compress((HEAD + lines(tfu(), 30)).encode())
    + gzip.compress("".join(tfu()(i) + "\n" for i in range(30, N)).encode()),
    suffix=".csv.gz",
)
add(
    "JSON, channels with arrays",
    json.dumps(
        {
            "fs_Hz": 2000,
            "channels": [
                {"name": "force", "unit": "N", "data": FORCE.tolist()},
                {"name": "position", "unit": "mm", "data": POSITION.tolist()},
            ],
        }
    ),
    suffix=".json",
    refused="JSON|table|rate|channel|list|row",
)
add(
    "JSON lines, units in the first",
    json.dumps({"units": {"time": "s", "force": "N", "position": "mm"}})
    + "\n"
    + lines(lambda i: json.dumps({"time": i / RATE, "force": FORCE[i], "position": POSITION[i]})),
    suffix=".jsonl",
    refused="unit",
)
