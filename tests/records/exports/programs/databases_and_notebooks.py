"""Workbooks that state a wrong size or hold results too, tables of Pandas and h5py, channels of catman, JSON by channels."""

from __future__ import annotations

import json
import re
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind
from tests.records.exports.boxes import made, matlab
from tests.records.exports.containers import ROWS, sheet
from tests.records.exports.programs.acquisition_scopes_and_testers import Drop

DATABASES_AND_NOTEBOOKS = Kind()
add = DATABASES_AND_NOTEBOOKS.add
MATRIX = np.stack([TIME, FORCE, POSITION], 1)
NAMES = ["time [s]", "force [N]", "position [mm]"]
BYTES = np.array([b"time_s", b"force_N", b"position_mm"])
UNITS = {"units": {"force": "N", "position": "mm"}}


def stated_size(rows: list[list[Any]], size: str) -> Callable[[Path], None]:
    """A workbook whose sheet states another size than it has, as programs write that do not know it beforehand."""

    def write(path: Path) -> None:
        sheet(rows)(path)
        with zipfile.ZipFile(path) as archive:
            parts = {name: archive.read(name) for name in archive.namelist()}
        with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, content in parts.items():
                if name.startswith("xl/worksheets/"):
                    content = re.sub(rb'<dimension ref="[^"]*"', b'<dimension ref="%b"' % size.encode(), content)
                archive.writestr(name, content)

    return write


add("xlsx, a stated size of one cell", stated_size(ROWS, "A1"), suffix=".xlsx")
add("xlsx, a stated size of two of the columns", stated_size(ROWS, "A1:B61"), suffix=".xlsx")
add("xlsx, a stated size of half of the rows", stated_size(ROWS, "A1:C31"), suffix=".xlsx")
add("xlsx, a stated size of much more", stated_size(ROWS, "A1:Z9999"), suffix=".xlsx")
add(
    "xlsx, a remark behind one row",
    stated_size([row + ["released by hand"] * (i == 20) for i, row in enumerate(ROWS)], "A1"),
    suffix=".xlsx",
)


def results_beside(drop: Drop, results: int, before: bool) -> Callable[[Path], None]:
    """A long table, and on another sheet a row of results for each of some tests."""

    def write(path: Path) -> None:
        import openpyxl

        book = openpyxl.Workbook()
        page = book.active
        page.title = "Messung"
        page.append(["Zeit [s]", "Kraft [N]", "Weg [mm]"])
        for row in zip(drop.time, drop.force, drop.position, strict=True):
            page.append([float(value) for value in row])
        other = book.create_sheet("Ergebnisse", 0 if before else 1)
        other.append(["Versuch", "Fmax [N]", "smax [mm]"])
        for k in range(results):
            other.append([k + 1, 50.0 + k, 1.5 + 0.1 * k])
        book.save(path)

    return write


d = Drop(2000.0, 600, 301)
add("xlsx, results on a sheet behind", results_beside(d, 6, before=False), suffix=".xlsx", **d.truth())
add("xlsx, results on a sheet before", results_beside(d, 6, before=True), suffix=".xlsx", **d.truth())
add(
    "xlsx, another table on a sheet behind",
    results_beside(d, 60, before=False),
    suffix=".xlsx",
    refused='2 sheets \\("Messung", "Ergebnisse"\\)',
    **d.truth(),
)


def table(sets: dict[str, Any], **attributes: Any) -> Callable[[Path], None]:
    """An HDF5 file of data sets, texts among them, and of attributes of the file."""
    return made(
        lambda file: (file.attrs.update(attributes), *(file.create_dataset(n, data=v) for n, v in sets.items()))
    )


def texts(*values: str) -> np.ndarray:
    return np.array(values, dtype=object)


