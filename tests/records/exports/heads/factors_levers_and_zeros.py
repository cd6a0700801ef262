"""Heads that tell operator, sensor and specimen, and heads with factors, levers, zeros, signs and rates that bear on the numbers."""

from __future__ import annotations

import json

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.boxes import told
from tests.records.exports.containers import parquet, sheet
from tests.records.exports.programs.workbooks_and_binary_files import mat

FACTORS_LEVERS_AND_ZEROS = Kind()
add = FACTORS_LEVERS_AND_ZEROS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
#: Of a force that is half of what it should be, and what is to be said then.
HALVED = lines(lambda i: f"{t(i)},{FORCE[i] / 2:.4f},{u(i)}")
TWICE = {"remedy": {"channels": {"force": {"column": "force [N]", "scale": "2"}}}}

# Ordinary: what any engineer reads without a doubt.
add(
    "Qualisys, analog board",
    "FILE_VERSION\t2.0.0\nTOT_NO_OF_CHAN\t2\nTIME_STAMP\t2024-05-12, 14:22:11\t1520.25\nDATA_INCLUDED\tANALOG\n"
    "CHANNEL_GAIN\t1\t1\nSample\tTime [s]\tForce [N]\tPosition [mm]\n" + lines(lambda i: f"{i + 1}\t{tfu(chr(9))(i)}"),
)
add(
    "DEWESoft, events above",
    "Data info\nFile name: drop.dxd\nStart time: 12.05.2024 14:22:11.351\nSample rate: 2000 Hz\nNumber of channels: 2\n\n"
    "Events\nEvent Type\tEvent\tTime\nStart\tStoring started\t0.000\n\nData\nTime (s)\tForce (N)\tTravel (mm)\n"
    + lines(tfu("\t")),
)
add(
    "a bench of a school, remarks below",
    HEAD + lines(tfu()) + "\nOperator: Novak\nSpecimen: PA6 cord, 2.5 m, 3.2 mm\nHumidity 45 %, 22.5 degC\n",
)
add(
    "sensor and amplifier told",
    "Sensor: HBM U9C/500N, sensitivity 1 mV/V\nAmplifier: Spider8, filter 500 Hz Bessel\nExcitation: 5 V\n"
    + HEAD
    + lines(tfu()),
)
add(
    "calibrated in June",
    "Last calibration: 12.06.2023, certificate 4711, next due 06/2025\nCalibrated by: ZMK\n" + HEAD + lines(tfu()),
)
add("a range and a limit", "Measuring range: +/-500 N\nOverload limit: 750 N\n" + HEAD + lines(tfu()))
add(
    "conditions of a drop",
    "Mass: 2.5 kg\nDrop height: 10 mm\nInclination: 90 deg\nPretension: 5 N\nTest speed: 100 mm/min\n"
    + HEAD
    + lines(tfu()),
)
add(
    "a German tester",
    "Prüfprotokoll;Nr. 17\nPrüfer;Meier\nVorkraft;2;N\nPrüfgeschwindigkeit;50;mm/min\nTemperatur;23,5;°C\n\nZeit;Kraft;Weg\ns;N;mm\n"
    + lines(tfu(";", de)),
)
add("zeroed before the test", "Load cell zeroed before test (offset removed: 3.21 N)\n" + HEAD + lines(tfu()))
add(
    "force in kN, its largest told",
    "Peak force: 0.0157 kN\ntime [ms],force [kN],position [mm]\n"
    + lines(lambda i: f"{t(i, 1e3, 1)},{f(i, 1e-3, 6)},{u(i)}"),
)
add(
    "statistics below",
    HEAD + lines(tfu()) + f"Max,,{FORCE.max():.3f},{POSITION.max():.4f}\nMin,,{FORCE.min():.3f},{POSITION.min():.4f}\n",
)
add(
    "phyphox",
    '"Time (s)","Force (N)","Position (mm)"\n' + lines(lambda i: f"{TIME[i]:.9E},{FORCE[i]:.9E},{POSITION[i]:.9E}"),
)
add("Vernier", "Latest: Time (s)\tLatest: Force (N)\tLatest: Position (mm)\n" + lines(tfu("\t")))
add(
    "AcqKnowledge",
    "drop.acq\n0.5 msec/sample\n2 channels\nForce\nN\nTravel\nmm\nsec,CH1,CH2\n,60,60\n" + lines(tfu()),
    refused="heading|unit|channel",
    remedy={
        "channels": {"force": {"column": "CH1", "unit": "N"}, "position": {"column": "CH2", "unit": "mm"}},
        "units": {"time": "s"},
    },
)
add("pandas with an index", ",time_s,force_N,position_mm\n" + lines(lambda i: f"{i},{tfu()(i)}"))
add(
    "a microcontroller's millis and micros",
    "micros,force_mN,position_um\n" + lines(lambda i: f"{500 * i},{f(i, 1e3, 0)},{u(i, 1e3, 1)}"),
)
add(
    "xlsx, an info sheet of people and dates",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]"],
            *[[float(TIME[i]), float(FORCE[i]), float(POSITION[i])] for i in range(N)],
        ],
        [
            ["Operator", "Novak"],
            ["Date", "2024-05-12"],
            ["Sample rate [Hz]", 2000],
            ["Load cell", "500 N"],
            ["Mass [kg]", 2.5],
        ],
    ),
    suffix=".xlsx",
)
add(
    "HDF5, sensors told in attributes",
    told(
        {"time": TIME},
        time={"units": "s"},
        force={"sensor": "U9C", "range": 500.0, "serial": 4711, "cal_date": "2024-01-05"},
        file={"operator": "Novak", "mass_kg": 2.5, "comment": "third drop, new rope"},
    ),
    suffix=".h5",
)
add(
    "MATLAB, a structure of the set-up",
    mat(t=TIME, F_N=FORCE, x_mm=POSITION, setup={"mass": 2.5, "operator": "Novak", "g": 9.81}),
    suffix=".mat",
    refused="unit",
    options={"channels": {"time": "t"}},
    remedy={"units": {"t": "s"}},
)
add(
    "JSON, a head and rows",
    json.dumps(
        {
            "meta": {"rig": 3, "operator": "Novak", "mass_kg": 2.5},
            "data": [{"t_s": float(TIME[i]), "F_N": float(FORCE[i]), "x_mm": float(POSITION[i])} for i in range(N)],
        }
    ),
    suffix=".json",
)

