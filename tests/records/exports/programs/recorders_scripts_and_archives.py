"""Whole files of recorders, controllers, boards, scripts, sheets and archives, each with a drop of its own."""

from __future__ import annotations

import gzip
import json
from datetime import datetime, timedelta
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de, joined
from tests.records.exports.containers import hdf5, parquet, sheet, zipped
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

RECORDERS_SCRIPTS_AND_ARCHIVES = Kind()


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    RECORDERS_SCRIPTS_AND_ARCHIVES.add(name, content, **drop.truth(**more))


d = Drop(800.0, 78, 20)
add(
    "ordinary: keys and values above, no times",
    "logger=DT9837\nsampling_rate=800 Hz\nchannels=2\nch1=force\nch1_unit=N\nch2=position\nch2_unit=mm\noperator=kv\n[data]\n"
    "force,position\n" + d.fx(),
    d,
    options={"units": {"force": "N", "position": "mm"}},
)
d = Drop(3000.0, 90, 21)
add(
    "ordinary: gzip of a table under percent signs",
    gzip.compress(
        (
            "% drop 12, rope R17\n% fs = 3 kHz\n% columns: force [N], position [mm]\nforce [N];position [mm]\n"
            + d.fx(";")
        ).encode()
    ),
    d,
    suffix=".csv.gz",
)
d = Drop(250.0, 65, 22)
add(
    "ordinary: a sheet with settings above the table",
    sheet(
        [
            ["Drop test", None, None],
            ["Date", datetime(2024, 5, 14), None],
            ["Rope", "R17-3", None],
            [None, None, None],
            ["Time", "Force", "Position"],
            ["ms", "N", "mm"],
            *([float(1000 * d.time[i]), float(d.force[i]), float(d.position[i])] for i in range(d.n)),
        ]
    ),
    d,
    suffix=".xlsx",
)
d = Drop(1000.0, 77, 23)
add(
    "ordinary: Parquet with stamps in nanoseconds",
    parquet(
        {
            "timestamp": np.datetime64("2024-05-14T10:22:31", "ns")
            + (np.arange(d.n) * 1000000).astype("timedelta64[ns]"),
            "force": d.force,
            "position": d.position,
        },
        {"force": {"unit": "N"}, "position": {"unit": "mm"}},
    ),
    d,
    suffix=".parquet",
)
d = Drop(2000.0, 81, 24)
add(
    "ordinary: HDF5 with groups, unit attributes and a rate of the file",
    hdf5(
        {"rig/force": d.force, "rig/position": d.position.astype("f8") * 1e-3},
        {"rig/force": "N", "rig/position": "m"},
        key="unit",
        sampling_rate=2000.0,
        operator="kv",
    ),
    d,
    suffix=".h5",
)
d = Drop(200.0, 61, 25)
add(
    "ordinary: one object a line, units in the names",
    d.rows(
        lambda i: json.dumps(
            {"t_ms": round(1000 * d.time[i], 3), "force_N": d.force[i], "position_mm": d.position[i], "ok": True}
        )
    ),
    d,
    suffix=".jsonl",
)
d = Drop(1600.0, 68, 26)
add(
    "ordinary: Excel's Unicode text, German",
    "Zeit [s]\tKraft [N]\tWeg [mm]\r\n" + d.tfx("\t", de, "\r\n"),
    d,
    encoding="utf-16",
    suffix=".txt",
    atol_time=1e-6,
)
d = Drop(400.0, 79, 27)
add(
    "ordinary: Czech, row numbers and a separator at the end",
    "Zkouška;pád 10 mm;;;\nObsluha;Novák;;;\nČ.;Čas [s];Síla [N];Poloha [mm];\n"
    + d.rows(lambda i: de(f"{i + 1};{d.t(i)};{d.f(i)};{d.x(i)};"), "\r\n"),
    d,
    encoding="cp1250",
)
d = Drop(100.0, 73, 28)
START = datetime(2024, 5, 14, 10, 22, 31)
add(
    "ordinary: stamps with an offset of the clock",
    "timestamp,force [N],position [mm]\n"
    + d.rows(
        lambda i: (
            f"{(START + timedelta(milliseconds=10 * i)).isoformat(timespec='milliseconds')}+02:00,{d.f(i)},{d.x(i)}"
        )
    ),
    d,
)
d = Drop(20.0, 64, 29)
add(
    "ordinary: TOA5, four rows of headings",
    '"TOA5","CR1000X","CR1000X","8842","CR1000X.Std.05.02","CPU:drop.CR1X","1234","Drop"\n"TIMESTAMP","RECORD","Force","Position"\n'
    '"TS","RN","N","mm"\n"","","Smp","Smp"\n'
    + d.rows(
        lambda i: (
            f'"{str(START + timedelta(milliseconds=50 * i))[:22].ljust(22, "0") if (50 * i) % 1000 else START + timedelta(milliseconds=50 * i)}",{i},{d.f(i)},{d.x(i)}'
        )
    ),
    d,
    suffix=".dat",
)
d = Drop(1000.0, 82, 30)
add(
    "ordinary: pandas with an index without a name",
    ",t_s,force_N,pos_mm\n" + d.rows(lambda i: joined((i, d.time[i], d.force[i], d.position[i]))),
    d,
)
d = Drop(125.0, 67, 31)
add(
    "ordinary: a board's milliseconds, messages of its start above",
    "ets Jul 29 2019 12:21:46\nrst:0x1 (POWERON_RESET),boot:0x13\nHX711 ready\nmillis\tforce_N\tpos_mm\n"
    + d.rows(lambda i: f"{4512 + 8 * i}\t{d.f(i)}\t{d.x(i)}"),
    d,
    suffix=".log",
)
d = Drop(100.0, 80, 32)
add(
    "ordinary: Graphtec, settings of channels above, clock and milliseconds apart",
    "Vendor,GRAPHTEC Corporation\nModel,GL980\nVersion,Ver1.20\nSampling interval,10ms\nTotal data points,80\n"
    "Start time,2024/05/14,10:22:31\nEnd time,2024/05/14,10:22:31\nTrigger Time,2024/05/14,10:22:31\n\nAMP settings\n"
    'CH,Signal name,Input,Range,Filter,Span\nCH1,"Force",DC,10V,Off,+500.0,+0.0,N\nCH2,"Position",DC,10V,Off,+50.0,+0.0,mm\n\nData\n'
    "Number,Date&Time,ms,CH1,CH2\nNO.,Time,ms,N,mm\n"
    + d.rows(lambda i: f"{i + 1},2024/05/14 10:22:31,{10 * i:3d},{d.force[i]:+.3f},{d.position[i]:+.4f}"),
    d,
    options={"channels": {"force": "CH1", "position": "CH2"}},
)
d = Drop(2000.0, 84, 33)
add(
    "ordinary: HiCorder, quoted lines above quoted headings",
    '"File name","0001.CSV"\n"Title comment",""\n"Trigger Time","\'24-05-14 10:22:31.001"\n"Sampling","500us"\n\n'
    '"Time","U1-1[N]","U1-2[mm]"\n' + d.rows(lambda i: f"{d.time[i] - 0.01:.9E},{d.f(i)},{d.x(i)}"),
    d,
    options={"channels": {"force": "U1-1[N]", "position": "U1-2[mm]"}, "units": {"Time": "s"}},
)
d = Drop(1000.0, 76, 34)
add(
    "ordinary: TwinCAT Scope, a column of milliseconds for each symbol",
    "Name\tScope Project\nFile\tC:\\Scope\\drop17.svdx\nStartTime\t133601557511230000\t14.05.2024 10:22:31\n"
    "EndTime\t133601557511990000\t14.05.2024 10:22:31\n\nName\tForce\tName\tPosition\nSymbolName\tMAIN.fForce\tSymbolName\tMAIN.fPos\n"
    "NetId\t5.24.2.1.1.1\tNetId\t5.24.2.1.1.1\nPort\t851\tPort\t851\nSampleTime[ms]\t1\tSampleTime[ms]\t1\nData-Type\tREAL64\tData-Type\tREAL64\n"
    "Offset\t0\tOffset\t0\nScaleFactor\t1\tScaleFactor\t1\nUnit\tN\tUnit\tmm\n\n"
    + d.rows(lambda i: f"{i}\t{d.f(i)}\t{i}\t{d.x(i)}"),
    d,
)
d = Drop(1000.0, 71, 35)
add(
    "ordinary: LabChart, interval above, commas in numbers",
    "Interval=\t0,001 s\nExcelDateTime=\t4,5426432318287e+04\t14.05.2024 10:22:31,123\nTimeFormat=\tStartOfBlock\nDateFormat=\t\n"
    "ChannelTitle=\tForce\tPosition\nRange=\t10,000 V\t10,000 V\nUnitName=\tN\tmm\nTopValue=\t500,000\t50,000\nBottomValue=\t-500,000\t-50,000\n"
    + d.rows(lambda i: de(f"{d.t(i, 3)}\t{d.f(i)}\t{d.x(i)}")),
    d,
    suffix=".txt",
)
d = Drop(2000.0, 74, 36)
add(
    "ordinary: AcqKnowledge, step, names and units one a line",
    "drop17.acq\n0.5 msec/sample\n2 channels\nForce\nN\nPosition\nmm\nCH1\tCH2\n74\t74\n" + d.fx("\t"),
    d,
    suffix=".txt",
    options={"channels": {"force": "CH1", "position": "CH2"}, "units": {"CH1": "N", "CH2": "mm"}},
)

