"""Headings in many languages, rows of units, rates and clocks in words: what the reader had not met."""

from __future__ import annotations

import gzip
import json

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.containers import hdf5, parquet, sheet, zipped

MANY_LANGUAGES_AND_UNIT_ROWS = Kind()
add = MANY_LANGUAGES_AND_UNIT_ROWS.add
FU = "Force [N],Position [mm]\n"
HEAD = "Time [s]," + FU

# Text
add(
    "bars without edges, units in round brackets",
    "time (ms)|load (kN)|travel (µm)\n" + lines(lambda i: f"{t(i, 1e3, 1)}|{f(i, 1e-3, 6)}|{u(i, 1e3, 1)}"),
)
add("Turkish words", "Zaman [s];Kuvvet [N];Konum [mm]\n" + lines(tfu(";", de)))
add("Portuguese words", "Tempo (s);Força (N);Deslocamento (mm)\n" + lines(tfu(";", de)), encoding="cp1252")
add("Dutch words", "Tijd [s];Kracht [N];Verplaatsing [mm]\n" + lines(tfu(";", de)))
add("Swedish words", "Tid [s]\tKraft [N]\tLäge [mm]\n" + lines(tfu("\t", de)), encoding="cp1252")
add("Korean words", "시간 [s],하중 [N],변위 [mm]\n" + lines(tfu()))
add("units in the first row, names in the second", "[s],[N],[mm]\nT,Load,Disp\n" + lines(tfu()))
add("names, ids, units, blank", "Time,Load,Disp\n#1,#2,#3\n(s),(N),(mm)\n\n" + lines(tfu()))
add("units after two blanks", "Time  s;Force  N;Position  mm\n" + lines(tfu(";")))
add("a unit in the middle of the name", "Time [s] rel,Force [N] filtered,Position [mm] laser\n" + lines(tfu()))
add("kN and cm", "time_s,force_kN,position_cm\n" + lines(lambda i: f"{t(i)},{f(i, 1e-3, 6)},{u(i, 0.1, 5)}"))
add(
    "pound-force and inches",
    "Time (s),Load (lbf),Position (in)\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] / 4.4482216152605:.9f},{POSITION[i] / 25.4:.12f}"),
    rtol=1e-6,
)
add("a comment sign at the head of every line of the header", "* Rig 3\n* 2024-05-12\n" + HEAD + lines(tfu()))
add("an empty first line and a title", "\nDROP TEST 3\n\n" + HEAD + lines(tfu()))
add("a title with a number", "Test 12, run 3\n" + HEAD + lines(tfu()))
add("a date line of three numbers", "2024,5,12\n" + HEAD + lines(tfu()))
add("calibration numbers above", "Cal:,1.0,2.5,3.0\n" + HEAD + lines(tfu()), refused="Cal")
add("zero rows above the names", "0,0,0\n" + HEAD + lines(tfu()))
add("a status column of hex", "Time [s],Force [N],Position [mm],Flags\n" + lines(lambda i: f"{tfu()(i)},0x{i:04X}"))
add("a column of GPS text", "Time [s],Force [N],Position [mm],GPS\n" + lines(lambda i: f"{tfu()(i)},N48.2 E16.3"))
add(
    "tabs and a trailing comment column",
    "Time [s]\tForce [N]\tPosition [mm]\tRemark\n" + lines(lambda i: tfu("\t")(i) + ("\tstart" if i == 3 else "\t")),
)
add("decimal commas with a BOM and sep", "\ufeffsep=;\n" + "Zeit [s];Kraft [N];Weg [mm]\n" + lines(tfu(";", de)))
add("rows that begin with a blank", HEAD + lines(lambda i: " " + tfu(", ")(i)))
add("numbers with a plus", HEAD + lines(lambda i: f"{t(i)},{FORCE[i]:+.3f},{POSITION[i]:+.4f}"))
add("units in cells", HEAD + lines(lambda i: f"{t(i)} s,{f(i)} N,{u(i)} mm"), refused="no number|units in the heading")
add(
    "percent of full scale",
    "Time [s],Force [%],Position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 2:.4f},{u(i)}"),
    refused="unit|%",
    remedy={"channels": {"force": {"column": "Force [%]", "scale": "2 N/%"}}},
)
add(
    "force in grams",
    "Time [s],Load [gf],Position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 9.80665e-3:.6f},{u(i)}"),
    rtol=1e-6,
)
add(
    "load in kilograms",
    "Time [s],Load [kg],Position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 9.80665:.9f},{u(i)}"),
    refused="kg|unit",
    rtol=1e-6,
    remedy={"channels": {"force": {"column": "Load [kg]", "scale": "9.80665 N/kg"}}},
)
add(
    "two forces",
    "Time [s],Force A [N],Force B [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{f(i)},{u(i)}"),
    refused="could each be the force",
    remedy={"channels": {"force": "Force A [N]"}},
)
add(
    "raw and filtered",
    "Time [s],Force raw [N],Force [N],Position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{f(i)},{u(i)}"),
    refused="could each be the force.*as it was measured",
    remedy={"channels": {"force": "Force raw [N]"}},
)
add(
    "thousands in the force with decimals",
    "t [s];F [N];u [mm]\n"
    + lines(
        lambda i: (
            f"{de(t(i))};{1000 + FORCE[i]:,.2f}".replace(",", "X")
            .replace(".", ",")
            .replace("X", ".")
            .replace("0.", "0,", 1)
            + ";"
            + de(u(i))
        )
    ),
    refused="thousands|decimal|two",
)
add("counter called Index with a unit row", "Index,Time,Force,Position\n,s,N,mm\n" + lines(lambda i: f"{i},{tfu()(i)}"))
add("a channel called Sample [N]", "Time [s],Sample [N],Position [mm]\n" + lines(tfu()))
add(
    "scale line with sensitivities, decimals below", "Time,Force,Position\ns,N,mm\nSensitivity,2.1,0.5\n" + lines(tfu())
)

