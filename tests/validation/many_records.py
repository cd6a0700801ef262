"""A long series of drops, of which one in a hundred is damaged in one of ten ways, with the truth of each record.

Lift, inclination, noise and length are varied; the fibre is another one in each record, by two percent, so that no
record's answer is that of its neighbour.
"""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from tests.independent.laws import DROP
from tests.independent.make import RIG_TABLES
from tests.independent.sensors import USUAL
from tests.independent.series import Plan, drop_plan, scattered, take
from tests.independent.simulate import Base

BASE = Base(14_000.0, 15.0, 3.0)
SCATTER = 0.02
STEP = 2e-5
"""Step of the independent simulator in s: its error is below a hundredth of the noise."""
EACH = 100
"""One record in so many is damaged."""
HEADING = "time [s],force [N],position [mm]"

Damage = Callable[[list[str]], list[str] | None]


def _without_force(lines: list[str]) -> list[str]:
    return [",".join(line.split(",")[::2]) for line in lines]


def _with_a_dead_position(lines: list[str]) -> list[str]:
    first = lines[1].split(",")[2]
    return [lines[0], *(",".join([*line.split(",")[:2], first]) for line in lines[1:])]


def _exchanged(lines: list[str]) -> list[str]:
    return ["time [s],position [mm],force [N]", *lines[1:]]


def _begun_late(lines: list[str]) -> list[str]:
    places = np.array([float(line.rpartition(",")[2]) for line in lines[1:]])
    falling = int(np.argmax(places - places[:100].mean() > 0.5 * np.ptp(places)))
    return [lines[0], *lines[1 + falling :]]


def _begun_again(lines: list[str]) -> list[str]:
    middle = len(lines) // 2
    return [*lines[:middle], *lines[1 : 1 + middle]]


DAMAGES: dict[str, tuple[Damage, str]] = {
    "missing": (lambda lines: None, "no such file"),
    "empty": (lambda lines: [], "empty"),
    "cut in the rest": (lambda lines: lines[:90], "does not fall by its lift"),
    "no force": (_without_force, "force"),
    "no headings": (lambda lines: lines[1:], "without headings"),
    "a dead position": (_with_a_dead_position, "does not fall by its lift"),
    "exchanged": (_exchanged, "exchanged"),
    "begun late": (_begun_late, "moves from the first sample"),
    "a unit that is none of a force": (
        lambda lines: [lines[0].replace("[N]", "[mm]"), *lines[1:]],
        'no column "force [N]"',
    ),
    "a time that begins again": (_begun_again, "time"),
}
"""What is done to the lines of a file, and a word of the reason it has to be refused or doubted for."""


@dataclass(frozen=True)
class Made:
    """A record that was made.

    Parameters
    ----------
    name : str
        Of its file.
    truth : Base
    damage : str
        Empty for none.
    """

    name: str
    truth: Base
    damage: str


def make(folder: Path, number: int, seed: int, base: Base = BASE, scatter: float = SCATTER) -> list[Made]:
    """Write records and study of a series.

    Parameters
    ----------
    folder : Path
    number : int
        Of records.
    seed : int
    base : Base
        About which fibre and guide of the records scatter.
    scatter : float
        Relative standard deviation between records.
    """
    folder.mkdir(parents=True, exist_ok=True)
    rows = ['schema = "fibrefit/study/1"', f'name = "{number} drops"', "", "[rig]", f'kind = "{DROP}"']
    rows += [f'{key} = "{value}"' for key, value in RIG_TABLES[DROP].items()]
    rows += ["", "[channels]", 'time = "time [s]"', 'force = "force [N]"', 'position = "position [mm]"']
    found = []
    for n in range(number):
        made, said = _make_one(folder, n, seed, base, scatter)
        found.append(made)
        rows += ["", "[[records]]", *said]
    (folder / "study.toml").write_text("\n".join(rows) + "\n", encoding="utf-8")
    content = [{"name": one.name, "truth": one.truth._asdict(), "damage": one.damage} for one in found]
    (folder / "truth.json").write_text(json.dumps(content, indent=1) + "\n", encoding="utf-8")
    return found


def known(folder: Path) -> list[Made]:
    """What was made in a folder; nothing where there is nothing."""
    file = folder / "truth.json"
    content = json.loads(file.read_text(encoding="utf-8")) if file.is_file() else []
    return [Made(row["name"], Base(**row["truth"]), row["damage"]) for row in content]


def _make_one(folder: Path, number: int, seed: int, base: Base, scatter: float) -> tuple[Made, list[str]]:
    rng = np.random.default_rng([seed, number])
    lift, degrees = round(rng.uniform(4.0, 20.0), 1), int(rng.integers(45, 91))
    usual = drop_plan(1, degrees, rng, after=rng.uniform(1.0, 1.8))
    plan = Plan(f"drop_{number:04d}.csv", replace(usual.conditions, lift=1e-3 * lift), usual.times)
    factor = math.exp(rng.uniform(math.log(0.5), math.log(2.0)))
    noise = replace(USUAL, rms={channel: factor * rms for channel, rms in USUAL.rms.items()})
    truth = scattered(base, rng, scatter)
    record = take(plan, truth, {}, rng.uniform(-3e-4, 3e-4), noise, rng, STEP).logged
    table = zip(record.times, record.force, 1e3 * record.position, strict=True)
    lines = [HEADING, *(f"{t:.4f},{f:.2f},{x:.3f}" for t, f, x in table)]
    kinds = list(DAMAGES)
    damage = kinds[number // EACH % len(kinds)] if number % EACH == EACH // 2 else ""
    kept = DAMAGES[damage][0](lines) if damage else lines
    if kept is not None:
        (folder / plan.name).write_text("\n".join([*kept, ""]) if kept else "", encoding="utf-8")
    said = [f'file = "{plan.name}"', f'lift = "{lift:g} mm"', f'inclination = "{degrees} deg"']
    return Made(plan.name, truth, damage), said
