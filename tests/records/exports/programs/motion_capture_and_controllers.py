"""Motion capture, simulations, controllers, teaching software and testers; then ten traps of signs, counters, rates and units."""

from __future__ import annotations

import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de, joined
from tests.records.exports.containers import parquet, sheet
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

MOTION_CAPTURE_AND_CONTROLLERS = Kind()
START = datetime(2025, 2, 3, 8, 5, 59)


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    MOTION_CAPTURE_AND_CONTROLLERS.add(name, content, **drop.truth(**more))


def named(force: str, position: str) -> dict[str, Any]:
    return {"channels": {"force": force, "position": position}}


d = Drop(1000.0, 80, 101)
add(
    "ordinary: Nexus, devices with frames and subframes, rate said by the user",
    "Devices\n1000\n,,Imported AMTI - Force,Laser - Distance\nFrame,Sub Frame,Fz,x\n,,N,mm\n"
    + d.rows(lambda i: f"{1 + i // 10},{i % 10},{d.f(i)},{d.x(i)}"),
    d,
    options={"rate": 1000.0, **named("Fz", "x")},
)
d = Drop(200.0, 75, 102)
add(
    "ordinary: Track Manager, keys and values behind tabs",
    "NO_OF_FRAMES\t75\nNO_OF_CAMERAS\t8\nFREQUENCY\t200\nTIME_STAMP\t2025-02-03, 08:05:59\t8412.123\nDATA_INCLUDED\tANALOG\n"
    "Frame\tTime [s]\tForce [N]\tPosition [mm]\n" + d.rows(lambda i: f"{i + 1}\t{d.t(i, 5)}\t{d.f(i)}\t{d.x(i)}"),
    d,
    suffix=".tsv",
)
d = Drop(500.0, 66, 103)
add(
    "ordinary: storage file of a simulation, an end of the header",
    "Rope drop\nversion=1\nnRows=66\nnColumns=3\ninDegrees=no\nendheader\ntime\tforce\tposition\n" + d.tfx("\t"),
    d,
    suffix=".sto",
    options={"units": {"time": "s", "force": "N", "position": "mm"}},
)
d = Drop(100.0, 64, 104)
add(
    "ordinary: Data Inspector, units and interpolation below the names",
    "time,Force,Position\n,Type: double,Type: double\n,Unit: N,Unit: mm\n,Interp: linear,Interp: linear\n" + d.tfx(),
    d,
    options={"units": {"time": "s"}},
)
d = Drop(250.0, 70, 105)
add(
    "ordinary: TIA trace, names with quotes and a comment of the device",
    '"Aufzeichnungszeit";"03.02.2025 08:05:59"\n"Abtastung";"4 ms"\n"Zeit [ms]";"""DB_Fall"".Kraft [N]";"""DB_Fall"".Weg [mm]"\n'
    + d.rows(lambda i: de(f"{d.t(i, 1, 1000)};{d.f(i)};{d.x(i)}")),
    d,
    encoding="cp1252",
)
d = Drop(800.0, 90, 106)
add(
    "ordinary: LJLogM, voltages and scaled values side by side",
    "Time\tv0\tv1\ty0\ty1\n"
    + d.rows(lambda i: joined((f"{d.time[i]:.5f}", d.f(i, 5, 0.1), d.x(i, 6, 0.5), d.f(i), d.x(i)), "\t")),
    d,
    suffix=".dat",
    options={
        "channels": {"force": {"column": "y0", "unit": "N"}, "position": {"column": "y1", "unit": "mm"}},
        "units": {"time": "s"},
    },
    atol_time=1e-6,
)
d = Drop(100.0, 71, 107)
add(
    "ordinary: DAQami, sample numbers, clock and a column of events",
    "Sample,Date/Time,Force (N),Position (mm),Events\n"
    + d.rows(
        lambda i: (
            f"{i + 1},{(START + timedelta(milliseconds=10 * i)).strftime('%m/%d/%Y %I:%M:%S.%f')[:-3]} AM,{d.f(i)},{d.x(i)},"
        )
    ),
    d,
)
d = Drop(20.0, 68, 108)
add(
    "ordinary: Capstone, runs behind the units",
    "Time (s) Run #3,Force (N) Run #3,Position (m) Run #3\n"
    + d.rows(lambda i: joined((d.t(i, 2), d.f(i), d.x(i, 7, 1e-3)))),
    d,
)
d = Drop(50.0, 69, 109)
add(
    "ordinary: Logger Pro, the latest run",
    "Latest: Time (s)\tLatest: Force (N)\tLatest: Position (mm)\n"
    + d.rows(lambda i: f"{d.t(i, 2)}\t{d.f(i)}\t{d.x(i)}"),
    d,
    suffix=".txt",
)
d = Drop(400.0, 72, 110)
add(
    "ordinary: phyphox, exponents in capitals",
    '"Time (s)","Force (N)","Position (mm)"\n'
    + d.rows(lambda i: f"{d.time[i]:.9E},{d.force[i]:.9E},{d.position[i]:.9E}"),
    d,
)
d = Drop(10.0, 62, 111)
add(
    "ordinary: MESUR gauge, readings numbered, peak and mean below",
    "Reading,Load [N],Travel [mm],Time [s]\n"
    + d.rows(lambda i: f"{i + 1},{d.f(i)},{d.x(i)},{d.t(i, 1)}")
    + f"\nStatistics\nMaximum,{max(d.force)},,\nAverage,{np.mean(d.force):.3f},,\n",
    d,
)
d = Drop(100.0, 67, 112)
add(
    "ordinary: Trapezium, number of the test above the headings",
    '"1 _ 1"\n"Time","Force","Stroke"\n"sec","N","mm"\n' + d.rows(lambda i: f"{d.t(i, 2)},{d.f(i)},{d.x(i)}"),
    d,
)
d = Drop(25.0, 63, 113)
add(
    "ordinary: Horizon, blanks around everything",
    "Horizon Export\n\n  Time (Sec) ,  Position (mm) ,  Force (N) \n"
    + d.rows(lambda i: f"  {d.t(i, 3)} ,  {d.x(i)} ,  {d.f(i)} "),
    d,
)
d = Drop(1000.0, 76, 114)
add(
    "ordinary: R, times in UTC with a Z and gaps as NA",
    "stamp,force_N,position_mm\n"
    + d.rows(
        lambda i: (
            f"{(START + timedelta(milliseconds=i)).isoformat(timespec='milliseconds')}Z,{'NA' if i == 31 else d.f(i)},{d.x(i)}"
        )
    ),
    d,
)
d = Drop(2000.0, 78, 115)
add(
    "ordinary: Julia, blanks behind commas",
    "t_s, F_N, x_mm\n" + d.tfx(", "),
    d,
)
d = Drop(50.0, 65, 116)
add(
    "ordinary: Excel, French, decanewtons",
    "Temps (s);Force (daN);Déplacement (mm)\n" + d.rows(lambda i: de(f"{d.t(i, 2)};{d.f(i, 4, 0.1)};{d.x(i)}"), "\r\n"),
    d,
    encoding="cp1252",
)
d = Drop(5000.0, 82, 117)


