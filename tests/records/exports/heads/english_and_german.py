"""Heads in English and German: rates, sensors and settings that change nothing, and factors, signs, drifts and lags that do."""

from __future__ import annotations

import json

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.boxes import told
from tests.records.exports.containers import parquet, sheet
from tests.records.exports.heads.factors_levers_and_zeros import FU, HALVED, HEAD
from tests.records.exports.programs.channel_blocks import said
from tests.records.exports.programs.workbooks_and_binary_files import mat

ENGLISH_AND_GERMAN = Kind()
add = ENGLISH_AND_GERMAN.add
GERMAN = "Zeit [s];Kraft [N];Weg [mm]\n"

for head in (
    "Abtastrate: 2000 Hz, Anzahl Werte: 60",
    "fs = 2 kHz; anti-aliasing filter 800 Hz; 16 bit",
    "Sampling interval 0.5 ms, pre-trigger 20 samples",
    "Sample rate,2000\nChannel count,2\nScan count,60",
):
    add(f"ordinary, no times: {head.splitlines()[0]}", head + "\n" + FU + lines(fu()))
for head in (
    "Kalibrierung vom 12.03.2024, Kalibrierschein 4711, Rückführung DKD",
    "Aufnehmer: 500 N, Kennwert 2 mV/V, Klasse 0,05",
    "Nullabgleich durchgeführt: ja",
    "Werte bereits skaliert",
    "Bediener: Zehnder; Prüfling: Seil 8 mm, halbstatisch",
):
    add(f"ordinary, German: {head}", head + "\n" + GERMAN + lines(tfu(";", de)))
for head in (
    "Load cell 2 of 2 (lower end)",
    "Drop test, double braid rope, three strands",
    "Mass 2.5 kg, g = 9.81 m/s2",
    "DAQ: NI 9237, half bridge, excitation 5 V, shunt calibration done",
    "Raw data, unfiltered",
    "Files: 1 of 3; next file drop_4.csv",
    "Position zero = taut point; downwards positive",
):
    add(f"ordinary: {head}", head + "\n" + HEAD + lines(tfu()))
add(
    "ordinary: HDF5, a processing history",
    told(
        {"time": TIME},
        time={"units": "s"},
        file={"history": "scaled by daq.py, offset removed, saved 2024-05-12", "n_channels": 2},
    ),
    suffix=".h5",
)
add(
    "ordinary: xlsx, a sheet of results",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]"],
            *[[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ],
        [
            ["Fmax [N]", float(FORCE.max())],
            ["Fmin [N]", float(FORCE.min())],
            ["Stiffness [N/mm]", 12.5],
            ["Energy [J]", 0.8],
        ],
    ),
    suffix=".xlsx",
)
add(
    "ordinary: JSON, a device and its settings",
    json.dumps(
        {
            "device": {"model": "X4", "serial": 1120, "range_N": 500},
            "t_s": TIME.tolist(),
            "F_N": FORCE.tolist(),
            "x_mm": POSITION.tolist(),
        }
    ),
    suffix=".json",
)
add(
    "ordinary: MATLAB, a rig",
    mat(time_s=TIME, force_N=FORCE, position_mm=POSITION, rig={"mass": 2.5, "lift": 0.01, "slope": 90.0}),
    suffix=".mat",
)

for head, number, scale in (
    ("Kraftwerte mit 2 multiplizieren", 0.5, "2"),
    ("Kraft doppelt so groß wie angezeigt", 0.5, "2"),
    ("Umrechnung Kraft: 0,5", 2.0, "0.5"),
    ("Vorzeichen der Kraft vertauscht", -1.0, "-1"),
    ("Kraft in kN", 1e-3, "1000"),
):
    add(
        f"nasty, German: {head}",
        head + "\n" + GERMAN + lines(lambda i, n=number: f"{de(t(i))};{de(f'{FORCE[i] * n:.7f}')};{de(u(i))}"),
        refused="[Kk]raft",
        remedy=said(scale, "Kraft [N]"),
        rtol=1e-4,
    )
for head in (
    "One load cell of a pair, the other one was not connected",
    "Readout unit: 2 N per digit",
    "Load cell gain error: reads 50 % low",
    "Corrected force = 2.00 * force",
    "K = 2.0 (force)",
    "Force transducer loaded through a lever, 100 mm / 200 mm",
):
    add(f"nasty: {head}", head + "\n" + HEAD + HALVED, refused="pair|digit|50 %|force|K|lever", remedy=said("2"))
add(
    "nasty: force drift",
    "Drift of the force zero over the test: 1.2 N, not compensated\n"
    + HEAD
    + lines(lambda i: f"{t(i)},{FORCE[i] + 1.2:.3f},{u(i)}"),
    refused="[Dd]rift",
    remedy=said("1"),
    force=FORCE + 1.2,
)
add(
    "nasty: a rate of blocks",
    "Data rate 500 blocks/s, 4 samples per block\n" + FU + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "nasty: rate and skip",
    "Sampling rate: 6000 Hz\nSkip: 2\n" + FU + lines(fu()),
    refused="Skip|rate",
    remedy={"rate": 2000.0},
)
add(
    "nasty: laser at another angle",
    "Laser at 60 deg to the motion, position not corrected\n"
    + HEAD
    + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] / 2:.5f}"),
    refused="not corrected|60 deg",
    remedy=said("2", "position [mm]", "position"),
    rtol=1e-3,
)
add(
    "nasty: force lags",
    HEAD + lines(tfu()) + "Force lags position by 2.5 ms (filter)\n",
    refused="lags",
    remedy={"channels": {**said("1")["channels"], **said("1", "position [mm]", "position")["channels"]}},
)
add(
    "nasty: HDF5, newtons in tens",
    told({"time": TIME}, time={"units": "s"}, force={"units": "N", "comment": "unit is 10 N"}),
    suffix=".h5",
    refused="10 N",
    remedy=said("10", "force"),
    force=10 * FORCE,
)
add(
    "nasty: Parquet, scaled is false",
    parquet(
        {"time": TIME, "force": FORCE / 2, "position": POSITION},
        {"time": {"unit": "s"}, "force": {"unit": "N", "scaled": "false"}, "position": {"unit": "mm"}},
    ),
    suffix=".parquet",
    refused="scaled",
    remedy=said("2", "force"),
)
add(
    "nasty: xlsx, a legend",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]"],
            *[[float(TIME[i]), float(FORCE[i] / 2), float(POSITION[i])] for i in range(N)],
        ],
        [["Legend"], ["Force", "half of the load, as two cells share it"]],
    ),
    suffix=".xlsx",
    refused="half",
    remedy=said("2", "Force [N]"),
)
add(
    "nasty: JSON, a unit elsewhere",
    json.dumps(
        {"units": {"F_N": "kN"}, "t_s": TIME.tolist(), "F_N": (FORCE / 1e3).tolist(), "x_mm": POSITION.tolist()}
    ),
    suffix=".json",
    refused="kN",
    remedy=said("1000", "F_N"),
    rtol=1e-6,
)
