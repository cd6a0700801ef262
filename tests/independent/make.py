"""Makes series of records with a known truth: ``python -m tests.independent.make --effect NAME --seed N --out DIR``."""

from __future__ import annotations

import argparse
import json
import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from tests.independent.laws import DRIVE, DROP, EFFECTS
from tests.independent.sensors import USUAL
from tests.independent.series import (
    Recording,
    Series,
    draw_base,
    draw_shape,
    make_series,
    plan_series,
)
from tests.independent.strength import Task, gap_of_all, strength_for

HEADINGS = {
    "force": ("force [N]", 1.0, "%.2f"),
    "position": ("position [mm]", 1e3, "%.3f"),
    "drive": ("drive [mm]", 1e3, "%.3f"),
}
RIG_TABLES = {
    DROP: {"weight_mass": "3.096 kg", "fibre_length": "599 mm", "fibre_mass": "1.63 g"},
    DRIVE: {
        "weight_mass": "3.096 kg",
        "fibre_length": "1.82 m",
        "fibre_mass": "4.95 g",
        "pulley_diameter": "80 mm",
        "inclination": "30 deg",
        "wrap_angle": "150 deg",
    },
}


def hide(
    rig: str,
    names: Sequence[str],
    seed: int,
    gap: float | Sequence[float] = 2.0,
    *,
    scatter: float = 0.0,
    pink: float = USUAL.pink,
    by: str = "refit",
) -> Series:
    """A series in which the named effects are hidden, each as strong as leaves its gap when it is alone.

    Parameters
    ----------
    rig : "fibre_mass" or "pulley_drive"
    names : of the effects; none for a series in which nothing is missing
    seed : of all that is drawn: base parameters, shapes, signs, conditions, noise
    gap : clean gap of each effect, or one for each
    scatter : relative standard deviation of the base parameters from record to record
    pink : share of the noise amplitude that is pink
    by : how the strength is found, see `strength_for`

    Returns
    -------
    Series
        Its `base_gap` is that of all effects together.
    """
    rng = np.random.default_rng([seed, 1])
    base = draw_base(rng)
    plans = plan_series(rig, np.random.default_rng(seed))[:-1]
    task, found = Task(plans, base), []
    gaps = [gap] * len(names) if isinstance(gap, float | int) else gap
    for name, wanted in zip(names, gaps, strict=True):
        if rig not in EFFECTS[name].rigs:
            raise ValueError(f"{name} does not apply to {rig}; it knows {', '.join(EFFECTS[name].rigs)}")
        sign = -1.0 if EFFECTS[name].signed and rng.random() < 0.5 else 1.0
        found.append(strength_for(task, name, wanted, draw_shape(name, rng), sign=sign, by=by))
    base_gap = gap_of_all(task, found) if found else 0.0
    effects = {name: values for one in found for name, values in one.effects.items()}
    noise = replace(USUAL, pink=pink)
    return make_series(rig, effects, seed=seed, base=base, scatter=scatter, noise=noise, base_gap=base_gap)


def write(series: Series, folder: Path) -> None:
    """CSV records, study.toml, truth.json and the held-out record in a folder of its own."""
    held_out = folder / "holdout"
    held_out.mkdir(parents=True, exist_ok=True)
    write_study(series, folder)
    _write_record(series.held_out, held_out)
    (held_out / "study.toml").write_text(_study(series, (series.held_out,), "hold-out"), encoding="utf-8")
    (folder / "truth.json").write_text(json.dumps(_truth(series), indent=1) + "\n", encoding="utf-8")


def write_study(series: Series, folder: Path) -> None:
    """CSV records and study.toml, nothing of the truth."""
    folder.mkdir(parents=True, exist_ok=True)
    for record in series.records:
        _write_record(record, folder)
    (folder / "study.toml").write_text(_study(series, series.records, "series"), encoding="utf-8")


def _write_record(record: Recording, folder: Path) -> None:
    columns, formats, headings = [record.logged.times], ["%.4f"], ["time [s]"]
    for channel, (heading, scale, form) in HEADINGS.items():
        values = getattr(record.logged, channel)
        if values is not None:
            columns.append(scale * values)
            formats.append(form)
            headings.append(heading)
    np.savetxt(
        folder / record.name,
        np.column_stack(columns),
        fmt=formats,
        delimiter=",",
        header=",".join(headings),
        comments="",
    )


def _study(series: Series, records: Sequence[Recording], what: str) -> str:
    channels = {"time": "time [s]"} | {
        c: row[0] for c, row in HEADINGS.items() if getattr(records[0].clean, c) is not None
    }
    lines = ['schema = "fibrefit/study/1"', f'name = "{what} {series.seed}, {series.rig}"', "", "[rig]"]
    lines += [f'kind = "{series.rig}"', *(f'{key} = "{value}"' for key, value in RIG_TABLES[series.rig].items())]
    lines += ["", "[channels]", *(f'{role} = "{heading}"' for role, heading in channels.items())]
    for record in records:
        held = record.conditions
        lines += ["", "[[records]]", f'file = "{record.name}"']
        if series.rig == DROP:
            degrees = math.degrees(held.inclination)
            lines += [f'lift = "{1e3 * held.lift:g} mm"', f'inclination = "{degrees:g} deg"']
            # A study of drops states the whole weight of a record.
            whole = held.weight_mass + held.added_mass
            lines += [f'weight_mass = "{whole:g} kg"'] if held.added_mass else []
        else:
            lines += [f'added_mass = "{held.added_mass:g} kg"', f'excitation = "{held.excitation.shape}"']
    return "\n".join(lines) + "\n"


def _truth(series: Series) -> dict:
    parameters = series.base._asdict()
    for name, values in series.effects.items():
        parameters |= {f"{name}.{key}": value for key, value in values.items()}
    return {
        "rig": series.rig,
        "hidden": sorted(series.effects),
        "parameters": parameters,
        "base_gap": series.base_gap,
        "seed": series.seed,
        "records": {record.name: _conditions(record) for record in (*series.records, series.held_out)},
    }


def _conditions(record: Recording) -> dict:
    known = {"position_zero": record.zero, **record.base._asdict()}
    if record.conditions.kind == DROP:
        known["release"] = record.conditions.release
    return known


def main() -> None:
    parser = argparse.ArgumentParser(prog="python -m tests.independent.make", description=__doc__)
    parser.add_argument("--rig", choices=(DROP, DRIVE), help="default: the first that the effect applies to")
    parser.add_argument("--effect", action="append", default=[], choices=sorted(EFFECTS), help="may be given twice")
    parser.add_argument("--gap", type=float, default=2.0, help="clean gap each effect leaves to the base model")
    parser.add_argument("--scatter", type=float, default=0.0, help="relative scatter of the base parameters")
    parser.add_argument("--pink", type=float, default=USUAL.pink, help="share of the noise amplitude that is pink")
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--out", type=Path, required=True)
    given = parser.parse_args()
    rig = given.rig or next(rig for rig in (DROP, DRIVE) if all(rig in EFFECTS[name].rigs for name in given.effect))
    series = hide(rig, given.effect, given.seed, given.gap, scatter=given.scatter, pink=given.pink)
    write(series, given.out)
    print(json.dumps(_truth(series), indent=1))


if __name__ == "__main__":
    main()
