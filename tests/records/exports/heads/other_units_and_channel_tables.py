"""Files as they turn up in shared folders: units told in a remark, slow clocks, changed gains, factors and signs in a table of channels."""

from __future__ import annotations

import json
from datetime import datetime, timedelta

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.boxes import told
from tests.records.exports.containers import parquet, sheet
from tests.records.exports.heads.factors_levers_and_zeros import FU, HALVED, HEAD, TWICE
from tests.records.exports.programs.workbooks_and_binary_files import mat

OTHER_UNITS_AND_CHANNEL_TABLES = Kind()
add = OTHER_UNITS_AND_CHANNEL_TABLES.add
START = datetime(2024, 5, 12, 14, 22, 11)
SAID = {"remedy": {"channels": {"force": {"column": "force [N]", "scale": "1"}}}}

# Ordinary.
add(
    "a rope tester of a climbing gym",
    "Line Scale 3\nDate: 12.05.2024\nTime: 14:22:11\nMax: 15.7 N\nMode: abs\nUnit: N\nRate: 2000 Hz\n"
    "nr,force [N],position [mm]\n" + lines(lambda i: f"{i},{fu()(i)}"),
)
add(
    "a data logger of soil science",
    '"TOA5","rig","CR1000X","12345","CR1000X.Std.05","CPU:drop.CR1X","4711","fast"\n"TIMESTAMP","RECORD","Force","Travel"\n'
    '"TS","RN","N","mm"\n"","","Smp","Smp"\n'
    + lines(lambda i: f'"{(START + timedelta(milliseconds=5 * i)).isoformat(" ", "milliseconds")}",{i},{fu()(i)}'),
    time=SLOW,
)
add(
    "a PLC trace",
    "Name;Trace1\nSampleTime;0.5 ms\nStart;12.05.2024 14:22:11\nTime [ms];Axis.Force [N];Axis.ActPos [mm]\n"
    + lines(lambda i: f"{t(i, 1e3, 1)};{fu(';')(i)}"),
)
add(
    "sensor sheet in comments",
    "# load cell: Futek LSB200, cap. 100 lb, rated output 2.0 mV/V, calibrated 2023-11-02\n# amplifier: IAA100, span 10 V, gain set by factory\n"
    "# laser: optoNCDT 1420-50, resolution 2 um\n" + HEAD + lines(tfu()),
)
add(
    "a laboratory diary",
    "Drop no. 3 of 5. Rope dried for two days. Height 10 mm above slack.\nTemperature 21 degrees, humidity 40 percent.\n"
    + HEAD
    + lines(tfu()),
)
add(
    "a drop tower",
    "Impactor mass,5.045,kg\nDrop height,0.5,m\nImpact velocity,3.13,m/s\nTup,15.6 kN,s/n 1120\nTime (ms),Load (N),Deflection (mm)\n"
    + lines(lambda i: f"{t(i, 1e3, 3)},{fu()(i)}"),
)
add("force plate", "Plate,1\nSampling frequency,2000,Hz\nTime,Fz,Pz\ns,N,mm\n" + lines(tfu()))
add("time in the middle", "force [N],time [s],position [mm]\n" + lines(lambda i: f"{f(i)},{t(i)},{u(i)}"))
add(
    "a header of a script",
    "# written by daq.py 1.4.2 (python 3.11, numpy 1.26)\n# n=60 fs=2000 Hz channels=2 device=Dev1 ai0:1 range=+-10 V terminal=RSE\n"
    "# units after scaling: N, mm\n" + HEAD + lines(tfu()),
)
add(
    "an oscilloscope in newtons",
    "Source,CH1,CH2\nVertical Units,N,mm\nVertical Scale,5,1\nVertical Position,-2,0.5\nHorizontal Units,s\nSample Interval,5e-4\n"
    "Record Length,60\nTIME [s],CH1 force [N],CH2 position [mm]\n" + lines(tfu()),
)
add(
    "exponents and blanks",
    "     time [s]      force [N]  position [mm]\n"
    + lines(lambda i: f" {TIME[i]: .6E}  {FORCE[i]: .6E}  {POSITION[i]: .6E}"),
)
add("a colon for hours", "Zeit;Kraft [N];Weg [mm]\n" + lines(lambda i: f"14:22:{11 + TIME[i]:07.4f};{fu(';')(i)}"))
add(
    "many other channels",
    "time [s],temp [degC],force [N],supply [V],position [mm],accel [g],humidity [%]\n"
    + lines(lambda i: f"{t(i)},21.5,{f(i)},10.01,{u(i)},{0.01 * i:.2f},40.1"),
)
add(
    "a calculated force beside",
    "time [s],force [N],position [mm],stress [MPa],energy [J]\n"
    + lines(lambda i: f"{tfu()(i)},{FORCE[i] / 7:.4f},{0.001 * i:.4f}"),
)
add(
    "xlsx with a heading far down",
    sheet(
        [
            ["Drop 3"],
            [],
            ["Rope", "PA6"],
            ["Mass", "2.5 kg"],
            [],
            ["t / s", "F / N", "x / mm"],
            *[[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ]
    ),
    suffix=".xlsx",
)
add(
    "HDF5 of a script",
    told(
        {"time": TIME},
        time={"units": "s", "long_name": "time since trigger"},
        force={"long_name": "force in the rope", "sensor": "U9C", "sensitivity_mV_V": 1.0},
        position={"long_name": "position of the mass, positive down"},
        file={
            "created": "2024-05-12T14:22:11",
            "software": "daq 1.4.2",
            "pretrigger_s": 0.1,
            "mass_kg": 2.5,
            "gain_amplifier": 100.0,
        },
    ),
    suffix=".h5",
)
add(
    "MATLAB of a script",
    mat(time_s=TIME, force_N=FORCE, position_mm=POSITION, fs=2000.0, mass_kg=2.5, note="drop 3, new rope", run=3.0),
    suffix=".mat",
)
add(
    "Parquet with nothing but names",
    parquet({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}),
    suffix=".parquet",
)
add(
    "JSON of a web page",
    json.dumps(
        {
            "title": "drop 3",
            "units": {"t": "s", "F": "N", "x": "mm"},
            "t_s": TIME.tolist(),
            "F_N": FORCE.tolist(),
            "x_mm": POSITION.tolist(),
        }
    ),
    suffix=".json",
)
add("Windows line ends and a last empty line", (HEAD + lines(tfu())).replace("\n", "\r\n") + "\r\n")

# Nasty.
add(
    "counts told in a sheet",
    sheet(
        [
            ["t [s]", "F [N]", "x [mm]"],
            *[[float(TIME[i]), float(round(FORCE[i] * 100)), float(POSITION[i])] for i in range(N)],
        ],
        [["Load cell", "1 digit = 0.01 N"]],
    ),
    suffix=".xlsx",
    refused="digit",
    remedy={"channels": {"force": {"column": "F [N]", "scale": "0.01"}}},
    force=np.round(FORCE * 100) / 100,
)
add(
    "a divisor in brackets of a comment",
    "# F (divide by 10 to get N)\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] * 10:.2f},{u(i)}"),
    refused="divide",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "0.1"}}},
)
add(
    "kilopond in a remark",
    "All loads in kp\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] / 9.80665:.6f},{u(i)}"),
    refused="kp",
    rtol=1e-4,
    remedy={"channels": {"force": {"column": "force [N]", "scale": "9.80665"}}},
)
add(
    "inches in a remark",
    "Displacement data are in inches\n" + HEAD + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] / 25.4:.8f}"),
    refused="inches",
    rtol=1e-3,
    remedy={"channels": {"position": {"column": "position [mm]", "scale": "25.4"}}},
)
add(
    "milliseconds in a remark",
    "Time stamps are given in ms\n" + HEAD + lines(lambda i: f"{t(i, 1e3, 1)},{fu()(i)}"),
    refused="ms",
    remedy={"units": {"time": "ms"}},
)
add(
    "a clock that runs fast",
    "Clock correction factor: 0.5\n" + HEAD + lines(lambda i: f"{TIME[i] * 2:.4f},{fu()(i)}"),
    refused="[Cc]lock",
    remedy={"channels": {"time": {"column": "time [s]", "scale": "0.5"}}},
)
add(
    "a film in slow motion",
    "High speed camera, slow motion 10x\n" + HEAD + lines(lambda i: f"{TIME[i] * 10:.4f},{fu()(i)}"),
    refused="10x|slow",
    remedy={"channels": {"time": {"column": "time [s]", "scale": "0.1"}}},
)
add(
    "a peak in another unit",
    f"Peak load: {FORCE.max():.2f} N\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] / 9.80665:.5f},{u(i)}"),
    refused="Peak",
    rtol=1e-3,
    remedy={"channels": {"force": {"column": "force [N]", "scale": "9.80665"}}},
)
add(
    "a lost offset below",
    HEAD + lines(lambda i: f"{t(i)},{FORCE[i] + 1.5:.3f},{u(i)}") + "Offset not subtracted: 1.5 N\n",
    refused="Offset",
    **SAID,
    force=FORCE + 1.5,
)
add(
    "gain changed",
    "Gain switched to 500 for this run, factors are those for 1000\n" + HEAD + HALVED,
    refused="[Gg]ain",
    **TWICE,
)
add(
    "a channel table with factors",
    "Ch;Name;Unit;Factor;Zero\n1;force;N;2.0;0.0\n2;position;mm;1.0;0.0\n\ntime [s];force [N];position [mm]\n"
    + lines(lambda i: f"{t(i)};{FORCE[i] / 2:.4f};{u(i)}"),
    refused="Factor|force;N",
    **TWICE,
)
add(
    "a sign in a channel table",
    "Ch;Name;Unit;Invert\n1;force;N;yes\n2;position;mm;no\n\ntime [s];force [N];position [mm]\n"
    + lines(lambda i: f"{t(i)};{-FORCE[i]:.3f};{u(i)}"),
    refused="Invert|yes",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "-1"}}},
)
add(
    "a resistor in parallel", "Shunt on: readings are 50 % of the true force\n" + HEAD + HALVED, refused="50 %", **TWICE
)
add(
    "two rates in two lines",
    "Acquisition: 8 kHz\nLogged: 2 kHz\n" + FU + lines(fu()),
    refused="kHz",
    remedy={"rate": 2000.0},
)
add(
    "rate of all channels",
    "Throughput: 4000 S/s (2 channels)\n" + FU + lines(fu()),
    refused="rate|S/s",
    remedy={"rate": 2000.0},
)
add(
    "an interval in samples of another clock",
    "Interval: 20 ticks of 25 us\n" + FU + lines(fu()),
    refused="rate|Interval",
    remedy={"rate": 2000.0},
)
add(
    "a force of which part was hung before",
    "Note: reading excludes dead weight of 3 N\n" + HEAD + lines(tfu()),
    refused="dead weight",
    **SAID,
)
add(
    "JSON, calibrated is false",
    json.dumps({"calibrated": False, "t_s": TIME.tolist(), "F_N": (FORCE / 2).tolist(), "x_mm": POSITION.tolist()}),
    suffix=".json",
    refused="calibrated",
    remedy={"channels": {"force": {"column": "F_N", "scale": "2"}}},
)
add(
    "MATLAB, a note on the force",
    mat(time_s=TIME, force_N=FORCE / 2, position_mm=POSITION, note="force has to be multiplied by 2 (wrong gain)"),
    suffix=".mat",
    refused="multiplied",
    remedy={"channels": {"force": {"column": "force_N", "scale": "2"}}},
)
add(
    "HDF5, a sign told",
    told({"time": TIME}, time={"units": "s"}, force={"polarity": "inverted"}),
    suffix=".h5",
    refused="polarity",
    remedy={"channels": {"force": {"column": "force", "scale": "-1 N/N"}}},
    force=-FORCE,
)