# Nasty: something in the file bears on the numbers.
add("a factor in a line of its own", "Load multiplier: 2\n" + HEAD + HALVED, refused="multiplier", **TWICE)
add("a correction in per cent", "Force correction: +100 %\n" + HEAD + HALVED, refused="correction", **TWICE)
add("two strands", "Rope reeving 2:1, load cell on one strand\n" + HEAD + HALVED, refused="2:1|strand|reeving", **TWICE)
add("a lever", "Lever ratio 2\n" + HEAD + HALVED, refused="[Ll]ever", **TWICE)
add(
    "units per volt in a head",
    "CHANNEL 1\nUNITS: NEWTONS\nUNITS PER VOLT: 123.456\nZERO OFFSET: 2.5\nCHANNEL 2\nUNITS: MM\n"
    + HEAD
    + lines(tfu()),
    refused="OFFSET|PER VOLT",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "1"}}},
)
add(
    "a zero that was not taken off",
    "Zero reading: 3.210 N\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] + 3.21:.3f},{u(i)}"),
    refused="[Zz]ero",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "1"}}},
    force=FORCE + 3.21,
)
add(
    "a scale of a slow recorder below",
    HEAD + HALVED + "Scale factors: time 1, force 2, position 1\n",
    refused="[Ss]cale",
    **TWICE,
)
add("a row of factors without a word", "time [s],force [N],position [mm]\n1,2,1\n" + HALVED, refused="2", **TWICE)
add("a row of times signs", "time [s],force [N],position [mm]\n,x2,x1\n" + HALVED, refused="x2", **TWICE)
add(
    "sign told in a remark",
    "Note: force signal reversed (cell mounted upside down)\n"
    + HEAD
    + lines(lambda i: f"{t(i)},{-FORCE[i]:.3f},{u(i)}"),
    refused="reversed",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "-1"}}},
)
add(
    "inverted by a switch",
    "Invert CH1=ON\nCH1=force\n" + HEAD + lines(lambda i: f"{t(i)},{-FORCE[i]:.3f},{u(i)}"),
    refused="Invert",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "-1"}}},
)
add(
    "stored slower than sampled",
    "Sample rate: 8000 Hz\nStored at 2000 Hz\n" + FU + lines(fu()),
    refused="2000|8000",
    remedy={"rate": 2000.0},
)
add(
    "split between channels",
    "Sample rate 4000 Hz split between 2 channels\n" + FU + lines(fu()),
    refused="split|rate",
    remedy={"rate": 2000.0},
)
add(
    "a duration that is another",
    "Sample rate: 1000 Hz\nDuration: 0.03 s\n" + FU + lines(fu()),
    refused="Duration",
    remedy={"rate": 2000.0},
)
add(
    "the largest force is ten times as large",
    f"Fmax = {10 * FORCE.max():.2f} N\n" + HEAD + lines(tfu()),
    refused="Fmax",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "10"}}},
    force=10 * FORCE,
)
add(
    "a flag of bad readings",
    "time [s],force [N],position [mm],force valid\n"
    + lines(lambda i: f"{t(i)},0.000,{u(i)},0" if i in (20, 21) else f"{tfu()(i)},1"),
    refused="valid",
)
add(
    "a column of gains",
    "time [s],force [N],position [mm],gain\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 2:.4f},{u(i)},2"),
    refused="gain",
    remedy={
        "channels": {
            "force": {"column": "force [N]", "scale": "2"},
            "position": {"column": "position [mm]", "scale": "1"},
        }
    },
)
add(
    "xlsx, a scale on the info sheet",
    sheet(
        [
            ["Time [s]", "Force [N]", "Position [mm]"],
            *[[float(TIME[i]), float(FORCE[i] / 2), float(POSITION[i])] for i in range(N)],
        ],
        [["Operator", "Novak"], ["Force scaling", 2.0]],
    ),
    suffix=".xlsx",
    refused="scaling",
    remedy={"channels": {"force": {"column": "Force [N]", "scale": "2"}}},
)
add(
    "HDF5, a factor in words at the root",
    told({"time": TIME}, time={"units": "s"}, file={"comment": "force to be multiplied by 2"}),
    suffix=".h5",
    refused="multipl",
    remedy={"channels": {"force": {"column": "force", "scale": "2 N/N"}}},
    force=2 * FORCE,
)
add(
    "Parquet, a calibration of a field",
    parquet(
        {"time": TIME, "force": FORCE / 2, "position": POSITION},
        {"time": {"unit": "s"}, "force": {"unit": "N", "calibration_factor": "2.0"}, "position": {"unit": "mm"}},
    ),
    suffix=".parquet",
    refused="calibration",
    remedy={"channels": {"force": {"column": "force", "scale": "2"}}},
)
