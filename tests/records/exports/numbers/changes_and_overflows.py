"""What could move numbers without a word in the headings: ranges, plugs, signs and units that change from a row on, overflows, and channels in turns."""

from __future__ import annotations

from typing import Any

import numpy as np

from tests.records.exports.base import Kind
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

CHANGES_AND_OVERFLOWS = Kind()
TFX = "Time [s],Force [N],Position [mm]\n"


def add(name: str, content: Any, drop: Drop, **more: Any) -> None:
    CHANGES_AND_OVERFLOWS.add(name, content, **drop.truth(**more))


d = Drop(100.0, 80, 251, force=1.0)
add(
    "nasty: a gauge that changes its range, the unit in each cell",
    "Time [s],Force,Position [mm]\n"
    + d.rows(lambda i: f"{d.t(i)},{f'{d.f(i)} N' if abs(d.force[i]) >= 1 else f'{d.f(i, 0, 1000)} mN'},{d.x(i)}"),
    d,
    refused="mN|unit",
)
d = Drop(1000.0, 90, 252)
add(
    "nasty: plugs of the two sensors swapped from a row on",
    "Time [s],Force [N],Position [mm]\n"
    + d.rows(
        lambda i: (
            (f"{d.t(i)},{d.f(i)},{d.x(i)}" if i < 45 else f"{d.t(i)},{d.x(i)},{d.f(i)}")
            + ("\n# plugs of A1 and A2 were the wrong way round from here" if i == 44 else "")
        )
    ),
    d,
    refused="wrong way",
)
d = Drop(1000.0, 90, 253)
add(
    "nasty: tension counted positive first, negative after",
    "# until 40 ms tension is positive, from then on compression is\n"
    + TFX
    + d.rows(lambda i: f"{d.t(i)},{d.f(i, 3, 1 if i < 40 else -1)},{d.x(i)}"),
    d,
    refused="compression",
)
d = Drop(500.0, 80, 254)
e = Drop(500.0, 40, 255)
add("nasty: a second run below the first", TFX + d.tfx() + "\n" + TFX + e.tfx(), d, refused="line|table")
d = Drop(500.0, 80, 256)
add(
    "nasty: headings again after a power cut, stamps from zero again",
    TFX
    + d.rows(lambda i: f"{d.t(i if i < 50 else i - 50)},{d.f(i)},{d.x(i)}" + ("\n" + TFX.strip() if i == 49 else "")),
    d,
    refused="line|table|increase|begin",
)
d = Drop(1000.0, 100, 257)
WHEEL = np.round(d.position * 10000).astype(int)
add(
    "nasty: counter of 16 bits that runs over",
    "t [ms],force [N],encoder\n" + d.rows(lambda i: f"{i},{d.f(i)},{(WHEEL[i] + 60000) % 65536}"),
    d,
    position=WHEEL * 1e-7,
    options={"channels": {"position": {"column": "encoder", "zero": 60000, "scale": "0.1 um"}}},
    refused="65536|65535|wrap|jump|runs over|overflow",
)
d = Drop(100.0, 90, 258)
add(
    "nasty: overflows and missing readings as numbers",
    TFX
    + d.rows(lambda i: f"{d.t(i)},{'9.90000E+37' if i in (11, 12) else d.f(i)},{'-999' if i in (30, 61) else d.x(i)}"),
    d,
    refused="-999|9.9",
)
d = Drop(100.0, 90, 259)
add(
    "nasty: stamps in seconds, then in milliseconds",
    "time,force [N],position [mm]\n" + d.rows(lambda i: f"{d.t(i, 2) if i < 40 else str(10 * i)},{d.f(i)},{d.x(i)}"),
    d,
    options={"units": {"time": "s"}},
    refused="time|step|stamps",
)
d = Drop(1000.0, 90, 260)
add(
    "nasty: 500Hz in its own name, a kilohertz in the file",
    "Sample rate: 1000 Hz\nforce [N],position [mm]\n" + d.fx(),
    d,
    refused="500",
    remedy={"rate": 1000.0},
)
d = Drop(200.0, 80, 261)
add(
    "nasty: two channels take turns in one column",
    "Sample rate: 400 Hz\nA0 and A1 alternately\nvalue [N]\n" + d.rows(lambda i: f"{d.f(i)}\n{d.x(i)}"),
    d,
    options={"channels": {"force": "value [N]"}},
    refused="alternately|take turns",
)
d = Drop(500.0, 80, 262)
add(
    "nasty: percent of full scale",
    "Full scale: 50 N\nTime [s],Force [% FS],Position [mm]\n" + d.rows(lambda i: f"{d.t(i)},{d.f(i, 4, 2)},{d.x(i)}"),
    d,
    refused="%",
    remedy={"channels": {"force": {"column": "Force [% FS]", "scale": "0.5 N"}}},
)
d = Drop(1000.0, 90, 263)
add(
    "nasty: an amplifier that switches, its range in a column",
    "Time [s],Force [N],PGA,Position [mm]\n"
    + d.rows(lambda i: f"{d.t(i)},{d.f(i, 3, 1 if i < 30 else 8)},{1 if i < 30 else 8},{d.x(i)}"),
    d,
    refused="PGA",
)
d = Drop(100.0, 80, 264)
OZF = 0.27801385095378125
add(
    "nasty: ounces of force",
    "Time (s),Force (ozf),Position (mm)\n" + d.rows(lambda i: f"{d.t(i)},{d.force[i] / OZF:.8f},{d.x(i)}"),
    d,
    rtol=1e-6,
    refused="ozf",
)
d = Drop(100.0, 80, 265)
add(
    "nasty: millimetres in the heading, inches in the row below",
    "Time [s],Force [N],Position [mm]\ns,N,in\n" + d.rows(lambda i: f"{d.t(i)},{d.f(i)},{d.position[i] / 25.4:.9f}"),
    d,
    rtol=1e-6,
    refused="mm|in",
    remedy={"units": {"position": "in"}},
)
assert len(CHANGES_AND_OVERFLOWS) == 14
