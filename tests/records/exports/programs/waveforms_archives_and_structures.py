"""Waveforms of LabVIEW, keys, archives, sheets, Parquet, HDF5, JSON lines, structures of MATLAB and blocks of catman."""

from __future__ import annotations

import gzip
import json
from datetime import datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de
from tests.records.exports.containers import hdf5, parquet, sheet, zipped
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

WAVEFORMS_ARCHIVES_AND_STRUCTURES = Kind()
START = datetime(2024, 11, 5, 9, 14, 3, 555000)


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    WAVEFORMS_ARCHIVES_AND_STRUCTURES.add(name, content, **drop.truth(**more))


d = Drop(1000.0, 80, 201)
add(
    "ordinary: LVM, an X column before each channel, segments with units",
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t.\nMulti_Headings\tYes\n"
    "X_Columns\tMulti\nTime_Pref\tRelative\nOperator\tlab\nDate\t2024/11/05\nTime\t09:14:03.5551232\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\t\nSamples\t80\t\t80\t\nDate\t2024/11/05\t\t2024/11/05\t\nTime\t09:14:03.5551232\t\t09:14:03.5551232\t\n"
    "Y_Unit_Label\tNewtons\t\tmm\t\nX_Dimension\tTime\t\tTime\t\nX0\t0.0000000000000000E+0\t\t0.0000000000000000E+0\t\n"
    "Delta_X\t1.000000E-3\t\t1.000000E-3\t\n***End_of_Header***\t\t\t\t\nX_Value\tForce\tX_Value\tPosition\tComment\n"
    + d.rows(lambda i: f"{d.t(i)}\t{d.f(i, 6)}\t{d.t(i)}\t{d.x(i, 6)}\t"),
    d,
    suffix=".lvm",
    options={"units": {"force": "N"}},
)
d = Drop(500.0, 75, 202)


def stamp(i: int, drop: Drop, form: str = "%d/%m/%Y %H:%M:%S.%f", cut: int = 3) -> str:
    said = (START + timedelta(seconds=float(drop.time[i]))).strftime(form)
    return said[:-cut] if cut else said


add(
    "ordinary: waveforms written to a spreadsheet file, a clock before each",
    f"waveform\t[0]\t\t[1]\t\nt0\t{stamp(0, d)}\t\t{stamp(0, d)}\t\ndelta t\t0.002000\t\t0.002000\t\n\ntime[0]\tY[0]\ttime[1]\tY[1]\n"
    + d.rows(lambda i: f"{stamp(i, d)}\t{d.force[i]:.6E}\t{stamp(i, d)}\t{d.position[i]:.6E}"),
    d,
    suffix=".txt",
    options={"channels": {"force": "Y[0]", "position": "Y[1]"}, "units": {"force": "N", "position": "mm"}},
)
d = Drop(2000.0, 80, 203)
add(
    "ordinary: lists of names and units behind keys",
    "TestName=Drop 12\nOperator=KB\nSampleRate=2000\nChannels=Force,Position\nUnits=N,mm\nSamples=80\n[Data]\n"
    + d.fx(),
    d,
    suffix=".dat",
)
d = Drop(400.0, 82, 204)
add(
    "ordinary: numbered channels behind keys",
    "; FieldLog 2.11\nStart=2024-11-05T09:14:03\nRate=400 Hz\nCh1.Name=Zugkraft\nCh1.Unit=N\nCh2.Name=Weg\nCh2.Unit=mm\nData=\n"
    + d.fx(";", de),
    d,
)
d = Drop(1250.0, 88, 205)
add(
    "ordinary: gzip of a text with tabs",
    gzip.compress(("# run 12, 2024-11-05\n#time(s)\tforce(N)\tpos(mm)\n" + d.tfx("\t")).encode()),
    d,
    suffix=".txt.gz",
)
d = Drop(1000.0, 70, 206)
add(
    "ordinary: zip with a log and a picture",
    zipped(
        {
            "run12/run12.csv": (
                "Time (ms),Force (N),Position (mm)\n" + d.rows(lambda i: f"{i},{d.f(i)},{d.x(i)}")
            ).encode(),
            "run12/run12.log": b"09:14:03 armed\n09:14:05 triggered\n09:14:06 saved 70 rows\n",
            "run12/run12.png": b"\x89PNG\r\n\x1a\n" + bytes(64),
        }
    ),
    d,
    suffix=".zip",
)
d = Drop(100.0, 66, 207)
add(
    "ordinary: sheet with a title, a date and a row of units",
    sheet(
        [
            ["Fallversuch 12", None, None],
            ["Datum", START, None],
            [None, None, None],
            ["Zeit", "Kraft", "Weg"],
            ["s", "N", "mm"],
            *([float(d.time[i]), float(d.force[i]), float(d.position[i])] for i in range(66)),
        ]
    ),
    d,
    suffix=".xlsx",
)
d = Drop(200.0, 60, 208)
add(
    "ordinary: sheet with a list of settings before it, table from the second column on",
    sheet(
        [
            [None, "No.", "t [ms]", "F [N]", "x [mm]"],
            *([None, i + 1, i * 5, float(d.force[i]), float(d.position[i])] for i in range(60)),
        ],
        [["Software", "RigControl 4.2"], ["Rate [Hz]", 200], ["Operator", "KB"], ["Samples", 60]],
    ),
    d,
    suffix=".xlsx",
)
d = Drop(2000.0, 90, 209)
add(
    "ordinary: Parquet with units of the fields, an index and a column of states",
    parquet(
        {
            "__index_level_0__": np.arange(90),
            "timestamp": np.int64(1730798043555000000) + np.arange(90, dtype=np.int64) * 500000,
            "load": d.force,
            "stroke": d.position,
            "state": np.array(["run"] * 90),
        },
        {"timestamp": {"unit": "ns"}, "load": {"unit": "N"}, "stroke": {"unit": "mm"}},
    ),
    d,
    suffix=".parquet",
    options={"channels": {"force": "load", "position": "stroke"}},
    atol_time=2e-7,  # a double holds ns since 1970 to 128 ns
)
d = Drop(5000.0, 100, 210)
add(
    "ordinary: HDF5, a group of measured data with units, rate and operator",
    hdf5(
        {"run_12/force": d.force, "run_12/displacement": d.position},
        {"run_12/force": "N", "run_12/displacement": "mm"},
        "unit",
        sampling_rate=5000.0,
        operator="KB",
        created="2024-11-05T09:14:03",
        software_version="1.4.2",
    ),
    d,
    suffix=".h5",
)
d = Drop(50.0, 64, 211)
add(
    "ordinary: JSON lines, a device, stamps from 1970 in ms",
    d.rows(
        lambda i: json.dumps(
            {
                "dev": "rig-7",
                "ts": 1730798043555 + 20 * i,
                "force_N": float(d.force[i]),
                "position_mm": float(d.position[i]),
                "batt": 3.91,
            }
        )
    ),
    d,
    suffix=".jsonl",
)
d = Drop(100.0, 61, 212)
add(
    "ordinary: JSON lines, values with their units inside",
    d.rows(
        lambda i: json.dumps(
            {
                "time": (START + timedelta(milliseconds=10 * i)).isoformat(timespec="milliseconds") + "Z",
                "force": {"value": float(d.force[i]), "unit": "N"},
                "position": {"value": float(d.position[i]), "unit": "mm"},
            }
        )
    ),
    d,
    suffix=".jsonl",
)
d = Drop(1000.0, 77, 213)
add(
    "ordinary: ControlDesk, keys in the first column and values of the traces below",
    "format_version,1.0,,\ngenerator,ControlDesk 7.5,,\ndate,11/05/2024 09:14:03,,\nsample_time,0.001,,\n"
    'name,Time,"Model Root/Load Cell/F","Model Root/Encoder/x"\nunit,s,N,mm\ndescription,,,\ntrace_values,,,\n'
    + d.rows(lambda i: f",{d.t(i)},{d.f(i)},{d.x(i)}"),
    d,
    options={"channels": {"force": "Model Root/Load Cell/F", "position": "Model Root/Encoder/x"}},
)
d = Drop(1000.0, 84, 214)