# Clocks and rates
add(
    "ISO with a comma",
    "Zeit;Kraft [N];Weg [mm]\n"
    + lines(lambda i: f"2024-05-12T14:22:{de(f'{11 + i / 2000:07.4f}')}+02:00;{de(f(i))};{de(u(i))}"),
)
add(
    "ISO with minus five hours",
    "time," + FU + lines(lambda i: f"2024-05-12T14:22:{11 + i / 2000:07.4f}-05:00,{fu()(i)}"),
)
add(
    "offset that changes sign",
    "time,"
    + FU
    + lines(
        lambda i: (
            (
                f"2024-03-31T00:59:{59.99 + i / 2000:.4f}+00:00"
                if i < 20
                else f"2024-03-31T02:00:{(i - 20) / 2000:07.4f}+01:00"
            )
            + f",{fu()(i)}"
        )
    ),
)
add(
    "date with dots, time with commas, two columns",
    "Datum;Uhrzeit;Kraft [N];Weg [mm]\n"
    + lines(lambda i: f"12.05.2024;14:22:{de(f'{11 + i / 2000:07.4f}')};{de(f(i))};{de(u(i))}"),
)
add(
    "day, month by name, short year",
    "Time," + FU + lines(lambda i: f"12 May 2024 14:22:{11 + i / 2000:07.4f},{fu()(i)}"),
)
add("unix_ms", "unix_ms," + FU + lines(lambda i: f"{1715523731000 + i * 0.5:.1f},{fu()(i)}"), atol_time=1e-6)
add("ts in us", "ts_us,force_N,pos_mm\n" + lines(lambda i: f"{1715523731000000 + i * 500},{fu()(i)}"), atol_time=1e-6)
add("time of day in s", "SecondsOfDay [s]," + FU + lines(lambda i: f"{51731 + i / 2000:.4f},{fu()(i)}"))
add("time that begins at a minus", "Time [ms]," + FU + lines(lambda i: f"{(i - 30) / 2:.1f},{fu()(i)}"))
for said, more in {
    "SAMPLE RATE (HZ): 2000": {},
    "Sampling Rate: 2.000,00 Hz": {},
    "Sample Frequency 2 kHz": {},
    "sampleRate: 2000.0": {},
    "Rate [S/s] 2000": {},
    "Samplerate = 2,0 kHz": {},
    "sampling_interval_us: 500": {},
    "Delta-t = 5e-4 s": {},
    "Ts: 0.5 ms": {},
    "Abtastintervall: 500 µs": {},
    "Abtastzeit: 0,5 ms": {},
    "Time/sample: 0.5 ms": {"refused": "rate"},
    "1/2000 s": {"refused": "rate"},
    "Filter: 200 Hz\nSampling: 2000 Hz": {},
    "Acquisition rate = 2 kS/s": {},
    "sample period = 500E-6": {},
    "2 kHz": {"refused": "rate"},
    "Samples: 60\nDuration: 0.03 s": {"refused": "rate"},
    "Sample rate: 2 000,0 Hz": {},
    "Sample rate = 2.000E+03 Hz": {},
    "Measuring rate: 2000 Hz": {},
    "Frequency: 2000 Hz": {"refused": "of something else"},
    "DAQ rate;2000;Hz": {},
}.items():
    add(f"rate: {said!r}", said + "\n" + FU + lines(fu()), remedy={"rate": 2000.0} if more else None, **more)
