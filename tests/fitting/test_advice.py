"""Which further record would help: what it would tell, and that no program is compiled to know it."""

from __future__ import annotations

from unittest.mock import patch

import equinox as eqx
import jax
import numpy as np

from fibrefit.core import programs
from fibrefit.fitting.advice import _information
from fibrefit.problem.task import Task
from fibrefit.study import load_study
from fibrefit.study.load import example
from fibrefit.workflow.prepare import task_of

BASE = ("stiffness", "damping", "friction")
"""What every record of a drop tells of."""


def normal_by_itself(task: Task, conditions: dict[str, float]) -> np.ndarray:
    """Normal matrix of the shared values from the first record under other conditions, by the definition."""
    problem = task.problem
    experiment = problem.observations.experiment
    taken = {name: np.asarray(values).copy() for name, values in experiment.conditions.items()}
    for name, value in conditions.items():
        taken[name][0] = value
    observations = problem.observations._replace(experiment=experiment._replace(conditions=taken))
    slopes = eqx.tree_at(lambda p: p.observations, problem, observations).linearised(task.start).slopes
    flat = np.asarray(slopes[0]).reshape(-1, slopes.shape[-1])
    columns = np.asarray(problem.layout.local_columns[0])
    shared = sum(record is None for _, record in problem.layout.entries)
    seen, own = flat[:, columns < shared], flat[:, columns >= shared]
    # The Schur complement of the block of its own nuisances; what it does not see at all has none.
    cross = seen.T @ own
    normal = np.zeros((problem.layout.size, problem.layout.size))
    there = columns[columns < shared]
    normal[np.ix_(there, there)] = seen.T @ seen - cross @ np.linalg.pinv(own.T @ own, hermitian=True) @ cross.T
    return normal


def test_what_a_further_record_tells_is_that_of_the_first_under_other_conditions(task: Task) -> None:
    problem = task.problem
    menu = problem.model.rig.menu(problem.observations.experiment.conditions)
    assert len(menu) > len(problem.layout.records)
    found = _information(problem, task.start, menu)
    assert len(found) == len(menu)
    for i in (0, len(problem.layout.records), len(menu) - 1):
        expected = normal_by_itself(task, menu[i])
        size = np.sqrt(np.diag(expected))
        assert np.count_nonzero(size) >= len(BASE)
        scale = np.where(size > 0.0, size, 1.0)
        np.testing.assert_allclose(found[i] / np.outer(scale, scale), expected / np.outer(scale, scale), atol=1e-5)


def test_no_program_is_compiled_to_know_it(task: Task) -> None:
    problem = task.problem
    values = task.start
    problem.linearised(values)
    menu = problem.model.rig.menu(problem.observations.experiment.conditions)
    with patch.object(programs.KeptProgram, "_found", side_effect=AssertionError("a program is made")):
        jax.block_until_ready(_information(problem, values, menu))


def test_a_lift_that_every_record_has_for_itself_is_that_of_the_further_record() -> None:
    """Not stated, it is a value of each record: what a further record tells is of the lift that it would have."""
    study = load_study(example("drop_series"))
    unstated = tuple(record.model_copy(update={"lift": None}) for record in study.records)
    task = task_of(study.model_copy(update={"records": unstated}))
    assert "lift" in task.problem.layout.names
    menu = [{"lift": 0.003}, {"lift": 0.012}]
    lower, higher = (np.diag(normal)[:2] for normal in _information(task.problem, task.start, menu))
    stated = _information(task_of(study).problem, task_of(study).start, menu)
    assert np.all(higher > 1.2 * lower)
    # The lift of a record that is planned is known; here it would be found from the record, and tells a little less.
    assert np.all(lower <= 1.001 * np.diag(stated[0])[:2])
