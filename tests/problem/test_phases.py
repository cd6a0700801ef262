"""The phase of a motion and its states: closed forms of the base laws, and rules on motions made by hand."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.core.declarations import FORWARDS, LOADING, REST, SLACK, STICKING, UNLOADING
from fibrefit.problem.diagnose.motion import Motion, _known, _phase, moves
from fibrefit.problem.statement.problem import Trajectories
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.simulation.drops import OF_RIG, given, pendulum

CONFIGS = Path(__file__).resolve().parents[2] / "configs"
DROPS = Path(__file__).resolve().parent.parent / "data" / "discover" / "viscous"
#: Of a tension of a hundred newtons, in N: rounding only.
ROUNDING = 1e-9
#: Of the slack samples: a fibre let go faster than it shortens carries nothing while it is still stretched.
MOST = 0.9


def moved(folder: Path) -> tuple[Task, Motion]:
    task = task_of(load_study(folder))
    return task, Motion.of(task.problem, jnp.asarray(task.start))


@pytest.fixture(scope="module")
def pulled() -> tuple[Task, Motion]:
    """A weight that a drive pulls and lets go."""
    return moved(CONFIGS / "drive_series")


@pytest.fixture(scope="module")
def dropped() -> tuple[Task, Motion]:
    return moved(DROPS)


@pytest.mark.parametrize("rig", ["pulled", "dropped"])
def test_stretch_and_its_rate_make_the_tension(rig: str, request: pytest.FixtureRequest) -> None:
    task, found = request.getfixturevalue(rig)
    names = task.problem.layout.names
    local = np.asarray(task.problem.layout.local(jnp.asarray(task.start)))
    k, b = (local[:, [names.index(name)]] for name in ("stiffness", "damping"))
    expected = np.maximum(k * found.states["stretch"] + b * found.states["stretch rate"], 0.0)
    taut = found.states["tension"] > 0.0
    np.testing.assert_allclose(found.states["tension"][taut], expected[taut], atol=ROUNDING)
    assert np.mean(found.states["stretch"][found.phase == SLACK] < 0.0) > MOST


def test_a_pulled_fibre_is_loaded_while_it_grows_longer_whatever_the_weight_does(pulled: tuple[Task, Motion]) -> None:
    _, found = pulled
    rate, speed = found.states["stretch rate"], found.states["speed"]
    assert (rate[found.phase == LOADING] >= 0.0).all()
    assert (rate[found.phase == UNLOADING] < 0.0).all()
    assert np.mean(speed[found.phase == LOADING] < 0.0) > 0.2, "the speed of the weight says something else"


def test_of_a_dropped_weight_it_is_the_speed(dropped: tuple[Task, Motion]) -> None:
    _, found = dropped
    np.testing.assert_array_equal(found.states["stretch rate"], found.states["speed"])
    assert found.driven is None
    assert (found.sliding[found.phase == LOADING] == 1).all()


def test_a_weight_under_a_moving_drive_sticks_and_with_the_drive_it_rests(pulled: tuple[Task, Motion]) -> None:
    _, found = pulled
    for phase, driven in ((STICKING, True), (REST, False)):
        inside = found.phase == phase
        assert inside.any()
        assert (found.driven[inside] == driven).all()
        assert not found.sliding[inside].any()
        assert not found.states["speed"][inside].any()


def test_a_guide_sticks_between_two_motions_and_rests_before_and_after() -> None:
    sliding = np.array([[0, 0, 1, 0, -1, 0, 1, 0, 0]])
    known = {"speed": sliding.astype(float), "stretch rate": np.zeros(sliding.shape)}
    alone = _phase(SimpleNamespace(guide=sliding), known, sliding, None)
    assert alone[0].tolist() == [REST, REST, FORWARDS, STICKING, FORWARDS + 1, STICKING, FORWARDS, REST, REST]
    caught = _phase(SimpleNamespace(guide=sliding, fibre=np.ones_like(sliding)), known, sliding, None)
    assert caught[0].tolist() == [REST, REST, LOADING, STICKING, LOADING, STICKING, LOADING, REST, REST]


def test_a_drive_that_turns_round_moves_and_its_noise_does_not() -> None:
    times = np.arange(4000)[None] / 2000.0
    swing = (times > 0.5) & (times < 1.5)
    clean = np.where(swing, 0.3 * np.cos(4.0 * np.pi * times), 0.0)
    noisy = clean + 0.001 * np.random.default_rng(0).standard_normal(clean.shape)
    found = moves(noisy, times)
    apart = np.abs(times - 0.5).clip(max=np.abs(times - 1.5)) > 0.02
    np.testing.assert_array_equal(found[apart], swing[apart])


def test_a_pause_of_a_drive_is_one_at_the_rate_of_its_own_record() -> None:
    """Strokes a fifth of a second apart, at 10 kHz and at 500 Hz."""
    found = []
    for rate in (1e4, 500.0):
        times = np.arange(1000) / 500.0 if rate == 500.0 else np.arange(1000) / rate * 2.0
        scale = 1.0 if rate == 500.0 else 500.0 / rate * 2.0
        strokes = (np.abs(times - 0.7 * scale) < 0.3 * scale) | (np.abs(times - 1.5 * scale) < 0.3 * scale)
        found.append((times, np.where(strokes, 0.2, 0.0), strokes))
    times, rates, strokes = (np.stack(part) for part in zip(*found, strict=True))
    np.testing.assert_array_equal(moves(rates, times)[1], moves(rates[1:], times[1:])[0])
    assert not moves(rates, times)[1][np.abs(times[1] - 1.1) < 0.05].any()


def test_both_fibres_of_an_upright_pendulum_are_stretched_by_their_preload() -> None:
    model, experiment = Model(RIGS["inverted_pendulum"]), pendulum(41, preload=400.0)
    values = given(OF_RIG["inverted_pendulum"])

    @jax.jit
    def both() -> tuple:
        return model.stretched(values, experiment, model.respond(values, experiment).solution)

    (first, first_rate), (second, second_rate) = both()
    for stretch in (first, second):
        assert stretch[0] == pytest.approx(400.0 / float(values["stiffness"]))
    assert first_rate[0] == pytest.approx(-second_rate[0])
    assert first_rate[0] > 0.0


def test_of_two_fibres_the_one_that_is_stretched_more_counts() -> None:
    states = SimpleNamespace(angle=np.zeros((1, 3)), rate=np.ones((1, 3)))
    forces = {"angle": np.zeros((1, 3)), "force_1": np.array([[5.0, 1.0, 0.0]]), "force_2": np.array([[0.0, 2.0, 7.0]])}
    first = np.array([[3.0, 1.0, -1.0]]), np.array([[1.0, 1.0, 1.0]])
    second = np.array([[-1.0, 2.0, 4.0]]), np.array([[-1.0, -1.0, -1.0]])
    modes = SimpleNamespace(fibre_1=np.array([[1, 1, 0]]), fibre_2=np.array([[0, 1, 0]]))
    known = _known(Trajectories(forces, states, modes, np.zeros(1, dtype=bool), (first, second)))
    assert known["stretch"].tolist() == [[3.0, 2.0, 4.0]]
    assert known["stretch rate"].tolist() == [[1.0, -1.0, -1.0]]
    assert known["tension"].tolist() == [[5.0, 2.0, 7.0]]
    assert _phase(modes, known, None, np.ones((1, 3), dtype=bool)).tolist() == [[LOADING, UNLOADING, SLACK]]


def test_the_motion_behind_slopes_is_that_of_a_simulation_alone() -> None:
    task, alone = moved(DROPS)
    beside = Motion.of_fit(task.problem, np.asarray(task.problem.layout.local(np.asarray(task.start))))
    assert (beside.phase == alone.phase).all()
    for one, other in ((beside.states, alone.states), (beside.readings, alone.readings)):
        assert one.keys() == other.keys()
        for name in one:
            np.testing.assert_array_equal(one[name], other[name])


def test_a_mass_on_a_guide_has_no_stretch() -> None:
    assert Model(RIGS["guided_mass"]).stretched({}, pendulum(3), None) == ()  # type: ignore[arg-type]
