"""What people make of their records in spreadsheets, scripts and text editors: a third set, second half."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import tarfile
from pathlib import Path

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.benches import SLOW
from tests.records.exports.containers import hdf5, parquet, sheet, zipped

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
            f"02/11/2023 23:59:{59.99 + i / RATE:.4f}" if i < 20 else f"03/11/2023 00:00:{(i - 20) / RATE:07.4f}"
        )
        + f",{fu()(i)}"
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
add("times that contradict the rate", "Sample rate: 2000 Hz\n" + HEAD + lines(lambda i: f"{i / 2:.1f},{fu()(i)}"), refused="Hz")
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
    "kiloponds", "Zeit [s];Kraft [kp];Weg [mm]\n" + lines(lambda i: f"{t(i)};{FORCE[i] / 9.80665:.9f};{u(i)}"), rtol=1e-6
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
    "time [s],force [N],force [lbf],position [mm]\n" + lines(lambda i: f"{t(i)},{f(i)},{FORCE[i] / 4.448222:.5f},{u(i)}"),
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

# Cells
BAD = {5: "#N/A", 17: "#DIV/0!", 30: "n/a", 41: "---"}
add("errors of a spreadsheet", HEAD + lines(lambda i: f"{t(i)},{BAD.get(i, f(i))},{u(i)}"))
add("cells as formulas of text", HEAD + lines(lambda i: f'="{t(i)}",="{f(i)}",="{u(i)}"'), refused="number|formula|=")
add(
    "a word for what is missing, said above",
    "# missing value: -999.25\n" + HEAD + lines(lambda i: f"{t(i)}," + ("-999.25" if i in (20, 21) else f(i)) + f",{u(i)}"),
)
add(
    "an event in the middle of a row",
    HEAD + lines(lambda i: f"{t(i)},TRIG,{fu()(i)}" if i in (11, 31) else tfu()(i)),
    refused="cells|TRIG|line",
)
add(
    "rows of two kinds",
    "type," + HEAD + "".join((f"E,{t(i)},1,\n" if i in (11, 31) else "") + f"D,{tfu()(i)}\n" for i in range(N)),
    refused="type|time|twice|line|same",
)
add(
    "channels in turn",
    "channel,time [s],value\n" + lines(lambda i: f"F,{t(i)},{f(i)}\nX,{t(i)},{u(i)}"),
    options={"units": {"F": "N", "X": "mm"}, "channels": {"force": "F", "position": "X"}},
    refused="channel|unit|F",
)
add(
    "force above, position below",
    "time [s],force [N]\n" + lines(lambda i: f"{t(i)},{f(i)}") + "\ntime [s],position [mm]\n" + lines(lambda i: f"{t(i)},{u(i)}"),
    refused="table|head|position|back|column",
)
add(
    "rows for columns",
    "time [s]," + ",".join(t(i) for i in range(N)) + "\nforce [N]," + ",".join(f(i) for i in range(N))
    + "\nposition [mm]," + ",".join(u(i) for i in range(N)) + "\n",
    refused="table|heading|row|column",
)
add("mixed decimal marks", "t [s];F [N];x [mm]\n" + lines(lambda i: f"{de(t(i))};{de(f(i))};{u(i)}"), refused="decimal|number")
add(
    "exponents without a letter",
    HEAD + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f}+1,{u(i)}"),
    refused="number",
)
add("letters for thousandths", HEAD + lines(lambda i: f"{500 * i}u,{f(i)},{u(i)}"), refused="number|unit|time")
add("hexadecimal force", "time [s],force [mN],position [mm]\n" + lines(lambda i: f"{t(i)},0x{int(round(FORCE[i] * 1e3)):04X},{u(i)}"), refused="number|hex")
add("flags glued to numbers", HEAD + lines(lambda i: f"{t(i)},{f(i)}" + ("*" if i in (20, 40) else "") + f",{u(i)}"), refused=r"number|\*")
add("a page every twenty rows", "".join(HEAD + "".join(tfu()(i) + "\n" for i in range(k, k + 20)) + f"Page {k // 20 + 1} of 3\n\f\n" for k in (0, 20, 40)))
add(
    "a calibration above the data",
    "Load [N],Output [mV/V],Error [%]\n0,0.000,0.00\n50,0.500,0.02\n100,1.001,0.03\n150,1.500,0.01\n200,2.002,0.02\n\n" + HEAD + lines(tfu()),
)
add("colons between cells", "time [s]:force [N]:position [mm]\n" + lines(tfu(":")), refused="delimiter|table|column|separat|time")
add("each row in quotes", '"time [s],force [N],position [mm]"\n' + lines(lambda i: f'"{tfu()(i)}"'), refused="quote|column|table|heading")
add("end mark of DOS", HEAD + lines(tfu(), end="\r\n") + "\x1a")
add("marks of writing direction", HEAD + lines(lambda i: ",".join("\u200e" + cell for cell in tfu()(i).split(","))))
add("two files joined, the mark of the second within", "\ufeff" + HEAD + lines(tfu(), 30) + "\ufeff" + HEAD + "".join(tfu()(i) + "\n" for i in range(30, N)))

# Tables of programs
add("pandas to_string", "    time_s  force_N  position_mm\n" + lines(lambda i: f"{i:<4d}{t(i)}  {f(i):>7}  {u(i):>11}"), suffix=".txt", refused="heading|counts")
add("psql", " time_s | force_N | position_mm \n--------+---------+-------------\n" + lines(lambda i: f" {t(i)} | {f(i)} | {u(i)}") + "(60 rows)\n", suffix=".txt")
add("mysql", "+--------+---------+-------------+\n| time_s | force_N | position_mm |\n+--------+---------+-------------+\n" + lines(lambda i: f"| {t(i)} | {f(i)} | {u(i)} |") + "+--------+---------+-------------+\n", suffix=".txt")
add("a printed table of MATLAB", "    Time_s    Force_N    Position_mm\n    ______    _______    ___________\n\n" + lines(lambda i: f"    {t(i)}    {f(i)}    {u(i)}"), suffix=".txt")
add("Weka", "@RELATION drop\n@ATTRIBUTE time_s NUMERIC\n@ATTRIBUTE force_N NUMERIC\n@ATTRIBUTE position_mm NUMERIC\n@DATA\n" + lines(tfu()), suffix=".arff", refused="heading|columns")
add("a web page named .xls", "<html><table><tr><th>time [s]</th><th>force [N]</th></tr>\n" + lines(lambda i: f"<tr><td>{t(i)}</td><td>{f(i)}</td></tr>") + "</table></html>\n", suffix=".xls", position=None, refused="HTML|web|table|XML|heading")
add("rows of LaTeX", "time [s] & force [N] & position [mm] \\\\\n\\hline\n" + lines(lambda i: tfu(" & ")(i) + " \\\\"), suffix=".tex", refused="table|heading|separat|delimiter|number")

# Containers
add("gzip without its ending", gzip.compress((HEAD + lines(tfu())).encode()))
add("bzip2", bz2.compress((HEAD + lines(tfu())).encode()), suffix=".csv.bz2", refused="bz2|bzip2|compress")


def tarred() -> bytes:
    buffer, content = io.BytesIO(), (HEAD + lines(tfu())).encode()
    with tarfile.open(fileobj=buffer, mode="w:gz") as archive:
        info = tarfile.TarInfo("drop.csv")
        info.size = len(content)
        archive.addfile(info, io.BytesIO(content))
    return buffer.getvalue()


add("tar of one file", tarred(), suffix=".tar.gz", refused="tar|archive|unpack")
add("zip within a zip", zipped({"run.zip": zipped({"run.csv": (HEAD + lines(tfu())).encode()})}), suffix=".zip", refused="zip|archive|unpack|holds")


def two_sheets(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    for page, name, values in ((book.active, "force [N]", FORCE), (book.create_sheet("x"), "position [mm]", POSITION)):
        page.append(["time [s]", name])
        for i in range(N):
            page.append([TIME[i], values[i]])
    book.save(path)


add("a sheet for each channel", two_sheets, suffix=".xlsx", refused="sheet")
add("xlsx, lines within headings", sheet([["Time\n[s]", "Force\n[N]", "Position\n[mm]"], *[[TIME[i], FORCE[i], POSITION[i]] for i in range(N)]]), suffix=".xlsx")
add("Parquet of texts", parquet({"time_s": np.array([t(i) for i in range(N)]), "force_N": np.array([f(i) for i in range(N)]), "position_mm": np.array([u(i) for i in range(N)])}), suffix=".parquet", refused="text|number")


def counts(attributes: dict[str, float]):
    def write(path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            for name, values, unit in (("time", TIME, "s"), ("position", POSITION, "mm")):
                file.create_dataset(name, data=values).attrs["units"] = unit
            data = file.create_dataset("force", data=np.round(FORCE * 1e3).astype("i4"))
            data.attrs.update({"units": "N", **attributes})

    return write


add("HDF5, counts with a gain", counts({"gain": 1e-3}), suffix=".h5", refused="gain")
add("HDF5, counts with a slope and an offset", counts({"slope": 1e-3, "offset": 0.0}), suffix=".h5", refused="slope|offset")
add("HDF5, counts with a resolution", counts({"LSB": 1e-3}), suffix=".h5", refused="LSB")
add("HDF5, position at half the rate", hdf5({"time": TIME, "force": FORCE, "position": POSITION[::2]}, {"time": "s", "force": "N", "position": "mm"}), suffix=".h5", refused="length|position|samples|values")


def table_of_fields(path: Path) -> None:
    import h5py

    rows = np.zeros(N, [("time_s", "f8"), ("force_N", "f8"), ("position_mm", "f8")])
    rows["time_s"], rows["force_N"], rows["position_mm"] = TIME, FORCE, POSITION
    with h5py.File(path, "w") as file:
        file.create_dataset("run/table", data=rows)


add("HDF5, one table of fields", table_of_fields, suffix=".h5", refused="table|field|compound")
add("JSON lines, numbers as texts", lines(lambda i: json.dumps({"time_s": t(i), "force_N": f(i), "position_mm": u(i)})), suffix=".jsonl")
add("JSON lines, an array of channels", lines(lambda i: json.dumps({"time_s": i / RATE, "ch": [FORCE[i], POSITION[i]]})), suffix=".jsonl", refused="ch|array|list|heading|unit")
add(
    "JSON lines, packets of ten",
    "".join(json.dumps({"t0_s": k / RATE, "dt_s": 0.0005, "force_N": FORCE[k : k + 10].tolist(), "position_mm": POSITION[k : k + 10].tolist()}) + "\n" for k in range(0, N, 10)),
    suffix=".jsonl",
    refused="array|list|packet|block|force|time",
)
add("JSON, columns and data", json.dumps({"columns": ["time_s", "force_N", "position_mm"], "data": [[TIME[i], FORCE[i], POSITION[i]] for i in range(N)]}), suffix=".json", refused="JSON|columns|data|table")
add("JSON, columns by row numbers", json.dumps({name: {str(i): float(values[i]) for i in range(N)} for name, values in (("time_s", TIME), ("force_N", FORCE), ("position_mm", POSITION))}), suffix=".json", refused="JSON|table|columns|objects")
add("JSON, fields with units", json.dumps({"fields": [{"name": "time", "unit": "s"}, {"name": "force", "unit": "N"}, {"name": "position", "unit": "mm"}], "rows": [[TIME[i], FORCE[i], POSITION[i]] for i in range(N)]}), suffix=".json", refused="JSON|table|columns|fields|heading")


def structured(path: Path) -> None:
    import scipy.io

    scipy.io.savemat(path, {"out": {"time": TIME, "signals": {"values": np.stack([FORCE, POSITION], 1), "label": "F_N x_mm"}}})


add("MATLAB, structure with time", structured, suffix=".mat", refused="struct|signals|values|column|unit|heading")
