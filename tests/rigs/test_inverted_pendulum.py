"""The inverted pendulum against trajectories of an independent simulator, closed forms and its own differences."""

from __future__ import annotations

import math

import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from tests.simulation.drops import deviation, jacobian, pendulum, respond
from tests.validation.reference import FORCE, POSITION, index, names, table

#: What the integrator reaches, with a margin of ten: a loss of order would stay within the limits asked for.
REACHED = 2e-7
#: Central differences of a trajectory computed to 1e-9 of its range, over steps of 1e-6 of the value.
DIFFERENCES = 1e-3
#: Period of a swing read off zero crossings between samples.
CROSSINGS = 1e-4


@pytest.mark.parametrize("name", names("inverted_pendulum__"))
def test_angle_and_forces_are_those_of_the_reference(name: str) -> None:
    entry, true = index()[name], table(name)
    drive = pendulum(8001, entry["frequency_Hz"], entry["amplitude_m"], preload=entry["preload_N"])
    values = {parameter: entry[parameter] for parameter in ("stiffness", "damping")}
    found = respond(drive, tension_law=entry["tension_law"], **values)
    angle, *forces = (deviation(found[role][1:], true[role]) for role in ("angle", "force_1", "force_2"))
    assert angle < min(POSITION, REACHED), f"angle deviates by {angle:.1e} of its range"
    assert max(forces) < min(FORCE, REACHED), f"forces deviate by {max(forces):.1e} of their range"


def test_the_comparison_sees_a_ten_thousandth_of_the_stiffness() -> None:
    name = "inverted_pendulum__3Hz_preload0N_clamped"
    found = respond(pendulum(8001), stiffness=8264.0 * 1.0001)
    assert deviation(found["angle"][1:], table(name)["angle"]) > REACHED


def test_small_oscillations_have_the_frequency_of_one_taut_fibre() -> None:
    """Without damping, drive and preload: ω² = (k r² - m g l/2)/I with the lever r = a d/sqrt(a² + d²)."""
    lever = 1.2 * 0.75 / math.hypot(1.2, 0.75)
    expected = math.sqrt((8264.0 * lever**2 - 9.864 * 9.81 * 0.5) / 3.288) / (2.0 * math.pi)
    assert expected == pytest.approx(5.04, abs=0.005)
    still = pendulum(4001, amplitude=0.0)
    angle = respond(still, damping=0.0, start_rate=1e-3)["angle"]
    times = np.asarray(still.times)
    rising = np.flatnonzero((angle[:-1] < 0.0) & (angle[1:] >= 0.0))
    crossings = times[rising] - angle[rising] * np.diff(times)[0] / (angle[rising + 1] - angle[rising])
    assert 1.0 / np.diff(crossings).mean() == pytest.approx(expected, rel=CROSSINGS)


def test_preload_is_the_force_in_the_upright_position() -> None:
    found = respond(pendulum(3, amplitude=0.0, preload=585.0))
    assert found["force_1"][0] == pytest.approx(585.0, rel=1e-12)
    assert found["force_2"][0] == pytest.approx(585.0, rel=1e-12)


def test_without_a_drive_it_stays_upright() -> None:
    found = respond(pendulum(201, amplitude=0.0))
    assert not found["angle"].any()
    assert not found["force_1"].any()


def test_a_clamped_fibre_never_pushes_and_the_other_law_may() -> None:
    drive = pendulum(2001, 5.0)
    clamped, plain = (respond(drive, tension_law=law, damping=60.0) for law in ("clamped", "heaviside"))
    for role in ("force_1", "force_2"):
        assert clamped[role].min() >= 0.0
        assert plain[role].min() < 0.0


@pytest.mark.parametrize("name", ["stiffness", pytest.param("damping", marks=pytest.mark.slow)])
def test_derivatives_are_those_of_the_readings(name: str) -> None:
    drive, value = pendulum(1601), {"stiffness": 8264.0, "damping": 4.132}[name]
    exact, size = jacobian(drive), 1e-6 * value
    up, down = (respond(drive, **{name: value + change}) for change in (size, -size))
    for role, columns in exact.items():
        error = np.sort(np.abs(columns[name] - (up[role] - down[role]) / (2.0 * size)))
        # Where a snap passes a sample between the two runs, the difference holds the jump itself.
        error = error[: -len(error) // 50]
        assert np.sqrt(np.mean(error**2)) < DIFFERENCES * np.sqrt(np.mean(columns[name] ** 2)), role


@pytest.mark.parametrize("name", [pytest.param("fibre.maxwell_branch", marks=pytest.mark.slow), "sensor.force_lag"])
def test_effects_leave_no_trace_at_their_null_and_one_otherwise(name: str) -> None:
    effect = CATALOGUE[name]
    typical = {f"{name}.{p.name}": p.typical for p in effect.parameters}
    null = typical | {f"{name}.{p.name}": p.null for p in effect.parameters if p.name in effect.strength}
    plain, zero, there = (
        respond(pendulum(801), effects, **values)
        for effects, values in (((), {}), ((effect,), null), ((effect,), typical))
    )
    assert all(np.array_equal(zero[role], reading) for role, reading in plain.items())
    assert not np.array_equal(there["force_1"], plain["force_1"])