def _compound(path: Path, drop: Drop = d) -> None:
    import h5py

    rows = np.zeros(drop.n, [("time", "f8"), ("force", "f8"), ("position", "f8")])
    rows["time"], rows["force"], rows["position"] = drop.time, drop.force, drop.position
    with h5py.File(path, "w") as file:
        data = file.create_dataset("drop", data=rows)
        data.attrs["units"] = ["s", "N", "mm"]


add(
    "ordinary: HDF5, a table of records with its units",
    _compound,
    d,
    suffix=".h5",
    options={"units": {"time": "s", "force": "N", "position": "mm"}},
)
d = Drop(1000.0, 74, 118)
add(
    "ordinary: Parquet, single precision, seconds in a column",
    parquet({"time_s": d.time, "force_N": d.force.astype("f4"), "position_mm": d.position.astype("f4")}),
    d,
    suffix=".parquet",
    rtol=1e-5,
)
d = Drop(1250.0, 61, 119)
add(
    "ordinary: LVM, an X column for each channel",
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\n"
    "X_Columns\tMulti\nTime_Pref\tRelative\nDate\t2025/02/03\nTime\t08:05:59.25\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\t\nSamples\t61\t\t61\t\t\nDate\t2025/02/03\t\t2025/02/03\t\t\nTime\t08:05:59.25\t\t08:05:59.25\t\t\n"
    "Y_Unit_Label\tN\t\tmm\t\t\nX_Dimension\tTime\t\tTime\t\t\nX0\t0.0\t\t0.0\t\t\nDelta_X\t0.000800\t\t0.000800\t\t\n"
    "***End_of_Header***\t\t\t\t\nX_Value\tForce\tX_Value\tPosition\tComment\n"
    + d.rows(lambda i: f"{d.t(i)}\t{d.f(i)}\t{d.t(i)}\t{d.x(i)}\t"),
    d,
    suffix=".lvm",
)
d = Drop(100.0, 73, 120)
add(
    "ordinary: a sheet with two rows of headings beside a sheet of settings",
    sheet(
        [
            ["Zeit", "Kraft", "Weg"],
            ["s", "N", "mm"],
            *([float(d.time[i]), float(d.force[i]), float(d.position[i])] for i in range(d.n)),
        ],
        [["Prüfer", "Sommer"], ["Seil", "R22"], ["Raum", 14]],
    ),
    d,
    suffix=".xlsx",
)
d = Drop(500.0, 70, 121)
add(
    "ordinary: Fortran, D for the exponent, columns of fixed width",
    "   TIME [S]        FORCE [N]       POS [MM]\n"
    + d.rows(lambda i: "".join(f"{v:16.6E}".replace("E", "D") for v in (d.time[i], d.force[i], d.position[i]))),
    d,
    suffix=".out",
    rtol=1e-5,
)
d = Drop(800.0, 77, 122)
add(
    "ordinary: lists by name with a rate beside",
    json.dumps({"fs_Hz": 800, "device": "cDAQ1", "force_N": d.force.tolist(), "position_mm": d.position.tolist()}),
    d,
    suffix=".json",
)
d = Drop(10.0, 66, 123)
add(
    "ordinary: SMARTDAC, tags, units and a clock in three columns",
    "Model,GX10\nSampling Interval,100 ms\nTag,,,Force,Position\nDate,Time,ms,N,mm\n"
    + d.rows(
        lambda i: f"{(START + timedelta(milliseconds=100 * i)):%Y/%m/%d,%H:%M:%S},{100 * i % 1000},{d.f(i)},{d.x(i)}"
    ),
    d,
    options={"channels": {"force": "column 4", "position": "column 5"}},
)
d = Drop(12800.0, 96, 124)
add(
    "ordinary: analyser, a step in the header with many digits",
    "Title:\tRope 22\nNumber of points:\t96\nX0:\t0 s\nDelta X:\t7.8125e-05 s\n\nForce (N)\tPosition (mm)\n"
    + d.fx("\t"),
    d,
    suffix=".txt",
)
d = Drop(2000.0, 85, 125)
add(
    "ordinary: amplifier's own memory card, rate per second and channels numbered",
    "MEAS DATA\nSPEED 2000 S/s\nCH01=FORCE,N\nCH02=POSITION,mm\nCH01,CH02\n" + d.fx(),
    d,
    options={"channels": {"force": {"column": "CH01", "unit": "N"}, "position": {"column": "CH02", "unit": "mm"}}},
)
d = Drop(60.0, 64, 126)
add(
    "ordinary: hours, minutes, seconds with two decimals at sixty a second",
    "Time;Load, N;Crosshead, mm\n"
    + d.rows(lambda i: f"{(START + timedelta(seconds=i / 60)).strftime('%H:%M:%S.%f')[:-2]};{d.f(i)};{d.x(i)}"),
    d,
    atol_time=2e-4,
)
d = Drop(4000.0, 88, 127)
add(
    "ordinary: a board's microseconds between brackets of a monitor",
    "[08:05:59] connected\nus;N;mm\n" + d.rows(lambda i: f"{81234500 + 250 * i};{d.f(i)};{d.x(i)}"),
    d,
    options={"columns": ["t [us]", "force [N]", "position [mm]"]},
)
d = Drop(1000.0, 90, 128)
add(
    "ordinary: everything in quotes, decimal commas between commas",
    '"Zeit [s]","Kraft [N]","Weg [mm]"\n'
    + d.rows(lambda i: ",".join(f'"{de(c)}"' for c in (d.t(i, 3), d.f(i), d.x(i)))),
    d,
)
d = Drop(200.0, 68, 129)
add(
    "ordinary: a calibration certificate named above, values corrected already",
    "Kraftmessdose: C2 #20417, Kalibrierschein 2024-1182 vom 11.06.2024\nTara durchgeführt\nZeit [s];Kraft [N];Weg [mm]\n"
    + d.tfx(";", de),
    d,
)
d = Drop(300.0, 72, 130)
add(
    "ordinary: names of the channels in Polish, a comment at the end",
    "Próba: 22\nOperator: Wójcik\nCzas [s];Siła [N];Przemieszczenie [mm]\n"
    + d.rows(lambda i: de(f"{d.time[i]:.7f};{d.f(i)};{d.x(i)}"))
    + "Koniec pomiaru\n",
    d,
    encoding="cp1250",
    atol_time=1e-6,
)

