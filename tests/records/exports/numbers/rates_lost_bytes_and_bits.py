"""Rates with thousands and decimal signs, names like counters, lost bytes, zones of clocks, and what the bit of a converter is worth."""

from __future__ import annotations

import gzip
import json
from datetime import datetime, timedelta

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import made
from tests.records.exports.containers import parquet, sheet, zipped

RATES_LOST_BYTES_AND_BITS = Kind()
add = RATES_LOST_BYTES_AND_BITS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
SEMI = "Kraft [N];Weg [mm]\n"
VOLTS = {
    "channels": {
        "force": {"column": "CH1", "unit": "V", "scale": "100 N/V"},
        "position": {"column": "CH2", "unit": "V", "scale": "10 mm/V"},
    }
}


def volts(i: int) -> str:
    return f"{FORCE[i] / 100:.5f},{POSITION[i] / 10:.5f}"


# Rates
for said, rate, german in (
    ("Abtastrate: 12.800 Hz", 12800.0, True),
    ("Abtastrate: 51.200,00 Hz", 51200.0, True),
    ("Abtastrate [Hz]: 2'000", 2000.0, True),
    ("Messrate: 0,5 kHz", 500.0, True),
    ("Sample rate: 12,800 Hz", 12800.0, False),
    ("Sample rate: 51,200.00 Hz", 51200.0, False),
    ("fs = 2e3 Hz", 2000.0, False),
    ("Sample Rate (Hz),1000", 1000.0, False),
    ("sampling_frequency_hz=25600", 25600.0, False),
    ("dt=0.0005 # s", 2000.0, False),
    ("Sample period: 200 us", 5000.0, False),
):
    add(
        f"rate: {said!r}",
        said + "\n" + (SEMI + lines(fu(";", de)) if german else FU + lines(fu())),
        time=np.arange(N) / rate,
        refused="rate|Hz|dt",
        remedy={"rate": rate},
    )
