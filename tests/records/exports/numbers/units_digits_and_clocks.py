"""Units, digits, clocks and rates as engineers, spreadsheets and home-made loggers write them, and what is said twice and differently."""

from __future__ import annotations

from datetime import datetime, timedelta

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW

UNITS_DIGITS_AND_CLOCKS = Kind()
add = UNITS_DIGITS_AND_CLOCKS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
NAMED = {"units": {"time": "s", "force": "N", "position": "mm"}}
BOTH = {"channels": {"force": "force [N]", "position": "position [mm]"}}


def lakhs(value: int) -> str:
    """Groups of two digits above the thousands, as in India."""
    head, tail = divmod(abs(value), 1000)
    text = f"{head // 100},{head % 100:02d},{tail:03d}" if head >= 100 else f"{head},{tail:03d}" if head else str(tail)
    return ("-" if value < 0 else "") + text


# What is said twice, and differently
add(
    "a unit in the name and another below",
    "time [s],force [N],position [mm]\ns,kN,mm\n" + lines(tfu()),
    refused="unit|kN|line 2",
)
add(
    "a unit in round and another in square brackets",
    "time [s],force [kN] (N),position [mm]\n" + lines(tfu()),
    refused="unit|kN",
    remedy={"channels": {"force": {"column": "force [kN] (N)", "unit": "N"}}},
)
add(
    "a sentence above that contradicts the headings",
    "All forces in kN\n" + HEAD + lines(tfu()),
    refused="unit|kN",
)
add(
    "times in ms under a heading in s, the rate above",
    "Sampling rate: 2000 Hz\n" + HEAD + lines(lambda i: f"{t(i, 1e3, 1)},{fu()(i)}"),
    refused="rate|time|Hz",
    remedy={"units": {"time": "ms"}},
)
add(
    "two rates above that differ",
    "fs = 2000 Hz\nSample interval: 1 ms\n" + FU + lines(fu()),
    refused="rate|interval|Hz",
    remedy={"rate": 2000.0},
)
add(
    "a remark that the load is to be multiplied",
    "Note: multiply load by 10\ntime [s],load [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f},{u(i)}"),
    refused="multipl|factor|10|scale",
    remedy={"channels": {"force": {"column": "load [N]", "scale": "10"}}},
)
add(
    "a scale above in the words of a key",
    "force.unit=N\nforce.scale=0.5\nposition.unit=mm\n" + HEAD + lines(lambda i: f"{t(i)},{FORCE[i] * 2:.3f},{u(i)}"),
    refused="scale",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "0.5"}}},
)
add(
    "a formula above",
    "# F = 100 * U1 - 3.0\ntime [s],U1 [V],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 100:.5f},{u(i)}"),
    refused="V|scale",
    remedy={"channels": {"force": {"column": "U1 [V]", "scale": "100 N/V"}}},
)
add(
    "the tare said and not taken off",
    "Tare: 0.35 N (not subtracted)\n" + HEAD + lines(tfu()),
    refused="Tare",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "1"}}},
)
# Units
add(
    "units of an upper-case program",
    "TIME (MSEC),FORCE (KN),POSITION (UM)\n" + lines(lambda i: f"{t(i, 1e3, 1)},{f(i, 1e-3, 6)},{u(i, 1e3, 1)}"),
    refused="unit",
)
add("capital S for seconds", "Time [S],Force [N],Position [mm]\n" + lines(tfu()))
add(
    "hundredths of a mm, as a fraction",
    "time [s],force [N],position [1/100 mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i, 100, 2)}"),
    refused="unit|1/100",
)
add(
    "tenths of a ms",
    "time [0.1 ms]," + FU + lines(lambda i: f"{5 * i},{fu()(i)}"),
    refused="unit|0.1",
)
add(
    "steps of the sampling as the unit",
    "fs = 2000 Hz\ntime [samples]," + FU + lines(lambda i: f"{i},{fu()(i)}"),
    refused="unit|sample",
)
add(
    "a torque and no force",
    "time [s],torque [Nm],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f},{u(i)}"),
    force=None,
    absent=("force",),
)
add(
    "a stress and a stiffness and no force",
    "time [s],stress [N/mm2],stiffness [N/mm],position [mm]\n" + lines(lambda i: f"{t(i)},1.25,3.1,{u(i)}"),
    force=None,
    absent=("force",),
)
add(
    "a wanted place and no other",
    "time_s,pos_cmd_mm,force_N\n" + lines(lambda i: f"{t(i)},{i // 20},{f(i)}"),
    position=None,
    refused="cmd|command|wanted|measured",
)
add(
    "a limit beside the force",
    "time [s],force limit [N],force [N],position limit [mm],position [mm]\n"
    + lines(lambda i: f"{t(i)},{200 - i % 3},{f(i)},{50 + i % 3},{u(i)}"),
    refused="could each",
    remedy=BOTH,
)
add(
    "the largest force so far",
    "time [s],force [N],peak force [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)},{FORCE[: i + 1].max():.3f},{u(i)}"),
    refused="could each",
    remedy=BOTH,
)
add(
    "three axes and their length",
    "time [s],Fx [N],Fy [N],Fz [N],|F| [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},0.1,0.2,{f(i)},{FORCE[i] * 1.0002:.4f},{u(i)}"),
    refused="could each",
    remedy={"channels": {"force": "Fz [N]"}},
)
# Numbers
add(
    "numbers with blanks after their signs",
    HEAD.replace(",", ";")
    + lines(lambda i: f"{t(i)};{f(i)};" + (f"- {-POSITION[i]:.4f}" if POSITION[i] < 0 else f"+ {POSITION[i]:.4f}")),
    refused="number",
)
add("dashes of typesetters", HEAD + lines(lambda i: f"{t(i)},{f(i)},{u(i)}".replace("-", "\u2013")), refused="number")
add("raised points", HEAD + lines(lambda i: tfu()(i).replace(".", "\u00b7")), refused="number|decimal|column|heading")
add(
    "Arabic decimal signs",
    HEAD.replace(",", ";") + lines(lambda i: tfu(";")(i).replace(".", "\u066b")),
    refused="number|decimal|column|heading",
)
add("hexadecimal floats", HEAD + lines(lambda i: f"{t(i)},{float(FORCE[i]).hex()},{u(i)}"), refused="number|hex")
add("exponents with D", HEAD + lines(lambda i: f"{i / RATE:.6E},{FORCE[i]:.6E},{POSITION[i]:.6E}".replace("E", "D")))
add("stars where a number was too wide", HEAD + lines(lambda i: f"{t(i)},{'******' if i in (20, 21) else f(i)},{u(i)}"))
add(
    "letters for the size, chosen by the meter",
    HEAD + lines(lambda i: f"{t(i)}," + (f"{FORCE[i] / 1e3:.6f}k" if FORCE[i] > 14 else f(i)) + f",{u(i)}"),
    refused="number|unit",
)
add(
    "lakhs",
    "time [s];force [N];position [nm]\n" + lines(lambda i: f"{t(i)};{f(i)};{lakhs(round(POSITION[i] * 1e6))}"),
    refused="thousands|number",
)
add(
    "French blanks and commas",
    "temps [µs];effort [mN];course [µm]\n"
    + lines(lambda i: f"{500 * i:,};{FORCE[i] * 1e3:,.1f};{u(i, 1e3, 1)}".replace(",", "\u202f").replace(".", ",")),
    refused="thousands",
)
add(
    "a blank before the unit in each cell, decimal commas",
    "Zeit;Kraft;Weg\n" + lines(lambda i: de(f"{t(i)} s;{f(i)} N;{u(i)} mm")),
    refused="unit|number",
)
add(
    "remarks behind the rows",
    HEAD + lines(lambda i: tfu()(i) + ("   # bang" if i in (3, 30) else "")),
    refused="#|number|remark|cells",
)
add("a blank line after each row", HEAD + lines(lambda i: tfu()(i) + "\n"))
add("carriage returns twice", HEAD + lines(tfu(), end="\r\r\n"))
add(
    "two signs between cells",
    "time [s]::force [N]::position [mm]\n" + lines(tfu("::")),
    refused="delimit|separat|column|heading|table",
)
add(
    "tildes between cells",
    "time [s]~force [N]~position [mm]\n" + lines(tfu("~")),
    refused="delimit|separat|column|heading|table",
)
# Clocks
STAMP = datetime(2023, 10, 29, 2, 59, 59, 900000)


