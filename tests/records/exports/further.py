"""Further programs of laboratories, written from the descriptions of their formats."""

from __future__ import annotations

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, Kind, N, de, f, lines, t, tfu, u

FURTHER = Kind()
add = FURTHER.add
SLOW = np.arange(N) * 0.005
"""Times of a logger at 200 Hz, whose stamps need three decimals only."""

add(
    "Campbell TOA5",
    '"TOA5","CR6","CR6","1234","CR6.Std.10","CPU:drop.CR6","5234","Drop"\n'
    '"TIMESTAMP","RECORD","Force","Position"\n"TS","RN","N","mm"\n"","","Smp","Smp"\n'
    + lines(lambda i: f'"2023-11-02 10:00:00.{5 * i:04d}",{i},{f(i)},{u(i)}'),
    suffix=".dat",
)
SIDE = ("Record Length,6.0e+01", "Sample Interval,5.0e-04", "Trigger Point,0", "Source,CH1", "Vertical Units,V")
add(
    "Tektronix TDS, its header beside the first rows",
    lines(lambda i: f"{SIDE[i] if i < len(SIDE) else ','},,{i / 2000 - 0.01:.6f},{FORCE[i] / 100:.5f},"),
    options={"channels": {"force": {"column": "column 5", "unit": "V", "scale": "100 N/V"}}},
    position=None,
)
QUOTED = ('"Record Length",60,"Points"', '"Sample Interval",0.0005,s')
add(
    "Tektronix TDS 3000, in quotes",
    lines(lambda i: f"{QUOTED[i] if i < len(QUOTED) else ',,'},{i / 2000:.4f},{FORCE[i] / 100:.5f}"),
    options={"channels": {"force": {"column": "column 5", "unit": "V", "scale": "100 N/V"}}},
    position=None,
)
add(
    "Instron Bluehill",
    '"Specimen label","A1"\n"Rate 1","50.0","mm/min"\n\n"Time","Extension","Load"\n"(s)","(mm)","(N)"\n'
    + lines(lambda i: f'"{t(i)}","{u(i)}","{f(i)}"'),
)
add(
    "MTS TestSuite",
    "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nData Acquisition: Timed\nStation Name: rig.cfg\n\n"
    "Time\tAxial Displacement\tAxial Force\nSec\tmm\tN\n" + lines(lambda i: f"{t(i)}\t{u(i)}\t{f(i)}"),
    suffix=".dat",
)
add(
    "Zwick testXpert",
    '"Prüfdatum";"02.11.2023"\n"Prüfzeit";"Standardweg";"Standardkraft"\n"s";"mm";"N"\n'
    + de(lines(lambda i: f"{t(i)};{u(i)};{f(i)}")),
    encoding="cp1252",
    suffix=".txt",
)
add(
    "Vernier Logger Pro",
    "Latest: Time (s),Latest: Force (N),Latest: Position (mm)\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)}"),
)
add("PASCO", "Time (s) Run #1,Force (N) Run #1,Position (mm) Run #1\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)}"))
add(
    "HBM catman, ASCII",
    "HBM_CATMANFILE_5.0\tdrop.BIN\nT0 = 02.11.2023 10:00:00\nNUMBER OF CHANNELS: 3\n\n"
    "Time  1 - default sample rate\tMX840 CH1 Force\tMX840 CH2 Position\n[s]\t[N]\t[mm]\n"
    + lines(lambda i: f"{t(i)}\t{f(i)}\t{u(i)}"),
    suffix=".asc",
)
add(
    "dSPACE, traces by name",
    "type,sampled\nraster,HostService\nsampletime,0.0005\nunit,s,N,mm\ntrace,XAxis,Force,Position\n"
    + lines(lambda i: f"trace_values,{t(i)},{f(i)},{u(i)}"),
)
add(
    "Mitsubishi servo amplifier",
    f"Axis1\nNumber of sampling data,{N}\nSampling time interval(ms),0.5\nTime,Analog 1,Analog 2\nms,Force [N],Position [mm]\n"
    + lines(lambda i: f"{i / 2:.6f},{f(i)},{u(i)}"),
)
add(
    "a summary above the data",
    "Summary\nname,value,unit\nmass,3.096,kg\nlength,599,mm\n\nData\ntime [s],force [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)},{u(i)}"),
)
add(
    "a table in Markdown",
    "| time [s] | force [N] | position [mm] |\n|---|---|---|\n" + lines(lambda i: f"| {t(i)} | {f(i)} | {u(i)} |"),
    suffix=".md",
)
add(
    "exponents of Fortran",
    " TIME(S)      FORCE(N)      DISP(MM)\n"
    + lines(lambda i: f"{i / 2000:.6E}  {FORCE[i]:.6E}  {POSITION[i]:.6E}".replace("E", "D")),
    suffix=".out",
)
add(
    "MATLAB timetable, a unit in each cell",
    "Time,force_N,position_mm\n" + lines(lambda i: f"{t(i)} sec,{f(i)},{u(i)}"),
    refused="0.0000 sec.*rate",
    remedy={"rate": 2000.0},
)
add(
    "means below the data",
    "time [s],force [N],position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)}") + "\nMean,10.0,-9.5\nStd,3.5,0.2\n",
)
add(
    "minutes, pounds and inches",
    "Elapsed Time (min),Load (lbf),Crosshead (in)\n"
    + lines(lambda i: f"{i / 120000:.12f},{FORCE[i] / 4.4482216152605:.9f},{POSITION[i] / 25.4:.11f}"),
    rtol=1e-7,
    atol_time=1e-7,
)
add(
    "milliseconds of a clock that counts no halves",
    "millis,force_N,position_mm\n" + lines(lambda i: f"{i // 2},{f(i)},{u(i)}"),
    refused="printed to 1 ms only",
)
add(
    "grams for a force", "time [s],force [g],position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)}"), refused="unit"
)
add(
    "serial plotter, no times",
    lines(lambda i: f"Force:{f(i)},Position:{u(i)}"),
    suffix=".txt",
    options={"units": {"force": "N", "position": "mm"}},
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "serial monitor with arrows",
    lines(lambda i: f"10:00:00.{5 * i:03d} -> {f(i)},{u(i)}"),
    suffix=".log",
    time=SLOW,
    refused="columns|heading|table",
)
add(
    "terminal log",
    "=~=~=~=~=~=~= PuTTY log 2023.11.02 10:00:00 =~=~=~=~=~=~=\n.4980,-0.2500\nt_ms,F_N,x_mm\n"
    + lines(lambda i: f"{t(i, 1e3, 1)},{f(i)},{u(i)}"),
    suffix=".log",
)
add(
    "chatter of a board before its table",
    "rst:0x1 (POWERON_RESET),boot:0x13\nconfigsip: 0, SPIWP:0xee\nload:0x3fff0030,len:1344\nHX711 ready, gain 128\n"
    "t_ms,F_N,x_mm\n" + lines(lambda i: f"{t(i, 1e3, 1)},{f(i)},{u(i)}"),
    suffix=".log",
)
add(
    "terminal stamps in brackets",
    "[2023-11-02 09:59:59.995] force_N, position_mm\n"
    + lines(lambda i: f"[2023-11-02 10:00:00.{5 * i:03d}] {f(i)}, {u(i)}"),
    suffix=".log",
    time=SLOW,
    refused="time|table|heading|columns",
)
add(
    "catman, two groups of rates",
    "Time 1 - fast [s]\tForce [N]\tPosition [mm]\tTime 2 - slow [s]\tTemp [degC]\n"
    + lines(lambda i: f"{tfu(chr(9))(i)}\t" + (f"{i * 0.005:.3f}\t21.5" if i < 6 else "\t")),
    suffix=".asc",
)
add(
    "sections of titles, units and types",
    "#HEADER\n#TITLES\nTime,Force,Pos\n#UNITS\ns,N,mm\n#DATATYPES\nDouble,Double,Double\n#DATA\n" + lines(tfu()),
    suffix=".asc",
)
add(
    "clock as one number",
    "[header]\ntime\nforce\nposition\n\n[column names]\ntime force_N position_mm\n\n[data]\n"
    + lines(lambda i: f"{100059.99 + i / RATE + (40.0 if i >= 20 else 0.0):.4f} {FORCE[i]:+.3f} {POSITION[i]:+.4f}"),
    suffix=".vbo",
    refused="unit|time|clock",
)
