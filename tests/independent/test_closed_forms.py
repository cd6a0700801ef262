"""The second simulator against what can be worked out by hand, and in its limits."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("numba", reason="the second simulator is compiled with numba: install the extra `bench`")

from tests.independent.excitation import Excitation
from tests.independent.laws import CATALOGUE, DRIVE, DROP, EFFECTS, GRAVITY, applicable, values_at
from tests.independent.simulate import Base, Conditions, simulate

TIMES = np.arange(0.0, 1.0, 5e-4)
HELD = Conditions(DROP, lift=0.012, release=0.1)
RAMP = Excitation("trapezoid", 0.06, 0.25, lead=0.1, hold=0.4, ramps=2)
PULLED = Conditions(DRIVE, added_mass=5.035, inclination=math.radians(30.0), excitation=RAMP)

# The midpoint rule is exact for constant forces; what is left is interpolation between steps of 5 µs, g h²/8.
BALLISTIC = 1e-10
# Force of the fibre over one step at impact speed: the resolution of an instant.
ONE_STEP = 1e-4


def test_free_fall() -> None:
    out = simulate(HELD, Base(friction=4.0), {}, TIMES)
    falling = (out.times > 0.1) & (out.position < -1e-4) & (out.times < 0.15)
    fallen = 0.5 * (GRAVITY - 4.0 / 3.096) * (out.times[falling] - 0.1) ** 2
    np.testing.assert_allclose(out.position[falling], fallen - 0.012, atol=BALLISTIC)
    assert not out.force[falling].any()


def test_held_until_release() -> None:
    out = simulate(HELD, Base(), {}, TIMES)
    held = out.times <= 0.1
    assert np.ptp(out.position[held]) == 0.0
    assert not out.force[held].any()


def test_undamped_bounce_returns_to_its_height() -> None:
    out = simulate(HELD, Base(friction=0.0, damping=0.0), {}, np.arange(0.0, 0.5, 5e-4))
    late = out.position[out.times > 0.25]
    assert late.min() == pytest.approx(-0.012, abs=5e-7)


def test_peak_force_from_energy() -> None:
    """No loss: k u²/2 = m g (u + lift) at the lowest point."""
    k, weight = 2e4, 3.096 * GRAVITY
    deepest = (weight + math.sqrt(weight**2 + 2.0 * k * weight * 0.012)) / k
    out = simulate(HELD, Base(k, 0.0, 0.0), {}, np.arange(0.1, 0.2, 1e-5))
    assert out.force.max() == pytest.approx(k * deepest, rel=ONE_STEP)


def test_comes_to_rest_inside_the_friction_band() -> None:
    out = simulate(HELD, Base(damping=60.0, friction=5.0), {}, np.arange(0.0, 2.0, 5e-4))
    last = out.position[-400:]
    assert np.ptp(last) == 0.0
    assert abs(out.force[-1] - 3.096 * GRAVITY) <= 5.0


@pytest.mark.parametrize("exponent", [-0.05, 0.05])
def test_a_fibre_that_is_softer_or_stiffer_at_rest_begins_at_rest(exponent: float) -> None:
    effects = {"fibre.stiffness_speed_exponent": {"stiffness_exponent": exponent}}
    out = simulate(PULLED, Base(friction=1.5), effects, TIMES[:180])
    assert np.ptp(out.position) < BALLISTIC
    assert out.force == pytest.approx(out.force[0])


def test_capstan_ratio() -> None:
    """Pulled slowly up, the weight's side carries m g sin α + F_c and the drive's side exp(μφ) times that."""
    slow = replace(PULLED, excitation=Excitation("trapezoid", 0.03, 0.03, lead=0.1, hold=1.0, ramps=1))
    out = simulate(slow, Base(damping=200.0), {"pulley.capstan_friction": {"capstan_coefficient": 0.05}}, TIMES)
    steady = (out.times > 0.6) & (out.times < 0.9)
    expected = (8.131 * GRAVITY * 0.5 + 4.0) * math.exp(0.05 * math.radians(150.0))
    assert np.mean(out.force[steady]) == pytest.approx(expected, rel=2e-3)


def test_asymmetric_pull_has_its_lever() -> None:
    """At rest in the band the force is unchanged; pulled up slowly, T c = m g sin α + F_c."""
    slow = replace(
        PULLED,
        lateral_offset=0.28,
        guide_distance=0.9,
        excitation=Excitation("trapezoid", 0.03, 0.03, lead=0.1, hold=1.0, ramps=1),
    )
    out = simulate(slow, Base(damping=200.0), {}, TIMES)
    i = 1600
    along = 0.9 - (out.position[i] - 8.131 * GRAVITY * 0.5 / 2e4)
    lever = along / math.hypot(along, 0.28)
    assert np.mean(out.force[i - 100 : i + 100]) * lever == pytest.approx(8.131 * GRAVITY * 0.5 + 4.0, rel=2e-3)


def test_delay_and_drift_and_gain() -> None:
    plain = simulate(HELD, Base(), {}, TIMES)
    late = simulate(HELD, Base(), {"sensor.force_delay": {"delay": 2e-3}}, TIMES)
    np.testing.assert_allclose(late.force[4:], plain.force[:-4], atol=ONE_STEP)
    other = {
        "sensor.force_gain": {"gain": 1.1},
        "sensor.force_offset": {"offset": 0.3},
        "sensor.force_drift": {"drift": 2.0},
    }
    np.testing.assert_allclose(simulate(HELD, Base(), other, TIMES).force, 1.1 * plain.force + 0.3 + 2.0 * TIMES)


def test_lag_and_resonance_keep_a_steady_force() -> None:
    for name, values in (
        ("sensor.force_lag", {"time_constant": 2e-3}),
        ("sensor.gauge_resonance", {"natural_frequency": 90.0, "damping_ratio": 0.05}),
    ):
        out = simulate(PULLED, Base(), {name: values}, TIMES)
        np.testing.assert_allclose(out.force[:200], 8.131 * GRAVITY * 0.5, rtol=1e-9)


def test_lag_of_a_ramp() -> None:
    """A first-order lag follows a ramp its own time constant late: F(t - τ)."""
    tau = 5e-4
    plain = simulate(PULLED, Base(friction=60.0), {}, TIMES)
    lagging = simulate(PULLED, Base(friction=60.0), {"sensor.force_lag": {"time_constant": tau}}, TIMES)
    # Stuck in its guide while the drive accelerates: the force is k a t²/2 + b a t.
    i = np.searchsorted(TIMES, 0.115)
    assert plain.force[i] - lagging.force[i] == pytest.approx(
        2e4 * 8.0 * tau * (TIMES[i] - 0.1) + 25.0 * 8.0 * tau - 2e4 * 8.0 * tau**2, rel=1e-3
    )


def strongless(name: str) -> dict[str, float]:
    return values_at(name, 0.0, {key: low for key, (low, _) in EFFECTS[name].fixed.items()}, 2e4)


# At strength zero these stand for something infinite, or need a mass: their limit is approached instead.
LIMITS = {"guide.presliding", "drive.compliance", "sensor.gauge_resonance", "fibre.mass", "pulley.inertia"}


@pytest.mark.parametrize("rig", [DROP, DRIVE])
def test_every_effect_vanishes_at_nil(rig: str) -> None:
    conditions = HELD if rig == DROP else PULLED
    plain = simulate(conditions, Base(), {}, TIMES)
    # The rim of 50 g that bearing friction brings along stays.
    for name in {*applicable(rig), *applicable(rig, outside=True)} - LIMITS - {"pulley.bearing_friction"}:
        out = simulate(conditions, Base(), {name: strongless(name)}, TIMES)
        np.testing.assert_array_equal(out.force, plain.force, err_msg=name)
        np.testing.assert_array_equal(out.position, plain.position, err_msg=name)


@pytest.mark.parametrize(
    ("conditions", "name", "values", "tolerance"),
    [
        # What is left falls with the reciprocal: checked by halving it below.
        (HELD, "guide.presliding", {"bristle_stiffness": 2e8, "bristle_damping": 0.0}, 2e-3),
        (PULLED, "drive.compliance", {"mount_stiffness": 2e8}, 2e-3),
        (HELD, "sensor.gauge_resonance", {"natural_frequency": 2e4, "damping_ratio": 0.7}, 4e-3),
        (PULLED, "pulley.inertia", {"rim_mass": 2e-3}, 2e-2),
        (PULLED, "fibre.mass", {"fibre_mass": 1e-5}, 5e-3),
        (HELD, "fibre.mass", {"fibre_mass": 1e-5}, 2e-2),
    ],
)
def test_limits_are_the_base_model(conditions: Conditions, name: str, values: dict, tolerance: float) -> None:
    plain = simulate(conditions, Base(), {}, TIMES)
    out = simulate(conditions, Base(), {name: values}, TIMES)
    assert math.sqrt(np.mean((out.force - plain.force) ** 2)) <= tolerance * np.ptp(plain.force)


@pytest.mark.parametrize("fibre_mass", [1e-4, 5e-4, 2e-3])
def test_a_light_fibre_does_not_ring(fibre_mass: float) -> None:
    """Its weight is 1 to 20 mN, and what bounces do beside that is over before the next sample."""
    plain = simulate(HELD, Base(), {}, TIMES)
    out = simulate(HELD, Base(), {"fibre.mass": {"fibre_mass": fibre_mass}}, TIMES)
    beside = out.force - plain.force - fibre_mass * 9.81
    assert np.sqrt(np.mean(np.diff(beside) ** 2)) < 2.0 * fibre_mass * 9.81


@pytest.mark.parametrize("rig", [DROP, DRIVE])
def test_every_effect_does_something(rig: str) -> None:
    conditions = HELD if rig == DROP else PULLED
    for name in {*applicable(rig), *applicable(rig, outside=True)} - {"guide.asymmetric_viscous_friction"}:
        shape = {key: math.sqrt(low * high) for key, (low, high) in EFFECTS[name].fixed.items()}
        # At 90 degrees an error of the inclination shows in second order only.
        held = replace(conditions, slip_instant=0.5, inclination=math.radians(45.0))
        plain = simulate(held, Base(), {}, TIMES)
        out = simulate(held, Base(), {name: values_at(name, 1.0, shape, 2e4)}, TIMES)
        moved = max(np.abs(out.force - plain.force).max() / 0.4, np.abs(out.position - plain.position).max() / 2e-5)
        assert moved > 0.3, name
        assert np.isfinite(out.force).all(), name


def test_first_order_in_the_step() -> None:
    fine = simulate(HELD, Base(), {}, TIMES, 1e-6)
    errors = [np.abs(simulate(HELD, Base(), {}, TIMES, step).position - fine.position).max() for step in (4e-5, 5e-6)]
    assert errors[1] < 0.3 * errors[0]
    assert errors[1] < 2e-6


def test_unsupported_combinations_are_refused() -> None:
    chain = {"fibre.mass": {"fibre_mass": 0.01}, "fibre.hardening": {"hardening": 50.0}}
    with pytest.raises(ValueError, match="stands alone"):
        simulate(HELD, Base(), chain, TIMES)
    both = {"pulley.inertia": {"rim_mass": 0.1}, "pulley.capstan_friction": {"capstan_coefficient": 0.1}}
    with pytest.raises(ValueError, match="locked pulley"):
        simulate(PULLED, Base(), both, TIMES)


def test_excitations_keep_their_limits() -> None:
    times = np.arange(0.0, 3.2, 1e-3)
    for excitation in (
        Excitation("trapezoid", 0.06, 0.06),
        Excitation("trapezoid", 0.08, 0.2),
        Excitation("quasi_sine", 0.05, 0.25),
        Excitation("rectangle", 0.02, 0.8, acceleration=40.0),
        Excitation("rectangle", 0.002, 0.8, acceleration=40.0),
    ):
        position, velocity = excitation.motion(times)
        assert position.min() == 0.0
        assert position.max() == pytest.approx(excitation.amplitude, rel=1e-4)
        assert np.abs(velocity).max() <= excitation.rate * (1.0 + 1e-12)
        np.testing.assert_allclose(
            np.gradient(position, times)[1:-1], velocity[1:-1], atol=6e-3 * excitation.acceleration
        )


def test_catalogue_names_are_complete() -> None:
    assert len(CATALOGUE) == 29


def test_clamped_fibre_never_pushes_and_heaviside_does() -> None:
    clamped = simulate(HELD, Base(damping=60.0), {}, TIMES)
    heaviside = simulate(replace(HELD, tension_law="heaviside"), Base(damping=60.0), {}, TIMES)
    assert clamped.force.min() == 0.0
    assert heaviside.force.min() < -1.0
