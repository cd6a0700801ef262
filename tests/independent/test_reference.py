"""The second simulator against converged trajectories of a third one."""

from __future__ import annotations

import json
import math
from pathlib import Path

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from tests.independent.chain import run_chain
from tests.independent.excitation import Excitation
from tests.independent.laws import GRAVITY
from tests.independent.simulate import Base, Conditions, laws_for, simulate

DATA = Path(__file__).resolve().parent.parent / "data" / "reference"
INDEX = json.loads((DATA / "index.json").read_text(encoding="utf-8"))

# First order in the step at each switch: 5 µs against switches in hundreds of steps. Measured here: 3e-6 to 7e-4 of the
# range, the largest where one sample falls on the other side of a jump of the force.
FORCE_TOLERANCE = 1e-3
POSITION_TOLERANCE = 5e-5
# Taut throughout, no switch at all: second order in the step.
CHAIN_TOLERANCE = 1e-6

NAMES = sorted(name for name in INDEX if name.startswith(("fibre_mass", "pulley_drive")) and "point_masses" not in name)
CHAINS = sorted(name for name in INDEX if "point_masses" in name)


def load(name: str) -> np.ndarray:
    return np.loadtxt(DATA / f"{name}.csv.gz", delimiter=",", skiprows=1)


def relative_rms(mine: np.ndarray, reference: np.ndarray) -> float:
    return math.sqrt(np.mean((mine - reference) ** 2)) / np.ptp(reference)


@pytest.mark.parametrize("name", NAMES)
def test_agrees_with_reference(name: str) -> None:
    entry = INDEX[name]
    values = {key.split(" [")[0]: value for key, value in entry["effect_parameters"].items()}
    geometry = values if entry["effect"] == "rig.asymmetric_weight" else {}
    effects = {} if geometry or entry["effect"] == "base" else {entry["effect"]: values}
    if entry["rig"] == "fibre_mass":
        conditions = Conditions("fibre_mass", lift=0.012)
    else:
        excitation = Excitation("trapezoid", 0.06, 0.25, lead=0.1, hold=0.4, ramps=2)
        conditions = Conditions(
            "pulley_drive",
            3.096,
            5.035,
            math.radians(30.0),
            excitation=excitation,
            zeroed=False,
            relaxed=False,
            **geometry,
        )
    reference = load(name)
    mine = simulate(conditions, Base(), effects, reference[:, 0])
    assert relative_rms(mine.force, reference[:, 1]) <= FORCE_TOLERANCE
    assert relative_rms(mine.position, reference[:, 2]) <= POSITION_TOLERANCE


def test_a_wrong_parameter_is_seen() -> None:
    reference = load("fibre_mass__base")
    mine = simulate(Conditions("fibre_mass", lift=0.012), Base(stiffness=2.02e4), {}, reference[:, 0])
    assert relative_rms(mine.force, reference[:, 1]) > 3 * FORCE_TOLERANCE


@pytest.mark.parametrize("name", CHAINS)
def test_point_masses_agree_with_reference(name: str) -> None:
    """Hanging from the frame, let go 1 mm above rest; the masses displaced in proportion."""
    values = INDEX[name]["effect_parameters"]
    count, fibre_mass = int(values["point_masses [-]"]), values["fibre_mass [kg]"]
    laws = laws_for(Conditions(), Base(friction=0.0), {})
    segments = count + 1
    carried = (laws.mass + fibre_mass / count * np.arange(count, -1, -1)) * GRAVITY
    hanging = np.cumsum(carried / (segments * laws.stiffness))
    reference, step = load(name), 5e-6
    n = round(reference[-1, 0] / step) + 1
    still = np.zeros(n)
    places = hanging - 1e-3 * np.arange(1, segments + 1) / segments
    motion = run_chain(places, count, still, still, 0.0, step, laws, fibre_mass, fibre_mass * GRAVITY)
    for mine, column in zip(motion, reference[:, 1:].T, strict=True):
        assert relative_rms(np.interp(reference[:, 0], (np.arange(n) + 0.5) * step, mine), column) <= CHAIN_TOLERANCE
