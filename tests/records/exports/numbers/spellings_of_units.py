"""Exports with traps that no earlier kind holds, written from the descriptions of their formats."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, lines, t, tfu, u
from tests.records.exports.containers import parquet, sheet, zipped

SPELLINGS_OF_UNITS = Kind()
add = SPELLINGS_OF_UNITS.add
VOLTS = {"channels": {"force": {"column": "CH1", "unit": "V", "scale": "100 N/V"}}}


def volts(i: int) -> str:
    return f"{FORCE[i] / 100:.5f}"


add(
    "NI with a start time and a delta t in rows",
    "t0,2/11/2023 10:00:00,2/11/2023 10:00:00\ndelta t,0.0005,0.0005\n\ntime,Force,Position\n,N,mm\n" + lines(tfu()),
)
add(
    "NI TDMS text view",
    "Root Name,Title,Author\ndrop,,\nGroup,Channels\nData,2\nChannel,Datatype,Unit,Length,wf_increment\n"
    "Force,DT_DOUBLE,N,60,0.0005\nPosition,DT_DOUBLE,mm,60,0.0005\n\nForce,Position\n"
    + lines(lambda i: f"{f(i)},{u(i)}"),
    refused="rate|interval|increment|time",
    remedy=None,
)
add(
    "LVM with a comment column",
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tNo\n"
    "X_Columns\tOne\nTime_Pref\tRelative\n***End_of_Header***\t\n\t\nChannels\t2\t\t\t\nSamples\t60\t60\t\t\nY_Unit_Label\tN\tmm\n"
    "X_Dimension\tTime\tTime\nX0\t0.0\t0.0\nDelta_X\t0.000500\t0.000500\n***End_of_Header***\t\t\t\t\n"
    "X_Value\tForce\tPosition\tComment\n" + lines(lambda i: f"{t(i)}\t{f(i)}\t{u(i)}\t" + ("start" if i == 0 else "")),
    suffix=".lvm",
)
add(
    "dSPACE with times in ms",
    "path,Model Root/Force,Model Root/Position\nunit,N,mm\ntime [ms],Force,Position\n"
    + lines(lambda i: f"{t(i, 1e3, 1)},{f(i)},{u(i)}"),
)
add(
    "catman with a date in each name",
    "MX840A_0_CH1 (2023-11-02)\tMX840A_0_CH2 (2023-11-02)\tTime\nN\tmm\ts\n"
    + lines(lambda i: f"{f(i)}\t{u(i)}\t{t(i)}"),
    options={
        "channels": {
            "force": {"column": "MX840A_0_CH1 (2023-11-02)", "unit": "N"},
            "position": {"column": "MX840A_0_CH2 (2023-11-02)", "unit": "mm"},
        }
    },
    suffix=".txt",
)
add(
    "Rigol with the step on the second line",
    "X,CH1,Start,Increment,\nSequence,Volt,0.000000e+00,5.000000e-04\n" + lines(lambda i: f"{i},{volts(i)},"),
    options=VOLTS,
    position=None,
)
add(
    "Rigol with a trigger in the middle",
    "X,CH1,Start,Increment,\nSequence,Volt,-1.500000e-02,5.000000e-04\n" + lines(lambda i: f"{i},{volts(i)},"),
    options=VOLTS,
    position=None,
)
add(
    "Tektronix MDO with a probe attenuation",
    "Model,MDO3024\nFirmware Version,1.30\n\nPoint Format,Y,\nHorizontal Units,S,\nHorizontal Scale,0.004,\n"
    "Sample Interval,5e-04,\nRecord Length,60,\nProbe Attenuation,10,10\nVertical Units,V,V\nLabel,,\nTIME,CH1,CH2\n"
    + lines(lambda i: f"{i / RATE - 0.01:.6e},{volts(i)},0.1"),
    options=VOLTS,
    position=None,
)
add(
    "Keysight with units in its second row",
    "x-axis,1,2\nsecond,Newton,Millimeter\n" + lines(lambda i: f"{i / RATE:.6E},{f(i)},{u(i)}"),
    options={"channels": {"force": {"column": "1", "unit": "N"}, "position": {"column": "2", "unit": "mm"}}},
    refused="column",
    remedy={
        "channels": {"force": {"column": "column 2", "unit": "N"}, "position": {"column": "column 3", "unit": "mm"}}
    },
)
add(
    "Yokogawa WE with its own head",
    '"Header Size",12\n"Model Name","DL850E"\n"Comment",""\n"TraceName","Force","Position"\n"BlockSize",60,60\n'
    '"VUnit","N","mm"\n"SampleRate",2000,2000\n"HResolution",5.0e-04,5.0e-04\n"HOffset",0,0\n"HUnit","s","s"\n'
    '"Date","2023/11/02","2023/11/02"\n"Time","10:00:00","10:00:00"\n' + lines(lambda i: f",{f(i)},{u(i)}"),
)
add(
    "time that wraps at 16 bits of ms",
    "t_ms,force_N,position_mm\n" + lines(lambda i: f"{(65530.0 + i / 2) % 65536:.1f},{f(i)},{u(i)}"),
    refused="time|back|clock",
)
add(
    "thousands in times of microseconds",
    "time [µs],force [N],position [mm]\n" + lines(lambda i: f'"{500 * i:,}",{f(i)},{u(i)}'),
    refused="thousands",
)
add(
    "thousands by a point in the times",
    "Zeit [µs];Kraft [N];Weg [mm]\n" + lines(lambda i: f"{500 * i:,}".replace(",", ".") + f";{de(f(i))};{de(u(i))}"),
    encoding="cp1252",
    refused="thousands",
)
add(
    "thin blanks for thousands",
    "time [µs];force [N];position [mm]\n" + lines(lambda i: f"{500 * i:,}".replace(",", "\u202f") + f";{f(i)};{u(i)}"),
    refused="thousands",
)
add(
    "force in mN with thousands",
    "time [s];force [mN];position [mm]\n" + lines(lambda i: f"{t(i)};{FORCE[i] * 1e3:,.0f};{u(i)}"),
    refused="thousands",
)
add(
    "units odd but right",
    "Time (sec.),Load (Newtons),Travel (millimetres)\n" + lines(tfu()),
)
add("units in upper case", "TIME (S),FORCE (N),POSITION (MM)\n" + lines(tfu()))
add("units after a comma", '"Time, s","Force, N","Position, mm"\n' + lines(tfu()))
add("units after a slash", "t/s,F/N,x/mm\n" + lines(tfu()))
add("units after in", "time in s,force in N,position in mm\n" + lines(tfu()))
add("units by a colon", "time:s,force:N,position:mm\n" + lines(tfu()))
add("units in curly brackets", "time {s},force {N},position {mm}\n" + lines(tfu()))
add(
    "displacement in hundredths of a mm",
    "time [s],force [N],position [0.01 mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] * 100:.2f}"),
    refused="unit",
)
add(
    "force in 10 N",
    "time [s],force [daN],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f},{u(i)}"),
)
add(
    "position in um with x10^3",
    "time [s],force [N],position [x10^3 um]\n" + lines(tfu()),
    refused="unit",
)
add(
    "factor in the heading",
    "time [s] x1e-3,force [N],position [mm]\n" + lines(lambda i: f"{t(i, 1e3, 1)},{f(i)},{u(i)}"),
    refused="time|unit",
)
START = datetime(2023, 3, 26, 1, 59, 59, 990000)
add(
    "local stamps over the beginning of summer time",
    "stamp,force [N],position [mm]\n"
    + lines(
        lambda i: (
            (START + timedelta(seconds=i / RATE) + timedelta(hours=1 if i >= 20 else 0)).isoformat(
                timespec="microseconds"
            )
            + f",{f(i)},{u(i)}"
        )
    ),
    refused="hour|summer|time",
)
add(
    "UTC offsets without a colon",
    "stamp,force [N],position [mm]\n" + lines(lambda i: f"2023-11-02T10:00:00.{5 * i:04d}+0100,{f(i)},{u(i)}"),
)
add(
    "stamps of a day of the year",
    "day,time,force [N],position [mm]\n" + lines(lambda i: f"306,10:00:00.{5 * i:04d},{f(i)},{u(i)}"),
)
add(
    "a stamp of s and a column of us",
    "sec,usec,force_N,position_mm\n" + lines(lambda i: f"{1698919200 + i // 2000},{500 * (i % 2000)},{f(i)},{u(i)}"),
)
add(
    "relative s and ms in two columns",
    "s,ms,force_N,position_mm\n" + lines(lambda i: f"{i // 2000},{(i % 2000) / 2:.1f},{f(i)},{u(i)}"),
    refused="time|ms",
)
add(
    "key=value with a time",
    lines(lambda i: f"t={t(i)}s F={f(i)}N x={u(i)}mm"),
    suffix=".log",
)
add(
    "JSON lines with values and units in pairs",
    lines(
        lambda i: json.dumps(
            {
                "time": {"value": i / RATE, "unit": "s"},
                "force": {"value": FORCE[i], "unit": "N"},
                "position": {"value": POSITION[i], "unit": "mm"},
            }
        )
    ),
    suffix=".jsonl",
)
add(
    "JSON lines in ms",
    lines(lambda i: json.dumps({"time_ms": i / 2, "force_N": FORCE[i], "position_um": POSITION[i] * 1e3})),
    suffix=".jsonl",
)
add(
    "zip of a text in UTF-16",
    zipped({"drop.txt": ("time [s]\tforce [N]\tposition [mm]\n" + lines(tfu("\t"))).encode("utf-16")}),
    suffix=".zip",
)
add(
    "zip with the folder of a Mac",
    zipped(
        {
            "drop.csv": ("time [s],force [N],position [mm]\n" + lines(tfu())).encode(),
            "__MACOSX/._drop.csv": b"\0\5\26\7",
        }
    ),
    suffix=".zip",
)
add(
    "xlsx with times in ms and merged titles",
    sheet(
        [
            ["Drop 7", None, None],
            ["time", "force", "position"],
            ["ms", "N", "mm"],
            *[[i / 2, FORCE[i], POSITION[i]] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
)
add(
    "xlsx of texts with decimal commas",
    sheet([["Zeit [s]", "Kraft [N]", "Weg [mm]"], *[[de(t(i)), de(f(i)), de(u(i))] for i in range(N)]]),
    suffix=".xlsx",
)
add(
    "Parquet of float32 in ms",
    parquet({"time_ms": TIME * 1e3, "force_N": FORCE.astype(np.float32), "position_mm": POSITION.astype(np.float32)}),
    suffix=".parquet",
    rtol=1e-6,
)


def packed(path: Path) -> None:
    """As netCDF packs: what is stored times a factor is the quantity."""
    import h5py

    with h5py.File(path, "w") as file:
        for name, values, unit in (("time", TIME, "s"), ("force", FORCE / 2.0, "N"), ("position", POSITION, "mm")):
            file.create_dataset(name, data=values).attrs["units"] = unit
        file["force"].attrs["scale_factor"] = 2.0


add("HDF5 with a scale factor", packed, suffix=".h5")
add(
    "negative numbers in brackets",
    "time [s],force [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)}," + (f"({-POSITION[i]:.4f})" if POSITION[i] < 0 else u(i))),
    refused="is no number",
)
add(
    "minus signs of typesetters",
    "time [s],force [N],position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)}".replace("-", "\u2212")),
)
add(
    "minus at the end",
    "time [s],force [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)}," + (f"{-POSITION[i]:.4f}-" if POSITION[i] < 0 else u(i))),
    refused="is no number",
)
add(
    "overflow marks",
    "time [s],force [N],position [mm]\n"
    + lines(lambda i: f"{t(i)}," + ("OVER" if i in (11, 12) else f(i)) + f",{u(i)}"),
)
add(
    "readings of 9999 where nothing was read",
    "time [s],force [N],position [mm]\n"
    + lines(lambda i: f"{t(i)}," + ("9999.000" if i in (11, 12) else f(i)) + f",{u(i)}"),
)
add(
    "columns swapped in a second header",
    "time [s],force [N],position [mm]\n"
    + lines(tfu(), 30)
    + "time [s],position [mm],force [N]\n"
    + "".join(f"{t(i)},{u(i)},{f(i)}\n" for i in range(30, N)),
    refused="head|column|order",
)
add(
    "unit that changes in a second header",
    "time [s],force [N],position [mm]\n"
    + lines(tfu(), 30)
    + "time [s],force [kN],position [mm]\n"
    + "".join(f"{t(i)},{FORCE[i] / 1e3:.6f},{u(i)}\n" for i in range(30, N)),
    refused="head|unit|table",
)
add(
    "times in a second half that begin anew",
    "time [s],force [N],position [mm]\n"
    + lines(tfu(), 30)
    + "".join(f"{t(i - 30)},{f(i)},{u(i)}\n" for i in range(30, N)),
    refused="time|back|two|twice",
)
add(
    "ASCII of a Nicolet",
    "Title: drop\nSamples: 60\nX: 0.0005 s/sample\nY1: N\nY2: mm\n" + lines(lambda i: f"{f(i)} {u(i)}"),
    refused="column|rate|time|force",
)
for said in (
    "Sampling rate: 4 kHz\nDecimation: 2",
    "Sample rate: 20000 Hz\nDownsampling factor: 10",
    "fs = 4000 Hz\nSample divider: 2",
):
    add(
        f"rate: {said!r}",
        f"{said}\nforce [N],position [mm]\n" + lines(lambda i: f"{f(i)},{u(i)}"),
        refused="read as .* Hz or 2000 Hz",
        remedy={"rate": 2000.0},
    )
add(
    "rate and times beside a decimation",
    "Sampling rate: 4 kHz\nDecimation: 2\ntime [s],force [N],position [mm]\n" + lines(tfu()),
)
add(
    "rate: oversampled",
    "Sample rate: 2000 Hz\nOversampling: 16\nforce [N],position [mm]\n" + lines(lambda i: f"{f(i)},{u(i)}"),
)
add(
    "JSON lines whose objects name their values alike",
    lines(
        lambda i: json.dumps(
            {"time [s]": i / RATE, "force": {"raw": 7, "N": FORCE[i]}, "position": {"raw": 9, "mm": POSITION[i]}}
        )
    ),
    suffix=".jsonl",
    options={"channels": {"force": {"column": "N", "unit": "N"}, "position": {"column": "mm", "unit": "mm"}}},
)
