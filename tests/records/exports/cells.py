"""What people make of their records in spreadsheets, scripts and text editors: cells, tables and containers."""

from __future__ import annotations

import bz2
import gzip
import io
import json
import tarfile
from pathlib import Path

import numpy as np

from tests.records.exports.base import FORCE, POSITION, RATE, TIME, Kind, N, de, f, fu, lines, t, tfu, u
from tests.records.exports.containers import hdf5, parquet, sheet, zipped
from tests.records.exports.desks import HEAD

CELLS = Kind()
add = CELLS.add

# Cells
BAD = {5: "#N/A", 17: "#DIV/0!", 30: "n/a", 41: "---"}
add("errors of a spreadsheet", HEAD + lines(lambda i: f"{t(i)},{BAD.get(i, f(i))},{u(i)}"))
add("cells as formulas of text", HEAD + lines(lambda i: f'="{t(i)}",="{f(i)}",="{u(i)}"'), refused="number|formula|=")
add(
    "a word for what is missing, said above",
    "# missing value: -999.25\n"
    + HEAD
    + lines(lambda i: f"{t(i)}," + ("-999.25" if i in (20, 21) else f(i)) + f",{u(i)}"),
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
    "time [s],force [N]\n"
    + lines(lambda i: f"{t(i)},{f(i)}")
    + "\ntime [s],position [mm]\n"
    + lines(lambda i: f"{t(i)},{u(i)}"),
    refused="table|head|position|back|column",
)
add(
    "rows for columns",
    "time [s],"
    + ",".join(t(i) for i in range(N))
    + "\nforce [N],"
    + ",".join(f(i) for i in range(N))
    + "\nposition [mm],"
    + ",".join(u(i) for i in range(N))
    + "\n",
    refused="table|heading|row|column",
)
add(
    "mixed decimal marks",
    "t [s];F [N];x [mm]\n" + lines(lambda i: f"{de(t(i))};{de(f(i))};{u(i)}"),
    refused="decimal|number",
)
add(
    "exponents without a letter",
    HEAD + lines(lambda i: f"{t(i)},{FORCE[i] / 10:.4f}+1,{u(i)}"),
    refused="number",
)
add("letters for thousandths", HEAD + lines(lambda i: f"{500 * i}u,{f(i)},{u(i)}"), refused="number|unit|time")
add(
    "hexadecimal force",
    "time [s],force [mN],position [mm]\n" + lines(lambda i: f"{t(i)},0x{round(FORCE[i] * 1e3):04X},{u(i)}"),
    refused="number|hex",
)
add(
    "flags glued to numbers",
    HEAD + lines(lambda i: f"{t(i)},{f(i)}" + ("*" if i in (20, 40) else "") + f",{u(i)}"),
    refused=r"number|\*",
)
add(
    "a page every twenty rows",
    "".join(
        HEAD + "".join(tfu()(i) + "\n" for i in range(k, k + 20)) + f"Page {k // 20 + 1} of 3\n\f\n"
        for k in (0, 20, 40)
    ),
)
add(
    "a calibration above the data",
    "Load [N],Output [mV/V],Error [%]\n0,0.000,0.00\n50,0.500,0.02\n100,1.001,0.03\n150,1.500,0.01\n200,2.002,0.02\n\n"
    + HEAD
    + lines(tfu()),
    refused="line 8.*second heading",
)
add(
    "colons between cells",
    "time [s]:force [N]:position [mm]\n" + lines(tfu(":")),
    refused="delimiter|table|column|separat|time",
)
add(
    "each row in quotes",
    '"time [s],force [N],position [mm]"\n' + lines(lambda i: f'"{tfu()(i)}"'),
    refused="quote|column|table|heading",
)
add("end mark of DOS", HEAD + lines(tfu(), end="\r\n") + "\x1a")
add("marks of writing direction", HEAD + lines(lambda i: ",".join("\u200e" + cell for cell in tfu()(i).split(","))))
add(
    "two files joined, the mark of the second within",
    "\ufeff" + HEAD + lines(tfu(), 30) + "\ufeff" + HEAD + "".join(tfu()(i) + "\n" for i in range(30, N)),
)

# Tables of programs
add(
    "pandas to_string",
    "    time_s  force_N  position_mm\n" + lines(lambda i: f"{i:<4d}{t(i)}  {f(i):>7}  {u(i):>11}"),
    suffix=".txt",
    refused="heading|counts",
)
add(
    "psql",
    " time_s | force_N | position_mm \n--------+---------+-------------\n"
    + lines(lambda i: f" {t(i)} | {f(i)} | {u(i)}")
    + "(60 rows)\n",
    suffix=".txt",
)
add(
    "mysql",
    "+--------+---------+-------------+\n| time_s | force_N | position_mm |\n+--------+---------+-------------+\n"
    + lines(lambda i: f"| {t(i)} | {f(i)} | {u(i)} |")
    + "+--------+---------+-------------+\n",
    suffix=".txt",
)
add(
    "a printed table of MATLAB",
    "    Time_s    Force_N    Position_mm\n    ______    _______    ___________\n\n"
    + lines(lambda i: f"    {t(i)}    {f(i)}    {u(i)}"),
    suffix=".txt",
)
add(
    "Weka",
    "@RELATION drop\n@ATTRIBUTE time_s NUMERIC\n@ATTRIBUTE force_N NUMERIC\n@ATTRIBUTE position_mm NUMERIC\n@DATA\n"
    + lines(tfu()),
    suffix=".arff",
    refused="heading|columns",
)
add(
    "a web page named .xls",
    "<html><table><tr><th>time [s]</th><th>force [N]</th></tr>\n"
    + lines(lambda i: f"<tr><td>{t(i)}</td><td>{f(i)}</td></tr>")
    + "</table></html>\n",
    suffix=".xls",
    position=None,
    refused="HTML|web|table|XML|heading",
)
add(
    "rows of LaTeX",
    "time [s] & force [N] & position [mm] \\\\\n\\hline\n" + lines(lambda i: tfu(" & ")(i) + " \\\\"),
    suffix=".tex",
    refused="table|heading|separat|delimiter|number",
)

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
add(
    "zip within a zip",
    zipped({"run.zip": zipped({"run.csv": (HEAD + lines(tfu())).encode()})}),
    suffix=".zip",
    refused="zip|archive|unpack|holds",
)


