"""What machines, scopes, loggers and their programs write, from the descriptions of their formats: a third set."""

from __future__ import annotations

import json

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, Kind, N, de, f, fu, lines, t, tfu, u

BENCHES = Kind()
add = BENCHES.add
SLOW = np.arange(N) * 0.005
"""Times of a logger at 200 Hz, whose stamps need three decimals only."""
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
VOLTS = {"channels": {"force": {"column": "CH1", "unit": "V", "scale": "100 N/V"}}}


def volts(i: int) -> str:
    return f"{FORCE[i] / 100:.5f}"


add(
    "data recorder of a piezo stage",
    "# REM GCS data recorder\n# VERSION = 1\n# TYPE = 1\n# SEPARATOR = 32\n# DIM = 2\n# SAMPLE_TIME = 0.000500\n"
    "# NDATA = 60\n# NAME0 = Force [N]\n# NAME1 = Position [mm]\n# END_HEADER\n" + lines(fu(" ")),
    suffix=".dat",
    refused="rate|unit|columns|heading",
)
add(
    "phyphox",
    '"Time (s)","Force (N)","Position (mm)"\n' + lines(lambda i: f"{i / RATE:.9E},{FORCE[i]:.9E},{POSITION[i]:.9E}"),
)
add(
    "rostopic echo",
    "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.wrench.force.z,field.pos.z\n"
    + lines(
        lambda i: (
            f"{1698919200000001200 + 500000 * i + 37 * (i % 5)},{i},{1698919200000000000 + 500000 * i},ft,{f(i)},{u(i)}"
        )
    ),
    options={
        "channels": {
            "force": {"column": "field.wrench.force.z", "unit": "N"},
            "position": {"column": "field.pos.z", "unit": "mm"},
        }
    },
    refused="time",
    atol_time=1e-6,
)
add(
    "PlotJuggler, a channel a row",
    "__time,/ft/force_N,/enc/position_mm\n"
    + "".join(f"{k / 4000:.5f}," + (f"{f(k // 2)},\n" if k % 2 == 0 else f",{u(k // 2)}\n") for k in range(2 * N)),
    refused="force|empty|missing|unit|time",
)
add(
    "robot controller with blanks",
    "timestamp actual_TCP_force_2 actual_TCP_pose_2\n" + lines(lambda i: f"{t(i)} {f(i)} {u(i, 1e-3, 7)}"),
    options={
        "channels": {
            "time": "timestamp",
            "force": {"column": "actual_TCP_force_2", "unit": "N"},
            "position": {"column": "actual_TCP_pose_2", "unit": "m"},
        },
        "units": {"time": "s"},
    },
)
add(
    "OpenSim storage",
    "forces\nversion=1\nnRows=60\nnColumns=3\ninDegrees=no\nendheader\ntime\tforce\tposition\n" + lines(tfu("\t")),
    suffix=".sto",
    options=NAMED,
)
add(
    "motion capture, frames and times",
    "NO_OF_FRAMES\t60\nNO_OF_CAMERAS\t8\nNO_OF_MARKERS\t1\nFREQUENCY\t2000\nDATA_INCLUDED\t3D\nMARKER_NAMES\tm1\n"
    "Frame\tTime\tm1 X\tm1 Y\tm1 Z\n" + lines(lambda i: f"{i + 1}\t{t(i)}\t101.2\t-33.0\t{u(i)}"),
    suffix=".tsv",
    options={"channels": {"position": {"column": "m1 Z", "unit": "mm"}}},
    force=None,
    refused="unit",
    remedy={"units": {"time": "s"}},
)
add(
    "force plate",
    "BioWare Data File\nSubject:\tfibre 7\nDate/Time:\t02-Nov-23 10:00:00\n#Samples/Trig\t60\nRate (Hz)\t2000.000\n\n"
    "abs time (s)\tFz\tAz\ns\tN\tmm\n" + lines(tfu("\t")),
    suffix=".txt",
    options={"channels": {"position": "Az", "force": "Fz"}},
)
add(
    "laser sensor tool",
    '"Sensor";"ILD1420-25"\n"Measuring rate";"2 kHz"\n"Averaging";"Median 3"\n\n'
    '"Time [ms]";"Distance1 [mm]";"Analog force [N]"\n' + lines(lambda i: de(f'"{t(i, 1e3, 1)}";"{u(i)}";"{f(i)}"')),
)
add(
    "Keyence wave logger",
    "[CH info]\nCH,(1)HA-V01,(2)HA-V02\nComment,Force,Position\nUnit,N,mm\nSampling cycle,500us\n[Data]\n"
    "No.,Time,(1)HA-V01,(2)HA-V02\n,s,N,mm\n" + lines(lambda i: f"{i + 1},{tfu()(i)}"),
    options={"channels": {"force": "(1)HA-V01", "position": "(2)HA-V02"}},
)
add(
    "Graphtec, stamp and ms apart",
    "Vendor,GRAPHTEC Corporation\nModel,GL2000\nSampling interval,500us\nTotal data points,60\n"
    "Start time,2023/11/02,10:00:00\nAMP settings\nCH,Signal name,Input,Range,Filter,Span\n"
    "CH1,Force,DC,10V,Off,100.00,0.00,N\nCH2,Pos,DC,10V,Off,10.00,0.00,mm\nData\n"
    "Number,Date&Time,ms,CH1,CH2\nNO.,Time,ms,N,mm\n"
    + lines(lambda i: f"{i + 1},2023/11/02 10:00:00,{i / 2:.1f},{FORCE[i]:+.3f},{POSITION[i]:+.4f}"),
    options={"channels": {"force": "CH1", "position": "CH2"}},
    refused="time|ms",
)
add(
    "Hioki, apostrophe and short year",
    '"Date-Time","CH1-1[N]","CH1-2[mm]"\n' + lines(lambda i: f"'23-11-02 10:00:{i / RATE:07.4f},{f(i)},{u(i)}"),
    refused="time|stamp|year",
)
add(
    "LabJack, raw and scaled, seconds since 1904",
    "Time\tv0\ty0 [N]\tv1\ty1 [mm]\n"
    + lines(lambda i: f"{3781767600 + i / RATE:.4f}\t{volts(i)}\t{f(i)}\t{POSITION[i] / 10:.5f}\t{u(i)}"),
    options={"units": {"time": "s"}},
    atol_time=1e-6,
)
add(
    "DAQami, twelve hours",
    "DAQami Export\nDevice,USB-1608\n\nSample,Date/Time,Force (N),Position (mm)\n"
    + lines(lambda i: f"{i + 1},11/2/2023 10:00:{i / RATE:07.4f} AM,{f(i)},{u(i)}"),
)
add(
    "force gauge in lbF and inches",
    "Reading,Load [lbF],Travel [in],Time [s]\n"
    + lines(lambda i: f"{i + 1},{FORCE[i] / 4.4482216152605:.9f},{POSITION[i] / 25.4:.11f},{t(i)}"),
    rtol=1e-6,
)
add(
    "texture analyser in grams",
    "Force (g)\tDistance (mm)\tTime (sec)\n" + lines(lambda i: f"{FORCE[i] / 9.80665e-3:.6f}\t{u(i)}\t{t(i)}"),
    suffix=".tab",
    refused="unit|gram|g",
    remedy={"channels": {"force": {"column": "Force (g)", "scale": "9.80665 mN/g"}}},
    rtol=1e-7,
)
add(
    "video tracker",
    "mass_A,,\nt,x,y\n" + lines(lambda i: f"{t(i)},0.001,{u(i, 1e-3, 7)}"),
    options={"channels": {"position": "y"}},
    force=None,
    refused="unit",
    remedy={"units": {"time": "s", "position": "m"}},
)
add(
    "Igor text",
    "IGOR\nWAVES/D\ttime_s\tforce_N\tposition_mm\nBEGIN\n"
    + lines(lambda i: "\t" + tfu("\t")(i))
    + 'END\nX SetScale d 0,0,"N", force_N\n',
    suffix=".itx",
    refused="heading|columns",
)
add(
    "strong motion, five values a row",
    "PEER NGA DATABASE\nRIG 3, DROP 7\nFORCE IN UNITS OF N\nNPTS=   60, DT=   .0005 SEC\n"
    + "".join("  ".join(f"{FORCE[i]:.7E}" for i in range(k, k + 5)) + "\n" for k in range(0, N, 5)),
    suffix=".at2",
    position=None,
    refused="columns|heading|row",
)
add(
    "universal file 58",
    "    -1\n    58\nForce\nNONE\n02-Nov-23 10:00:00\nNONE\nNONE\n    1    0    0    0 NONE 1 3 NONE 0 0\n"
    "    2   60    1  0.00000e+00  5.00000e-04  0.00000e+00\n   17    0    0    0 Time    s\n   13    0    0    0 Force   N\n"
    + "".join("".join(f"{FORCE[i]:13.5e}" for i in range(k, k + 6)) + "\n" for k in range(0, N, 6))
    + "    -1\n",
    suffix=".uff",
    position=None,
    refused="data set 58",
)
add(
    "seismic sample list",
    "TIMESERIES XX_RIG__FOR_R, 60 samples, 2000 sps, 2023-11-02T10:00:00.000000, SLIST, FLOAT, N\n"
    + "".join("  ".join(f(i) for i in range(k, k + 6)) + "\n" for k in range(0, N, 6)),
    suffix=".slist",
    position=None,
    refused="table|columns|heading",
)
add(
    "InfluxDB, annotated",
    "#group,false,false,false,false,true\n#datatype,string,long,dateTime:RFC3339,double,string\n#default,_result,,,,\n"
    ",result,table,_time,_value,_field\n"
    + lines(lambda i: f",,0,2023-11-02T10:00:{i / RATE:07.4f}Z,{f(i)},force")
    + lines(lambda i: f",,1,2023-11-02T10:00:{i / RATE:07.4f}Z,{u(i)},position"),
    options={"units": {"force": "N", "position": "mm"}},
    refused="long|_field|group|column|channel|unit",
)
add(
    "Grafana, units in cells",
    '"Time","force","position"\n' + lines(lambda i: f'"2023-11-02 10:00:{i / RATE:07.4f}","{f(i)} N","{u(i)} mm"'),
    refused="unit|number",
)
add(
    "search engine, documents",
    lines(
        lambda i: json.dumps(
            {
                "_id": str(i),
                "_source": {
                    "@timestamp": f"2023-11-02T10:00:{i / RATE:07.4f}Z",
                    "force_N": FORCE[i],
                    "position_mm": POSITION[i],
                },
            }
        )
    ),
    suffix=".jsonl",
)
add(
    "line protocol",
    lines(lambda i: f"rig,site=a force={f(i)},position={u(i)} {1698919200000000000 + 500000 * i}"),
    suffix=".lp",
    options={"units": {"force": "N", "position": "mm"}},
    refused="time|rate|table|key",
)
add(
    "two specimens side by side",
    "Specimen 1,,,,Specimen 2,,\nTime,Force,Extension,,Time,Force,Extension\ns,N,mm,,s,N,mm\n"
    + lines(lambda i: f"{tfu()(i)},,{t(i)},{FORCE[i] * 0.9:.3f},{POSITION[i] * 1.1:.4f}"),
    refused="could each|which|two|twice",
    remedy={"channels": {"time": "column 1", "force": "column 2", "position": "column 3"}},
)
add("Lloyd Nexygen", "Time (s)\tLoad (N)\tExtension from Preload (mm)\n" + lines(tfu("\t")), suffix=".txt")
add("Tinius Olsen", "Time, Force, Position\nsec, N, mm\n" + lines(tfu(", ")))
add(
    "dynamic tester, total and cycle times",
    '"Total Time (s)","Cycle Elapsed Time (s)","Total Cycles","Position(8800 (0,1):Position) (mm)","Load(8800 (0,2):Load) (kN)"\n'
    + lines(lambda i: f"{t(i)},{i % 20 / RATE:.4f},{i // 20},{u(i)},{f(i, 1e-3, 6)}"),
    refused="time",
)
add(
    "blocks of a servohydraulic machine",
    "".join(
        f"Data Header:\tTime:\t{k / RATE:.4f}\tSec\nData Acquisition:\tPeak/Valley\n"
        "Time\tAxial Force\tAxial Displacement\nSec\tN\tmm\n"
        + "".join(f"{t(i)}\t{f(i)}\t{u(i)}\n" for i in range(k, k + 20))
        + "\n"
        for k in (0, 20, 40)
    ),
    suffix=".dat",
    refused="head|table|unit",
)
add(
    "unit of the time left empty",
    '"Prüfzeit";"Standardkraft";"Standardweg"\n"";"N";"mm"\n' + lines(tfu(";", de)),
    encoding="cp1252",
    suffix=".TRA",
    refused="unit",
    remedy={"units": {"time": "s"}},
)
add(
    "FAMOS, step in rows",
    ";Kraft;Weg\nx-Delta;5e-4;5e-4\nx-Einheit;s;s\ny-Einheit;N;mm\n" + de(lines(lambda i: f";{f(i)};{u(i)}")),
    suffix=".txt",
    refused="rate|unit|heading",
)
add(
    "Gantner, year first with dots",
    "Timestamp;Force;Pos\n[UTC];[N];[mm]\n" + lines(lambda i: f"2023.11.02 10:00:{i / RATE:09.6f};{f(i)};{u(i)}"),
    refused="time|unit",
)
add(
    "reduced values",
    "Time (s);Force (N) (avg);Force (N) (min);Force (N) (max);Position (mm) (avg)\n"
    + lines(lambda i: f"{t(i)};{f(i)};{FORCE[i] - 0.5:.3f};{FORCE[i] + 0.5:.3f};{u(i)}"),
    refused="could each|force",
    remedy={"channels": {"force": "Force (N) (avg)"}},
)
add(
    "a slow channel between fast ones",
    "Time (s)\tForce (N)\tTemp (C)\tPosition (mm)\n"
    + lines(lambda i: f"{t(i)}\t{f(i)}\t" + ("21.5" if i % 10 == 0 else "") + f"\t{u(i)}"),
    suffix=".txt",
)
add(
    "types between names and units",
    "ETASAsciiItemFile\trecord\tTimebase\nsampleCount\t60\ntime\tForce\tPos\nf8\tf8\tf8\ns\tN\tmm\n" + lines(tfu("\t")),
    suffix=".ascii",
    refused="unit|heading",
)
add(
    "frames of a CAN bus",
    "date Thu Nov 2 10:00:00.000 2023\nbase hex timestamps absolute\n"
    + lines(
        lambda i: f"   {i / RATE:.6f} 1  {0x120 + i % 2:X}  Rx d 2 {round(FORCE[i] * 1e3) // 256:02X} {i % 256:02X}"
    ),
    suffix=".asc",
    refused="table|heading|columns",
)
add(
    "scope of a controller, a time beside each",
    "Name;Drop\nFile;C:\\drop.svdx\n\nName;Force;Name;Position\nUnit;N;Unit;mm\nSampleTime[ms];0.5;SampleTime[ms];0.5\n\n"
    + lines(lambda i: f"{i / 2:.1f};{f(i)};{i / 2:.1f};{u(i)}"),
    refused="time|heading|unit|rate",
)
add(
    "trace of a drive, stamps in µs",
    "Nr;Zeitstempel [µs];Kraft [N];Weg [mm]\n" + lines(lambda i: f"{i};{500 * i};{de(f(i))};{de(u(i))}"),
    encoding="cp1252",
)
add(
    "recorder of a servo drive",
    '"Time [ms]";"Position actual value [qc]";"Current actual value [mA]"\n'
    + lines(lambda i: f"{i / 2:.1f};{POSITION[i] * 1e4:.0f};{FORCE[i] * 500:.1f}"),
    options={
        "channels": {
            "position": {"column": "Position actual value [qc]", "unit": "counts", "scale": "0.1 um"},
            "force": {"column": "Current actual value [mA]", "scale": "2 N/A"},
        }
    },
)
add(
    "axis with dots in its names",
    "Time (sec),X.PosFbk (mm),X.CurFbk (A)\n" + lines(lambda i: f"{t(i)},{u(i)},{FORCE[i] / 2:.4f}"),
    options={
        "channels": {"force": {"column": "X.CurFbk (A)", "scale": "2 N/A"}, "position": {"column": "X.PosFbk (mm)"}}
    },
)
add(
    "six-axis sensor in counts",
    "Start Time: 11/2/2023 10:00:00 AM\nRDT Sample Rate: 2000\nForce Units: N\nCounts per Unit Force: 1000.0\n"
    "Status (hex),RDT Sequence,Fx,Fy,Fz\n" + lines(lambda i: f"0,{i},12,-31,{FORCE[i] * 1e3:.0f}"),
    options={"channels": {"force": "Fz"}},
    position=None,
    refused="unit|count",
    remedy={"channels": {"force": {"column": "Fz", "unit": "counts", "scale": "1 mN"}}, "rate": 2000.0},
)
add(
    "vibrometer, blanks inside brackets",
    "Polytec File\nSource File Name\tdrop.svd\nTime\tDisplacement Ch1\tForce Ch2\n[ s ]\t[ m ]\t[ N ]\n"
    + lines(lambda i: f"{t(i)}\t{u(i, 1e-3, 7)}\t{f(i)}"),
    suffix=".txt",
)
add(
    "LeCroy, two segments",
    "LECROYWR640Zi,12345,Waveform\nSegments,2,SegmentSize,30\nSegment,TrigTime,TimeSinceSegment1\n"
    "#1,02-Nov-2023 10:00:00,0\n#2,02-Nov-2023 10:00:05,5\nTime,Ampl\n"
    + lines(lambda i: f"{i % 30 / RATE:.6E},{volts(i)}"),
    options={"channels": {"force": {"column": "Ampl", "unit": "V", "scale": "100 N/V"}}, "units": {"time": "s"}},
    position=None,
    refused="back|segment|twice|again",
)
add(
    "scanner with alarms",
    "Scan,Time,101 (N),Alarm 101,102 (mm),Alarm 102\n"
    + lines(lambda i: f"{i + 1},11/02/2023 10:00:00:{5 * i:03d},{f(i)},0,{u(i)},0"),
    options={"channels": {"force": "101 (N)", "position": "102 (mm)"}},
    time=SLOW,
)
add(
    "scope with labels and units in rows",
    "Model,MSO58\nLabel,Force,Pos\nHorizontal units,s\nSample Interval,5e-04\nRecord Length,60\nZero Index,20\n"
    "Vertical Units,N,mm\nTIME,CH1,CH2\n" + lines(lambda i: f"{(i - 20) / RATE:.6e},{f(i)},{u(i)}"),
    options={"channels": {"force": "CH1", "position": "CH2"}},
    refused="unit",
    remedy={"units": {"force": "N", "position": "mm", "time": "s"}},
)
add(
    "Rigol, its step among the headings",
    "CH1V,CH2V,t0 =-1.5e-02, tInc = 5.0e-04,\n" + lines(lambda i: f"{volts(i)},0.1,,,"),
    options={"channels": {"force": {"column": "CH1V", "unit": "V", "scale": "100 N/V"}}},
    position=None,
    refused="rate|tInc|time",
)
add(
    "PicoScope, out of range",
    "Time,Channel A,Channel B\n(us),(V),(V)\n\n"
    + lines(lambda i: f"{500 * i}," + ("∞" if i in (11, 12) else volts(i)) + ",0.1"),
    options={"channels": {"force": {"column": "Channel A", "scale": "100 N/V"}}},
    position=None,
)
add(
    "Scopy",
    ";Scopy version,1.4\n;Exported on,Thu Nov 2\n;Device,M2K\n;Nr of samples,60\n;Sample rate,2000\n;Tool,Oscilloscope\n"
    "Sample,Time(S),CH1(V),CH2(V)\n" + lines(lambda i: f"{i},{t(i)},{volts(i)},0.1"),
    options={"channels": {"force": {"column": "CH1(V)", "scale": "100 N/V"}}},
    position=None,
)
