"""Contacts tell when a force was measured: delays that are put in come back, and noise is told by its error."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.fitting.checks import beyond_chance, check
from fibrefit.problem.diagnose.motion import Motion
from fibrefit.problem.diagnose.newton import Lag
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
NOISES = {
    "white": Noise(4e-13, 0.0, 0.0, 1000),
    "pink": Noise(1e-13, 2e-11, 0.0, 1000),
    "slow": Noise(1e-13, 0.0, 0.0, 1000, slow=((8.0, 4e-10),)),
}
DRAWS = 40
TRUE = {"stiffness": 11_000.0, "damping": 9.5, "friction": 2.7}
LATER = [-2e-3, -5e-4, 0.0, 5e-4, 1e-3, 3e-3]
Dropped = tuple[Task, Motion, np.ndarray]


@pytest.fixture(scope="module")
def dropped() -> Dropped:
    """The drop series, its motion at values of our own, and these."""
    task = task_of(load_study(CONFIGS / "drop_series"))
    values = np.array(task.start)
    for name, value in TRUE.items():
        values[task.problem.layout.free_names.index(name)] = value
    return task, Motion.of(task.problem, jnp.asarray(values)), values


def measured(dropped: Dropped, late: float = 0.0, noise: Noise | None = None, seed: int = 0) -> Task:
    """The task with the simulated readings as what was measured: the force so much later, the positions with noise."""
    task, moved, _ = dropped
    random, data = np.random.default_rng(seed), task.problem.observations
    positions, traces = np.array(moved.readings["position"]), []
    for r, trace in enumerate(task.traces):
        n = len(trace.times)
        force = np.interp(trace.times - late, trace.times, np.asarray(moved.readings["force"])[r, :n])
        traces.append(trace._replace(channels={**trace.channels, "force": force}))
        if noise is not None:
            positions[r, :n] += noise.draw(n, trace.rate, random)
    changed = data._replace(measured={**data.measured, "position": jnp.asarray(positions)})
    problem = Problem(task.problem.model, task.problem.layout, changed)
    return replace(
        task, traces=tuple(traces), problem=problem, noise={**task.noise, "position": noise or NOISES["white"]}
    )


def passes(lag: Lag) -> bool:
    found = beyond_chance(lag)
    assert found is not None
    return check("lag", found).passed


def found(dropped: Dropped, task: Task, moved: Motion | None = None) -> Lag:
    lag = Lag.in_contacts(task, dropped[2], moved or dropped[1])
    assert lag is not None
    return lag


@pytest.mark.parametrize("late", LATER)
def test_a_delay_comes_back(dropped: Dropped, late: float) -> None:
    lag = found(dropped, measured(dropped, late))
    # Samples are joined by straight lines: a quarter of a sample in a delay of parts of one.
    assert lag.late == pytest.approx(late, rel=0.03, abs=2e-5)
    assert passes(lag) == (late == 0.0)


@pytest.mark.parametrize("name", NOISES)
def test_noise_is_told_as_the_error(dropped: Dropped, name: str) -> None:
    """The negative control: records without a fault pass, and delays scatter by their error."""
    lags = [found(dropped, measured(dropped, 0.0, NOISES[name], seed)) for seed in range(DRAWS)]
    assert all(passes(lag) for lag in lags)
    scores = [lag.late / lag.error for lag in lags]
    # Three standard deviations of a mean and of a standard deviation of so many.
    assert abs(np.mean(scores)) < 3.0 / np.sqrt(DRAWS)
    assert 0.65 < np.std(scores) < 1.35


def test_it_does_not_hang_on_the_model_of_the_fibre(dropped: Dropped) -> None:
    """Another fibre in the simulation, with other contacts: those of the record count."""
    task, _, values = dropped
    other = np.array(values)
    names = task.problem.layout.free_names
    other[names.index("stiffness")] *= 0.7
    other[names.index("damping")] *= 3.0
    lag = found(dropped, measured(dropped), Motion.of(task.problem, jnp.asarray(other)))
    assert abs(lag.late) < 1e-4


@pytest.mark.parametrize(("gain", "offset"), [(1.1, 0.0), (1.0, 3.0)])
def test_scale_and_zero_of_the_force_are_no_delay(dropped: Dropped, gain: float, offset: float) -> None:
    task = measured(dropped)
    traces = tuple(
        trace._replace(channels={**trace.channels, "force": gain * trace.channels["force"] + offset})
        for trace in task.traces
    )
    assert abs(found(dropped, replace(task, traces=traces)).late) < 3e-5


def test_a_delay_in_the_model_counts_as_stated(dropped: Dropped) -> None:
    _, moved, _ = dropped
    late = np.stack([np.roll(row, 2) for row in moved.readings["force"]])
    has_it = replace(moved, readings={**moved.readings, "force": late})
    assert found(dropped, measured(dropped), has_it).late == pytest.approx(-1e-3, rel=0.03)


def with_force(task: Task, change: Callable[[np.ndarray], np.ndarray]) -> Task:
    traces = tuple(t._replace(channels={**t.channels, "force": change(t.channels["force"])}) for t in task.traces)
    return replace(task, traces=traces)


@pytest.mark.parametrize("late", [0.0, 1e-3])
def test_a_contact_with_gaps_in_its_force_tells_nothing(dropped: Dropped, late: float) -> None:
    """The softer contacts that are whole tell what they would, and with a greater error."""
    task = measured(dropped, late)
    cut = found(dropped, with_force(task, lambda force: np.where(force > 0.5 * force.max(), np.nan, force)))
    assert abs(cut.late - late) < 4.0 * cut.error
    assert cut.error > 2.0 * found(dropped, task).error


@pytest.mark.parametrize("value", [np.nan, 0.0])
def test_a_record_without_contacts_tells_nothing(dropped: Dropped, value: float) -> None:
    task = with_force(measured(dropped, 1e-3), lambda force: np.full(len(force), value))
    assert Lag.in_contacts(task, dropped[2], dropped[1]) is None


def test_a_rig_that_nothing_falls_in_has_no_such_check() -> None:
    task = task_of(load_study(CONFIGS / "drive_series"))
    assert Lag.in_contacts(task, task.start, Motion.of(task.problem, jnp.asarray(task.start))) is None
