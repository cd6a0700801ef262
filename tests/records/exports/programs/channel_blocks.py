"""Blocks of channels as programs write them above their columns, plain, and with an offset, a factor or a remark on a channel."""

from __future__ import annotations

import json
from datetime import datetime, timedelta

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.boxes import told
from tests.records.exports.containers import parquet, sheet
from tests.records.exports.heads.factors_levers_and_zeros import FU, HALVED, HEAD

CHANNEL_BLOCKS = Kind()
add = CHANNEL_BLOCKS.add
START = datetime(2024, 5, 12, 14, 22, 11)


def scope(scale: float, offset: float, force: np.ndarray) -> str:
    """Export of a controller's scope, a block of channels above the columns."""
    return (
        "Name\tDrop\nStartTime\t133600000000000000\n\nName\tForce\tPosition\nSampleTime[ms]\t0.5\t0.5\nSymbolBased\tTRUE\tTRUE\n"
        f"Data-Type\tREAL64\tREAL64\nUnit\tN\tmm\nOffset\t{offset:g}\t0\nScaleFactor\t{scale:g}\t1\n\n"
        "Time [ms]\tForce [N]\tPosition [mm]\n" + lines(lambda i: f"{t(i, 1e3, 1)}\t{force[i]:.4f}\t{u(i)}")
    )


def catman(remark: str, force: np.ndarray) -> str:
    """Columns with the settings of each channel above them."""
    return (
        "Time\tKraft\tWeg\nSample rate: 2000 Hz\tSample rate: 2000 Hz\tSample rate: 2000 Hz\n"
        f"Sensor: none\tSensor: U9C\tSensor: WA50\nRemark: \tRemark: {remark}\tRemark: \ns\tN\tmm\n"
        + lines(lambda i: f"{t(i)}\t{force[i]:.4f}\t{u(i)}")
    )


def said(scale: str, column: str = "force [N]", role: str = "force") -> dict:
    return {"channels": {role: {"column": column, "scale": scale}}}


