"""Further programs of laboratories, written from the descriptions of their formats."""

from __future__ import annotations

from tests.records.exports.base import FORCE, POSITION, Kind, N, de, f, lines, t, u

FURTHER = Kind()
add = FURTHER.add

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