def two_sheets(path: Path) -> None:
    import openpyxl

    book = openpyxl.Workbook()
    for page, name, values in ((book.active, "force [N]", FORCE), (book.create_sheet("x"), "position [mm]", POSITION)):
        page.append(["time [s]", name])
        for i in range(N):
            page.append([TIME[i], values[i]])
    book.save(path)


add("a sheet for each channel", two_sheets, suffix=".xlsx", refused="sheet")
add(
    "xlsx, lines within headings",
    sheet([["Time\n[s]", "Force\n[N]", "Position\n[mm]"], *[[TIME[i], FORCE[i], POSITION[i]] for i in range(N)]]),
    suffix=".xlsx",
)
add(
    "Parquet of texts",
    parquet(
        {
            "time_s": np.array([t(i) for i in range(N)]),
            "force_N": np.array([f(i) for i in range(N)]),
            "position_mm": np.array([u(i) for i in range(N)]),
        }
    ),
    suffix=".parquet",
    refused="text|number",
)


def counts(attributes: dict[str, float]):
    def write(path: Path) -> None:
        import h5py

        with h5py.File(path, "w") as file:
            for name, values, unit in (("time", TIME, "s"), ("position", POSITION, "mm")):
                file.create_dataset(name, data=values).attrs["units"] = unit
            data = file.create_dataset("force", data=np.round(FORCE * 1e3).astype("i4"))
            data.attrs.update({"units": "N", **attributes})

    return write


add(
    "HDF5, counts with a gain",
    counts({"gain": 1e-3}),
    suffix=".h5",
    refused="gain",
    remedy={"channels": {"force": {"column": "force", "scale": "0.001"}}},
)
add(
    "HDF5, counts with a slope and an offset",
    counts({"slope": 1e-3, "offset": 0.0}),
    suffix=".h5",
    refused="slope|offset",
)
add("HDF5, counts with a resolution", counts({"LSB": 1e-3}), suffix=".h5", refused="LSB")
add(
    "HDF5, position at half the rate",
    hdf5({"time": TIME, "force": FORCE, "position": POSITION[::2]}, {"time": "s", "force": "N", "position": "mm"}),
    suffix=".h5",
    refused="length|position|samples|values",
)


def table_of_fields(path: Path) -> None:
    import h5py

    rows = np.zeros(N, [("time_s", "f8"), ("force_N", "f8"), ("position_mm", "f8")])
    rows["time_s"], rows["force_N"], rows["position_mm"] = TIME, FORCE, POSITION
    with h5py.File(path, "w") as file:
        file.create_dataset("run/table", data=rows)


add("HDF5, one table of fields", table_of_fields, suffix=".h5", refused="table|field|compound")
add(
    "JSON lines, numbers as texts",
    lines(lambda i: json.dumps({"time_s": t(i), "force_N": f(i), "position_mm": u(i)})),
    suffix=".jsonl",
)
add(
    "JSON lines, an array of channels",
    lines(lambda i: json.dumps({"time_s": i / RATE, "ch": [FORCE[i], POSITION[i]]})),
    suffix=".jsonl",
    refused="ch|array|list|heading|unit",
)
add(
    "JSON lines, packets of ten",
    "".join(
        json.dumps(
            {
                "t0_s": k / RATE,
                "dt_s": 0.0005,
                "force_N": FORCE[k : k + 10].tolist(),
                "position_mm": POSITION[k : k + 10].tolist(),
            }
        )
        + "\n"
        for k in range(0, N, 10)
    ),
    suffix=".jsonl",
    refused="array|list|packet|block|force|time",
)
add(
    "JSON, columns and data",
    json.dumps(
        {"columns": ["time_s", "force_N", "position_mm"], "data": [[TIME[i], FORCE[i], POSITION[i]] for i in range(N)]}
    ),
    suffix=".json",
    refused="JSON|columns|data|table",
)
add(
    "JSON, columns by row numbers",
    json.dumps(
        {
            name: {str(i): float(values[i]) for i in range(N)}
            for name, values in (("time_s", TIME), ("force_N", FORCE), ("position_mm", POSITION))
        }
    ),
    suffix=".json",
    refused="JSON|table|columns|objects",
)
add(
    "JSON, fields with units",
    json.dumps(
        {
            "fields": [
                {"name": "time", "unit": "s"},
                {"name": "force", "unit": "N"},
                {"name": "position", "unit": "mm"},
            ],
            "rows": [[TIME[i], FORCE[i], POSITION[i]] for i in range(N)],
        }
    ),
    suffix=".json",
    refused="JSON|table|columns|fields|heading",
)


def structured(path: Path) -> None:
    import scipy.io

    scipy.io.savemat(
        path, {"out": {"time": TIME, "signals": {"values": np.stack([FORCE, POSITION], 1), "label": "F_N x_mm"}}}
    )


add("MATLAB, structure with time", structured, suffix=".mat", refused="struct|signals|values|column|unit|heading")
