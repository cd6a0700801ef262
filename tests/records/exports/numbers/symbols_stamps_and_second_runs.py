"""Symbols over units, words for units, constants among readings, thousands alone, stamps without signs, and second runs."""

from __future__ import annotations

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind, N, de, f, fu, lines, t, tfu, u

SYMBOLS_STAMPS_AND_SECOND_RUNS = Kind()
add = SYMBOLS_STAMPS_AND_SECOND_RUNS.add

add("a way by its symbol over its unit", "t/s\tF/N\ts/mm\n" + lines(tfu("\t", de)))
add("a way by its symbol in its unit", "t in s;F in N;s in mm\n" + lines(tfu(";", de)))
add("a height by its symbol over its unit", "t/s,F/N,h/mm\n" + lines(tfu()))
add("words for units in French", "Temps (secondes);Effort (N);Déplacement (millimètres)\n" + lines(tfu(";", de)))
add(
    "words for units in French, of one byte a letter",
    "Temps (secondes);Effort (N);Déplacement (millimètres)\n" + lines(tfu(";", de)),
    encoding="cp1252",
)
add("words for units in Chinese", "时间(秒),拉力(牛顿),位移(毫米)\n" + lines(tfu()))
add(
    "a Chinese head, of two bytes a sign, with a line of units",
    "材料试验\n采样频率,2000,Hz\n单位,N,mm\n序号,拉力(N),位移(mm)\n" + lines(lambda i: f"{i + 1},{fu()(i)}"),
    encoding="gbk",
)
add(
    "a Japanese head with a line of units",
    "サンプリング周波数(Hz),2000\nCH名称,荷重,変位\n単位,N,mm\n" + lines(tfu()),
    encoding="cp932",
)
add("a line of units in Spanish", "Tiempo;Fuerza;Desplazamiento\nseg;N;mm\n" + lines(tfu(";", de)))
add(
    "mils",
    "Time (sec),Load (N),Displacement (mils)\n" + lines(lambda i: f"{t(i)},{f(i)},{POSITION[i] / 0.0254:.9f}"),
    rtol=1e-6,
)
add(
    "pounds, which are a mass",
    "Time (sec),Load (lbs),Displacement (mm)\n" + lines(lambda i: f"{t(i)},{FORCE[i] / 4.4482216152605:.9f},{u(i)}"),
    refused='unit "lbs", a mass.*force = "lbf"',
    remedy={"units": {"force": "lbf"}},
    rtol=1e-6,
)
add(
    "units that are not known",
    "t (tik),F (Grunt),x (Span)\n" + lines(tfu()),
    refused="no units",
)
add(
    "conditions of the test in every row",
    "time_s,force_N,drop_height_mm,mass_kg\n" + lines(lambda i: f"{t(i)},{f(i)},50,3.096"),
    position=None,
    absent=("position",),
)
add(
    "a preload in every row",
    "time [s],Kistler [N],preload [N],x [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},2.0,{u(i)}"),
)


def thousands(separator: str, mark: str) -> str:
    """Rows of whole numbers only: microseconds, millinewtons and micrometres."""
    cells = (
        f"{500 * i}{separator}{round(1e3 * (FORCE[i] - 12.5)):,}{separator}{round(1e3 * POSITION[i]):,}"
        for i in range(N)
    )
    return "".join(row.replace(",", mark) + "\n" for row in cells)


truth = {"force": np.round(FORCE - 12.5, 3), "position": np.round(POSITION, 3) * 1e-3}
add(
    "thousands by commas and no decimals",
    "Time (us)\tForce (mN)\tDisplacement (um)\n" + thousands("\t", ","),
    refused='"," may separate thousands or decimals',
    suffix=".txt",
    **truth,
)
add(
    "thousands by points and no decimals",
    "Zeit [µs];Kraft [mN];Weg [µm]\n" + thousands(";", "."),
    refused='"." may separate thousands or decimals',
    **truth,
)
add(
    "a step by a Greek letter",
    "Δt = 0,5 ms\nKraft [N]\tWeg [mm]\n" + lines(fu("\t", de)),
    suffix=".txt",
)
add(
    "a short time below a key that says little",
    "Delta : 0,0005 sec.\nKraft [N]\tWeg [mm]\n" + lines(fu("\t", de)),
    refused="Delta.*may be the rate of the samples or of something else",
    remedy={"rate": 2000.0},
    suffix=".txt",
)
add(
    "a stamp without a sign in it",
    "Timestamp,Force [N],Position [mm]\n" + lines(lambda i: f"202405121422{11 + TIME[i]:07.4f},{fu()(i)}"),
)
add(
    "thousandths without their zeros",
    "Timestamp,Force [N],Position [mm]\n" + lines(lambda i: f"14:22:11.{8 + i},{fu()(i)}"),
    refused="thousandths without their leading zeros",
    time=2.0 * TIME,
)
HEAD = "# fs = 2000 Hz\nForce [N];Position [mm]\n"
add("a second run below the same head, without times", HEAD + lines(fu(";")) + HEAD + lines(fu(";")), refused="line 63")
add(
    "a second trigger, without times",
    HEAD + lines(fu(";")) + "# trigger 2\n" + lines(fu(";")),
    refused="line 63 stands between the rows",
)
add(
    "pages of a printout, without times",
    "# fs = 2000 Hz\n"
    + "".join("Force [N];Position [mm]\n" + lines(lambda i, k=k: fu(";")(15 * k + i), 15) for k in range(4)),
)