d = Drop(500.0, 90, 131)
add(
    "nasty: pushed or pulled in a column of words, numbers without signs",
    "time [s],mode,force [N],position [mm]\n"
    + d.rows(lambda i: f"{d.t(i)},{'PULL' if d.force[i] >= 18 else 'PUSH'},{abs(d.force[i] - 18):.3f},{d.x(i)}"),
    d,
    force=d.force - 18,
    refused="mode",
)
d = Drop(500.0, 90, 132)
add(
    "nasty: the force's scale said by the user, another one of the position in the file",
    "position is printed divided by ten\ntime [s],force [N],position [mm]\n"
    + d.rows(lambda i: joined((d.t(i), d.f(i, 4, 0.5), d.x(i, 5, 0.1)))),
    d,
    options={"channels": {"force": {"column": "force [N]", "scale": "2"}}},
    refused="divided",
    remedy={
        "channels": {
            "force": {"column": "force [N]", "scale": "2"},
            "position": {"column": "position [mm]", "scale": "10"},
        }
    },
    rtol=1e-3,
)
d = Drop(500.0, 90, 133)
add(
    "nasty: a counter that begins anew, rate said by the user",
    "sample,force [N],position [mm]\n" + d.rows(lambda i: f"{i % 50},{d.f(i)},{d.x(i)}"),
    d,
    options={"rate": 500.0},
    refused="sample",
)
d = Drop(100.0, 90, 134)
add(
    "nasty: every tenth sample kept",
    "Sampling rate: 1000 Hz, every 10th sample logged\nforce [N],position [mm]\n" + d.fx(),
    d,
    refused="10th",
    remedy={"rate": 100.0},
)
d = Drop(1000.0, 90, 135)
add(
    "nasty: another rate from a row on, rate said by the user",
    "force [N];position [mm]\n" + d.rows(lambda i: f"{d.f(i)};{d.x(i)}" + ("\n# from here 500 Hz" if i == 44 else "")),
    d,
    options={"rate": 1000.0},
    time=np.append(d.time[:45], d.time[44] + np.arange(1, 46) / 500.0),
    refused="500 Hz",
)
d = Drop(100.0, 90, 136)
add(
    "nasty: kilonewtons in the heading, newtons below it",
    "Time [s],Force [kN],Position [mm]\ns,N,mm\n" + d.tfx(),
    d,
    refused="kN",
    remedy={"units": {"force": "N"}},
)
d = Drop(100.0, 90, 137)
add(
    "nasty: cells that a sheet was too narrow for",
    "Time [s];Force [N];Position [mm]\n"
    + d.rows(lambda i: f"{d.t(i)};{'########' if i in (20, 21) else d.f(i)};{d.x(i)}"),
    d,
)
d = Drop(200.0, 90, 138)
add(
    "nasty: minus signs behind the numbers",
    "Time [s];Force [N];Position [mm]\n"
    + d.rows(lambda i: f"{d.t(i)};{d.f(i)};{abs(d.position[i]):.4f}{'-' if d.position[i] < 0 else ''}"),
    d,
    refused="-",
)
d = Drop(400.0, 90, 139)
add(
    "nasty: counts in hexadecimal digits",
    "t [ms];force [N];adc\n"
    + d.rows(lambda i: f"{d.t(i, 1, 1000)};{d.f(i)};0x{round(d.position[i] * 1000) & 0xFFFF:04X}"),
    d,
    options={"channels": {"position": {"column": "adc", "scale": "1 um"}}},
    refused="adc",
)
d = Drop(1000.0, 90, 140)
add(
    "nasty: a counter that counts down, rate said by the user",
    "remaining,force [N],position [mm]\n"
    + "".join(reversed(d.rows(lambda i: f"{i},{d.f(i)},{d.x(i)}").splitlines(True))),
    d,
    options={"rate": 1000.0},
    refused="remaining",
)
assert len(MOTION_CAPTURE_AND_CONTROLLERS) == 40
