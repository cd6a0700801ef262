"""Makes the short drops in ``tests/data/discover`` anew: ``python -m tests.discovery.make_data``.

The simulator is the independent one, which shares nothing with the package.
"""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np

from tests.independent.laws import DROP
from tests.independent.make import write
from tests.independent.sensors import USUAL
from tests.independent.series import RATE, Plan, Series, take
from tests.independent.simulate import FINE_STEP, Base, Conditions, Effects

FOLDER = Path(__file__).resolve().parent.parent / "data" / "discover"
BASE = Base(stiffness=2.2e4, damping=20.0, friction=3.0)
RELEASE, SECONDS, ZERO = 0.12, 0.85, 1.5e-4
DROPS = ((10, 90), (20, 45))
HIDDEN: dict[str, Effects] = {
    "plain": {},
    "viscous": {"guide.viscous_friction": {"viscous_coefficient": 2.5}},
    "rough": {"open.position_dependent_friction": {"roughness": 0.45, "roughness_length": 5e-3}},
}


def main() -> None:
    for seed, (name, effects) in enumerate(HIDDEN.items(), 1):
        rng = np.random.default_rng(seed)
        times = np.arange(round(SECONDS * RATE)) / RATE
        records = []
        for lift, degrees in DROPS:
            conditions = Conditions(DROP, inclination=math.radians(degrees), lift=1e-3 * lift, release=RELEASE)
            plan = Plan(f"drop_{lift}mm_{degrees}deg.csv", conditions, times)
            records.append(take(plan, BASE, effects, ZERO, USUAL, rng, FINE_STEP))
        series = Series(DROP, BASE, {k: dict(v) for k, v in effects.items()}, tuple(records), records[0], None, seed)
        write(series, FOLDER / name)


if __name__ == "__main__":
    main()
