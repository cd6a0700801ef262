"""Files of recorders, simulations, scopes and classroom software, missing readings in each one's words, rates that are not of the samples."""

from __future__ import annotations

from datetime import datetime, timedelta

from tests.records.exports.base import FORCE, POSITION, RATE, Kind, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW

LABORATORIES_AND_CLASSROOMS = Kind()
add = LABORATORIES_AND_CLASSROOMS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
START = datetime(2023, 11, 2, 10)
CH = {"channels": {"force": "CH1", "position": "CH2"}}
VOLTS = {
    "channels": {
        "force": {"column": "CH1", "unit": "V", "scale": "100 N/V"},
        "position": {"column": "CH2", "unit": "V", "scale": "10 mm/V"},
    }
}


def volts(i: int) -> str:
    return f"{FORCE[i] / 100:.5f},{POSITION[i] / 10:.5f}"


add(
    "recorder with its header in quoted words",
    '"COMMENT",\n"DROP"\n"DATE",\n"11-02-2023"\n"TIME",\n"10:00:00"\n"NUM_SIGS",\n3\n"INTERVAL",\n5.000E-04\n"HORZ_UNITS",\n"S"\n'
    '"VERT_UNITS",\n"S","N","mm"\n"SIGNAL",\n"TIME","CH1","CH2"\n"DATA"\n'
    + lines(lambda i: f"{i / RATE:+.4E},{FORCE[i]:+.4E},{POSITION[i]:+.4E}"),
    options=CH,
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add(
    "logger of a weather station at 200 Hz",
    '"TOA5","Rig","CR6","4120","CR6.Std.12","CPU:drop.CR6","4062","Fast"\n"TIMESTAMP","RECORD","Force_N","Pos"\n'
    '"TS","RN","Newtons","mm"\n"","","Smp","Smp"\n'
    + lines(
        lambda i: f'"{(START + timedelta(milliseconds=5 * i)).isoformat(" ", "milliseconds")}",{i + 8120},{fu()(i)}'
    ),
    time=SLOW,
)
add(
    "two runs of a classroom logger beside each other",
    "Run 1: Time (s),Run 1: Force (N),Run 1: Position (mm),Run 2: Time (s),Run 2: Force (N),Run 2: Position (mm)\n"
    + lines(lambda i: f"{tfu()(i)},{t(i)},{FORCE[i] * 0.8:.4f},{POSITION[i] * 1.2:.5f}"),
    refused="could each|which|two|twice",
    remedy={"channels": {"time": "Run 1: Time (s)", "force": "Run 1: Force (N)", "position": "Run 1: Position (mm)"}},
)
add(
    "classroom software with definitions",
    "MIN=0\nMAX=1\nSCALE=0\nDEC=0\nDEF=Zeit t s\nDEF=Kraft F N\nDEF=Weg s mm\n" + lines(tfu("\t", de)),
    suffix=".txt",
    refused="heading|columns",
    remedy={"columns": ("t [s]", "F [N]", "s [mm]")},
)
add(
    "signals of a simulation with units in a row of words",
    "time,Force,Position\n,Unit: N,Unit: mm\n,Interp: linear,Interp: linear\n" + lines(tfu()),
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add(
    "text view of a binary group, names behind their words",
    "# group-id:                usi4863\n# name:                    drop\n# channels:                usi1 usi2 usi3\n#\n"
    "# channel-id:  usi1        channel-id:  usi2        channel-id:  usi3\n"
    "# name:        Time        name:        Force       name:        Position\n"
    "# unit:        s           unit:        N           unit:        mm\n"
    + lines(lambda i: f"{t(i):>27}{f(i):>25}{u(i):>25}"),
    refused="heading|columns|name",
    remedy={"columns": ("time [s]", "force [N]", "position [mm]")},
)
add(
    "logger with a code of time and local time beside",
    "Seq;TimeCode;Local Date;Local Time;Milliseconds;Data quality;F;x\n;Time since 1970;date;time;ms;not used;load cell;laser\n"
    ";ms;;;ms;;N;mm\n" + lines(lambda i: f"{i};{1698919200000 + 5 * i};02.11.2023;10:00:00;{5 * i};0;{f(i)};{u(i)}"),
    time=SLOW,
    refused="time|could each|Milliseconds",
    remedy={"channels": {"time": "TimeCode"}},
)
add(
    "recorder of a controller, an interval in a column",
    "Drop\nDate,Time,Interval[ms],1,2\n-,-,-,Load,Path\n-,-,-,N,mm\n"
    + lines(lambda i: f"2023-11-02,10:00:00,{5 if i else 0},{fu()(i)}"),
    time=SLOW,
    options={"channels": {"force": "Load", "position": "Path"}},
    refused="time|rate|same|increase|heading|Load",
)
add(
    "scope of a controller with stamps of a file system",
    "Name,Axis 1\nFile,drop.tcscopex\n,\nStart,133433712000000000\nTime,F,x\nFiletime,N,mm\n"
    + lines(lambda i: f"{133433712000000000 + 5000 * i},{fu()(i)}")
    + "EOF\n",
    refused="unit|time|Filetime|heading",
)
add(
    "acoustics program, units behind the names",
    "Number of channels: 2\nTime    s\tForce    N\tDisplacement    mm\n" + lines(tfu("\t")),
    suffix=".txt",
)
add(
    "vibration program, a number for each row",
    "X-Axis size:\t60\nX-Axis type:\tdouble\nX-Axis delta:\t5.0E-04\nX-Axis unit:\ts\nY-Axis unit:\tN\nHeader Size:\t6\n"
    + lines(lambda i: f"{i + 1}\t{i / RATE:.6E}\t{f(i)}"),
    suffix=".txt",
    position=None,
    refused="heading|columns",
    remedy={"columns": ("No", "time [s]", "force [N]")},
)
add(
    "multibody program, letters for columns",
    "Drop 7\nA. Time (sec)\nB. Force (newton)\nC. Displacement (mm)\n\n"
    "         A.             B.             C.\n"
    + lines(lambda i: f"{i / RATE:15.6E}{FORCE[i]:15.6E}{POSITION[i]:15.6E}"),
    suffix=".tab",
    refused="unit|column|time",
    remedy={
        "channels": {"time": "column 1", "force": "column 2", "position": "column 3"},
        "units": {"time": "s", "force": "N", "position": "mm"},
    },
)
add(
    "finite elements, a report with NoValue",
    "\n           X            force_N       disp_mm\n\n"
    + lines(lambda i: f"{i / RATE:>15.4f}{'NoValue' if i in (20, 21) else f(i):>14}{u(i):>14}"),
    suffix=".rpt",
    refused="time|unit",
    remedy={"channels": {"time": "X"}, "units": {"time": "s"}},
)
add(
    "robot bag as a table",
    "header.stamp.sec,header.stamp.nanosec,header.frame_id,wrench.force.z,pose.z\n"
    + lines(lambda i: f"1698919200,{500000 * i},ft,{fu()(i)}"),
    options={
        "channels": {"force": {"column": "wrench.force.z", "unit": "N"}, "position": {"column": "pose.z", "unit": "mm"}}
    },
    refused="time|nanosec",
)
add(
    "sentences of a serial sensor",
    lines(lambda i: f"$FRC,{5 * i:06d},{fu()(i)},N,mm*{i % 16:02X}"),
    suffix=".nmea",
    time=SLOW,
    refused="heading|columns|words",
)
add(
    "lines of a program's log with commas in the stamps",
    "time," + FU + lines(lambda i: f"2023-11-02 10:00:00,{5 * i:03d},{fu()(i)}"),
    time=SLOW,
    refused="heading|cells|columns|decimal",
)
add(
    "sentences of a program's log",
    lines(lambda i: f"2023-11-02 10:00:00,{5 * i:03d} - daq - INFO - F={f(i)} N, x={u(i)} mm"),
    suffix=".log",
    time=SLOW,
    refused="table|key|cells|heading",
)
add(
    "matrix as MATLAB displays it",
    "\nans =\n\n   1.0e+01 *\n\n"
    + lines(lambda i: f"    {i / RATE / 10:.6f}    {FORCE[i] / 10:.4f}    {POSITION[i] / 10:.5f}"),
    suffix=".txt",
    options={"columns": ("time [s]", "force [N]", "position [mm]")},
    refused=r"1\.0e\+01|factor|scale|line",
)
add(
    "circuit simulator",
    "time\tV(f)\tV(x)\n" + lines(lambda i: f"{i / RATE:.15e}\t{FORCE[i] / 100:.6e}\t{POSITION[i] / 10:.6e}"),
    suffix=".txt",
    options={
        "channels": {
            "force": {"column": "V(f)", "unit": "V", "scale": "100 N/V"},
            "position": {"column": "V(x)", "unit": "V", "scale": "10 mm/V"},
        },
        "units": {"time": "s"},
    },
    rtol=1e-6,
)
add(
    "motion capture with its rate on a line alone",
    "Devices\n2000\n,,Force plate,Force plate\nFrame,Sub Frame,Fz,Pz\n,,N,mm\n"
    + lines(lambda i: f"{i // 10 + 1},{i % 10},{fu()(i)}"),
    options={"channels": {"force": "Fz", "position": "Pz"}},
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "data acquisition software with a title for each column",
    "Drop.WDH\nForce,Position\n2000.0,2000.0\nN,mm\n11/2/2023 10:00:00\n" + lines(lambda i: f"{fu()(i)}"),
    refused="rate|unit|heading",
)
add(
    "vehicle recorder with its mode",
    "DataMode: TimeHistory\nTestDescription: drop\nChannelName: Force|Position\nUnits: N|mm\nSampleRate: 2000|2000\n"
    "Time|Force|Position\n" + lines(lambda i: f"{t(i)}|{f(i)}|{u(i)}"),
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add(
    "power analyser, readings that did not fit",
    "Store No.,Millisecond,CH1,CH2\n"
    + lines(lambda i: f"{i + 1},{5 * i}," + (f"9.9E+37,{u(i)}" if i in (20, 21) else fu()(i))),
    time=SLOW,
    options={"channels": {"force": {"column": "CH1", "unit": "N"}, "position": {"column": "CH2", "unit": "mm"}}},
    refused="9.9|time|unit",
)
add(
    "bench meter through its remote commands, no number",
    HEAD + lines(lambda i: f"{t(i)},{'+9.910000E+37' if i in (20, 21) else f(i)},{u(i)}"),
    refused="9.91",
)
add(
    "words of a C library for what is no number",
    HEAD + lines(lambda i: f"{t(i)},{ {20: '1.#QNAN', 21: '-1.#IND', 22: '1.#INF'}.get(i, f(i)) },{u(i)}"),
)
add(
    "points for what is missing",
    HEAD + lines(lambda i: f"{t(i)},{'.' if i in (20, 21) else f(i)},{u(i)}"),
)
add(
    "nulls of a data base",
    "time_s\tforce_N\tposition_mm\n" + lines(lambda i: f"{t(i)}\t{chr(92) + 'N' if i in (20, 21) else f(i)}\t{u(i)}"),
    suffix=".tsv",
)
add(
    "two decks of a recorder at two rates",
    "[Fast]\nRate=2000 Hz\n"
    + FU
    + lines(fu())
    + "[Slow]\nRate=10 Hz\ntemperature [C],humidity [%]\n20.1,40\n20.2,41\n",
    refused="rate|table|heading|Rate",
)
add(
    "scope whose only frequencies are of the instrument",
    "Model,SDS1104\nBandwidth,100 MHz\nMax. sample rate,1 GSa/s\nCH1,CH2\n" + lines(volts),
    options=VOLTS,
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "amplifier with a carrier and a filter, no rate",
    "Carrier frequency: 4800 Hz\nFilter: Bessel 200 Hz\n" + FU + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "controller whose display has a rate",
    "Baud rate: 115200\nDisplay refresh: 10 Hz\n" + FU + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
add(
    "averages of four readings each",
    "Sampling rate: 8 kHz\nAveraging: 4 samples per point\n" + FU + lines(fu()),
    refused="rate|Hz",
    remedy={"rate": 2000.0},
)