d = Drop(2000.0, 63, 37)
add(
    "ordinary: DIAdem, labels of the header's rows in a first column",
    "Name;Time;Force;Position\nUnit;s;N;mm\nDescription;;Load cell above;Laser below\nLength;63;63;63\n"
    + d.rows(lambda i: f";{d.t(i)};{d.f(i)};{d.x(i)}"),
    d,
)
d = Drop(500.0, 90, 38)
add(
    "ordinary: zip of a table and a picture, kilonewtons with three decimals more",
    zipped(
        {
            "run17/plot.png": b"\x89PNG\r\n\x1a\n" + bytes(40),
            "run17/data.csv": (
                "Time [s];Load [kN];Stroke [mm]\n" + d.rows(lambda i: f"{d.t(i)};{d.f(i, 6, 1e-3)};{d.x(i)}")
            ).encode(),
        }
    ),
    d,
    suffix=".zip",
)
d = Drop(1000.0, 87, 39)
add(
    "ordinary: OpenDAQ log under hash signs, names and units in two remarks",
    "# device: ADS1256 board 3\n# rate: 1000 sps\n# time force position\n# s N mm\n" + d.tfx(" "),
    d,
    suffix=".dat",
)
d = Drop(60.0, 70, 40)
add(
    "ordinary: minutes, pounds and inches under headings in capitals",
    "ELAPSED TIME (min),LOAD (lbf),EXTENSION (in)\n"
    + d.rows(
        lambda i: joined(
            (f"{d.time[i] / 60:.9f}", f"{d.force[i] / 4.4482216152605:.9f}", f"{d.position[i] / 25.4:.9f}")
        )
    ),
    d,
    rtol=1e-5,
    atol_time=1e-6,
)
assert len(RECORDERS_SCRIPTS_AND_ARCHIVES) == 21