add("h5py, a matrix and a data set of names", table({"data": MATRIX, "columns": NAMES}), suffix=".h5")
add("h5py, names under a key of their own", table({"run/samples": MATRIX, "run/what": NAMES}), suffix=".h5")
add(
    "h5py, texts beside",
    table({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION, "title": "Drop 7", "people": ["KB", "Novak"]}),
    suffix=".h5",
)
add(
    "h5py, a text that multiplies",
    table({"data": MATRIX, "columns": NAMES, "remark": "force to be multiplied by 2"}),
    suffix=".h5",
    refused="multipl",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "2"}}},
    force=2 * FORCE,
)
add(
    "h5py, a column of words",
    table({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION, "state": ["run"] * len(TIME)}),
    suffix=".h5",
)
add(
    "h5py, labels of the axes of a matrix",
    made(
        lambda file: file.create_dataset("force_N", data=MATRIX[:, 1:]).attrs.update(
            {"DIMENSION_LABELS": ["time [s]", "force [N]"]}
        )
    ),
    suffix=".h5",
    refused="time|rate|channel|force",
    remedy={
        "rate": 2000.0,
        "channels": {"force": "force_N(:,1)", "position": "force_N(:,2)"},
        "units": {"force": "N", "position": "mm"},
    },
)
add(
    "h5py, a gain of a matrix",
    made(lambda file: file.create_dataset("data", data=MATRIX).attrs.update({"columns": NAMES, "gain": 2.0})),
    suffix=".h5",
    refused="gain",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "2"}}},
    force=2 * FORCE,
)
add(
    "Pandas, to_hdf of a frame",
    table(
        {
            "df/axis0": BYTES,
            "df/axis1": np.arange(len(TIME)),
            "df/block0_items": BYTES,
            "df/block0_values": MATRIX,
        }
    ),
    suffix=".h5",
)
add(
    "Pandas, to_hdf of a frame of two types",
    table(
        {
            "df/axis0": np.array([b"force_N", b"position_mm", b"time_s", b"trigger_state"]),
            "df/axis1": np.arange(len(TIME)),
            "df/block0_items": np.array([b"force_N", b"position_mm"]),
            "df/block0_values": MATRIX[:, 1:],
            "df/block1_items": np.array([b"time_s", b"trigger_state"]),
            "df/block1_values": np.stack([TIME, np.ones(len(TIME))], 1),
        }
    ),
    suffix=".h5",
)
add(
    "HDF5, units of all in one text",
    table({"time": TIME, "force": FORCE, "position": POSITION}, units="time: s; force: N; position: mm"),
    suffix=".h5",
)
add(
    "HDF5, a text of units that a name contradicts",
    table({"time_s": TIME, "force_N": FORCE, "position_mm": POSITION}, units="force: kN; position: mm"),
    suffix=".h5",
    refused="unit",
    force=1e3 * FORCE,
)


def channels(**more: Any) -> dict[str, Any]:
    """Force and position as catman writes them: a structure of texts beside each vector."""
    found: dict[str, Any] = {"File_Header": {"TestId": "Fall7", "Comment": ""}}
    for k, (name, unit, values) in enumerate((("Kraft", "N", FORCE), ("Weg", "mm", POSITION)), 1):
        found[f"Channel_{k}_Header"] = {
            "SignalName": name,
            "Unit": unit,
            "NoOfSamples": str(len(values)),
            "SampleFrequency": "2000",
            "MaxVal": float(values.max()),
            **(more if k == 1 else {}),
        }
        found[f"Channel_{k}_Data"] = values.reshape(-1, 1)
    return found


