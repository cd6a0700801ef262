"""``python -m tests.report.many FOLDER``: a study of two hundred drops whose fibre wears; the batch of docs/page.md."""

from __future__ import annotations

import math
import sys
from pathlib import Path

import numpy as np

from fibrefit.laws.guide.drag import ViscousFriction
from tests.fitting import made

NUMBER = 200
LIFTS = (5e-3, 1e-2, 2e-2)
WEAR = 5e-4
"""Share of its stiffness that the fibre loses from one drop to the next."""
STICKY = range(19, NUMBER, 20)
"""Drops over a guide that has become viscous."""
BROKEN = (33, 77, 120)
"""Records whose force was not written."""


def write_many(folder: Path) -> Path:
    """The study and its records."""
    folder.mkdir(parents=True, exist_ok=True)
    lines = [
        'schema = "fibrefit/study/1"',
        'name = "two hundred drops of one fibre"',
        "[rig]",
        'kind = "fibre_mass"',
        f'weight_mass = "{made.MASS} kg"',
        "[channels]",
        'time = "time [s]"',
        'force = "force [N]"',
        'position = "position [mm]"',
    ]
    for i in range(NUMBER):
        one = drop(i)
        made.write(folder, [one])
        if i in BROKEN:
            text = (folder / one.name).read_text(encoding="utf-8")
            (folder / one.name).write_text(text.replace("force [N]", "channel 3"), encoding="utf-8")
        lines += ["[[records]]", f'file = "{one.name}"', f'lift = "{1e3 * LIFTS[i % 3]:g} mm"']
        lines += [f'inclination = "{90 if i % 2 else 45} deg"']
    (folder / "study.toml").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return folder


def drop(number: int) -> made.Made:
    """One of the records."""
    random = np.random.default_rng(number)
    values = {
        "stiffness": made.TRUTH["stiffness"] * math.exp(-WEAR * number) * (1.0 + 0.002 * random.standard_normal()),
        "friction": made.TRUTH["friction"] * (1.0 + 0.02 * random.standard_normal()),
    }
    effects: tuple = ()
    if number in STICKY:
        effects, values["guide__viscous_friction__viscous_coefficient"] = (ViscousFriction,), 6.0
    inclination = math.radians(90.0 if number % 2 else 45.0)
    return made.record(
        f"run_{number + 1:03d}.csv", LIFTS[number % 3], seed=number, inclination=inclination, effects=effects, **values
    )


if __name__ == "__main__":
    print(write_many(Path(sys.argv[1])))