add(
    "rate: 'Abtastrate: 1.024 kHz' above decimal commas",
    "Abtastrate: 1.024 kHz\n" + SEMI + lines(fu(";", de)),
    time=np.arange(N) / 1024.0,
    refused="1.024",
    remedy={"rate": 1024.0},
)
# Names like counters, cells too many
add(
    "a load called Nr",
    "t [s];Nr [N];Pos [mm]\n" + lines(tfu(";")),
    refused="force|could each|channel",
    remedy={"channels": {"force": "Nr [N]"}},
)
add(
    "a place called Point, a load called Index",
    "t [s],Index [N],Point [mm]\n" + lines(tfu()),
    refused="force|could each|channel",
)
add(
    "an index, and a heading less",
    "time [s],force [N],position [mm]\n" + lines(lambda i: f"{i + 1},{tfu()(i)},"),
    refused="heading|columns|cells",
)
add(
    "one heading more, at the front",
    "run,time [s],force [N],position [mm]\n" + lines(tfu()),
    refused="heading|columns|cells",
)
add(
    "a heading that stands over two cells",
    "time [s],force [N] (filtered, 100 Hz),position [mm]\n" + lines(tfu()),
    refused="heading|columns|cells",
)
# Bytes lost
add(
    "NUL bytes in a file with a counter",
    ("fs = 2000 Hz\nsample," + FU).encode()
    + b"".join((b"\0" * 30 + b"\n" if i in (20, 21) else f"{i},{fu()(i)}\n".encode()) for i in range(N)),
)
add("NUL bytes to the end", (HEAD + lines(tfu(), 50)).encode() + b"\0" * 400, time=TIME[:50])
add(
    "a block of 0xFF in the middle",
    (HEAD + lines(tfu(), 30)).encode() + b"\xff" * 64 + b"\n" + "".join(f"{tfu()(i)}\n" for i in range(30, N)).encode(),
    refused="encod|bytes|character|damag",
)
# Clocks
ends = datetime(2023, 11, 5, 1, 59, 59, 900000)
add(
    "summer time ends in New York",
    "stamp,"
    + FU
    + lines(
        lambda i: (
            (ends + timedelta(milliseconds=5 * i) - timedelta(hours=0 if i < 20 else 1)).isoformat("T", "milliseconds")
            + f"{'-04:00' if i < 20 else '-05:00'},{fu()(i)}"
        )
    ),
    time=SLOW,
)
add(
    "stamps in Newfoundland",
    "stamp," + FU + lines(lambda i: f"2023-07-02 10:00:00.{5 * i:03d}-02:30,{fu()(i)}"),
    time=SLOW,
)
add("stamps with Z and six digits", "stamp," + FU + lines(lambda i: f"2023-07-02T10:00:00.{500 * i:06d}Z,{fu()(i)}"))
# Steps of converters
add(
    "the step of a converter in the heading",
    "time [s],force [N] (LSB = 0.001),position [mm]\n" + lines(lambda i: f"{t(i)},{round(FORCE[i] * 1e3)},{u(i)}"),
    refused="LSB|0.001|factor|unit",
    remedy={"channels": {"force": {"column": "force [N] (LSB = 0.001)", "scale": "0.001"}}},
)
add(
    "newtons a bit in the heading",
    "time [s],force [0.001 N/LSB],position [mm]\n" + lines(lambda i: f"{t(i)},{round(FORCE[i] * 1e3)},{u(i)}"),
    refused="unit|LSB",
    remedy={"channels": {"force": {"column": "force [0.001 N/LSB]", "unit": "counts", "scale": "0.001 N"}}},
)
add(
    "a row of steps, its unit beside",
    "time;force;position\ns;N;mm\nLSB [unit];0.001;0.0001\n"
    + lines(lambda i: f"{t(i)};{round(FORCE[i] * 1e3)};{round(POSITION[i] * 1e4)}"),
    refused="LSB",
    remedy={
        "channels": {
            "force": {"column": "force", "scale": "0.001"},
            "position": {"column": "position", "scale": "0.0001"},
        }
    },
)
# Exports
add(
    "NI, times named by their channels",
    "Time - Force_0 [s]\tForce_0 [N]\tTime - Pos_1 [s]\tPos_1 [mm]\n"
    + lines(lambda i: f"{t(i)}\t{f(i)}\t{t(i)}\t{u(i)}"),
    suffix=".txt",
)
add(
    "NI, interval below the units",
    "Channel\tForce\tPosition\nUnits\tN\tmm\nInterval\t0.0005\t0.0005\nTime\t10:00:00\t10:00:00\n"
    + lines(lambda i: f"\t{fu(chr(9))(i)}"),
    suffix=".txt",
    refused="rate|unit|Interval",
    remedy={"rate": 2000.0},
)
add(
    "catman, names and units in rows of a long head",
    "catmanEasy\n\nChannel 1: U9C 200 N\nChannel 2: WA 50 mm\nSample rate: 2000 Hz\n\nTime\tKraft\tWeg\ns\tN\tmm\n"
    + lines(tfu("\t", de)),
    suffix=".asc",
)
add(
    "Keysight, blanks before the names",
    ",Ch1,Ch2\ns,V,V\n" + lines(lambda i: f"{i / RATE:.6e},{volts(i)}"),
    options={
        "channels": {
            "force": {"column": "Ch1", "unit": "V", "scale": "100 N/V"},
            "position": {"column": "Ch2", "unit": "V", "scale": "10 mm/V"},
        }
    },
    refused="time|unit",
    remedy={"units": {"time": "s"}},
)
add(
    "Siglent, the step alone",
    "Record Length,60\nSample Interval,0.0005\nVertical Units,V\nCH1,CH2\n" + lines(volts),
    options=VOLTS,
    refused="rate|Interval",
    remedy={"rate": 2000.0},
)
add(
    "Tektronix, the step with its unit behind",
    "Model,MSO24\nSample Interval,5.0E-04,s\nRecord Length,60\n\nTIME,CH1,CH2\n"
    + lines(lambda i: f"{i / RATE:.6e},{volts(i)}"),
    options=VOLTS,
    refused="unit",
    remedy={"units": {"time": "s"}},
)
add(
    "Yokogawa, the rate of each trace",
    "TraceName,CH1,CH2\nBlockSize,60,60\nVUnit,V,V\nSampleRate,2000,2000\nHUnit,s,s\n"
    + lines(lambda i: f",{volts(i)}"),
    options=VOLTS,
    refused="heading|rate|CH1",
)
add(
    "dSPACE, a raster for each signal",
    "path,F,x\nunit,N,mm\nraster,1 ms,0.5 ms\n" + lines(lambda i: f"{t(i)},{fu()(i)}"),
    refused="time|heading|unit|rate",
    options={"channels": {"force": "F", "position": "x"}},
    remedy=None,
)
# Containers
add(
    "zip with a text beside",
    zipped({"run.csv": (HEAD + lines(tfu())).encode(), "notes.txt": b"a remark on the run\n"}),
    suffix=".zip",
    refused="run.csv",
)
add(
    "gzip of two parts, each with its heading",
    gzip.compress((HEAD + lines(tfu(), 30)).encode())
    + gzip.compress((HEAD + "".join(f"{tfu()(i)}\n" for i in range(30, N))).encode()),
    suffix=".csv.gz",
)
add(
    "xlsx, the rate in a cell with its unit",
    sheet(
        [
            ["Rate", "2 kHz"],
            [],
            ["Force [N]", "Position [mm]"],
            *[[float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "HDF5, names of units in words",
    made(
        lambda file: [
            file.create_dataset(n, data=v).attrs.update({"unit": np.array([unit.encode()])})
            for n, v, unit in (
                ("time", TIME * 1e3, "milliseconds"),
                ("force", FORCE / 1e3, "kilonewton"),
                ("position", POSITION, "millimeter"),
            )
        ]
    ),
    suffix=".h5",
    refused="unit",
)
add(
    "Parquet, headings with brackets",
    parquet({"Time (ms)": TIME * 1e3, "Force (kN)": FORCE / 1e3, "Position (um)": POSITION * 1e3}),
    suffix=".parquet",
)
add(
    "JSON lines, a head with the rate",
    json.dumps({"sample_rate_hz": 2000, "force_unit": "N"})
    + "\n"
    + lines(lambda i: json.dumps({"force_N": FORCE[i], "position_mm": POSITION[i]})),
    suffix=".jsonl",
)
add(
    "JSON lines, a line cut in the middle",
    lines(
        lambda i: json.dumps({"time_s": TIME[i], "force_N": FORCE[i], "position_mm": POSITION[i]})[
            : 20 if i == 30 else None
        ]
    ),
    suffix=".jsonl",
    refused="line 31",
)