def structure(drop: Drop) -> Any:
    def write(path: Path) -> None:
        from scipy.io import savemat

        x = {"Name": "Time", "Type": 4, "Data": drop.time, "Unit": "s", "Raster": "HostService"}
        named = (("F", "N", drop.force), ("x", "mm", drop.position))
        y = [
            {
                "Name": n,
                "Type": 4,
                "Data": v,
                "Unit": u,
                "XIndex": 1,
                "Raster": "HostService",
                "Path": f"Model Root/{n}",
            }
            for n, u, v in named
        ]
        savemat(
            path,
            {
                "rec12": {
                    "X": x,
                    "Y": np.array(y, dtype=object),
                    "Description": {"General": "drop"},
                    "RTProgram": "rig.sdf",
                }
            },
        )

    return write


add("ordinary: structure of a recorder, X and a list of Y with names and units", structure(d), d, suffix=".mat")
d = Drop(300.0, 81, 215)
add(
    "ordinary: catman, default rate, commas, tabs",
    "Zeit  1 - Standardmessrate [s]\tKraft_U9C [N]\tWeg_WA20 [mm]\n" + d.tfx("\t", de),
    d,
    suffix=".asc",
    encoding="cp1252",
    atol_time=1e-6,
)
d = Drop(500.0, 79, 216)
add(
    "ordinary: catman, blocks of each channel in rows",
    "HBM_CATMAN_DATAFILE_40\nT0 = 05.11.2024 09:14:03\nKanalanzahl\t3\nWerte\t79\n\n"
    "Zeit  1 - Standardmessrate\tMX840A_CH 1\tMX840A_CH 2\ndt = 2 ms\tdt = 2 ms\tdt = 2 ms\n05.11.2024 09:14:03\t05.11.2024 09:14:03\t05.11.2024 09:14:03\n"
    "s\tN\tmm\n" + d.tfx("\t", de),
    d,
    suffix=".asc",
    encoding="cp1252",
    options={"channels": {"force": "MX840A_CH 1", "position": "MX840A_CH 2"}},
)
assert len(WAVEFORMS_ARCHIVES_AND_STRUCTURES) == 16
