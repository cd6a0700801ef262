"""Laws that change while a rig moves, against closed forms and what two plain motions say."""

from __future__ import annotations

import math

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy.linalg import expm

from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.laws.drive.play import Play
from fibrefit.rigs.parts.guide import Guide, Sliding
from tests.simulation.drops import CONDITIONS, STEP, TRAPEZOID, drive, drop, pendulum, respond

GRAVITY = 9.81
#: Of the range: what is exact is solved to rounding, what the integrator follows to its own error.
EXACT, FOLLOWED = 1e-10, 2e-5
MASS = CONDITIONS["weight_mass"]


def of(name: str, **values: float) -> tuple[tuple, dict[str, float]]:
    return (CATALOGUE[name],), {f"{name}.{key}": value for key, value in values.items()}


def test_a_clock_that_runs_wrong_makes_a_free_fall_look_slow_or_fast() -> None:
    effects, values = of("study.clock", error=0.02)
    found = respond(drop(61, lift=0.05), effects, friction=0.0, **values)
    true_time = 1.02 * STEP * np.arange(61)
    np.testing.assert_allclose(found["position"], -0.05 + 0.5 * GRAVITY * true_time**2, atol=EXACT)


def test_a_clock_scales_a_driven_motion_too() -> None:
    """The same record on a clock that is right: sampled as much later, with a drive as much slower."""
    effects, values = of("study.clock", error=0.02)
    found = respond(drive(801), effects, **values)
    slow = drive(801)
    signal = slow.inputs["drive"]
    slow = slow._replace(times=1.02 * slow.times, inputs={"drive": signal._replace(slopes=signal.slopes / 1.02)})
    expected = respond(slow)
    for role, reading in expected.items():
        np.testing.assert_allclose(found[role], reading, atol=1e-7 * np.ptp(reading))


def test_before_its_instant_a_sudden_law_is_not_there() -> None:
    record, at = drop(801), 0.5
    effects, values = of("fibre.knot_slip", slip=4e-4, instant=at)
    found, without = respond(record, effects, **values), respond(record)
    before = np.arange(801) < at * 800
    for role, reading in without.items():
        np.testing.assert_allclose(found[role][before], reading[before], atol=EXACT * np.ptp(reading))
        assert not np.allclose(found[role][~before], reading[~before], atol=1e-3 * np.ptp(reading))


def test_a_slip_lets_the_weight_hang_lower_in_the_end() -> None:
    effects, values = of("fibre.knot_slip", slip=4e-4, instant=0.2)
    record = drop(6001, lift=0.002)
    found, without = (respond(record, e, friction=0.0, **v) for e, v in ((effects, values), ((), {})))
    assert found["position"][-1] - without["position"][-1] == pytest.approx(4e-4, rel=1e-3)
    assert found["force"][-1] == pytest.approx(MASS * GRAVITY, rel=1e-3)


def test_what_hangs_loosely_swings_about_the_centre_of_mass_in_free_fall() -> None:
    share, omega = 0.3, 2.0 * math.pi * 15.0
    effects, values = of("guide.loose_mass", loose_share=share, frequency=15.0, damping_ratio=0.0)
    found = respond(drop(61, lift=0.05), effects, friction=0.0, **values)
    times = STEP * np.arange(61)
    # At first it hangs by its weight; let go, the centre of mass falls freely and both swing about it.
    hanging = GRAVITY / omega**2
    swing = hanging * np.cos(omega / math.sqrt(1.0 - share) * times)
    expected = -0.05 + 0.5 * GRAVITY * times**2 - share * (swing - hanging)
    np.testing.assert_allclose(found["position"], expected, atol=1e-8)


def test_two_masses_on_a_taut_fibre_swing_as_linear_algebra_says() -> None:
    share, omega, ratio, k, b = 0.3, 2.0 * math.pi * 15.0, 0.05, 20e3, 25.0
    effects, values = of("guide.loose_mass", loose_share=share, frequency=15.0, damping_ratio=ratio)
    # Let go 1 mm below the taut point, the weight swings about 1.5 mm and stays taut.
    found = respond(drop(401, lift=-1e-3), effects, friction=0.0, **values)
    heavy, light = (1.0 - share) * MASS, share * MASS
    spring, damper = light * omega**2, 2.0 * light * ratio * omega
    rest = MASS * GRAVITY / k
    system = np.array(
        [
            [0.0, 1.0, 0.0, 0.0],
            [-(k + spring) / heavy, -(b + damper) / heavy, spring / heavy, damper / heavy],
            [0.0, 0.0, 0.0, 1.0],
            [omega**2, 2.0 * ratio * omega, -(omega**2), -2.0 * ratio * omega],
        ]
    )
    step, state, expected = expm(system * STEP), np.array([1e-3 - rest, 0.0, 1e-3 - rest, 0.0]), []
    for _ in range(401):
        expected.append(state[0] + rest)
        state = step @ state
    assert np.max(np.abs(found["position"] - expected)) < FOLLOWED * np.ptp(expected)