add("a length, not a step", "Acquisition time: 0.03 s\n" + FU + lines(fu()), refused="rate", remedy={"rate": 2000.0})
add(
    "the length of a recording",
    "Recording time,0.03,s\nLog period: 1 s\n" + FU + lines(fu()),
    refused="rate",
    remedy={"rate": 2000.0},
)
add("a step in German", "Zeitschritt: 0,5 ms\nKraft [N];Weg [mm]\n" + lines(fu(";", de)))
add("German file, 2.000 Hz", "Abtastrate: 2.000 Hz\nKraft [N];Weg [mm]\n" + lines(fu(";", de)))
add(
    "German file, 2,000 Hz",
    "Abtastrate: 2,000 Hz\nKraft [N];Weg [mm]\n" + lines(fu(";", de)),
    refused="2,000",
    remedy={"rate": 2000.0},
)

# Programs
add(
    "LabVIEW array to spreadsheet string",
    lines(tfu("\t")),
    suffix=".xls",
    refused="heading|columns",
    remedy={"columns": ("time [s]", "force [N]", "position [mm]")},
)
add(
    "NI DAQExpress",
    "Time Stamp,Force (N),Position (mm)\n" + lines(lambda i: f"05/12/2024 14:22:{11 + i / 2000:07.4f},{fu()(i)}"),
)
add(
    "NI with wf_ properties",
    "wf_start_time,12.05.2024\nwf_increment,0.0005\nwf_samples,60\nForce [N],Position [mm]\n" + lines(fu()),
)
add(
    "three interval rows",
    "Channel,Force,Position\nUnits,N,mm\nInterval (s),0.0005,0.0005\nLength,60,60\n" + lines(lambda i: "," + fu()(i)),
)
add("QuantumX assistant", "Time  1 - fast [s];Force;Position\n;[N];[mm]\n" + lines(tfu(";")))
add("dSPACE with unit in braces", "Time {s},Force {N},Position {mm}\n" + lines(tfu()))
add(
    "Yokogawa with BlockSize and VUnit of volts",
    "Model,DL350\nTraceName,CH1,CH2\nVUnit,V,V\nSampleRate,2.0E+03\n\n"
    + lines(lambda i: f",{FORCE[i] / 100:.6f},{POSITION[i] / 10:.6f}"),
    options={
        "channels": {
            "force": {"column": "CH1", "unit": "V", "scale": "100 N/V"},
            "position": {"column": "CH2", "unit": "V", "scale": "10 mm/V"},
        }
    },
    refused="heading|CH1|rate",
    rtol=1e-6,
)
add(
    "Keysight with a title row",
    "InfiniiVision,MSO-X 3024A\nx-axis,1,2\nsecond,Volt,Volt\n"
    + lines(lambda i: f"{i / 2000:+.6E},{FORCE[i] / 100:+.6E},{POSITION[i] / 10:+.6E}"),
    options={
        "channels": {"force": {"column": "1", "scale": "100 N/V"}, "position": {"column": "2", "scale": "10 mm/V"}}
    },
    rtol=1e-6,
)
add(
    "Tektronix with time and a trigger offset",
    "Model,TBS1104\nSample Interval,5.0E-4\nTrigger Point,30\n\nTIME,CH1\n"
    + lines(lambda i: f"{(i - 30) / 2000:.6E},{FORCE[i] / 100:.6f}"),
    options={"channels": {"force": {"column": "CH1", "unit": "V", "scale": "100 N/V"}}},
    position=None,
    rtol=1e-6,
)
add(
    "Rigol, volts in mV",
    "Time(s),CH1(mV),CH2(mV)\n" + lines(lambda i: f"{i / 2000:.6E},{FORCE[i] * 10:.4f},{POSITION[i] * 100:.4f}"),
    options={
        "channels": {
            "force": {"column": "CH1(mV)", "scale": "100 N/V"},
            "position": {"column": "CH2(mV)", "scale": "10 mm/V"},
        }
    },
    rtol=1e-6,
)
add(
    "Instron with units in quotes and decimal commas",
    '"Zeit";"Weg";"Kraft"\n"(s)";"(mm)";"(N)"\n' + lines(lambda i: f'"{de(t(i))}";"{de(u(i))}";"{de(f(i))}"'),
)
add("Shimadzu with a name row", '"Name","1 _ 1"\n"Time","Force","Stroke"\n"s","N","mm"\n' + lines(tfu()))
add("Speedgoat, time last", "Force [N],Position [mm],Time [s]\n" + lines(lambda i: f"{f(i)},{u(i)},{t(i)}"))
add(
    "two times, relative and absolute",
    "Timestamp,Elapsed [s],Force [N],Position [mm]\n"
    + lines(lambda i: f"2024-05-12 14:22:{11 + i / 2000:07.4f},{tfu()(i)}"),
)

