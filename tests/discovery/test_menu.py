"""Further records that could be taken: each under the conditions it names, from rest, as the next of its series."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
import pytest

from fibrefit.discovery.design.menu import _driven, _times, batches, duration_of, menu_of, records_of
from fibrefit.discovery.design.plan import options_of
from fibrefit.discovery.model.finding import Choice
from fibrefit.problem.statement.layout import Layout, Range, Slot
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.rigs.thresholds import FARTHER
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import ORDER, corrected_conditions
from fibrefit.study import load_study
from fibrefit.workflow.prepare import task_of
from tests.workflow import axis

PARAMETERS = """
[parameters.stiffness]
initial = "20 kN/m"
[parameters.damping]
initial = "25 N s/m"
[parameters.friction]
initial = "4 N"
"""
DROPS = """
schema = "fibrefit/study/1"
name = "two drops"
[rig]
kind = "fibre_mass"
weight_mass = "3.096 kg"
inclination = "{inclination}"
[[records]]
name = "one"
lift = "5 mm"
sampling_rate = "2 kHz"
duration = "0.3 s"
[[records]]
name = "two"
lift = "10 mm"
sampling_rate = "2 kHz"
duration = "0.3 s"
"""
DRIVES = """
schema = "fibrefit/study/1"
name = "two drives"
[rig]
kind = "pulley_drive"
weight_mass = "3.096 kg"
inclination = "30 deg"
[[records]]
name = "one"
excitation = "trapezoid"
amplitude = "60 mm"
rate = "200 mm/s"
sampling_rate = "2 kHz"
duration = "0.4 s"
[[records]]
name = "two"
added_mass = "5 kg"
excitation = "trapezoid"
amplitude = "20 mm"
rate = "100 mm/s"
sampling_rate = "2 kHz"
duration = "0.4 s"
"""
STILL = 1e-9
"""In m: a motion below it is rounding."""


def planned(folder: Path, text: str) -> Task:
    (folder / "study.toml").write_text(text + PARAMETERS, encoding="utf-8")
    return task_of(load_study(folder))


def with_own_lift(task: Task) -> Task:
    """The lift a value of each record, as where one of them was measured without it."""
    old = task.problem
    (lift,) = (one for one in old.model.rig.conditions if one.name == "lift")
    layout = Layout((*old.layout.slots, Slot("lift", "m", Range.of(lift), shared=False)), old.layout.records)
    named = dict(zip(old.layout.names, np.asarray(old.layout.local(jnp.asarray(task.start))).T, strict=True))
    stated = np.asarray(old.observations.experiment.conditions["lift"])
    return replace(
        task, problem=Problem(old.model, layout, old.observations), start=layout.pack({**named, "lift": stated})
    )


CASES = {
    "drops": (DROPS.format(inclination="60 deg"), lambda task: task),
    "drops, slope found": (DROPS.format(inclination="60 +/- 1 deg"), lambda task: task),
    "drops, lift found": (DROPS.format(inclination="60 deg"), with_own_lift),
    "drives": (DRIVES, lambda task: task),
}


@pytest.mark.parametrize("case", CASES)
def test_a_further_record_rests_at_first_and_is_under_the_conditions_it_names(case: str, tmp_path: Path) -> None:
    text, changed = CASES[case]
    task = changed(planned(tmp_path, text))
    problem, local = task.problem, np.asarray(task.problem.layout.local(jnp.asarray(task.start)))
    names, own = problem.layout.names, problem.observations.experiment.conditions
    offered = [choice for choice in options_of(task) if choice.pace == choice.size == 1.0]
    assert len(offered) >= len(local) + 2
    for batch in batches(offered, len(local)):
        data, values = records_of(problem, local, batch)
        experiment = data.experiment
        there = eqx.tree_at(lambda p: p.observations, problem, data)
        moved = there.trajectories_at(jnp.asarray(values))
        place = np.asarray(moved.states.position)
        for r, choice in enumerate(batch):
            row = dict(zip(names, values[r], strict=True))
            said = experiment._replace(conditions={n: np.asarray(v)[r] for n, v in experiment.conditions.items()})
            known = corrected_conditions(said.conditions, row, ())
            for name in own:
                like = row[name] if name in names else np.asarray(own[name])[choice.record]
                assert known[name] == pytest.approx(
                    len(local) + 1 if name == ORDER else choice.conditions.get(name, like)
                )
            begins = row["release"] if "release" in row else first_motion(there, r)
            still = np.asarray(experiment.times)[r] < begins
            assert still.sum() > 20
            assert np.ptp(place[r, still]) < STILL
            assert np.ptp(place[r]) > 1e-3, "it moves afterwards"


def first_motion(problem: Problem, record: int) -> float:
    """Instant at which the drive of a record begins to move, in s."""
    experiment = problem.observations.experiment
    drive = np.asarray(experiment.inputs["drive"].values)[record]
    return float(np.asarray(experiment.times)[record][np.flatnonzero(np.abs(drive - drive[0]) > 0.0)[0] - 1])


def test_a_weight_under_the_tension_of_a_lighter_one_would_not_rest(tmp_path: Path) -> None:
    """The negative control of the rest before the drive moves."""
    task = planned(tmp_path, DRIVES)
    problem, local = task.problem, np.asarray(task.problem.layout.local(jnp.asarray(task.start)))
    heavy = next(choice for choice in menu_of(task) if choice.conditions.get("added_mass", 0.0) > 5.0)
    data, values = records_of(problem, local, [heavy, heavy])
    column = problem.layout.names.index("start_tension")
    assert values[0, column] > 1.5 * local[0, column]
    values[:, column] = local[0, column]
    there = eqx.tree_at(lambda p: p.observations, problem, data)
    place = np.asarray(there.trajectories_at(jnp.asarray(values)).states.position)[0]
    assert np.ptp(place[np.asarray(data.experiment.times)[0] < first_motion(there, 0)]) > 1e3 * STILL


def test_what_all_records_share_is_not_offered_otherwise(tmp_path: Path) -> None:
    found = menu_of(planned(tmp_path, DROPS.format(inclination="60 +/- 1 deg")))
    assert found
    assert not any("inclination" in choice.conditions for choice in found)
    stated = menu_of(planned(tmp_path, DROPS.format(inclination="60 deg")))
    assert any("inclination" in choice.conditions for choice in stated)


def test_a_menu_has_no_record_at_hand_and_tells_what_differs_alone(tmp_path: Path) -> None:
    task = planned(tmp_path, DROPS.format(inclination="60 deg"))
    stated = {name: np.asarray(values) for name, values in task.problem.observations.experiment.conditions.items()}
    for choice in menu_of(task):
        assert choice.conditions
        assert not any(np.isclose(stated[name][choice.record], value) for name, value in choice.conditions.items())
        whole = {name: choice.conditions.get(name, stated[name][0]) for name in ("lift", "inclination", "added_mass")}
        assert not np.all([np.isclose(stated[name], value) for name, value in whole.items()], axis=0).any()


def test_an_input_run_faster_and_farther_and_slower() -> None:
    times = np.linspace(0.0, 1.0, 101)[None]
    stroke = np.where(times < 0.5, 0.1 * times, 0.05)
    slope = np.where(times < 0.5, 0.1, 0.0)
    signals = Signals(jnp.asarray(stroke), jnp.asarray(slope))
    experiment: Any = SimpleNamespace(times=times, count=np.array([101]), inputs={"drive": signals})
    run = _driven(experiment, [Choice(0, {}, pace=2.0, size=3.0)])["drive"]
    expected = np.where(times < 0.25, 0.6 * times, 0.15)
    np.testing.assert_allclose(run.values, expected, atol=1e-12)
    inside = (times < 0.24) | (times > 0.26)
    np.testing.assert_allclose(np.asarray(run.slopes)[inside], np.where(times < 0.25, 0.6, 0.0)[inside], atol=1e-12)
    np.testing.assert_array_equal(_times(experiment, [Choice(0, {}, pace=2.0)]), times)
    same = _driven(experiment, [Choice(0, {})])["drive"]
    np.testing.assert_array_equal(same.values, stroke)
    # At half the pace the whole of it, in twice the time.
    slow, later = _driven(experiment, [Choice(0, {}, pace=0.5)])["drive"], _times(experiment, [Choice(0, {}, pace=0.5)])
    np.testing.assert_allclose(later, 2.0 * times)
    np.testing.assert_allclose(slow.values, np.where(times < 0.5, 0.05 * later, 0.05), atol=1e-12)
    np.testing.assert_allclose(slow.slopes, 0.5 * slope, atol=1e-12)
    assert duration_of(experiment, Choice(0, {}, pace=0.5)) == 2.0


def test_each_record_of_a_batch_lasts_as_long_as_the_one_it_is_taken_from(tmp_path: Path) -> None:
    """So an instant, which is a share of the record, is where it would be."""
    task = planned(tmp_path, DRIVES.replace('duration = "0.4 s"', 'duration = "0.8 s"', 1))
    problem, local = task.problem, np.asarray(task.problem.layout.local(jnp.asarray(task.start)))
    data, _ = records_of(problem, local, [Choice(1, {}, pace=2.0), Choice(0, {}, pace=0.5)])
    np.testing.assert_allclose(np.asarray(data.experiment.duration), [0.4, 1.6])


def test_a_slower_drive_comes_to_its_end_and_its_weight_with_it(tmp_path: Path) -> None:
    task = planned(tmp_path, DRIVES)
    problem, local = task.problem, np.asarray(task.problem.layout.local(jnp.asarray(task.start)))
    data, values = records_of(problem, local, [Choice(1, {}, pace=0.5), Choice(1, {})])
    there = eqx.tree_at(lambda p: p.observations, problem, data)
    end = int(np.asarray(problem.observations.experiment.count)[1]) - 1
    drive = np.asarray(problem.observations.experiment.inputs["drive"].values)[1, : end + 1]
    slow = np.asarray(there.trajectories_at(jnp.asarray(values)).states.position)[0, : end + 1]
    assert np.ptp(slow) == pytest.approx(np.ptp(drive), rel=0.1)


def test_a_drive_is_run_no_faster_or_farther_than_the_rig_is_said_to_do(tmp_path: Path) -> None:
    """Strokes at 200 and 100 mm/s: without limits each goes half as far again, and less."""

    def factors(limits: str) -> dict[tuple[int, str], Any]:
        found: dict[tuple[int, str], Any] = {}
        for choice in menu_of(planned(tmp_path, DRIVES + limits)):
            for what in ("pace", "size"):
                if (factor := getattr(choice, what)) != 1.0:
                    found.setdefault((choice.record, what), []).append(factor)
        return {key: pytest.approx(sorted(values), rel=1e-2) for key, values in found.items()}

    free = [1.0 / FARTHER, FARTHER]
    assert factors("") == {(r, what): free for r in (0, 1) for what in ("pace", "size")}
    bound = factors('[limits]\ndrive_speed = ["80 mm/s", "240 mm/s"]\ndrive_travel = ["1 mm", "1 m"]\n')
    # Farther is faster too.
    first = [1.0 / FARTHER, 1.2]
    assert bound == {(0, "pace"): first, (0, "size"): first, (1, "pace"): [0.8, FARTHER], (1, "size"): [0.8, FARTHER]}


def test_a_drive_that_stands_still_is_run_no_other_way(tmp_path: Path) -> None:
    task = planned(tmp_path, DRIVES)
    still = jax.tree.map(lambda leaf: leaf.at[0].set(leaf[0, 0]), task.problem.observations.experiment.inputs)
    still["drive"] = still["drive"]._replace(slopes=still["drive"].slopes.at[0].set(0.0))
    problem = eqx.tree_at(lambda p: p.observations.experiment.inputs, task.problem, still)
    run = {choice.record for choice in menu_of(replace(task, problem=problem)) if choice.pace != 1.0}
    assert run == {1}


def test_what_is_made_of_a_measured_motion_is_not_run_faster_or_farther(tmp_path: Path) -> None:
    assert menu_of(task_of(load_study(axis.write(tmp_path, ("guide.viscous_friction",))))) == []
    assert any(choice.pace != 1.0 for choice in menu_of(planned(tmp_path, DRIVES)))


def test_what_a_study_holds_of_planned_records_is_held(tmp_path: Path) -> None:
    text = DROPS.format(inclination="60 deg") + PARAMETERS.replace('[parameters.friction]\ninitial = "4 N"', "")
    text += '[parameters.friction]\nfixed = "4 N"\n'
    (tmp_path / "study.toml").write_text(text, encoding="utf-8")
    task = task_of(load_study(tmp_path))
    assert "friction" not in task.problem.layout.free_names
    assert "stiffness" in task.problem.layout.free_names
    local = np.asarray(task.problem.layout.local(jnp.asarray(task.start)))
    assert local[:, task.problem.layout.names.index("friction")] == pytest.approx([4.0, 4.0])
