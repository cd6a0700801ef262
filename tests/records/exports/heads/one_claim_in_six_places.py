"""Claims, each as key, comment, footer, sheet, attribute and JSON, and some in a heading; half of them change the numbers."""

from __future__ import annotations

import json
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np

from tests.records.exports.base import FORCE, POSITION, TIME, Kind
from tests.records.exports.boxes import made
from tests.records.exports.containers import sheet

ONE_CLAIM_IN_SIX_PLACES = Kind()
add = ONE_CLAIM_IN_SIX_PLACES.add
HEADINGS = ("time [s]", "force [N]", "position [mm]")
Numbers = tuple[np.ndarray, np.ndarray, np.ndarray]
TRUE: Numbers = (TIME, FORCE, POSITION)


def rows(numbers: Numbers, separator: str = ",") -> str:
    return "".join(separator.join(f"{x:.9g}" for x in row) + "\n" for row in zip(*numbers, strict=True))


def table(numbers: Numbers) -> str:
    return ",".join(HEADINGS) + "\n" + rows(numbers)


def of_hdf5(key: str, value: str, numbers: Numbers) -> Callable[[Any], None]:
    def fill(file: Any) -> None:
        for name, unit, values in zip(("time", "force", "position"), ("s", "N", "mm"), numbers, strict=True):
            file.create_dataset(name, data=values).attrs["units"] = unit
        file.attrs[key] = value

    return made(fill)


def of_json(key: str, value: str, numbers: Numbers) -> str:
    columns = dict(zip(("time_s", "force_N", "position_mm"), (v.tolist() for v in numbers), strict=True))
    return json.dumps({"meta": {"rig": "3", key: value}, **columns})


def of_sheet(key: str, value: str, numbers: Numbers) -> Any:
    body = [[float(x) for x in row] for row in zip(*numbers, strict=True)]
    return sheet([list(HEADINGS), *body], [["rig", "3"], [key.replace("_", " "), value]])


#: How the six places say it; the suffix, and the headings of time, force and position there.
PLACES: Mapping[str, tuple[Callable[[str, str, Numbers], Any], str, tuple[str, str, str]]] = {
    "key=value": (lambda k, v, n: f"rig=3\n{k}={v}\n" + table(n), ".csv", HEADINGS),
    "comment": (lambda k, v, n: f"# {k.replace('_', ' ')}: {v}\n" + table(n), ".csv", HEADINGS),
    "footer": (lambda k, v, n: table(n) + f"\n{k.replace('_', ' ')};{v}\n", ".csv", HEADINGS),
    "sheet": (of_sheet, ".xlsx", HEADINGS),
    "attribute": (of_hdf5, ".h5", ("time", "force", "position")),
    "JSON": (of_json, ".json", ("time_s", "force_N", "position_mm")),
}

for key, value in (
    ("load_cell", "U9C 500 N"),
    ("force_range", "500 N"),
    ("mass", "2.5 kg"),
    ("filter", "200 Hz Bessel"),
    ("position_sensor", "laser, 50 mm"),
    ("pre_trigger", "5 ms"),
):
    for place, (write, suffix, _) in PLACES.items():
        add(f"{place}: {key} {value}", write(key, value, TRUE), suffix=suffix)

SCALED = ("force", "2"), ("force", "1"), ("force", "-1"), ("position", "25.4"), ("position", "1"), ("time", "0.5")
for (key, value, numbers), (role, worth) in zip(
    (
        ("k_force", "2.0", (TIME, FORCE / 2, POSITION)),
        ("force_zero", "1.5 N", (TIME, FORCE + 1.5, POSITION)),
        ("force_sign", "-1", (TIME, -FORCE, POSITION)),
        ("position_unit", "inch", (TIME, FORCE, POSITION / 25.4)),
        ("position_delay", "5 ms", (TIME, FORCE, POSITION)),
        ("time_factor", "0.5", (TIME * 2, FORCE, POSITION)),
    ),
    SCALED,
    strict=True,
):
    for place, (write, suffix, headings) in PLACES.items():
        column = headings[("time", "force", "position").index(role)]
        unit = {"time": "s/s", "force": "N/N", "position": "mm/mm"}[role]
        add(
            f"{place}: {key} {value}",
            write(key, value, numbers),
            suffix=suffix,
            refused=key.replace("_", "[_ ]"),
            remedy={
                "channels": {role: {"column": column, "scale": f"{worth} {unit}" if "inch" not in value else worth}}
            },
            force=FORCE + 1.5 if key == "force_zero" else FORCE,
            rtol=1e-6,
        )

for heading, numbers, role, worth in (
    ("time [10 ms]", (TIME * 100, FORCE, POSITION), "time", "10 ms"),
    ("force [N] (inv)", (TIME, -FORCE, POSITION), "force", "-1"),
    ("force [N] (zero 1.5)", (TIME, FORCE + 1.5, POSITION), "force", "1"),
    ("position [mm] (delayed 5 ms)", (TIME, FORCE, POSITION), "position", "1"),
    ("force uncalibrated [N]", (TIME, FORCE / 2, POSITION), "force", "2"),
    ("force [N] at half gain", (TIME, FORCE / 2, POSITION), "force", "2"),
):
    names = [heading if heading.startswith(h.split(" ")[0]) else h for h in HEADINGS]
    add(
        f"heading: {heading}",
        ",".join(names) + "\n" + rows(numbers),
        refused="10 ms|inv|zero|delayed|uncal|half|unit",
        remedy={"channels": {role: {"column": heading, "scale": worth}}},
        force=FORCE + 1.5 if "zero" in heading else FORCE,
        rtol=1e-6,
    )
