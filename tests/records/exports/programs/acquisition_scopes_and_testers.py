"""Whole files of acquisition software, scopes and testing machines, each with a drop, a rate and a length of its own."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de, joined, lines


class Drop:
    """A record of its own rate, length and numbers, and how it is printed."""

    def __init__(self, rate: float, n: int, seed: int, force: float = 20.0, position: float = 3.0) -> None:
        noise = np.random.default_rng(seed).normal(size=(2, n))
        self.n, self.rate, self.time = n, rate, np.arange(n) / rate
        ring = np.exp(-np.arange(n) / (0.6 * n)) * np.sin(0.21 * np.arange(n) + seed)
        self.force = np.round(force * (0.9 + 0.7 * ring) + 0.02 * force * noise[0], 3)
        self.position = np.round(position * (0.3 - ring) + 0.01 * position * noise[1], 4)

    def truth(self, **more: Any) -> dict[str, Any]:
        return {"time": self.time, "force": self.force, "position": self.position * 1e-3, **more}

    def t(self, i: int, digits: int = 6, scale: float = 1.0) -> str:
        return f"{self.time[i] * scale:.{digits}f}"

    def f(self, i: int, digits: int = 3, scale: float = 1.0) -> str:
        return f"{self.force[i] * scale:.{digits}f}"

    def x(self, i: int, digits: int = 4, scale: float = 1.0) -> str:
        return f"{self.position[i] * scale:.{digits}f}"

    def rows(self, make: Callable[[int], str], end: str = "\n") -> str:
        return lines(make, self.n, end)

    def tfx(self, separator: str = ",", form: Callable[[str], str] = str, end: str = "\n") -> str:
        return self.rows(lambda i: form(separator.join((self.t(i), self.f(i), self.x(i)))), end)

    def txf(self, separator: str = ",", form: Callable[[str], str] = str, end: str = "\n") -> str:
        return self.rows(lambda i: form(separator.join((self.t(i), self.x(i), self.f(i)))), end)

    def fx(self, separator: str = ",", form: Callable[[str], str] = str, end: str = "\n") -> str:
        return self.rows(lambda i: form(separator.join((self.f(i), self.x(i)))), end)


ACQUISITION_SCOPES_AND_TESTERS = Kind()


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    ACQUISITION_SCOPES_AND_TESTERS.add(name, content, **drop.truth(**more))


VOLTS = {"force": ("10 N/V", 0.1), "position": ("2 mm/V", 0.5)}


def volts(force: str, position: str) -> dict[str, Any]:
    return {
        "channels": {
            "force": {"column": force, "unit": "V", "scale": "10 N/V"},
            "position": {"column": position, "unit": "V", "scale": "2 mm/V"},
        }
    }


d = Drop(1000.0, 90, 1)
add(
    "ordinary: DAQExpress, a column of times before each channel",
    '"Time (s)","Load cell (N)","Time (s)","Laser position (mm)"\r\n'
    + d.rows(lambda i: joined((d.t(i), d.f(i), d.t(i), d.x(i))), "\r\n"),
    d,
)
d = Drop(5000.0, 120, 2)
add(
    "ordinary: SignalExpress, names, starts and steps in blocks",
    "channel names:\nForce (N)\tPosition (mm)\nstart times:\n5/14/2024 10:22:31.123456\t5/14/2024 10:22:31.123456\n"
    "dt:\n0.000200\t0.000200\ndata:\n" + d.fx("\t"),
    d,
    suffix=".txt",
)
d = Drop(500.0, 75, 3)
add(
    "ordinary: LVM with one X column, commas and unit labels",
    "LabVIEW Measurement\t\nWriter_Version\t2\nReader_Version\t2\nSeparator\tTab\nDecimal_Separator\t,\nMulti_Headings\tNo\n"
    "X_Columns\tOne\nTime_Pref\tAbsolute\nOperator\tlab3\nDate\t2024/05/14\nTime\t10:22:31,1234567\n***End_of_Header***\t\n\t\n"
    "Channels\t2\t\t\nSamples\t75\t75\t\nDate\t2024/05/14\t2024/05/14\t\nTime\t10:22:31,1234567\t10:22:31,1234567\t\n"
    "Y_Unit_Label\tN\tmm\t\nX_Dimension\tTime\tTime\t\nX0\t0,0000000000000000E+0\t0,0000000000000000E+0\t\n"
    "Delta_X\t0,002000\t0,002000\t\n***End_of_Header***\t\t\t\nX_Value\tForce\tPosition\tComment\n"
    + d.rows(lambda i: de(f"{d.t(i)}\t{d.f(i)}\t{d.x(i)}\t")),
    d,
    suffix=".lvm",
)
d = Drop(1200.0, 100, 4)
add(
    "ordinary: catman, channel blocks in one row each",
    "DATEI=D:\\Messdaten\\Seil_17.asc\nT0 = 14.05.2024 10:22:31\nKanäle = 3\nLänge = 100\n\n"
    "Zeit  1 - Standard-Messrate\tKraft oben\tWeg Laser\ns\tN\tmm\n"
    "SR=1200 Hz\tSR=1200 Hz\tSR=1200 Hz\nT0=0\tT0=0\tT0=0\n" + d.tfx("\t", de),
    d,
    encoding="cp1252",
    suffix=".asc",
    atol_time=1e-6,
)
d = Drop(2500.0, 80, 5)
add(
    "ordinary: ControlDesk, labels in a first column",
    "file_type,csv_export\nversion,2\ngenerated_by,ControlDesk 7.6\nrecording_start,2024-05-14T10:22:31\n\n"
    'type,x_axis,y_axis,y_axis\npath,,"Model Root/DS1104ADC_C5/Force","Model Root/Enc/Position"\nunit,s,N,mm\ntrace_values,,,\n'
    + d.rows(lambda i: joined(("", d.t(i), d.f(i), d.x(i)))),
    d,
)
d = Drop(10000.0, 150, 6)
add(
    "ordinary: Rigol MSO, start and increment in the row of headings",
    "Time(s),CH1(V),CH2(V),t0 = -5.000000e-03, tInc = 1.000000e-04,\n"
    + d.rows(lambda i: joined((f"{d.time[i] - 0.005:.6e}", d.f(i, 4, 0.1), d.x(i, 5, 0.5), ""))),
    d,
    options=volts("CH1(V)", "CH2(V)"),
)
d = Drop(5000.0, 100, 7)
add(
    "ordinary: Tektronix MSO, settings with an empty column per channel",
    "Model,MSO44\nFirmware Version,1.28.3\n\nWaveform Type,ANALOG,,\nPoint Format,Y,,\nHorizontal Units,s,,\n"
    "Horizontal Scale,0.002,,\nHorizontal Delay,0.01,,\nSample Interval,2e-04,,\nRecord Length,100,,\nGating,0.0% to 100.0%,,\n"
    "Probe Attenuation,1,1,\nVertical Units,V,V,\nVertical Offset,0,0,\nVertical Scale,1,0.5,\nVertical Position,0,-1.2,\n,,,\n,,,\n"
    "Label,Force,Position,\nTIME,CH1,CH2\n" + d.rows(lambda i: joined((d.t(i), d.f(i, 4, 0.1), d.x(i, 5, 0.5)))),
    d,
    options=volts("CH1", "CH2"),
)
d = Drop(4000.0, 110, 8)
add(
    "ordinary: Keysight, headings and names of units",
    "x-axis,1,2\nsecond,Volt,Volt\n"
    + d.rows(lambda i: f"{d.time[i] - 0.01:+.5E},{d.force[i] / 10:+.5E},{d.position[i] / 2:+.6E}"),
    d,
    options=volts("1", "2"),
    rtol=1e-4,
)
d = Drop(5000.0, 90, 9)
add(
    "ordinary: Yokogawa, quoted header of sixteen lines, no times",
    '"Header Size",16\n"Model Name","DL850E"\n"Comment",""\n"BlockNumber",1\n"TraceName","Force","Position"\n"BlockSize",90,90\n'
    '"VUnit","N","mm"\n"SampleRate",5.0000000E+03,5.0000000E+03\n"HResolution",2.0000000E-04,2.0000000E-04\n'
    '"HOffset",-1.0000000E-02,-1.0000000E-02\n"HUnit","s","s"\n"DisplayPointNo.",1,1\n"PhaseShift",0,0\n"Date","2024/05/14","2024/05/14"\n'
    '"Time","10:22:31.123456","10:22:31.123456"\n\n' + d.rows(lambda i: f",{d.f(i)},{d.x(i)}"),
    d,
)
d = Drop(20000.0, 130, 10)
add(
    "ordinary: LeCroy, one channel with segments above",
    "LECROYWS434,20014,Waveform\nSegments,1,SegmentSize,130\nSegment,TrigTime,TimeSinceSegment1\n#1,14-May-2024 10:22:31,0\nTime,Ampl\n"
    + d.rows(lambda i: f"{d.time[i] - 0.003:.6e},{d.f(i, 5, 0.1)}"),
    d,
    position=None,
    absent=("position",),
    options={"channels": {"force": {"column": "Ampl", "unit": "V", "scale": "10 N/V"}}},
    atol_time=1e-7,
)
d = Drop(2000.0, 70, 11)
add(
    "ordinary: PicoScope, units in brackets and an empty row",
    "Time,Channel A,Channel B\n(ms),(V),(mV)\n\n"
    + d.rows(lambda i: joined((d.t(i, 8, 1000), d.f(i, 8, 0.1), d.x(i, 8, 500)))),
    d,
    options={
        "channels": {
            "force": {"column": "Channel A", "scale": "10 N/V"},
            "position": {"column": "Channel B", "scale": "2 mm/V"},
        }
    },
)
d = Drop(600.0, 85, 12)
add(
    "ordinary: imc FAMOS, names with units behind, decimal commas",
    "x in s\tKraft_F1 in N\tWeg_S1 in mm\r\n" + d.tfx("\t", de, "\r\n"),
    d,
    suffix=".asc",
    encoding="cp1252",
    atol_time=1e-6,
)
d = Drop(5000.0, 95, 13)
add(
    "ordinary: Dewesoft, events above the data",
    "File name: drop_017.dxd\nStart time: 5/14/2024 10:22:31.123 AM\nSample rate: 5000 Hz\nNumber of channels: 2\nStore type: always fast\n"
    "\nEvents\nEvent Type\tEvent\tTime\tComment\n1\tstoring started at\t0.000\t\n2\tstoring stopped at\t0.019\t\n\nData1\n"
    "Time (s)\tForce (N)\tPosition (mm)\n" + d.tfx("\t"),
    d,
    suffix=".txt",
)
d = Drop(1024.0, 64, 14)
add(
    "ordinary: MTS TestSuite, a line of marks and an acquisition line",
    "MTS793|MPT|ENU|1|2|.|/|:|1|0|0|A\n\nData Header:\t\tTime:\t0.0634766\tSec\t5/14/2024 10:22:31 AM\nData Acquisition:\tTimed Data\n"
    "Time\tAxial Displacement\tAxial Force\nSec\tmm\tN\n" + d.rows(lambda i: f"{d.time[i]:.8f}\t{d.x(i)}\t{d.f(i)}"),
    d,
    suffix=".dat",
    atol_time=1e-7,
)
d = Drop(100.0, 66, 15)
add(
    "ordinary: Bluehill, specimen lines, quoted cells, a blank line",
    '"Specimen label","R17-3"\n"Length","599","mm"\n"Diameter","1.20","mm"\n"Test rate 1","500","mm/min"\n\n'
    '"Time","Extension","Load"\n"(s)","(mm)","(N)"\n' + d.rows(lambda i: f'"{d.t(i, 4)}","{d.x(i)}","{d.f(i)}"'),
    d,
)
d = Drop(50.0, 70, 16)
add(
    "ordinary: testXpert, German, results above the curve",
    '"Prüfer";"K. Sommer"\n"Prüfnorm";"DIN EN ISO 2062"\n"Einspannlänge";"500,00";"mm"\n"Vorkraft";"0,5";"N"\n'
    '"Prüfgeschwindigkeit";"250";"mm/min"\n\n"Prüfzeit";"Traversenweg";"Standardkraft"\n"s";"mm";"N"\n'
    + d.txf(";", de),
    d,
    encoding="cp1252",
)
d = Drop(1000.0, 88, 17)
add(
    "ordinary: StrainSmart, scan numbers and seconds",
    "StrainSmart 8000\nProject:\tDropRig\nScan Session:\t17\nDate:\t5/14/2024 10:22:31 AM\nScan Rate:\t1000 scans/sec\n\n"
    "Scan\tSeconds\tForce\tPosition\n\ts\tN\tmm\n" + d.rows(lambda i: f"{i + 1}\t{d.t(i, 4)}\t{d.f(i)}\t{d.x(i)}"),
    d,
    suffix=".txt",
)
d = Drop(4800.0, 96, 18)
add(
    "ordinary: DynoWare, settings with units in their keys",
    "File Name:\tR17_03.dwd\nSampling rate [Hz]:\t4800.00000\nMeasuring time [s]:\t0.02\nDelay time [s]:\t0\nCycle No:\t1\n"
    "Samples per channel:\t96\n\nTime\tFz\tPos\ns\tN\tmm\n" + d.rows(lambda i: f"{d.time[i]:.8f}\t{d.f(i)}\t{d.x(i)}"),
    d,
    suffix=".txt",
    options={"channels": {"force": "Fz"}},
    atol_time=1e-7,
)
d = Drop(2048.0, 72, 19)
add(
    "ordinary: Test.Lab, names, units and increments of each function",
    "Project name\tRopes\nSection name\tSection1\nRun name\tRun 17\nFunction class\tTime\tTime\nPoint id\tForce:+Z\tPosition:+Z\n"
    "X axis unit\ts\ts\nY axis unit\tN\tmm\nNumber of values\t72\t72\nX start\t0\t0\nX increment\t0.00048828125\t0.00048828125\n\n"
    "s\tN\tmm\n" + d.rows(lambda i: f"{d.time[i]:.10f}\t{d.f(i)}\t{d.x(i)}"),
    d,
    suffix=".txt",
)
assert len(ACQUISITION_SCOPES_AND_TESTERS) == 19
