"""Traps in rows and clocks: reversed, doubled and overlapping rows, counters that run over, implied points, bits, the hour of winter."""

from __future__ import annotations

from datetime import datetime, timedelta
from typing import Any

import numpy as np

from tests.records.exports.base import Kind, de, joined
from tests.records.exports.containers import hdf5
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

ROW_ORDER_COUNTERS_AND_CLOCKS = Kind()


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    ROW_ORDER_COUNTERS_AND_CLOCKS.add(f"nasty: {name}", content, **drop.truth(**more))


d = Drop(1000.0, 90, 51)
add(
    "a trace that begins with its last sample, rate said by the user",
    "Transient memory, latest reading first\nforce [N];position [mm]\n" + "".join(reversed(d.fx(";").splitlines(True))),
    d,
    options={"rate": 1000.0},
    refused="latest",
)
d = Drop(250.0, 80, 52)
add(
    "times that run backwards",
    "time [s],force [N],position [mm]\n" + "".join(reversed(d.tfx().splitlines(True))),
    d,
    refused="time",
)
d = Drop(2000.0, 85, 53)
add(
    "an implied point, rate and separator said by the user",
    "Dezimalpunkt nicht gedruckt: 3 Nachkommastellen\nKraft [N];Weg [mm]\n"
    + d.rows(lambda i: f"{round(1000 * d.force[i])};{round(1000 * d.position[i])}"),
    d,
    options={"rate": 2000.0, "delimiter": ";"},
    refused="Nachkomma|nicht gedruckt",
)
d = Drop(2000.0, 100, 54)
pieces = [range(k, min(k + 30, 100)) for k in range(0, 100, 20)]
add(
    "buffers that each begin with the last ten rows of the one before, rate said by the user",
    "force [N],position [mm]\n" + "".join(f"{d.f(i)},{d.x(i)}\n" for rows in pieces for i in rows),
    d,
    options={"rate": 2000.0},
    refused="rows?|repeat",
)
d = Drop(500.0, 70, 55)
add(
    "every row printed twice, rate said by the user",
    "force [N]\tposition [mm]\n" + d.rows(lambda i: f"{d.f(i)}\t{d.x(i)}\n{d.f(i)}\t{d.x(i)}"),
    d,
    options={"rate": 500.0},
    refused="rows?|repeat|twice",
    suffix=".txt",
)
d = Drop(1000.0, 90, 56)
add(
    "rows missing by the row counter, rate said by the user",
    "no,force [N],position [mm]\n"
    + d.rows(lambda i: f"{i},{d.f(i)},{d.x(i)}" if not 40 <= i < 55 else "#").replace("#\n", ""),
    Drop(1000.0, 90, 56),
    options={"rate": 1000.0},
    refused="no",
)
d = Drop(800.0, 90, 57)
add(
    "a line of what the least bit is worth below the headings",
    "Zeit;Kraft;Weg\ns;N;mm\nLSB;0,005;0,0002\n"
    + d.rows(lambda i: f"{de(d.t(i))};{round(d.force[i] / 0.005)};{round(d.position[i] / 0.0002)}"),
    d,
    refused="LSB",
    remedy={
        "channels": {
            "force": {"column": "Kraft", "scale": "0.005"},
            "position": {"column": "Weg", "scale": "0.0002"},
        }
    },
    rtol=0.03,
)
d = Drop(400.0, 75, 58)
add(
    "signs in a column of their own",
    "t [s],dir,F [N],x [mm]\n"
    + d.rows(lambda i: f"{d.t(i)},{'-' if d.force[i] < 18 else '+'},{abs(d.force[i] - 18):.3f},{d.x(i)}"),
    d,
    force=d.force - 18,
    refused="dir",
)
d = Drop(600.0, 90, 59)
add(
    "hundreds of newtons in the unit",
    "time [s],force [100 N],position [mm]\n" + d.rows(lambda i: joined((f"{d.time[i]:.8f}", d.f(i, 6, 0.01), d.x(i)))),
    d,
    refused="100 N",
    remedy={"channels": {"force": {"column": "force [100 N]", "scale": "100 N"}}},
    rtol=1e-4,
    atol_time=1e-7,
)
d = Drop(1000.0, 90, 60)
add(
    "a rate said by the user that the header contradicts",
    "# sampling rate 1 kHz\nforce [N],position [mm]\n" + d.fx(),
    d,
    options={"rate": 2000.0},
    refused="1 kHz|1000",
)
d = Drop(100.0, 90, 61)
START = datetime(2024, 10, 27, 2, 59, 59, 600000)
add(
    "the hour of winter begins, clock without an offset",
    "Uhrzeit;Kraft [N];Weg [mm]\n"
    + d.rows(
        lambda i: de(
            (START + timedelta(milliseconds=10 * i) - timedelta(hours=1 if i >= 40 else 0)).strftime(
                "%d.%m.%Y %H:%M:%S.%f"
            )[11:-3]
            + f";{d.f(i)};{d.x(i)}"
        )
    ),
    d,
    refused="Uhrzeit|clock|hour|jump|back",
)
add(
    "the hour of winter begins, clock with offsets",
    "stamp,force_N,position_mm\n"
    + d.rows(
        lambda i: (
            (START + timedelta(milliseconds=10 * i) - timedelta(hours=1 if i >= 40 else 0)).isoformat(
                timespec="milliseconds"
            )
            + ("+01:00" if i >= 40 else "+02:00")
            + f",{d.f(i)},{d.x(i)}"
        )
    ),
    d,
)
d = Drop(1000.0, 95, 62)
add(
    "two clocks that drift apart",
    "pc_time_s,device_time_s,force_N,position_mm\n"
    + d.rows(lambda i: f"{12.5 + d.time[i] * 1.02:.6f},{d.t(i)},{d.f(i)},{d.x(i)}"),
    d,
    refused="pc_time_s|device_time_s",
    remedy={"channels": {"time": "device_time_s"}},
)
d = Drop(1000.0, 90, 63)
add(
    "words and huge numbers where the amplifier was overdriven",
    "time_s;force_N;position_mm\n"
    + d.rows(
        lambda i: f"{d.t(i)};{'OVLD' if i == 33 else '9.9E+37' if i == 34 else d.f(i)};{'n/a' if i == 60 else d.x(i)}"
    ),
    d,
)
d = Drop(500.0, 90, 64)
add(
    "a slow channel that is printed where it has news",
    "time [s];force [N];position [mm]\n" + d.rows(lambda i: f"{d.t(i)};{d.f(i)};{d.x(i) if i % 10 == 0 else ''}"),
    d,
    valid=0.1,
)
d = Drop(500.0, 90, 65)
add(
    "two drops in one file, headings again between them",
    "time [s],force [N],position [mm]\n" + d.tfx() + "\ntime [s],force [N],position [mm]\n" + Drop(500.0, 80, 66).tfx(),
    d,
    refused="time|two|again|table",
)
d = Drop(1000.0, 90, 67)
add(
    "a counter of milliseconds in sixteen bits",
    "tick_ms,force_N,position_mm\n" + d.rows(lambda i: f"{(65500 + i) % 65536},{d.f(i)},{d.x(i)}"),
    d,
    refused="tick",
)
d = Drop(1000.0, 90, 68)
add(
    "counts of HDF5 and what one is worth",
    hdf5(
        {"force": np.round(d.force / 0.005).astype("i4"), "position": np.round(d.position / 0.0002).astype("i4")},
        {"force": "N", "position": "mm"},
        fs=1000.0,
        force_lsb=0.005,
        position_lsb=0.0002,
    ),
    d,
    suffix=".h5",
    refused="lsb",
    remedy={
        "channels": {
            "force": {"column": "force", "scale": "0.005"},
            "position": {"column": "position", "scale": "0.0002"},
        }
    },
    rtol=0.03,
)
d = Drop(1000.0, 90, 69)
add(
    "a wire over a loose wheel told by a user who has named the columns",
    "note: force cell sits in a 1:2 tackle, values as measured\n" + d.tfx(";"),
    d,
    options={"columns": ["time [s]", "F [N]", "x [mm]"], "delimiter": ";"},
    refused="tackle",
    force=d.force * 2,
    remedy={"channels": {"force": {"column": "F [N]", "scale": "2"}}},
)
d = Drop(1000.0, 90, 70)
add(
    "decimal commas between commas",
    "time [s],force [N],position [mm]\n" + d.rows(lambda i: joined(map(de, (d.t(i), d.f(i), d.x(i))))),
    d,
    refused="comma|separator|read in",
)
assert len(ROW_ORDER_COUNTERS_AND_CLOCKS) == 20
