"""What people make of their records in spreadsheets, scripts and text editors: clocks, units and headings."""

from __future__ import annotations

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW

DESKS = Kind()
add = DESKS.add
FU = "force [N],position [mm]\n"
HEAD = "time [s]," + FU
AUTO = [(FORCE[i], "N") if FORCE[i] >= 12 else (FORCE[i] * 1e3, "mN") for i in range(N)]
"""Readings of a meter that chooses its range."""

# Clocks
add(
    "serial days of a spreadsheet",
    "Date/Time," + FU + lines(lambda i: f"{45232.4166666667 + i / RATE / 86400:.12f},{f(i)},{u(i)}"),
    refused="unit|time",
    atol_time=1e-6,
)
add("days as the unit", "Time [d]," + FU + lines(lambda i: f"{0.25 + i / RATE / 86400:.13f},{fu()(i)}"), atol_time=1e-6)
add(
    "minutes and seconds",
    "Time," + FU + lines(lambda i: f"{i // 600:02d}:{i / 10 % 60:04.1f},{fu()(i)}"),
    time=np.arange(N) / 10,
    refused="time|unit",
)
add(
    "minutes and seconds as the unit",
    "Time [mm:ss.ffff]," + FU + lines(lambda i: f"12:{i / RATE:07.4f},{fu()(i)}"),
)
add(
    "date, time and ms in three columns",
    "Date,Time,Millisec," + FU + lines(lambda i: f"02/11/2023,10:00:00,{5 * i},{fu()(i)}"),
    time=SLOW,
    refused="time|ms|Millisec",
)
add(
    "dots in the clock",
    "Ora;Forza [N];Posizione [mm]\n" + lines(lambda i: f"10.00.{de(f'{i / RATE:07.4f}')};{de(f(i))};{de(u(i))}"),
    refused="time|unit|clock",
)
add(
    "ISO basic", "stamp," + FU + lines(lambda i: f"20231102T1000{i / RATE:07.4f}Z,{fu()(i)}"), refused="time|unit|stamp"
)
add(
    "ISO ordinal",
    "stamp," + FU + lines(lambda i: f"2023-306T10:00:{i / RATE:07.4f},{fu()(i)}"),
    refused="time|unit|stamp",
)
add(
    "day or month over midnight",
    "stamp,"
    + FU
    + lines(
        lambda i: (
            (f"02/11/2023 23:59:{59.99 + i / RATE:.4f}" if i < 20 else f"03/11/2023 00:00:{(i - 20) / RATE:07.4f}")
            + f",{fu()(i)}"
        )
    ),
    refused="day|month",
)
add("newest first", HEAD + "".join(tfu()(i) + "\n" for i in reversed(range(N))), refused="back|descend|decreas|order")
add(
    "every row twice",
    HEAD + "".join(tfu()(i) + "\n" for i in range(N) for _ in (0, 1)),
    refused="twice|same|repeat|duplicate|steps",
)
add(
    "time that is left",
    "time left [s]," + FU + lines(lambda i: f"{(N - i) / RATE:.4f},{fu()(i)}"),
    refused="back|descend|decreas|order|time",
)
add("steps in place of times", "dt [s]," + FU + lines(lambda i: f"0.0005,{fu()(i)}"), refused="time|dt|increase|rate")
add(
    "stamps of packets of ten",
    "epoch_ms," + FU + lines(lambda i: f"{1698919200000 + 5 * (i // 10)},{fu()(i)}"),
    refused="time|twice|same|printed|rate",
)
add(
    "fractions of each second",
    HEAD + lines(lambda i: f"{(0.98 + i / RATE) % 1:.4f},{fu()(i)}"),
    refused="back|again|clock|time",
)
add(
    "counter with lost rows, rate above",
    "# fs = 2000 Hz\nNo," + FU + "".join(f"{i},{fu()(i)}\n" for i in range(N) if i not in (20, 21, 22)),
)
add(
    "counter of eight bits, rate above",
    "# fs = 2000 Hz\nNo," + FU + lines(lambda i: f"{(230 + i) % 256},{fu()(i)}"),
    refused="No|count|back|row",
)
add(
    "counter that begins anew, rate above",
    "# fs = 2000 Hz\nNo," + FU + lines(lambda i: f"{i % 30},{fu()(i)}"),
    refused="No|count|back|row",
)
add(
    "times that contradict the rate",
    "Sample rate: 2000 Hz\n" + HEAD + lines(lambda i: f"{i / 2:.1f},{fu()(i)}"),
    refused="Hz",
)
add(
    "positions a quarter of a step later",
    "Force_Time [s],Force [N],Position_Time [s],Position [mm]\n"
    + lines(lambda i: f"{i / RATE:.6f},{f(i)},{i / RATE + 0.01:.6f},{u(i)}"),
    refused="time",
)
add(
    "positions half as often",
    "t_F [s],Force [N],t_x [s],Position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)}," + (f"{i / 1000:.4f},{u(2 * i)}" if i < N // 2 else ",")),
    refused="time|position|rate",
)
for said in (
    "Filter frequency: 100 Hz\nExcitation: 5 Hz",
    "Baud rate: 115200",
    "Screen refresh 60 Hz",
    "dt = 500",
    "Sample rate: 2 kHz (force), 1 kHz (position)",
):
    add(f"rate: {said!r}", f"{said}\n" + FU + lines(fu()), refused="rate|sampl|unit|times", remedy={"rate": 2000.0})
for said in ("Update rate: 10 Hz\nSample rate: 2000 Hz", "Sampling: 2000 SPS", "Speed: 2 kSPS", "sampling = 2000 1/s"):
    add(f"rate: {said!r}", f"{said}\n" + FU + lines(fu()), refused="rate|sampl", remedy={"rate": 2000.0})

# Units and headings
add("units in two languages", "Zeit / Time [s];Kraft / Force [N];Weg / Travel [mm]\n" + lines(tfu(";", de)))
add(
    "force times a hundred",
    "time [s],force x100 [N],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] * 100:.1f},{u(i)}"),
    refused="100|factor|scale|unit|heading",
)
add(
    "force over ten",
    "time [s],F/10 [N],x [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f},{u(i)}"),
    refused="10|factor|scale|force|unit",
)
add(
    "minus the force",
    "time [s],-F [N],x [mm]\n" + lines(lambda i: f"{t(i)},{-FORCE[i]:.3f},{u(i)}"),
    refused="sign|-F|minus|force",
)
add(
    "ten to the minus three",
    "time [s],force [10^-3 N],position [mm]\n" + lines(lambda i: f"{t(i)},{FORCE[i] * 1e3:.0f},{u(i)}"),
    refused="unit",
)
add(
    "hundredths of a second",
    "time [1/100 s]," + FU + lines(lambda i: f"{t(i, 100, 2)},{fu()(i)}"),
    refused="unit",
)
add("ticks", "time [ticks]," + FU + lines(lambda i: f"{36 * i},{fu()(i)}"), refused="unit|time|rate")
add(
    "kips and thousandths of an inch",
    "time [s],load [kip],position [mil]\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] / 4448.2216152605:.12f},{POSITION[i] / 0.0254:.9f}"),
    refused="unit",
    rtol=1e-6,
)
add(
    "kiloponds",
    "Zeit [s];Kraft [kp];Weg [mm]\n" + lines(lambda i: f"{t(i)};{FORCE[i] / 9.80665:.9f};{u(i)}"),
    rtol=1e-6,
)
add(
    "micro read in the wrong encoding",
    "time [s],force [N],position [Âµm]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i, 1e3, 1)}"),
    refused="unit",
)
add(
    "micro lost to ASCII",
    "time [s],force [N],position [?m]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i, 1e3, 1)}"),
    refused="unit",
)
add(
    "micro of DOS",
    "Zeit [s];Kraft [N];Weg [µm]\n" + lines(lambda i: de(f"{t(i)};{f(i)};{u(i, 1e3, 1)}")),
    encoding="cp850",
    refused="unit|encod",
)
add(
    "micro of HTML",
    "time [s],force [N],position [&micro;m]\n" + lines(lambda i: f"{t(i)},{f(i)},{u(i, 1e3, 1)}"),
    refused="unit",
)
add(
    "error of the position, no position",
    "time [s],force [N],position error [mm]\n" + lines(tfu()),
    options={"roles": ("force", "position")},
    position=None,
    refused="position",
)
add(
    "uncertainties beside",
    "time [s],F [N],u(F) [N],x [mm],u(x) [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},0.02,{u(i)},0.001"),
    refused="could each",
    remedy={"channels": {"force": "F [N]", "position": "x [mm]"}},
)
add(
    "asked and found",
    "t [s];F_soll [N];F_ist [N];s_soll [mm];s_ist [mm]\n" + lines(lambda i: de(f"{t(i)};12.0;{f(i)};0.0;{u(i)}")),
)
add(
    "left and right",
    "time [s],force L [N],force R [N],position [mm]\n"
    + lines(lambda i: f"{t(i)},{FORCE[i] * 0.6:.4f},{FORCE[i] * 0.4:.4f},{u(i)}"),
    refused="could each",
)
add(
    "one heading twice",
    "time [s],force [N],position [mm],position [mm]\n" + lines(lambda i: f"{tfu()(i)},{POSITION[i] * 2:.4f}"),
    refused="could each|twice|two",
    remedy={"channels": {"position": "column 3"}},
)
add(
    "both newtons and pounds",
    "time [s],force [N],force [lbf],position [mm]\n"
    + lines(lambda i: f"{t(i)},{f(i)},{FORCE[i] / 4.448222:.5f},{u(i)}"),
    refused="could each|two",
    remedy={"channels": {"force": "force [N]"}},
)
add(
    "units beside the values",
    "time,force,unit,position,unit\n" + lines(lambda i: f"{t(i)},{f(i)},N,{u(i)},mm"),
    options={"units": {"time": "s"}},
    refused="unit",
    remedy={"units": {"time": "s", "force": "N", "position": "mm"}},
)
add(
    "units beside the values, of a meter that chooses its range",
    "time [s],force,unit,position [mm]\n" + lines(lambda i: f"{t(i)},{AUTO[i][0]:.3f},{AUTO[i][1]},{u(i)}"),
    options={"units": {"force": "N"}},
    refused="unit",
)
add(
    "key=value of a meter that chooses its range",
    lines(lambda i: f"t={t(i)}s F={AUTO[i][0]:.3f}{AUTO[i][1]} x={u(i)}mm"),
    suffix=".log",
    refused="unit",
)
