"""Series of an independent simulator with and without a law of speed: how often it is found, how often made up.

A long study: ``pytest -m slow -s tests/validation/test_speed_laws.py``. Each series is drawn anew from its number:
fibre and guide, which parameter depends on speed, how strongly and with which sign; without a law, records scatter by
one percent.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest

from fibrefit.study import load_study
from fibrefit.workflow.together.series import series_study
from tests.independent.laws import DRIVE, DROP
from tests.independent.make import write_study
from tests.independent.series import Series, draw_base, make_series

LAWFUL, LAWLESS = {DROP: 15, DRIVE: 15}, {DROP: 30, DRIVE: 30}
FOUND, MADE_UP = 0.9, 0.05
SCATTER = 0.01
STRENGTHS = {
    "stiffness": ("fibre.stiffness_speed_exponent", "stiffness_exponent", (0.01, 0.05)),
    "damping": ("fibre.damping_speed_exponent", "damping_exponent", (0.1, 0.5)),
    "friction": ("guide.friction_speed_exponent", "friction_exponent", (0.1, 0.3)),
}
"""Law, its exponent in the simulator, and the range of its size."""


@dataclass(frozen=True)
class Case:
    """One series: which parameter goes with speed, empty for none, and by which exponent."""

    rig: str
    number: int
    parameter: str = ""

    def make(self) -> Series:
        """Draw it and take the records."""
        rng = np.random.default_rng([self.number, len(self.rig), len(self.parameter)])
        base = draw_base(rng)
        effects = {}
        if self.parameter:
            name, key, (low, high) = STRENGTHS[self.parameter]
            effects = {name: {key: float(rng.uniform(low, high) * rng.choice([-1.0, 1.0]))}}
        return make_series(self.rig, effects, seed=self.number, base=base, scatter=0.0 if effects else SCATTER)

    def asked(self, folder: Path) -> str:
        """Parameters that were found to depend on speed, joined; the answer where it is not a law."""
        write_study(self.make(), folder)
        found = series_study(load_study(folder))
        if found.answer != "speed_law":
            return found.answer
        return " + ".join(sorted(one.law.parameter for one in found.verdict.curves))


def share(cases: list[Case], wanted: set[str], folder: Path) -> float:
    outcomes = []
    for case in cases:
        outcome = case.asked(folder / f"{case.rig}-{case.parameter}-{case.number}")
        print(f"{case}: {outcome}", flush=True)
        outcomes.append(outcome == case.parameter if case.parameter else outcome in wanted)
    return float(np.mean(outcomes))


@pytest.mark.slow
@pytest.mark.parametrize("rig", [DROP, DRIVE])
def test_a_law_is_found(rig: str, tmp_path: Path) -> None:
    names = list(STRENGTHS)
    cases = [Case(rig, 100 + n, names[n % len(names)]) for n in range(LAWFUL[rig])]
    assert share(cases, set(), tmp_path) >= FOUND


@pytest.mark.slow
@pytest.mark.parametrize("rig", [DROP, DRIVE])
def test_none_is_made_up_of_scatter(rig: str, tmp_path: Path) -> None:
    cases = [Case(rig, 500 + n) for n in range(LAWLESS[rig])]
    assert share(cases, {"constant", "per_record"}, tmp_path) >= 1.0 - MADE_UP