SLOW = {"Channel_3_Header": {"SignalName": "Temp", "Unit": "C", "SampleFrequency": "100"}}
add("MATLAB, channels of catman", matlab(**channels()), suffix=".mat")
add(
    "MATLAB, channels of catman by their names in the file",
    matlab(**channels()),
    suffix=".mat",
    options={"channels": {"force": "Channel_1_Data", "position": "Channel_2_Data"}},
)
add("MATLAB, a slow channel of catman", matlab(**channels(), **SLOW, Channel_3_Data=POSITION[:7]), suffix=".mat")
add(
    "MATLAB, a factor in the structure of a channel",
    matlab(**channels(Factor=2.0)),
    suffix=".mat",
    refused="Factor",
    remedy={"channels": {"force": {"column": "Kraft", "scale": "2"}}},
    force=2 * FORCE,
)
add(
    "MATLAB, a remark in the structure of a channel",
    matlab(**channels(Comment="values to be multiplied by 2")),
    suffix=".mat",
    refused="multiplied",
    remedy={"channels": {"force": {"column": "Kraft", "scale": "2"}}},
    force=2 * FORCE,
)
add(
    "MATLAB, a remark in the structure that is the channel",
    matlab(
        time_s=TIME,
        force={"data": FORCE, "unit": "N", "note": "multiply by 2"},
        position={"data": POSITION, "unit": "mm"},
    ),
    suffix=".mat",
    refused="multiply",
    remedy={"channels": {"force": {"column": "force", "scale": "2"}}},
    force=2 * FORCE,
)
add(
    "MATLAB, names and units as texts beside",
    matlab(
        fs=2000.0,
        Ch1_Data=FORCE,
        Ch1_Name="Force",
        Ch1_Unit="N",
        Ch2_Data=POSITION,
        Ch2_Name="Position",
        Ch2_Unit="mm",
    ),
    suffix=".mat",
)
add("MATLAB, names under a key of their own", matlab(m=MATRIX, what=texts(*NAMES)), suffix=".mat")
add(
    "MATLAB, two lists that could name",
    matlab(m=MATRIX, a=texts(*NAMES), b=texts(*NAMES[::-1])),
    suffix=".mat",
    refused="time|channel",
    remedy={
        "channels": {"time": "m(:,1)", "force": "m(:,2)", "position": "m(:,3)"},
        "units": {"time": "s", "force": "N", "position": "mm"},
    },
)
add(
    "JSON, a series each with its unit, and a rate",
    json.dumps(
        {
            "test": "drop 7",
            "fs": 2000,
            "channels": {
                "force": {"unit": "N", "data": FORCE.tolist()},
                "position": {"unit": "mm", "data": POSITION.tolist()},
            },
        }
    ),
    suffix=".json",
)
add(
    "JSON, a list of times and two series",
    json.dumps(
        {
            "time_s": TIME.tolist(),
            "force": {"unit": "N", "values": FORCE.tolist()},
            "position": {"unit": "mm", "values": POSITION.tolist()},
        }
    ),
    suffix=".json",
)
add(
    "JSON, a list of channels",
    json.dumps(
        [
            {"name": name, "unit": unit, "data": values.tolist()}
            for name, unit, values in (("time", "s", TIME), ("force", "N", FORCE), ("position", "mm", POSITION))
        ]
    ),
    suffix=".json",
)
add(
    "JSON, rows with three accelerations each",
    json.dumps(
        [
            {"time_s": a, "force_N": b, "position_mm": c, "acceleration": [0.1, 0.2, 9.8]}
            for a, b, c in zip(TIME.tolist(), FORCE.tolist(), POSITION.tolist(), strict=True)
        ]
    ),
    suffix=".json",
)
add(
    "JSON, a gain of one series",
    json.dumps(
        {
            "fs_Hz": 2000,
            "force": {"unit": "N", "gain": 2, "values": FORCE.tolist()},
            "position": {"unit": "mm", "values": POSITION.tolist()},
        }
    ),
    suffix=".json",
    refused="gain",
    remedy={"channels": {"force": {"column": "force [N]", "scale": "2"}}},
    force=2 * FORCE,
)
add(
    "JSON, a series that is shorter",
    json.dumps(
        {
            "time_s": TIME.tolist(),
            "force": {"unit": "N", "values": FORCE.tolist()},
            "position": {"unit": "mm", "values": POSITION[:30].tolist()},
        }
    ),
    suffix=".json",
    refused="different lengths",
)


def frame(**attributes: Any) -> Callable[[Path], None]:
    """A table of Pandas with an index of times without a name, and what its user noted of it."""

    def write(path: Path) -> None:
        import pandas as pd

        index = pd.to_timedelta(np.arange(len(TIME)) * 500_000, unit="ns")
        made = pd.DataFrame({"force": FORCE, "position": POSITION}, index=index)
        made.attrs = attributes
        made.to_parquet(path)

    return write


def stated(metadata: dict[str, str], force: str = "force") -> Callable[[Path], None]:
    """A Parquet file with metadata of the whole."""

    def write(path: Path) -> None:
        import pyarrow as pa
        import pyarrow.parquet as pq

        columns = {"time_s": TIME, force: FORCE, "position": POSITION}
        pq.write_table(pa.table(columns).replace_schema_metadata(metadata), path)

    return write


add("Pandas, units of the columns in attrs", frame(**UNITS), suffix=".parquet")
add(
    "Pandas, units and ranges in attrs",
    frame(**UNITS, range={"force": 500, "position": 20}, rig="3"),
    suffix=".parquet",
)
add(
    "Pandas, a gain in attrs",
    frame(**UNITS, gain={"force": 2.0}),
    suffix=".parquet",
    refused="gain",
    remedy={"channels": {"force": {"column": "force", "scale": "2"}}},
    force=2 * FORCE,
)
add("Parquet, units of the columns in metadata", stated({"units": json.dumps(UNITS["units"])}), suffix=".parquet")
add(
    "Parquet, metadata of the writer of Arrow alone",
    stated({"pandas": json.dumps({"columns": [], "attributes": UNITS})}),
    suffix=".parquet",
)
add(
    "Parquet, metadata that contradict a name",
    stated({"units": json.dumps({"force_N": "kN", "position": "mm"})}, force="force_N"),
    suffix=".parquet",
    refused="unit",
    force=1e3 * FORCE,
)