def test_friction_that_wears_takes_the_work_of_its_mean_level() -> None:
    """Sliding down freely: a level that falls with the path takes its integral over the path."""
    effects, values = of("guide.friction_wear", wear=-0.5, path=0.02)
    found = respond(drop(121, lift=0.05, inclination=math.radians(60.0)), effects, friction=6.0, **values)
    u = found["position"] + 0.05
    speed = np.gradient(u, STEP)
    work = 6.0 * (u - 0.5 * (u - 0.02 * (1.0 - np.exp(-u / 0.02))))
    energy = MASS * GRAVITY * math.sin(math.radians(60.0)) * u - 0.5 * MASS * speed**2
    inside = slice(5, -5)
    np.testing.assert_allclose(energy[inside], work[inside], atol=2e-4 * work.max())


def test_a_drive_with_play_loses_it_at_each_reversal() -> None:
    course = jnp.asarray(np.concatenate([np.linspace(0, 1e-2, 101), np.linspace(1e-2, 0, 101)[1:]]))
    rates = jnp.asarray(np.concatenate([np.full(101, 0.2), np.full(100, -0.2)]))
    end, passed = (np.asarray(x) for x in Play(jnp.asarray(1e-3)).passed_on(course, rates))
    np.testing.assert_allclose(end[:101], course[:101], atol=1e-15)
    np.testing.assert_allclose(end[101:110], 1e-2, atol=1e-12)
    np.testing.assert_allclose(end[112:], np.asarray(course)[112:] + 1e-3, atol=1e-12)
    assert np.all(passed[102:110] == 0.0)


def test_a_play_does_not_swallow_the_noise_of_a_drive_that_rests() -> None:
    """What a reading does at rest is no motion: it reaches the fibre as without play."""
    noise = 2e-5 * np.random.default_rng(1).standard_normal(100)
    course = np.concatenate([np.linspace(0, 1e-2, 101), 1e-2 + noise, np.linspace(1e-2, 0, 101)])
    rates = np.concatenate([np.full(101, 0.2), 50.0 * noise, np.full(101, -0.2)])
    end, passed = (np.asarray(x) for x in Play(jnp.asarray(5e-5)).passed_on(jnp.asarray(course), jnp.asarray(rates)))
    np.testing.assert_allclose(end[:201], course[:201], atol=1e-15)
    np.testing.assert_array_equal(passed[101:201], rates[101:201])
    np.testing.assert_allclose(end[-90:], course[-90:] + 5e-5, atol=1e-12)


def test_a_gauge_feels_the_acceleration_by_true_time_whatever_the_clock_says() -> None:
    crosstalk, clock = CATALOGUE["sensor.acceleration_crosstalk"], CATALOGUE["study.clock"]
    (error,) = (p.name for p in clock.parameters)
    values = {f"{crosstalk.name}.seismic_mass": 0.2, f"{clock.name}.{error}": 0.1}
    record = drop(801)
    with_both, with_clock = (
        respond(record, effects, friction=0.0, **{k: v for k, v in values.items() if k.split(".")[1] in names})["force"]
        for effects, names in (((crosstalk, clock), ("acceleration_crosstalk", "clock")), ((clock,), ("clock",)))
    )
    felt = 0.2 * (GRAVITY - with_clock / MASS)
    np.testing.assert_allclose(with_both - with_clock, felt, atol=1e-9 * np.ptp(with_clock))


def test_laws_that_change_are_followed_on_a_pendulum() -> None:
    """A fibre that lengthens by and by holds it less and less: forces of both fibres differ from those without."""
    effects, values = of("fibre.length_drift", drift=1e-4)
    record = pendulum(801)
    found, without = respond(record, effects, **values), respond(record)
    assert np.abs(found["force_1"] - without["force_1"])[1:].max() > 0.1
    np.testing.assert_array_equal(found["angle"][0], without["angle"][0])


def test_laws_of_friction_that_leave_none_together_never_drive() -> None:
    laws = (
        CATALOGUE["guide.friction_change"](jnp.asarray(-0.9)),
        CATALOGUE["guide.asymmetric_friction"](jnp.asarray(0.2)),
    )
    guide, none = Guide(jnp.asarray(4.0), laws), jnp.zeros(())
    levels = [float(guide.level(jnp.asarray(way), none, Sliding(none, none, none))) for way in (1.0, -1.0)]
    assert levels == [pytest.approx(4.0 * 0.3), 0.0]
    # What is just at nothing still has its slope.
    slope = jax.grad(lambda friction: Guide(friction).level(jnp.ones(()), none, Sliding(none, none, none)))
    assert float(slope(none)) == 1.0


def test_play_shows_in_the_motion_of_the_weight() -> None:
    effects, values = of("drive.play", play=5e-4)
    record = drive(2401, TRAPEZOID)
    lost = respond(record)["position"] - respond(record, effects, **values)["position"]
    assert np.abs(lost[:600]).max() < 1e-4
    assert np.abs(lost).max() > 4e-4
