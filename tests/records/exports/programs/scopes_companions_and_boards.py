"""Scopes, settings in a file beside bare numbers, records in parts, second loggers, boards and phones."""

from __future__ import annotations

from datetime import UTC, datetime, timedelta, timezone
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de, joined
from tests.records.exports.containers import zipped
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop
from tests.records.exports.programs.waveforms_archives_and_structures import stamp

SCOPES_COMPANIONS_AND_BOARDS = Kind()
VOLTS = {"force": ("10 N/V", 0.1), "position": ("2 mm/V", 0.5)}


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    SCOPES_COMPANIONS_AND_BOARDS.add(name, content, **drop.truth(**more))


def volts(force: str, position: str | None) -> dict[str, Any]:
    scales = {"force": (force, "10 N/V"), "position": (position, "2 mm/V")}
    channels = {r: {"column": c, "unit": "V", "scale": scale} for r, (c, scale) in scales.items() if c is not None}
    return {"channels": channels}


d = Drop(2000.0, 90, 217)
add(
    "ordinary: Rigol, a start and an increment behind the names",
    "X,CH1,CH2,Start,Increment,\nSequence,Volt,Volt,-1.000000e-02,5.000000e-04\n"
    + d.rows(lambda i: f"{i},{d.force[i] / 10:.5e},{d.position[i] / 2:.6e},"),
    d,
    options=volts("CH1", "CH2"),
)
d = Drop(2000.0, 85, 218)
add(
    "ordinary: Tektronix, scales and positions of the screen",
    "Model,MSO24\nFirmware Version,1.38.0.6\n\nWaveform Type,ANALOG,,\nPoint Format,Y,,\nHorizontal Units,s,,\nHorizontal Scale,0.004,,\n"
    "Horizontal Delay,0.0,,\nSample Interval,5e-04,,\nRecord Length,85,,\nGating,0.0% to 100.0%,,\nProbe Attenuation,1,1,\n"
    "Vertical Units,V,V,\nVertical Offset,0,0,\nVertical Scale,0.5,1,\nVertical Position,-1.2,0.4,\n,,,\n,,,\n,,,\nLabel,Force,Position,\nTIME,CH1,CH2\n"
    + d.rows(lambda i: f"{d.time[i] - 0.02:.6e},{d.f(i, 5, 0.1)},{d.x(i, 6, 0.5)}"),
    d,
    options=volts("CH1", "CH2"),
)
d = Drop(5000.0, 95, 219)
add(
    "ordinary: Infiniium, one trace below its increment and origin",
    "Revision:,0\nType:,Raw\nStart:,0\nPoints:,95\nCount:,1\nXDispRange:,+2.0E-02\nXDispOrg:,-1.0E-02\nXInc:,+2.0E-04\nXOrg:,-1.0E-02\n"
    "YDispRange:,+4.0E+00\nYDispOrg:,+0.0E+00\nYInc:,+6.1E-05\nYOrg:,+2.0E-01\nFrame:,MSO-S 104A:MY57\nAcq Mode:,Real Time\nCompletion:,100\n"
    "X Units:,second\nY Units:,Volt\nMax Bandwidth:,+1.0E+09\nMin Bandwidth:,+0.0E+00\nDate:,05 NOV 2024\nTime:,09:14:03\nData:\n"
    + d.rows(lambda i: f"{d.force[i] / 10:+.5E}"),
    d,
    position=None,
    options={**volts("column 1", None)},
)
d = Drop(1000.0, 91, 220)
add(
    "ordinary: Yokogawa, blocks with rates, resolution and offset",
    '//YOKOGAWA ASCII FILE FORMAT\n"Header Size","18"\n"Model","DL850E"\n"Comment",""\n"BlockNumber","1"\n"TraceName","Force","Position"\n'
    '"BlockSize","91","91"\n"VUnit","N","mm"\n"SampleRate","1000","1000"\n"HResolution","1.0000000E-03","1.0000000E-03"\n'
    '"HOffset","-4.5000000E-02","-4.5000000E-02"\n"HUnit","s","s"\n"DisplayBlockSize","91","91"\n"DisplayPointNo.","1","1"\n'
    '"PhaseShift","0","0"\n"Date","2024/11/05","2024/11/05"\n"Time","09:14:03.123456","09:14:03.123456"\n\n'
    + d.rows(lambda i: f",{d.force[i]:.7E},{d.position[i]:.7E}"),
    d,
)
d = Drop(10000.0, 93, 221)
add(
    "ordinary: LeCroy, one segment of a trace",
    "LECROYHDO4034,12345,Waveform\nSegments,1,SegmentSize,93\nSegment,TrigTime,TimeSinceSegment1\n#1,05-Nov-2024 09:14:03,0\nTime,Ampl\n"
    + d.rows(lambda i: f"{d.time[i] - 0.005:.6e},{d.f(i, 5, 0.1)}"),
    d,
    position=None,
    options={"channels": {"force": {"column": "Ampl", "unit": "V", "scale": "10 N/V"}}, "units": {"time": "s"}},
)
d = Drop(1000.0, 92, 222)
add(
    "ordinary: PicoScope, units in brackets below, one reading beyond the range",
    "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n"
    + d.rows(lambda i: f"{i - 20:.8f},{'∞' if i == 7 else d.f(i, 5, 0.1)},{d.x(i, 4, 500)}"),
    d,
    options={
        "channels": {
            "force": {"column": "Channel A", "scale": "10 N/V"},
            "position": {"column": "Channel B", "scale": "2 mm/V"},
        }
    },
)
d = Drop(800.0, 83, 223)
add(
    "ordinary: configuration of a logger in sections beside bare numbers",
    d.fx("\t"),
    d,
    suffix=".dat",
    header=(
        "setup.ini",
        "[Acquisition]\nDevice=DAQ-4711\nSampleRate=800\nSampleRateUnit=Hz\nFilter=off\n[Channel0]\nName=Force\nUnit=N\nEnabled=1\n"
        "[Channel1]\nName=Position\nUnit=mm\nEnabled=1\n",
    ),
)
d = Drop(2000.0, 87, 224)
add(
    "ordinary: sheet of notes beside bare numbers",
    d.fx(";", de),
    d,
    suffix=".txt",
    header=(
        "notes.txt",
        "Drop rig, hall 2\nSampling frequency: 2 kHz\nNumber of channels: 2\nForce [N];Position [mm]\n",
    ),
)
d = Drop(1000.0, 120, 225)
HEAD = "Time [s];Force [N];Position [mm]\n"


