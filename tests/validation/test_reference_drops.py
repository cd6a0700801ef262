"""The drop rig and its effects against trajectories of an independent simulator."""

from __future__ import annotations

import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from tests.simulation.drops import deviation, drop, jacobian, respond
from tests.validation.reference import DERIVATIVE, FORCE, POSITION, effect_values, index, names, table

DROPS = [name for name in names("fibre_mass__") if "point_masses" not in name]
#: What the integrator reaches, with a margin of ten: a loss of order would stay within the limits asked for.
REACHED = 5e-5


@pytest.mark.parametrize("name", DROPS)
def test_force_and_position(name: str) -> None:
    effect = index()[name]["effect"]
    effects = () if effect == "base" else (CATALOGUE[effect],)
    true, found = table(name), respond(drop(), effects, **effect_values(name))
    force, position = (deviation(found[role][1:], true[role]) for role in ("force", "position"))
    assert force < min(FORCE, REACHED), f"force deviates by {force:.1e} of its range"
    assert position < min(POSITION, REACHED), f"position deviates by {position:.1e} of its range"


@pytest.mark.parametrize(("parameter", "symbol"), [("stiffness", "k"), ("damping", "b"), ("friction", "Fc")])
def test_derivatives(parameter: str, symbol: str) -> None:
    true, found = table("fibre_mass__base"), jacobian(drop())
    for role in ("force", "position"):
        column = true[f"d {role} / d {symbol}"]
        error = np.sqrt(np.mean((found[role][parameter][1:] - column) ** 2) / np.mean(column**2))
        assert error < DERIVATIVE, f"d {role} / d {symbol} deviates by {error:.1e}"


def test_the_comparison_sees_a_thousandth_of_the_damping() -> None:
    true, found = table("fibre_mass__base"), respond(drop(), damping=25.0 * 1.001)
    assert deviation(found["force"][1:], true["force"]) > REACHED