def zoned(i: int) -> str:
    stamp = STAMP + timedelta(milliseconds=5 * i)
    return (
        stamp.isoformat(" ", "milliseconds") + " CEST"
        if i < 20
        else ((stamp - timedelta(hours=1)).isoformat(" ", "milliseconds") + " CET")
    )


add(
    "letters of the zone over the end of summer time",
    "time," + FU + lines(lambda i: f"{zoned(i)},{fu()(i)}"),
    time=SLOW,
    refused="time|zone|hour",
)
add(
    "zones by their distance from Greenwich",
    "time," + FU + lines(lambda i: f"2023-11-02 10:00:00.{5 * i:03d} GMT+02:00,{fu()(i)}"),
    time=SLOW,
    refused="time|rate|zone",
)
add(
    "half an hour beside Greenwich",
    "time," + FU + lines(lambda i: f"2023-11-02T10:00:00.{5 * i:03d}+05:30,{fu()(i)}"),
    time=SLOW,
)
add(
    "minutes and seconds as a spreadsheet shows them",
    "time," + FU + lines(lambda i: f"00:{i / 10:04.1f},{fu()(i)}"),
    time=np.arange(N) / 10,
    refused="time|unit",
)
add(
    "clock with full stops",
    "ora;forza [N];corsa [mm]\n" + lines(lambda i: f"10.00.00,{5 * i:03d};{de(f(i))};{de(u(i))}"),
    time=SLOW,
    refused="time|unit|ora",
)
add(
    "the day before the month over midnight",
    "time;"
    + FU.replace(",", ";")
    + lines(
        lambda i: (
            (datetime(2023, 2, 1, 23, 59, 59, 900000) + timedelta(milliseconds=5 * i)).strftime("%d/%m/%Y %H:%M:%S.%f")
            + f";{fu(';')(i)}"
        )
    ),
    time=SLOW,
    refused="day|month|date|gap",
)
add(
    "two clocks of two devices",
    "t_daq [s],t_ctrl [s]," + FU + lines(lambda i: f"{t(i)},{TIME[i] * 1.003 + 0.12:.7f},{fu()(i)}"),
    refused="could each|time|two",
    remedy={"channels": {"time": "t_daq [s]"}},
)
add(
    "a number of the sample beside ms",
    "sample,t_ms,force_N,position_mm\n" + lines(lambda i: f"{i + 1},{t(i, 1e3, 1)},{fu()(i)}"),
)
add(
    "a number of the sample called t",
    "t,time_ms,force_N,position_mm\n" + lines(lambda i: f"{i},{t(i, 1e3, 1)},{fu()(i)}"),
    refused="could each|time|unit",
    remedy={"channels": {"time": "time_ms"}},
)
add(
    "runs one below the other, numbered",
    "run," + HEAD + lines(lambda i: f"1,{tfu()(i)}", 30) + "".join(f"2,{t(i - 30)},{fu()(i)}\n" for i in range(30, N)),
    refused="back|again|run|two|anew",
)
add(
    "rows in a little disorder",
    HEAD + lines(lambda i: tfu()(i + (1 if i % 10 == 4 else -1 if i % 10 == 5 else 0))),
    refused="back|increase|order|time",
)
add(
    "a pause told in a line",
    HEAD
    + lines(tfu(), 30)
    + "-- logging paused --\n-- logging resumed --\n"
    + "".join(f"{TIME[i] + 0.25:.4f},{fu()(i)}\n" for i in range(30, N)),
    time=np.r_[TIME[:30], TIME[30:] + 0.25],
    refused="gap|paus|line 32",
)
for said in (
    "Scan period (usec): 500",
    "Sample rate: 2 kS/s/ch",
    "Samples per second: 2000",
    "Abtastung: 2000/s",
    "Sampling interval: 1/2000 s",
    "dt = 5,0E-4 s",
    "Acquisition rate 2000 Hz, decimated from 10000 Hz",
):
    add(
        f"rate: {said!r}",
        f"{said}\nforce [N];position [mm]\n" + lines(fu(";")),
        refused="rate|decimat",
        remedy={"rate": 2000.0},
    )
