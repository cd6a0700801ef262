"""A fibre with a mass of its own: against trajectories of an independent simulator, and stable whatever the fibre."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.errors import StudyError
from fibrefit.laws.catalogue import CATALOGUE, select_effects
from fibrefit.laws.fibre.point_masses import point_masses
from fibrefit.rigs.catalogue import RIGS
from tests.simulation.drops import STEP, deviation, drive, drop, pendulum, respond
from tests.validation.reference import FORCE, POSITION, index, names, table

MASS = "fibre.mass.fibre_mass"
#: What the integrator reaches, with a margin of five.
REACHED = 1e-6
#: A fibre of a gram and a half against one without mass: a two-thousandth of the weight's.
LIGHT = 1e-3
#: The same fibre in steps a quarter as long.
FINER = 5e-4
CHAINS = [
    pytest.param(name, marks=pytest.mark.slow if "_1_" not in name else ())
    for name in names("fibre_mass__point_masses")
]


@pytest.mark.parametrize("name", CHAINS)
def test_force_and_position_are_those_of_the_reference(name: str) -> None:
    """Let go at rest 1 mm above the place where weight and points hang."""
    values, true = index()[name]["effect_parameters"], table(name)
    points, mass = int(values["point_masses [-]"]), values["fibre_mass [kg]"]
    carried = [3.096 + mass * (points - i) / points for i in range(points + 1)]
    hanging = sum(carried) * 9.81 / ((points + 1) * 20e3)
    experiment = drop(len(true["time"]) + 1, lift=1e-3 - hanging)
    found = respond(experiment, (point_masses(points),), friction=0.0, **{MASS: mass})
    force, position = (deviation(found[role][1:], true[role]) for role in ("force", "position"))
    assert force < min(FORCE, REACHED), f"force deviates by {force:.1e} of its range"
    assert position < min(POSITION, REACHED), f"position deviates by {position:.1e} of its range"


@pytest.mark.parametrize("damping", [25.0, 1.0, 0.0])
@pytest.mark.parametrize(
    "points", [1, pytest.param(4, marks=pytest.mark.slow), pytest.param(8, marks=pytest.mark.slow)]
)
def test_bounces_of_a_light_fibre_are_those_of_one_without_mass(points: int, damping: float) -> None:
    """Its segments go taut and slack thousands of times faster than it is sampled; nothing rings and nothing bursts."""
    effect, values = point_masses(points), {"damping": damping, MASS: 1.63e-3}
    found, plain = respond(drop(1601), (effect,), **values), respond(drop(1601), damping=damping)
    assert np.isfinite(found["force"]).all()
    assert found["force"].max() == pytest.approx(plain["force"].max(), rel=2e-3)
    assert deviation(found["position"], plain["position"]) < LIGHT
    fine = drop(4 * 1600 + 1)._replace(times=jnp.arange(4 * 1600 + 1) * (STEP / 4))
    assert deviation(found["position"], respond(fine, (effect,), **values)["position"][::4]) < FINER


@pytest.mark.slow
@pytest.mark.parametrize("mass", [5e-4, pytest.param(2e-3, marks=pytest.mark.slow)])
def test_what_a_bounce_stirs_up_in_the_fibre_is_over_as_soon_as_it_is_in_finer_steps(mass: float) -> None:
    """Points calm within microseconds; a whole step would leave a sixth of it in the gauge's next reading."""
    values = {"damping": 16.0, "stiffness": 3e4, MASS: mass}
    fine = drop(16 * 800 + 1)._replace(times=jnp.arange(16 * 800 + 1) * (STEP / 16))
    found, exact = (
        respond(experiment, (CATALOGUE["fibre.mass"],), **values)["force"] for experiment in (drop(801), fine)
    )
    off = np.abs(found - exact[::16])
    assert off.max() < 2e-3 * found.max()
    assert np.sqrt(np.mean(off**2)) < 1e-4 * found.max()


def test_a_heavier_fibre_moves_the_weight_another_way() -> None:
    effect = CATALOGUE["fibre.mass"]
    light, heavy = (respond(drop(801), (effect,), **{MASS: mass})["position"] for mass in (1.63e-3, 0.2))
    assert deviation(heavy, light) > 5.0 * LIGHT


@pytest.mark.slow
@pytest.mark.parametrize("kind", [pytest.param("pendulum", marks=pytest.mark.slow), "drive"])
def test_other_rigs_have_such_fibres_too(kind: str) -> None:
    experiment = {"pendulum": pendulum, "drive": drive}[kind](1601)
    plain, found, zero = (
        respond(experiment, effects, **values)
        for effects, values in (
            ((), {}),
            ((CATALOGUE["fibre.mass"],), {MASS: 4e-3}),
            ((CATALOGUE["fibre.mass"],), {MASS: 0.0}),
        )
    )
    for role, reading in plain.items():
        assert np.array_equal(zero[role], reading)
        assert 0.0 < deviation(found[role], reading) < 10.0 * LIGHT


def test_the_study_says_how_many_points() -> None:
    (default,) = select_effects(["fibre.mass"], RIGS["fibre_mass"])
    (chosen,) = select_effects(["fibre.mass"], RIGS["fibre_mass"], points=7)
    assert default is CATALOGUE["fibre.mass"]
    assert (default.points, chosen.points) == (2, 7)
    assert chosen is point_masses(7)
    assert chosen.parameters == default.parameters


def test_a_rim_that_moves_by_itself_and_points_exclude_each_other() -> None:
    with pytest.raises(StudyError, match='"fibre.mass": stands beside "pulley.inertia"; expected one of the two'):
        select_effects(["fibre.mass", "pulley.inertia"], RIGS["pulley_drive"])
