"""Heads full of words that bear on nothing, and forces of one rope of two, checks with weights, footnotes and remarks in cells."""

from __future__ import annotations

import json

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.boxes import told
from tests.records.exports.containers import parquet, sheet
from tests.records.exports.heads.factors_levers_and_zeros import FU, HALVED, HEAD, TWICE
from tests.records.exports.programs.workbooks_and_binary_files import mat

ROPES_WEIGHTS_AND_FOOTNOTES = Kind()
add = ROPES_WEIGHTS_AND_FOOTNOTES.add
DOUBLE = {"channels": {"force": {"column": "force", "scale": "2 N/N"}}}

# Ordinary.
add(
    "an amplifier of a bridge in German",
    "Messverstärker: MGCplus, Verstärkung 1000, Filter 200 Hz Bessel\nMessbereich: 500 N\n"
    "Zeit [s];Kraft [N];Weg [mm]\n" + lines(tfu(";", de)),
)
add("a charge amplifier", "Kistler 5015A, range 1000 N, sensitivity -4.1 pC/N, low pass 1 kHz\n" + HEAD + lines(tfu()))
add(
    "zeroed by the tester",
    "Balance load: yes\nBalance extension: yes\nLoad cell zeroed at start: yes\n" + HEAD + lines(tfu()),
)
add(
    "LabChart",
    "Interval=\t0.0005 s\nExcelDateTime=\t4.5424598738425926e+004\t5/12/2024 14:22:11\nTimeFormat=\tStartOfBlock\n"
    "ChannelTitle=\tForce\tPosition\nRange=\t500 N\t50 mm\nUnitName=\tN\tmm\nTopValue=\t500\t50\nBottomValue=\t-500\t-50\n"
    + lines(tfu("\t")),
    refused="heading",
    remedy={"columns": ("time [s]", "force [N]", "position [mm]")},
)
add(
    "a mass that was weighed",
    "Mass weighed on a laboratory scale: 2.500 kg\nRope: 9.8 mm, elongation 8 %, 7 falls, impact force 8.5 kN\n"
    + HEAD
    + lines(tfu()),
)
add(
    "compensations are on",
    "Temperature compensation: on\nOffset compensation: on\nAutozero: on\n" + HEAD + lines(tfu()),
)
add(
    "gains of one and offsets of nothing",
    "Channel;Gain;Offset\nforce;1.000;0.000\nposition;1.000;0.000\n\ntime [s];force [N];position [mm]\n"
    + lines(tfu(";")),
)
add("the length told thrice", "dt = 0.5 ms\n60 samples\nDuration: 30 ms\n" + FU + lines(fu()))
add("no averaging", "Sampling 2 kHz, filter off, no averaging\n" + HEAD + lines(tfu()))
add("totals of a file", "Total channels: 2\nTotal rows: 60\nData starts in line 5\n\n" + HEAD + lines(tfu()))
add("a checksum below", HEAD + lines(tfu()) + "END OF DATA\nChecksum: 0x1F3A\n")
add(
    "Spanish",
    "Ensayo n.º 12\nOperador: García\nFecha: 12/05/2024\nCelda de carga: 500 N\nTiempo (s);Fuerza (N);Posición (mm)\n"
    + lines(tfu(";", de)),
)
add(
    "French",
    "Essai 12\nMasse : 2,5 kg\nHauteur de chute : 10 mm\nTemps (s);Force (N);Déplacement (mm)\n" + lines(tfu(";", de)),
)
add(
    "HDF5, a calibration by its date",
    told(
        {"time": TIME},
        time={"units": "s"},
        force={"calibration": "2024-03-01, ZMK 4711", "bandwidth_hz": 500.0, "calibrated": True},
        file={"rate": 2000.0, "rows": 60},
    ),
    suffix=".h5",
)
add(
    "JSON lines, a sensor in each",
    lines(
        lambda i: json.dumps(
            {"t_s": float(TIME[i]), "F_N": float(FORCE[i]), "x_mm": float(POSITION[i]), "sensor": "U9C", "ok": True}
        )
    ),
    suffix=".jsonl",
)
add(
    "xlsx, a protocol of a norm",
    sheet(
        [
            ["Zeit [s]", "Kraft [N]", "Weg [mm]"],
            *[[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ],
        [["Prüfnorm", "EN 892"], ["Fallhöhe", 2.3, "m"], ["Fallmasse", 80, "kg"], ["Seildurchmesser", 9.8, "mm"]],
    ),
    suffix=".xlsx",
)
add(
    "Parquet, whole micrometres",
    parquet(
        {"t": (TIME * 1e6).round().astype(np.int64), "F": FORCE, "x": np.round(POSITION * 1e3)},
        {"t": {"unit": "us"}, "F": {"unit": "N"}, "x": {"unit": "um"}},
    ),
    suffix=".parquet",
    position=np.round(POSITION * 1e3) * 1e-6,
)
add("a scale of a picture", "Plot: x axis 10 ms/div, y axis 5 N/div, zoom 2x\n" + HEAD + lines(tfu()))
add("a controller's gains beside", "Controller: Kp = 2.5, Ki = 0.3, Kd = 0\n" + HEAD + lines(tfu()))
add(
    "remarks in a column",
    "time [s],force [N],position [mm],remark\n" + lines(lambda i: f"{tfu()(i)},{'release' if i == 3 else ''}"),
)
add(
    "zero line found by the tester",
    "Zero determined from first 100 samples and subtracted from force\n" + HEAD + lines(tfu()),
)

# Nasty.
add(
    "tenths in the heading",
    "time [s],force [10^-1 N],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] * 10:.2f},{u(i)}"),
    refused="unit|10",
    remedy={"channels": {"force": {"column": "force [10^-1 N]", "scale": "0.1 N"}}},
)
add(
    "halved in the heading",
    "time [s],force [N/2],position [mm]\n" + HALVED,
    refused="unit|N/2",
    remedy={"channels": {"force": {"column": "force [N/2]", "scale": "2 N"}}},
)
add(
    "one rope of two",
    "Force measured in one of two ropes, total force is the sum\n" + HEAD + HALVED,
    refused="two ropes",
    **TWICE,
)
add("force per rope", "Force per rope (2 ropes)\n" + HEAD + HALVED, refused="per rope", **TWICE)
add(
    "hundredths",
    "Loads are in hundredths of a newton\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] * 100:.1f},{u(i)}"),
    refused="hundredths",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "0.01"}}},
)
add(
    "a check with a weight",
    "Check: weight of 10.00 N indicated as 5.00 N\n" + HEAD + HALVED,
    refused="5.00|indicated",
    **TWICE,
)
add("true and displayed", "true force = 2 x displayed force\n" + HEAD + HALVED, refused="displayed", **TWICE)
add(
    "measured at the end of an arm",
    "Position measured at the end of the arm, 2:1\n" + HEAD + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] * 2:.4f}"),
    refused="2:1",
    remedy={"channels": {"position": {"column": "position [mm]", "scale": "0.5"}}},
)
add(
    "every row is two scans",
    "Scan rate: 4000 Hz\nTwo scans averaged per row\n" + FU + lines(fu()),
    refused="averaged|Two scans",
    remedy={"rate": 2000.0},
)
add(
    "resampled after",
    "fs = 4000 Hz (before resampling by 2)\n" + FU + lines(fu()),
    refused="resampling",
    remedy={"rate": 2000.0},
)
add(
    "tension is negative",
    "Sign convention: tension negative\n" + HEAD + lines(lambda i: f"{t(i)},{-FORCE[i]:.3f},{u(i)}"),
    refused="tension",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "-1"}}},
)
add(
    "a remark beside the first row",
    "time [s],force [N],position [mm],\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] / 2:.4f},{u(i)},{'force x2!' if i == 0 else ''}"),
    refused="x2",
    **TWICE,
)
add(
    "a remark in a row of its column",
    "time [s],force [N],position [mm],note\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] / (2 if i >= 30 else 1):.4f},{u(i)},{'force gain halved' if i == 30 else ''}"),
    refused="halved",
)
add(
    "a star and a footnote",
    "time [s],force* [N],position [mm]\n" + HALVED + "* to be doubled\n",
    refused="doubled|\\*",
    remedy={"channels": {"force": {"column": "column 2", "unit": "N", "scale": "2"}}},
)
add(
    "JSON, a scale in a list of channels",
    json.dumps(
        {
            "channels": [
                {"name": "force", "unit": "N", "scale": 2.0},
                {"name": "position", "unit": "mm", "scale": 1.0},
            ],
            "rows": [
                {"time_s": float(TIME[i]), "force_N": float(FORCE[i] / 2), "position_mm": float(POSITION[i])}
                for i in range(N)
            ],
        }
    ),
    suffix=".json",
    refused="scale|table",
    remedy={"channels": {"force": {"column": "force_N", "scale": "2"}}},
)
add(
    "Parquet, an offset of the file",
    parquet(
        {"time": TIME, "force": FORCE, "position": POSITION},
        {
            "time": {"unit": "s"},
            "force": {"unit": "N", "tare": "3.21 N, not yet taken off"},
            "position": {"unit": "mm"},
        },
    ),
    suffix=".parquet",
    refused="tare",
    remedy={"channels": {"force": {"column": "force", "scale": "1"}}},
)
add(
    "MATLAB, a factor beside the force",
    mat(time_s=TIME, force={"values": FORCE / 2, "unit": "N", "factor": 2.0}, position_mm=POSITION),
    suffix=".mat",
    refused="factor",
    remedy={"channels": {"force": {"column": "force", "scale": "2"}}},
)
add(
    "HDF5, half of the force",
    told({"time": TIME}, time={"units": "s"}, force={"description": "half of the rope force"}),
    suffix=".h5",
    refused="half",
    remedy=DOUBLE,
    force=2 * FORCE,
)
