"""Gravity told by flights: what is put into the positions comes back, and noise is told by its error."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.declarations import SLACK
from fibrefit.fitting.checks import beyond_chance, check
from fibrefit.problem.diagnose import newton
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.diagnose.newton import Gravity
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.rigs.rig import STANDARD_GRAVITY
from fibrefit.rigs.signals.trace import Trace
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
NOISES = {
    "white": Noise(4e-13, 0.0, 0.0, 1000),
    "pink": Noise(1e-13, 2e-11, 0.0, 1000),
    "slow": Noise(1e-13, 0.0, 0.0, 1000, slow=((8.0, 4e-10),)),
}
DRAWS = 40
FLIGHTS = (0.3, 0.45, 0.58, 0.69)
"""Instants at which a weight leaves its fibre, in s."""
LEAVES = (0.5, 0.4, 0.32, 0.25)
"""Speeds at which it does, in m/s."""
FRICTION = 2.7
Dropped = tuple[Task, Motion]


def passes(gravity: newton.Gravity) -> bool:
    found = beyond_chance(gravity)
    assert found is not None
    return check("free_flight", found).passed


def thrown(trace: Trace) -> tuple[np.ndarray, ...]:
    """Phase, position and speed of a weight that is thrown up again and again: parabolas, with friction both ways."""
    mass, fall = trace.conditions["weight_mass"], STANDARD_GRAVITY * np.sin(trace.conditions["inclination"])
    phase, position, speed = np.zeros(len(trace.times), dtype=int), *np.zeros((2, len(trace.times)))
    for begins, leaves in zip(FLIGHTS, LEAVES, strict=True):
        slowed, hastened = fall + FRICTION / mass, fall - FRICTION / mass
        top, height = leaves / slowed, 0.5 * leaves**2 / slowed
        t = trace.times - begins
        inside = (t > 0.0) & (t < top + np.sqrt(2.0 * height / hastened))
        after = np.where(t < top, slowed, hastened) * (t - top)
        phase[inside], speed[inside] = SLACK, after[inside]
        position[inside] = (0.5 * after * (t - top) - height)[inside]
    return phase, position, speed


@pytest.fixture(scope="module")
def dropped() -> Dropped:
    """The drop series, with motions of closed form in place of its own."""
    task = task_of(load_study(CONFIGS / "drop_series"))
    shape = np.shape(task.problem.observations.measured["position"])
    phase, position, speed = np.zeros(shape, dtype=int), *np.zeros((2, *shape))
    traces = []
    for r, trace in enumerate(task.traces):
        for rows, row in zip((phase, position, speed), thrown(trace), strict=True):
            rows[r, : len(row)] = row
        force = np.where(phase[r, : len(trace.times)] == SLACK, 0.0, 100.0)
        traces.append(trace._replace(channels={**trace.channels, "force": force}))
    states = {"position": position, "speed": speed}
    return replace(task, traces=tuple(traces)), Motion(
        phase, states, np.zeros(shape[0], dtype=bool), {"position": position}
    )


def measured(dropped: Dropped, positions: np.ndarray, noise: Noise) -> Task:
    """The task with other positions, and with that noise."""
    task, _ = dropped
    data = task.problem.observations
    changed = data._replace(measured={**data.measured, "position": jnp.asarray(positions)})
    problem = Problem(task.problem.model, task.problem.layout, changed)
    return replace(task, problem=problem, noise={**task.noise, "position": noise})


def readings(dropped: Dropped) -> np.ndarray:
    return np.asarray(dropped[1].readings["position"])


def drawn(dropped: Dropped, noise: Noise, random: np.random.Generator) -> np.ndarray:
    positions = readings(dropped)
    extra = np.zeros_like(positions)
    for row, trace in zip(extra, dropped[0].traces, strict=True):
        row[: len(trace.times)] = noise.draw(len(trace.times), trace.rate, random)
    return positions + extra


@pytest.mark.parametrize("name", NOISES)
def test_noise_is_told_as_the_error(dropped: Dropped, name: str) -> None:
    """The negative control: records without a fault pass, and gravity scatters by its error."""
    random, scores = np.random.default_rng(17), []
    for _ in range(DRAWS):
        found = Gravity.in_flight(
            measured(dropped, drawn(dropped, NOISES[name], random), NOISES[name]), dropped[0].start, dropped[1]
        )
        assert found is not None
        assert passes(found)
        scores.append(found.excess / found.error)
    # Three standard deviations of a mean and of a standard deviation of so many.
    assert abs(np.mean(scores)) < 3.0 / np.sqrt(DRAWS)
    assert 0.65 < np.std(scores) < 1.35


@pytest.mark.parametrize("pace", [0.99, 0.998, 1.002, 1.01, 1.05])
def test_another_clock_is_another_gravity(dropped: Dropped, pace: float) -> None:
    """A clock that is fast by so much: a flight seems longer, each about its own middle."""
    task, moved = dropped
    positions = readings(dropped).copy()
    for r, trace in enumerate(task.traces):
        for start, end in newton._stretches(moved.phase[r] == SLACK):
            own = trace.times[start:end]
            middle = own.mean()
            positions[r, start:end] = np.interp(
                middle + (own - middle) / pace, trace.times, positions[r, : len(trace.times)]
            )
    found = Gravity.in_flight(measured(dropped, positions, NOISES["white"]), task.start, moved)
    assert found is not None
    assert found.excess == pytest.approx(pace**-2 - 1.0, rel=0.03)
    assert passes(found) == (abs(pace - 1.0) < 0.0025)


def test_a_larger_scale_is_a_larger_gravity(dropped: Dropped) -> None:
    found = Gravity.in_flight(
        measured(dropped, 1.03 * readings(dropped), NOISES["white"]), dropped[0].start, dropped[1]
    )
    assert found is not None
    assert found.excess == pytest.approx(0.03, rel=0.02)


@pytest.mark.parametrize("late", [-40, 40])
def test_contacts_that_the_model_has_late_or_early_are_no_gravity(dropped: Dropped, late: int) -> None:
    """By a fifth of a flight, as where the model of the fibre is wrong: load and direction are those of the record."""
    task, moved = dropped
    moved_on = {name: np.roll(state, late, axis=1) for name, state in moved.states.items()}
    shifted = replace(
        moved, phase=np.roll(moved.phase, late, axis=1), states=moved_on, readings={"position": moved_on["position"]}
    )
    found = Gravity.in_flight(measured(dropped, readings(dropped), NOISES["white"]), task.start, shifted)
    assert found is not None
    assert abs(found.excess) < 2e-3


def test_a_clock_in_the_model_counts_as_stated(dropped: Dropped) -> None:
    task, moved = dropped
    scaled = replace(moved, readings={"position": 1.03 * readings(dropped)})
    found = Gravity.in_flight(measured(dropped, 1.03 * readings(dropped), NOISES["white"]), task.start, scaled)
    assert found is not None
    assert abs(found.excess) < 1e-4


def test_what_is_left_is_louder_than_the_rests(dropped: Dropped) -> None:
    """Noise ten times as loud in flight as at rest: the error is that of the flights."""
    loud = drawn(dropped, NOISES["white"].scaled(10.0), np.random.default_rng(3))
    quiet = Gravity.in_flight(measured(dropped, loud, NOISES["white"]), dropped[0].start, dropped[1])
    known = Gravity.in_flight(measured(dropped, loud, NOISES["white"].scaled(10.0)), dropped[0].start, dropped[1])
    assert quiet is not None
    assert known is not None
    assert quiet.error == pytest.approx(known.error, rel=0.1)


def test_flights_one_way_tell_nothing(dropped: Dropped) -> None:
    """Gravity and friction are one force there; nor does a rig that nothing falls in have a check."""
    task, moved = dropped
    vertical = np.array([trace.conditions["inclination"] > 1.5 for trace in task.traces])[:, None]
    both = np.where(vertical, moved.phase, 0)
    assert Gravity.in_flight(task, task.start, replace(moved, phase=both)) is not None
    downwards = np.where(moved.states["speed"] > 0.03, both, 0)
    positions = measured(dropped, readings(dropped), NOISES["white"])
    assert Gravity.in_flight(positions, task.start, replace(moved, phase=downwards)) is None
    never = replace(moved, phase=np.zeros_like(moved.phase))
    assert Gravity.in_flight(task, task.start, never) is None
    driven = task_of(load_study(CONFIGS / "guided_axis"))
    assert Gravity.in_flight(driven, driven.start, moved) is None


def test_shortest_flights_are_left_out() -> None:
    phase = np.zeros(40, dtype=int)
    phase[5:15], phase[20:24] = SLACK, SLACK
    assert newton._stretches(phase == SLACK) == [(6, 14)]


@pytest.mark.parametrize(
    "noise", [*NOISES.values(), Noise(0.0, 0.0, 4e-10, 100), Noise(0.0, 0.0, 0.0, 9, lines=((50.1, 4e-10),))]
)
def test_variance_of_a_sum(noise: Noise) -> None:
    random, count, rate = np.random.default_rng(5), 600, 2000.0
    weights = np.zeros(count)
    weights[100:300] = np.linspace(-1.0, 1.0, 200) ** 2
    weights[100:300] -= weights[100:300].mean()
    sums = []
    for _ in range(3000):
        row = noise.draw(count, rate, random)
        # Lines, of a phase nobody knows; one that is not known better is either of the mains'.
        for f, v in (*noise.lines, (random.choice([50.0, 60.0]), noise.line)):
            row = row + np.sqrt(2.0 * v) * np.cos(2.0 * np.pi * (f * np.arange(count) / rate + random.random()))
        sums.append(weights @ row)
    assert np.var(sums) == pytest.approx(noise.variance_of_sum(weights, rate), rel=0.1)
