"""What comes together in a motion, and laws that depend on it: closed forms, and a plain integrator as the oracle."""

from __future__ import annotations

import math

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from fibrefit.discovery.curves.probes import Curve, FrictionOfRest, StiffnessOfCycles, StiffnessOfDriveSpeed
from fibrefit.discovery.curves.variables import _rested
from fibrefit.laws.law import CYCLE, FORGETS, FORGOTTEN_AFTER, loading, resting
from fibrefit.rigs.excitation import Excitation
from tests.simulation.drops import CONDITIONS, DRIVE_CONDITIONS, START_TENSION, STEP, drive, drop, respond

GRAVITY, MASS = 9.81, CONDITIONS["weight_mass"]
FOLLOWED = 2e-5
"""Of the range."""


def rising(probe: type[Curve], slope: float, high: float) -> tuple[tuple[type[Curve], ...], dict[str, float]]:
    """A probe whose curve is a straight line from the origin."""
    heights = dict(zip(probe.heights, slope * high * np.linspace(0.0, 1.0, probe.knots), strict=True))
    return (probe,), {f"{probe.name}.{name}": value for name, value in {"low": 0.0, "high": high, **heights}.items()}


def test_the_time_at_rest_grows_as_time_and_is_forgotten_within_a_millimetre() -> None:
    assert float(resting(0.3, 0.0)) == 1.0
    speed, rested = 0.05, 0.4
    found = solve_ivp(lambda t, y: [float(resting(y[0], speed))], (0.0, 0.06), [rested], rtol=1e-9, atol=1e-12).y[0, -1]
    steady = FORGOTTEN_AFTER / speed
    assert found == pytest.approx(steady + (rested - steady) * math.exp(-speed * 0.06 / FORGOTTEN_AFTER), rel=1e-6)
    # No faster than samples can follow.
    assert float(resting(1.0, 100.0)) == pytest.approx(1.0 - 1.0 / FORGETS)


@pytest.mark.parametrize(("amplitude", "frequency"), [(1e-3, 10.0), (2e-3, 10.0), (1e-3, 25.0)])
def test_a_taut_cycle_counts_by_its_amplitude_squared_and_its_frequency(amplitude: float, frequency: float) -> None:
    times = np.linspace(0.0, 4.0 / frequency, 4001)
    turn = 2.0 * math.pi * frequency
    stretch, rate = 3e-3 + amplitude * np.sin(turn * times), amplitude * turn * np.cos(turn * times)
    cycles = np.trapezoid(np.asarray(loading(stretch, rate)), times)
    assert cycles == pytest.approx(4.0 * (amplitude / 1e-3) ** 2 * frequency / 10.0, rel=1e-6)
    assert not np.any(np.asarray(loading(-stretch, rate)))


def test_a_stiffness_that_changes_with_load_cycles_is_integrated_with_them() -> None:
    k, change = 20e3, 0.02
    effects, values = rising(StiffnessOfCycles, change, 10.0)
    found = respond(drop(801, lift=-1e-3), effects, friction=0.0, damping=0.0, **values)["position"]

    def rates(_: float, y: np.ndarray) -> list[float]:
        return [y[1], GRAVITY - k * (1.0 + change * y[2]) / MASS * y[0], y[1] ** 2 / CYCLE]

    times = STEP * np.arange(801)
    expected = solve_ivp(rates, (0.0, times[-1]), [1e-3, 0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-13).y[0]
    plain = respond(drop(801, lift=-1e-3), friction=0.0, damping=0.0)["position"]
    assert np.abs(plain - expected).max() > 0.05 * np.ptp(expected)
    assert np.abs(found - expected).max() < FOLLOWED * np.ptp(expected)


def test_a_stiffness_that_changes_with_the_speed_of_the_drive_is_followed() -> None:
    """A swing of the drive so gentle that the fibre stays taut."""
    k, change, swing = 20e3, 10.0, Excitation("quasi_sine", amplitude=6e-3, rate=0.05, lead=0.0)
    effects, values = rising(StiffnessOfDriveSpeed, change, 0.1)
    record, mass = drive(761, swing), DRIVE_CONDITIONS["weight_mass"]
    found = respond(record, effects, friction=0.0, damping=0.0, **values)["position"][:751]
    turn = 2.0 * swing.rate / swing.amplitude

    def rates(t: float, y: np.ndarray) -> list[float]:
        pulled = 0.5 * swing.amplitude * (1.0 - math.cos(turn * t))
        factor = 1.0 + change * swing.rate * abs(math.sin(turn * t))
        return [y[1], (k * factor * (pulled - y[0]) - START_TENSION) / mass]

    times = STEP * np.arange(751)
    whole = solve_ivp(rates, (0.0, times[-1]), [-START_TENSION / k, 0.0], t_eval=times, rtol=1e-10, atol=1e-13)
    plain = respond(record, friction=0.0, damping=0.0)["position"][:751]
    assert np.abs(plain - whole.y[0]).max() > 0.05 * np.ptp(whole.y[0])
    assert np.abs(found - whole.y[0]).max() < FOLLOWED * np.ptp(whole.y[0])


def test_a_friction_that_fades_when_the_weight_slides_is_integrated_with_that() -> None:
    """Down a gentle slope: what friction has grown by in the first moments goes as the weight gets faster."""
    slope, level, growth = math.radians(20.0), 6.0, 150.0
    effects, values = rising(FrictionOfRest, growth, 0.1)
    record = drop(201, lift=0.05, inclination=slope)
    found = respond(record, effects, friction=level, **values)["position"]

    def rates(_: float, y: np.ndarray) -> list[float]:
        forgets = min(abs(y[1]) / FORGOTTEN_AFTER, 1.0 / FORGETS)
        return [y[1], GRAVITY * math.sin(slope) - (level + growth * y[2]) / MASS, 1.0 - forgets * y[2]]

    times = STEP * np.arange(201)
    expected = solve_ivp(rates, (0.0, times[-1]), [-0.05, 0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-13).y[0]
    plain = respond(record, friction=level)["position"]
    assert np.abs(plain - expected).max() > 0.05 * np.ptp(expected)
    assert np.abs(found - expected).max() < FOLLOWED * np.ptp(expected)


def test_the_range_of_a_curve_over_the_time_at_rest_is_that_of_the_motion() -> None:
    step, speed = 5e-4, np.concatenate([np.zeros(600), np.full(200, 0.02), np.full(200, 0.5), np.zeros(400)])
    begun = np.arange(1400) >= 100
    found = _rested(speed[None], begun[None], np.full((1, 1399), step))[0]
    assert np.all(found[:101] == 0.0)
    assert found[600] == pytest.approx(0.25)
    times = step * np.arange(201)
    slow = FORGOTTEN_AFTER / 0.02 + (0.25 - FORGOTTEN_AFTER / 0.02) * np.exp(-0.02 * times / FORGOTTEN_AFTER)
    np.testing.assert_allclose(found[600:801], slow, rtol=1e-9)
    assert found[-1] == pytest.approx(399 * step + found[1000], rel=1e-6)