def cut(drop: Drop, first: int, last: int, row: Any, head: str = HEAD) -> str:
    return head + "".join(row(i) + "\n" for i in range(first, last))


add(
    "ordinary: three files of forty rows, times run on",
    cut(d, 0, 40, lambda i: f"{d.t(i)};{d.f(i)};{d.x(i)}"),
    d,
    parts=tuple(cut(d, a, a + 40, lambda i: f"{d.t(i)};{d.f(i)};{d.x(i)}") for a in (40, 80)),
)
d = Drop(500.0, 100, 226)
HEAD = "Interval: 2 ms\nFile of the ring: {}\nforce (N),position (mm)\n"
add(
    "ordinary: two files of a ring buffer, the interval in each",
    cut(d, 0, 50, lambda i: f"{d.f(i)},{d.x(i)}", HEAD.format(1)),
    d,
    parts=(cut(d, 50, 100, lambda i: f"{d.f(i)},{d.x(i)}", HEAD.format(2)),),
)
d = Drop(2000.0, 110, 227)
add(
    "ordinary: a laser of its own beside, its clock begins 12.5 ms later",
    "Time [s],Force [N]\n" + d.rows(lambda i: f"{d.t(i)},{d.f(i)}"),
    d,
    beside=("t [ms],Distance [mm]\n" + d.rows(lambda i: f"{d.time[i] * 1e3 - 12.5:.1f},{d.x(i)}"), 0.0125),
)
d = Drop(100.0, 105, 228)
add(
    "ordinary: two loggers with the time of day",
    "Date;Time;Force [N]\n" + d.rows(lambda i: f"{stamp(i, d, '%d.%m.%Y;%H:%M:%S.%f')};{d.f(i)}"),
    d,
    beside=("Timestamp;Position [mm]\n" + d.rows(lambda i: f"{stamp(i, d, '%Y-%m-%d %H:%M:%S.%f')};{d.x(i)}"), None),
)
d = Drop(80.0, 90, 229)
COUNTS = np.round(d.force / 0.0035).astype(int)
add(
    "ordinary: HX711 on an Arduino, ms and raw counts with a zero",
    "HX711 test sketch\nms,raw,pos_mm\n" + d.rows(lambda i: f"{int(i * 12.5) + 4021},{COUNTS[i] + 84213},{d.x(i)}"),
    d,
    suffix=".log",
    force=COUNTS * 0.0035,
    atol_time=7e-4,
    options={"channels": {"force": {"column": "raw", "zero": 84213, "scale": "3.5 mN"}, "position": "pos_mm"}},
)
d = Drop(50.0, 88, 230)
ESP = np.round(d.force / 0.002).astype(int)
add(
    "ordinary: ESP32 below its boot messages, arrows of the serial monitor",
    "09:14:01.102 -> ets Jun  8 2016 00:22:57\n09:14:01.102 -> \n09:14:01.150 -> rst:0x1 (POWERON_RESET),boot:0x13 (SPI_FAST_FLASH_BOOT)\n"
    "09:14:01.155 -> load:0x3fff0030,len:1344\n09:14:01.301 -> entry 0x400805f0\n09:14:02.011 -> millis;hx711;laser_um\n"
    + d.rows(lambda i: f"{stamp(i, d, '%H:%M:%S.%f')} -> {1210 + 20 * i};{ESP[i] - 120455};{d.x(i, 1, 1000)}"),
    d,
    suffix=".log",
    force=ESP * 0.002,
    options={
        "channels": {
            "time": "millis",
            "force": {"column": "hx711", "zero": -120455, "scale": "2 mN"},
            "position": {"column": "laser_um", "unit": "um"},
        },
        "units": {"time": "ms"},
    },
)
d = Drop(100.0, 99, 231)
add(
    "ordinary: phyphox, a zip with the phone and the pauses beside the data",
    zipped(
        {
            "Raw Data.csv": (
                '"Time (s)","Force (N)","Position (mm)"\n'
                + d.rows(lambda i: f"{d.time[i]:.9E},{d.force[i]:.9E},{d.position[i]:.9E}")
            ).encode(),
            "meta/device.csv": b'"property","value"\n"version","1.1.16"\n"deviceModel","Pixel 7"\n"depthFrontRate","0"\n',
            "meta/time.csv": b'"event","experiment time","system time","system time text"\n'
            b'"START",0.000000000E0,1.730798043555E9,"2024-11-05 09:14:03.555 UTC+01:00"\n'
            b'"PAUSE",9.910000000E-1,1.730798044546E9,"2024-11-05 09:14:04.546 UTC+01:00"\n',
        }
    ),
    d,
    suffix=".zip",
)
d = Drop(20.0, 65, 232)
add(
    "ordinary: Graphical Analysis, data sets before the names",
    '"Data Set 1:Time(s)","Data Set 1:Force(N)","Data Set 1:Position(m)"\n'
    + d.rows(lambda i: joined((d.t(i, 2), d.f(i), d.x(i, 7, 1e-3)))),
    d,
)
d = Drop(250.0, 76, 233)
add(
    "ordinary: commas, a separator at the end of headings and rows",
    "Zeit [s];Kraft [N];Weg [mm];\r\n" + d.rows(lambda i: de(f"{d.t(i)};{d.f(i)};{d.x(i)};"), "\r\n"),
    d,
    encoding="cp1252",
)
d = Drop(10.0, 80, 234)
CHANGE = datetime(2024, 10, 27, 0, 59, 56, tzinfo=UTC)


