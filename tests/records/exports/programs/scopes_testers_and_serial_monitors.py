"""Further programs of laboratories, written from the descriptions of their formats."""

from __future__ import annotations

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, Kind, N, de, f, lines, t, tfu, u

SCOPES_TESTERS_AND_SERIAL_MONITORS = Kind()
add = SCOPES_TESTERS_AND_SERIAL_MONITORS.add
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


QUANTITIES_BESIDE_FORCE = Kind()
add = QUANTITIES_BESIDE_FORCE.add
"""A fifth set, written after the reader was mended for the fourth."""

add(
    "Yokogawa, blocks with a group number",
    '"Model","DL850"\n"BlockNumber",1\n"TraceName","Force","Pos"\n"VUnit","N","mm"\n"HResolution",5.0E-04\n"HUnit","s"\n\n'
    + lines(lambda i: f",{f(i)},{u(i)}"),
    options={"channels": {"force": "Force", "position": "Pos"}},
)
add(
    "Keysight, one channel with its unit in the title",
    "Time (s),Force (N) on CH1\n" + lines(lambda i: f"{t(i)},{f(i)}"),
    position=None,
)
add(
    "Rohde, step and start above",
    '"XStart:-0.01:s"\n"XStop:0.02:s"\n"Resolution:0.0005:s"\n"Record length:60"\nForce [N];Pos [mm]\n'
    + lines(lambda i: f"{f(i)};{u(i)}"),
    refused="rate|Resolution",
    remedy={"rate": RATE},
)
add(
    "HBM, calibrations above the columns",
    "Channel;Kraft;Weg\nSensor;U9C 200N;WA 20\nNennwert;200 N;20 mm\nKennwert;1,02 mV/V;80 mV/V\nMessrate;2000 Hz;2000 Hz\nEinheit;N;mm\n"
    + lines(lambda i: de(f";{f(i)};{u(i)}")),
    refused="rate|heading|unit|Kennwert",
    remedy={"rate": RATE},
)
add(
    "machine data with a cycle column",
    "Cycle,Time (s),Load (N),Position (mm)\n" + lines(lambda i: f"{i // 20 + 1},{t(i)},{f(i)},{u(i)}"),
)
add(
    "machine data with a segment word",
    "Segment;Time;Load;Stroke\n;s;N;mm\n" + lines(lambda i: f"{'ramp' if i < 30 else 'hold'};{t(i)};{f(i)};{u(i)}"),
)
add(
    "strain beside extension",
    "Time (s),Force (N),Extension (mm),Strain (%)\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i)},{POSITION[i] / 5:.5f}"),
)
add(
    "stress beside force",
    "Time (s),Force (N),Stress (MPa),Extension (mm)\n" + lines(lambda i: f"{t(i)},{f(i)},{FORCE[i] / 12:.5f},{u(i)}"),
)
add(
    "maximum and minimum beside the force",
    "Time (s),Force (N),Max force (N),Position (mm)\n"
    + lines(lambda i: f"{t(i)},{f(i)},{FORCE[: i + 1].max():.3f},{u(i)}"),
    refused="could each",
    remedy={"channels": {"force": "Force (N)"}},
)
add(
    "a nominal and a measured time",
    "Nominal time [s],Time [s],Force [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{t(i)},{f(i)},{u(i)}"),
)
add(
    "analogue inputs with scaled names",
    "Timestamp (s);AI0 - Force (N);AI1 - Displacement (mm);AI2 - Supply (V)\n"
    + lines(lambda i: f"{t(i)};{f(i)};{u(i)};5.001"),
)
add(
    "DIO word and counter",
    "time [s],force [N],position [mm],DIO,frame\n" + lines(lambda i: f"{tfu()(i)},{i % 16:04b},{i}"),
)
add(
    "accelerations of three axes",
    "t [s],ax [m/s2],ay [m/s2],az [m/s2],F [N],x [mm]\n" + lines(lambda i: f"{t(i)},0.1,-0.2,9.81,{f(i)},{u(i)}"),
)
add(
    "force and its rate",
    "t [s],F [N],dF/dt [N/s],x [mm],dx/dt [mm/s]\n" + lines(lambda i: f"{t(i)},{f(i)},12.0,{u(i)},0.5"),
)
add(
    "millivolts and newtons",
    "t [s];U [mV];F [N];s [mm]\n" + de(lines(lambda i: f"{t(i)};{FORCE[i] * 10:.2f};{f(i)};{u(i)}")),
)
add(
    "Excel, Swiss",
    "Zeit [s];Kraft [mN];Weg [mm]\n" + lines(lambda i: f"{t(i)};{FORCE[i] * 1e3:,.1f};{u(i)}".replace(",", "\u2019")),
    refused="thousands",
)
add(
    "Excel, French",
    "Temps (s);Force (N);Position (mm)\n" + de(lines(lambda i: f"{t(i)};{f(i)};{u(i)}")),
    encoding="cp1252",
)
add(
    "Excel, Japanese with full-width units", "時間（ｓ）,荷重（Ｎ）,変位（ｍｍ）\n" + lines(tfu()), encoding="shift_jis"
)
add(
    "Excel, dates of the day before the month",
    "Datum/Zeit;Kraft [N];Weg [mm]\n"
    + lines(lambda i: f"13.11.2023 10:00:{de(f'{i / RATE:07.4f}')};{de(f(i))};{de(u(i))}"),
)
add(
    "missing words of a German logger",
    "t [s];F [N];s [mm]\n" + de(lines(lambda i: f"{t(i)};{'ungültig' if i in (7, 8) else f(i)};{u(i)}")),
)
add(
    "missing words of a PLC",
    "t [s];F [N];s [mm]\n" + lines(lambda i: f"{t(i)};{'BAD' if i in (7, 8) else f(i)};{u(i)}"),
)
add("quality beside each value", "t [s];F [N];F_Q;s [mm];s_Q\n" + lines(lambda i: f"{t(i)};{f(i)};192;{u(i)};192"))
add("a valid flag that is off", "t [s],F [N],valid,x [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},1,{u(i)}"))
add(
    "stamps with a zone in the heading",
    "Time (UTC+1),Force [N],Position [mm]\n" + lines(lambda i: f"2023-11-02 10:00:{i / RATE:07.4f},{f(i)},{u(i)}"),
)
add(
    "elapsed time with days",
    "Elapsed,Force [N],Position [mm]\n" + lines(lambda i: f"0 days 00:00:{i / RATE:09.6f},{f(i)},{u(i)}"),
    refused="time|rate|number",
)
add(
    "times in hours",
    "Time [h],Force [N],Position [mm]\n" + lines(lambda i: f"{i / RATE / 3600:.12f},{f(i)},{u(i)}"),
    atol_time=1e-7,
)
add(
    "times with a comma of thousands in ms",
    "Time [ms];Force [N];Position [mm]\n" + lines(lambda i: f"{1000 + i / 2:,.1f};{f(i)};{u(i)}"),
    refused="thousands",
)
add(
    "rate in a table of settings",
    "Setting,Value,Unit\nSample rate,2,kHz\nRange,200,N\nFilter,Bessel,\n\nforce [N],position [mm],temp [C]\n"
    + lines(lambda i: f"{f(i)},{u(i)},21.5"),
    refused="rate",
    remedy={"rate": RATE},
)
add(
    "rate and filter in one line",
    "fs=2000Hz fc=500Hz order=4\nforce [N],position [mm]\n" + lines(lambda i: f"{f(i)},{u(i)}"),
    refused="rate",
    remedy={"rate": RATE},
)
add(
    "two rates for two devices",
    "DAQ rate: 2000 Hz\nCamera rate: 100 Hz\nforce [N],position [mm]\n" + lines(lambda i: f"{f(i)},{u(i)}"),
    refused="rate",
    remedy={"rate": RATE},
)
add(
    "comment with a rate of the drive",
    "# motor at 50 Hz, sampled at 2 kHz\nforce [N],position [mm]\n" + lines(lambda i: f"{f(i)},{u(i)}"),
    refused="rate",
    remedy={"rate": RATE},
)
add("header between two rules", "-------------\ntime [s],force [N],position [mm]\n-------------\n" + lines(tfu()))
add(
    "headings with footnotes",
    "time [s]*,force [N]**,position [mm]***\n" + lines(tfu()) + "* since trigger\n** tared\n*** laser\n",
)
add(
    "notes to the right of the table",
    "time [s],force [N],position [mm],,operator\n" + lines(lambda i: tfu()(i) + (",,N. Novak" if i == 0 else ",,")),
)
add(
    "setup to the right of the table",
    "time [s],force [N],position [mm],,mass [kg]\n" + lines(lambda i: tfu()(i) + (",,3.096" if i == 0 else ",,")),
)
add(
    "results to the right of the table",
    "time [s],force [N],position [mm],,Fmax [N],xmax [mm]\n"
    + lines(lambda i: tfu()(i) + (",,15.7,1.25" if i == 0 else ",,,")),
    refused="could each|empty",
    remedy={"channels": {"force": "force [N]", "position": "position [mm]"}},
)
add(
    "an average row after each ten",
    "time [s],force [N],position [mm]\n"
    + "".join(
        tfu()(i)
        + "\n"
        + (f"avg,{FORCE[i - 9 : i + 1].mean():.3f},{POSITION[i - 9 : i + 1].mean():.4f}\n" if i % 10 == 9 else "")
        for i in range(N)
    ),
)
add(
    "a header of another run in the middle",
    "Run 1\ntime [s],force [N],position [mm]\n"
    + lines(tfu(), 30)
    + "Run 2\ntime [s],force [N],position [mm]\n"
    + "".join(f"{t(i - 30)},{f(i)},{u(i)}\n" for i in range(30, N)),
    refused="again|table|head|run",
)
add(
    "units beside names in a second table",
    "Name,Unit,Column\nTime,s,1\nForce,N,2\nPosition,mm,3\n\nTime,Force,Position\n" + lines(tfu()),
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add("a legend of columns", "# col1: time/s\n# col2: force/N\n# col3: position/mm\n" + lines(tfu(" ")), suffix=".dat")
add("gnuplot, a key behind a sign", "#t F x\n#[s] [N] [mm]\n" + lines(tfu(" ")), suffix=".dat")
add(
    "a force logger of a rope",
    "AA:10:02\n03.11.23\n10:00:00\nLogNo=007\nUnit=N\nMode=ABS\nRelZero=0.00\nSpeed=2000\nTrig=0.50\nPre=1\nTotal=11\n"
    + lines(lambda i: f"{FORCE[i]:.3f}"),
    position=None,
    refused="heading|columns",
    remedy={"columns": ("force [N]",), "rate": RATE},
)