# Ordinary.
add("a controller's scope", scope(1, 0, FORCE), suffix=".txt")
add("catman without remarks", catman("", FORCE), suffix=".txt")
add("catman with a remark", catman("upper end of the rope", FORCE), suffix=".txt")
add(
    "stretcher of tissue",
    "SetName,Cycle,Time_S,Size_mm,Displacement_mm,Force_N\n"
    + lines(lambda i: f"A,1-Stretch,{t(i)},{70 + POSITION[i]:.4f},{u(i)},{f(i)}"),
    refused="position|could",
    remedy={"channels": {"position": "Displacement_mm"}},
)
add(
    "ROS bag",
    "header.stamp,wrench.force.z_N,pose.position.x_mm\n" + lines(lambda i: f"{1715523731 + TIME[i]:.4f},{fu()(i)}"),
    refused="unit",
    remedy={"units": {"time": "s"}},
    atol_time=1e-6,
)
add(
    "InfluxDB",
    "_time,force_N,position_mm\n"
    + lines(lambda i: f"{(START + timedelta(microseconds=500 * i)).isoformat('T', 'microseconds')}Z,{fu()(i)}"),
)
add(
    "a universal tester",
    "Specimen 1\nThickness,3.2,mm\nWidth,10.0,mm\nGauge length,50,mm\nTime,Load,Extension\n(s),(N),(mm)\n"
    + lines(tfu()),
)
add(
    "quoted with a results block",
    '"Results Table 1"\n"Maximum Load (N)","15.73"\n"Modulus (MPa)","2100"\n\n"Time (s)","Load (N)","Extension (mm)"\n'
    + lines(lambda i: f'"{t(i)}","{f(i)}","{u(i)}"'),
)
add(
    "PicoScope",
    "Time,Channel A,Channel B\n(ms),(N),(mm)\n\n" + lines(lambda i: f"{t(i, 1e3, 1)},{fu()(i)}"),
    refused="could|known|Channel",
    remedy={"channels": {"force": "Channel A", "position": "Channel B"}},
)
add(
    "WinDaq",
    "Sample rate,2000,Hz\nChannel,1,2\nAnnotation,Force,Travel\nUnits,N,mm\nRelative Time,Force [N],Travel [mm]\n"
    + lines(tfu()),
)
add(
    "imc",
    "Name;Kraft;Weg\nEinheit;N;mm\nAbtastzeit [s];0,0005;0,0005\nZeit [s];Kraft [N];Weg [mm]\n" + lines(tfu(";", de)),
)
add("a table from an article", "t/ms  F/N  u/mm\n" + lines(lambda i: f"{t(i, 1e3, 1)}  {f(i)}  {u(i)}"))
add("negative numbers with a long dash", HEAD + lines(tfu()).replace("-", "\u2212"))
add(
    "a drop of a climbing laboratory",
    "UIAA 101 drop test\nFall factor: 1.77\nMass: 80 kg\nRope: single, 9.8 mm\n" + HEAD + lines(tfu()),
)
add(
    "a battery and a logger",
    "Battery: 3.7 V, 85 %\nMemory: 12 % used\nLogger gain setting: auto\n" + HEAD + lines(tfu()),
)
add(
    "geometry of the rig",
    "Pulley diameter: 50 mm\nArm length: 250 mm\nRope length: 2.5 m\nOffset of the laser from the axis: see drawing\n"
    + HEAD
    + lines(tfu()),
)
add(
    "xlsx with units in cells of their own",
    sheet(
        [
            ["Time", "Force", "Position"],
            ["s", "N", "mm"],
            *[[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
)
add(
    "HDF5 with a mean and a peak told",
    told({"time": TIME}, time={"units": "s"}, force={"mean": float(FORCE.mean()), "max": float(FORCE.max()), "n": 60}),
    suffix=".h5",
)
add(
    "JSON with a version and a count",
    json.dumps({"version": "2.1", "count": 60, "t_s": TIME.tolist(), "F_N": FORCE.tolist(), "x_mm": POSITION.tolist()}),
    suffix=".json",
)
add(
    "Parquet with the firmware",
    parquet(
        {"time": TIME, "force": FORCE, "position": POSITION},
        {
            "time": {"unit": "s", "source": "RTC"},
            "force": {"unit": "N", "firmware": "1.4", "channel": "2"},
            "position": {"unit": "mm"},
        },
    ),
    suffix=".parquet",
)

# Nasty.
add(
    "a scope whose factor is to be applied",
    scope(2, 0, FORCE / 2),
    suffix=".txt",
    refused="Scale",
    remedy=said("2", "Force [N]"),
)
add(
    "a scope with an offset",
    scope(1, 1.5, FORCE - 1.5),
    suffix=".txt",
    refused="Offset",
    remedy=said("1", "Force [N]"),
    force=FORCE - 1.5,
)
add(
    "catman, a remark with a factor",
    catman("x 2 (two legs)", FORCE / 2),
    suffix=".txt",
    refused="x 2|two",
    remedy=said("2", "Kraft"),
)
add(
    "catman, a remark with a sign",
    catman("inverted", -FORCE),
    suffix=".txt",
    refused="inverted",
    remedy=said("-1", "Kraft"),
)
add("a pulley block", "Load cell behind a 2:1 pulley block\n" + HEAD + HALVED, refused="2:1", remedy=said("2"))
add(
    "an amplifier that was set wrongly",
    "Amplifier was set to 50 % of calibration, multiply force accordingly\n" + HEAD + HALVED,
    refused="50 %|multiply",
    remedy=said("2"),
)
add(
    "a divider in the head",
    "Signal divider 1:2 in front of channel force\n" + HEAD + HALVED,
    refused="1:2",
    remedy=said("2"),
)
add(
    "newtons by another gravity",
    "Force [N] computed with g = 4.903\n" + HEAD + HALVED,
    refused="4.903",
    remedy=said("2"),
    rtol=1e-3,
)
add(
    "a tare in the footer",
    HEAD + lines(lambda i: f"{t(i)},{FORCE[i] - 2:.3f},{u(i)}") + "\nTara;2,0;N\n",
    refused="Tara",
    remedy=said("1"),
    force=FORCE - 2,
)
add(
    "a film and its frames",
    "frame rate 8000 fps, played at 2000 fps\n" + FU + lines(fu()),
    refused="fps|rate",
    remedy={"rate": 2000.0},
)
add(
    "a rate by its divider",
    "Base clock 8000 Hz, divider 4\n" + FU + lines(fu()),
    refused="rate|divider|clock",
    remedy={"rate": 2000.0},
)
add(
    "a burst of rows",
    "fs=8000 Hz\nOnly one of four samples is kept\n" + FU + lines(fu()),
    refused="four|one of",
    remedy={"rate": 2000.0},
)
add(
    "times of another channel",
    "time [s],force [N],position [mm]\n" + lines(tfu()) + "# position is 3 samples behind force\n",
    refused="behind",
    remedy=said("1", "position [mm]", "position"),
)
add(
    "mm told as inches in the units row",
    "Time [s],Force [N],Position [mm]\ns,N,in\n" + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] / 25.4:.8f}"),
    refused="unit",
    remedy={"units": {"position": "inch"}},
    rtol=1e-3,
)
add(
    "thousands in a column's remark",
    "time [s],force [N],position [mm],unit of force\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 1e3:.7f},{u(i)},kN"),
    refused="kN|unit",
    remedy={"units": {"force": "kN"}},
    rtol=1e-4,
)
add(
    "a column of a sign",
    "time [s],force [N],position [mm],sign\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)},-1"),
    refused="sign",
    remedy={"channels": {**said("-1")["channels"], **said("1", "position [mm]", "position")["channels"]}},
    force=-FORCE,
)
add(
    "a column of zeros to take off",
    "time [s],force [N],position [mm],force zero [N]\n" + lines(lambda i: f"{t(i)},{FORCE[i] + 1.5:.3f},{u(i)},1.5"),
    refused="zero|could",
    remedy=said("1"),
    force=FORCE + 1.5,
)
add(
    "HDF5, sampled by two",
    told({}, file={"sampling_rate_hz": 4000.0, "decimation": 2}),
    suffix=".h5",
    refused="rate|decimation",
    remedy={"rate": 2000.0},
)
add(
    "Parquet, a note of the file's owner",
    parquet(
        {"time": TIME, "force": FORCE / 2, "position": POSITION},
        {
            "time": {"unit": "s"},
            "force": {"unit": "N", "note": "only one of two load cells"},
            "position": {"unit": "mm"},
        },
    ),
    suffix=".parquet",
    refused="two",
    remedy=said("2", "force"),
)
add(
    "xlsx, a cell beside the heading",
    sheet(
        [
            ["t [s]", "F [N]", "x [mm]", "F must be doubled!"],
            *[[float(TIME[i]), float(FORCE[i] / 2), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
    refused="doubled",
    remedy=said("2", "F [N]"),
)
