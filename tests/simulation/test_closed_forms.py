"""The simulator against what can be worked out by hand: fall, bounces, ratios of tension, energy, order."""

from __future__ import annotations

import math
from typing import Any

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.laws.catalogue import CATALOGUE
from fibrefit.rigs.excitation import Excitation
from fibrefit.simulation.inputs import Signals
from tests.simulation.drops import DRIVE_CONDITIONS, drive, drop, pendulum, respond

MASS, GRAVITY = 3.096, 9.81
STIFFNESS = 20e3
#: Constant forces are integrated exactly.
ROUNDING = 1e-12
#: Height of a bounce from the parabola through three samples; what is left is the contact's integration.
BOUNCE = 1e-7
#: Steady pull: what is left of the start's oscillation, over the force.
STEADY = 1e-4
#: Work by Simpson's rule over samples, where a force may jump inside a step, over the energy that goes through.
WORK = 2e-4
#: Shrinking of the error when the step is halved: 16 for order 4, less near the error of the located instants.
ORDER = 8.0


def tops(position: np.ndarray) -> list[float]:
    """Greatest heights above the taut point, between samples."""
    inner = np.flatnonzero((position[1:-1] < position[:-2]) & (position[1:-1] <= position[2:])) + 1
    found = []
    for i in inner[position[inner] < 0.0]:
        before, here, after = position[i - 1 : i + 2]
        bend = before - 2.0 * here + after
        found.append(-(here - (after - before) ** 2 / (8.0 * bend)))
    return found


def test_free_fall() -> None:
    found = respond(drop(80), friction=4.0)["position"]
    times = np.arange(80) * 5e-4
    np.testing.assert_allclose(found, 0.5 * (GRAVITY - 4.0 / MASS) * times**2 - 0.012, atol=ROUNDING)


def test_each_bounce_loses_what_friction_takes_on_its_way() -> None:
    """Down: (m g - F)(h + e) = k e²/2; up: (m g + F)(h' + e) = k e²/2, e the deepest stretch."""
    friction, weight, height = 4.0, MASS * GRAVITY, 0.012
    heights = tops(respond(drop(2401), friction=friction, damping=0.0)["position"])
    assert len(heights) > 3
    for found in heights[:4]:
        down = weight - friction
        deepest = (down + math.sqrt(down**2 + 2.0 * STIFFNESS * down * height)) / STIFFNESS
        height = (weight - friction) / (weight + friction) * (height + deepest) - deepest
        assert found == pytest.approx(height, abs=BOUNCE)


def test_without_losses_it_comes_back_to_its_height() -> None:
    heights = tops(respond(drop(2401), friction=0.0, damping=0.0)["position"])
    np.testing.assert_allclose(heights, 0.012, atol=BOUNCE)


def test_bounces_with_viscous_friction_decay_geometrically_and_with_coulomb_friction_linearly() -> None:
    """Swinging on a taut fibre, c alone: each swing is exp(-π c/(m ω)) of the one before; F alone: 4 F/k less."""
    # Let go 1 mm above the place where it hangs: the fibre stays taut, as its lift below zero says.
    hanging = MASS * GRAVITY / STIFFNESS
    viscous, name = CATALOGUE["guide.viscous_friction"], "guide.viscous_friction.viscous_coefficient"
    started = drop(2001, lift=-(hanging - 1e-3))
    plain = {"damping": 0.0, "friction": 0.0}
    for effects, values, law in (
        ((viscous,), {name: 6.0}, "geometric"),
        ((), {"friction": 0.5}, "linear"),
    ):
        swing = respond(started, effects, **(plain | values))["position"] - hanging
        peaks = [abs(swing[i]) for i in np.flatnonzero(np.diff(np.sign(np.diff(swing)))) + 1]
        assert len(peaks) > 6
        if law == "geometric":
            omega = math.sqrt(STIFFNESS / MASS - (6.0 / (2.0 * MASS)) ** 2)
            expected = math.exp(-math.pi * 6.0 / (2.0 * MASS * omega))
            np.testing.assert_allclose(np.divide(peaks[1:7], peaks[:6]), expected, rtol=2e-3)
        else:
            np.testing.assert_allclose(-np.diff(peaks[:7]), 2.0 * 0.5 / STIFFNESS, rtol=5e-2)