# Counts, volts, containers
add(
    "amperes with an uncertain gain and no unit",
    "Time [s],I,x [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 2.07:.9f},{u(i)}"),
    options={"channels": {"force": {"column": "I", "scale": "2.07 +/- 0.29 N/A"}}},
    rtol=1e-7,
)
add(
    "counts with a negative step",
    "Time [s],F [N],enc [counts]\n" + lines(lambda i: f"{t(i)},{f(i)},{-POSITION[i] * 1e4:.0f}"),
    options={"channels": {"position": {"column": "enc", "scale": "-0.1 um"}}},
)
add(
    "ADC steps",
    "Time [s],adc [LSB],x [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] * 1e3:.0f},{u(i)}"),
    options={"channels": {"force": {"column": "adc", "scale": "1 mN"}}},
)
add(
    "gz of decimal commas",
    gzip.compress(("Zeit [s];Kraft [N];Weg [mm]\n" + lines(tfu(";", de))).encode("cp1252")),
    suffix=".txt.gz",
)
add(
    "zip with a text and a picture",
    zipped({"run.txt": (HEAD + lines(tfu())).encode(), "plot.png": b"\x89PNG"}),
    suffix=".zip",
)
add(
    "xlsx with times of day",
    sheet(
        [
            ["Time", "Force [N]", "Position [mm]"],
            *([f"14:22:{11 + i / 2000:07.4f}", float(FORCE[i]), float(POSITION[i])] for i in range(N)),
        ]
    ),
    suffix=".xlsx",
)
add(
    "Parquet with a duration",
    parquet({"t": (np.arange(N) * 500).astype("timedelta64[us]"), "force_N": FORCE, "position_mm": POSITION}),
    suffix=".parquet",
)
add(
    "HDF5 with units in kN",
    hdf5(
        {"time": TIME, "force": FORCE * 1e-3, "position": POSITION},
        {"time": "s", "force": "kN", "position": "mm"},
        "units",
    ),
    suffix=".h5",
)
add(
    "HDF5 with deep groups",
    hdf5(
        {"a/b/time": TIME, "a/b/force": FORCE, "a/b/position": POSITION},
        {"a/b/time": "s", "a/b/force": "N", "a/b/position": "mm"},
        "Units",
    ),
    suffix=".h5",
)
add(
    "JSON with a rate and lists",
    json.dumps(
        {"meta": {"sample_rate_hz": 2000}, "data": {"force_N": FORCE.tolist(), "position_mm": POSITION.tolist()}}
    ),
    suffix=".json",
)
add(
    "JSON lines with a unit object",
    "".join(
        json.dumps({"t_ms": float(t(i, 1e3, 1)), "force_N": float(f(i)), "pos_mm": float(u(i))}) + "\n"
        for i in range(N)
    ),
    suffix=".ndjson",
)
add(
    "key: value in rows",
    lines(lambda i: f"time: {t(i)}, force: {f(i)}, position: {u(i)}"),
    suffix=".log",
    options={"units": {"time": "s", "force": "N", "position": "mm"}},
)
