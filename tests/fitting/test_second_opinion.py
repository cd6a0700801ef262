"""The solver that checks the other one keeps inside the bounds whatever it is told of the scale."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from fibrefit.fitting.search import rescue as module
from fibrefit.fitting.search.rescue import second_opinion
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task

NARROW = (15e3, 25e3)


def test_a_scale_wider_than_the_range_is_no_obstacle(task: Task) -> None:
    """As where the data do not see a parameter: its error is larger than anything it may be."""
    layout = task.problem.layout
    slots = tuple(
        replace(slot, range=replace(slot.range, lower=NARROW[0], upper=NARROW[1])) if slot.name == "stiffness" else slot
        for slot in layout.slots
    )
    problem = Problem(task.problem.model, Layout(slots, layout.records), task.problem.observations)
    scale = np.full(layout.size, 1e-3)
    scale[layout.free_names.index("stiffness")] = 1e15
    start = task.start.copy()
    start[layout.free_names.index("stiffness")] = 1e18
    found = second_opinion(problem, start, scale)
    assert NARROW[0] <= found.values[layout.free_names.index("stiffness")] <= NARROW[1]


@pytest.mark.parametrize("everywhere", [False, True])
def test_a_motion_that_runs_away_is_left(task: Task, monkeypatch: pytest.MonkeyPatch, everywhere: bool) -> None:
    """As of an effect that was composed of records: a step too far ends in no numbers."""
    problem, place = task.problem, task.problem.layout.free_names.index("stiffness")
    limit, gram_at = 1.01 * task.start[place], module.gram_at

    def running_away(problem: Problem, values: np.ndarray) -> np.ndarray:
        gram = gram_at(problem, values)
        return np.full_like(gram, np.nan) if everywhere or values[place] > limit else gram

    monkeypatch.setattr(module, "gram_at", running_away)
    found = second_opinion(problem, task.start.copy(), np.abs(task.start) + 1e-3)
    assert found.values[place] <= limit
    assert bool(np.isfinite(found.cost)) is not everywhere