def test_capstan_ratio() -> None:
    """Pulled steadily up: the weight takes m g sin α + F, the drive exp(μ φ) times that."""
    pull = Excitation("trapezoid", amplitude=0.1, rate=0.05, lead=0.02, hold=1.0, cycles=1)
    effect, name = CATALOGUE["pulley.capstan_friction"], "pulley.capstan_friction.capstan_coefficient"
    found = respond(drive(3601, pull), (effect,), damping=400.0, **{name: 0.05})["force"][3000:3500]
    carried = DRIVE_CONDITIONS["weight_mass"] * GRAVITY * 0.5 + 4.0
    wrapped = math.exp(0.05 * DRIVE_CONDITIONS["wrap_angle"])
    # The sign of the motion is smoothed over 0.1 mm/s.
    np.testing.assert_allclose(found, carried * wrapped ** (0.05 / (0.05 + 1e-4)), rtol=STEADY)


def simpson(values: np.ndarray, step: float) -> float:
    """Integral over an even number of steps."""
    return float(step / 3.0 * (values[:-2:2] + 4.0 * values[1:-1:2] + values[2::2]).sum())


def test_energy_of_a_drop() -> None:
    """What gravity gives is in the motion, in the fibre, or was taken by friction and damping."""
    step, samples = 2.5e-5, 16_001
    experiment = drop(samples)._replace(times=jnp.arange(samples) * step)
    found = respond(experiment)
    u, force = found["position"], found["force"]
    v = np.gradient(u, step, edge_order=2)
    taut = force > 0.0
    given = MASS * GRAVITY * (u - u[0])
    moving = 0.5 * MASS * v**2
    lost_by_damping = force * v - np.where(taut, STIFFNESS * u * v, 0.0)
    stored = 0.5 * STIFFNESS * np.maximum(u, 0.0)[-1] ** 2 if taut[-1] else 0.0
    taken = simpson(4.0 * np.abs(v), step) + simpson(lost_by_damping, step)
    # Stretch that is left when a damped fibre goes slack takes its energy with it.
    left = sum(0.5 * STIFFNESS * max(u[i], 0.0) ** 2 for i in np.flatnonzero(taut[:-1] & ~taut[1:]))
    through = np.ptp(given)
    assert given[-1] - moving[-1] - stored - taken - left == pytest.approx(0.0, abs=5.0 * WORK * through)


def test_energy_of_a_driven_pendulum() -> None:
    """The power of the drive is what the fibres take up and what the rod gains."""
    step, samples, frequency, amplitude = 1e-4, 20_001, 4.3, 0.02
    experiment = pendulum(samples, frequency, amplitude, step, preload=100.0)
    found = respond(experiment)
    times, angle = np.asarray(experiment.times), found["angle"]
    rate = np.gradient(angle, step, edge_order=2)
    omega = 2.0 * np.pi * frequency
    x, x_rate = amplitude * np.sin(omega * times), amplitude * omega * np.cos(omega * times)
    by_drive = into_fibres = 0.0
    for side, role in ((1.0, "force_1"), (-1.0, "force_2")):
        across = 1.2 + side * (x - 0.75 * np.sin(angle))
        length = np.hypot(0.75 * np.cos(angle), across)
        by_drive += simpson(found[role] * side * across / length * x_rate, step)
        into_fibres += simpson(found[role] * np.gradient(length, step, edge_order=2), step)
    rod = 0.5 * 3.288 * (rate**2 - rate[0] ** 2) + 9.864 * GRAVITY * 0.5 * (np.cos(angle) - 1.0)
    through = float(np.ptp(rod))
    assert by_drive == pytest.approx(into_fibres + rod[-1], abs=WORK * through)
    assert abs(rod[-1]) > 100.0 * WORK * through


@pytest.mark.parametrize("kind", ["drop", "drive", "pendulum"])
def test_order_of_convergence_across_switches(kind: str) -> None:
    """Halving the step divides the error by about 16, though fibres snap and guides stick inside the steps."""

    def run(parts: int) -> np.ndarray:
        step = 1e-3 / parts
        return position(kind, 400 * parts + 1, step)[::parts]

    exact = run(16)
    coarse, fine = (np.sqrt(np.mean((run(parts) - exact) ** 2)) for parts in (1, 2))
    assert coarse / fine > ORDER, f"{coarse:.1e} becomes {fine:.1e}"


def position(kind: str, samples: int, step: float) -> np.ndarray:
    """Position, or angle, of a short run that holds several switches."""
    if kind == "pendulum":
        return respond(pendulum(samples, step=step))["angle"]
    if kind == "drop":
        experiment: Any = drop(samples)._replace(times=jnp.arange(samples) * step)
    else:
        times = np.arange(samples) * step
        # Whole swings of one smooth formula: corners of a drive would be seen by some grids and not by others.
        smooth = Excitation("quasi_sine", amplitude=0.02, rate=0.35, lead=0.0)
        signal = Signals(*map(jnp.asarray, smooth.motion(times)))
        experiment = drive(samples)._replace(times=jnp.asarray(times), inputs={"drive": signal})
    return respond(experiment)["position"]