def summer(i: int) -> str:
    now = CHANGE + timedelta(milliseconds=100 * i)
    local = now.astimezone(timezone(timedelta(hours=2 if now.hour < 1 else 1)))
    return local.isoformat(timespec="milliseconds")


add(
    "ordinary: stamps with offsets over the end of summer time",
    "timestamp,force [N],position [mm]\n" + d.rows(lambda i: f"{summer(i)},{d.f(i)},{d.x(i)}"),
    d,
)
d = Drop(1000.0, 78, 235)
add(
    "ordinary: a row of least bits below the units, values are physical",
    "Channel,Time,Force,Position\nUnit,s,N,mm\nLSB,1e-6,0.001,0.0001\n"
    + d.rows(lambda i: f"{i + 1},{d.t(i)},{d.f(i)},{d.x(i)}"),
    d,
)
d = Drop(500.0, 74, 236)
add(
    "ordinary: UTF-16 with tabs, commas and a mark at the beginning",
    "﻿Datei:\tVersuch 12\r\nZeit\tKraft\tWeg\r\ns\tN\tmm\r\n"
    + d.rows(lambda i: de(f"{d.t(i)}\t{d.f(i)}\t{d.x(i)}"), "\r\n"),
    d,
    suffix=".txt",
    encoding="utf-16-le",
)
assert len(SCOPES_COMPANIONS_AND_BOARDS) == 20
