"""Minima beside the one that all starts were led into."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from fibrefit.fitting.identify import identify
from fibrefit.fitting.result import Identification, Starts
from fibrefit.fitting.search import rescue as around
from fibrefit.fitting.search.rescue import rough_errors, searched_nearby
from fibrefit.fitting.search.solve import FOR_A_HORIZON, TO_THE_END, Descent, Stopping, gram_at
from fibrefit.fitting.search.starts import STARTS_AT_ONCE, collected, latin_hypercube_starts, search
from fibrefit.problem.formulation import formulate
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.rigs.catalogue import RIGS
from fibrefit.simulation.model import Model
from tests.fitting import made

LIFT, SLOPE, SEED, FEW = 7.5e-3, math.radians(74.0), 97, 4
"""One of 120 drops like it: in it a last small bounce is told by its noise alone."""


@pytest.fixture(scope="module")
def in_wrong_minimum(tmp_path_factory: pytest.TempPathFactory) -> tuple[Task, dict[str, float]]:
    """A drop and its truth, of which all starts end beside it."""
    random = np.random.default_rng(SEED)
    truth = {name: usual * math.exp(0.02 * random.normal()) for name, usual in USUAL.items()}
    truth["release"] = random.uniform(0.1, 0.3)
    name = f"drop_{1e3 * LIFT:g}mm.csv"
    one = made.record(name, LIFT, seed=SEED, inclination=SLOPE, samples=2000, loud=0.5, **truth)
    study = made.study(tmp_path_factory.mktemp("wrong_minimum"), (LIFT,), own=['inclination = "74 deg"'])
    return formulate(study, [one], Model(RIGS["fibre_mass"])), truth


USUAL = {"stiffness": 14e3, "damping": 15.0, "friction": 3.0}


def searched(task: Task) -> Starts:
    layout = task.problem.layout
    began = latin_hypercube_starts(layout, task.start, task.spread, FEW, 0)
    return collected(layout, began, search(task.problem, layout.free(began), task.horizons, lambda share: None))


@pytest.mark.slow
def test_what_all_starts_agree_on_is_left_for_a_lower_minimum_beside_it(
    in_wrong_minimum: tuple[Task, dict[str, float]],
) -> None:
    task, truth = in_wrong_minimum
    alone = searched(task)
    assert alone.agreeing == FEW
    found = searched_nearby(task.problem, alone, task.counts[-1:])
    best = int(np.argmin(found.cost))
    assert found.cost[best] < alone.cost.min() - 20.0
    assert FEW <= found.agreeing < found.tried
    errors = rough_errors(task.problem, found.values[best], found.cost[best])[:3]
    away = [
        abs(start.ended[int(np.argmin(start.cost))] - list(truth.values())[:3]) / errors for start in (found, alone)
    ]
    assert np.all(away[0] < 4.0)
    assert away[1].max() > 8.0


def test_a_fit_says_that_starts_ended_in_several(in_wrong_minimum: tuple[Task, dict[str, float]]) -> None:
    task, _ = in_wrong_minimum
    found = identify(task, FEW)
    (check,) = [check for check in found.checks if check.identifier == "starts"]
    assert check.facts["others"] >= FEW
    assert found.starts.planned == found.starts.tried


def test_what_comes_back_to_the_best_minimum_is_followed_no_further(
    in_wrong_minimum: tuple[Task, dict[str, float]], task: Task, found: Identification, monkeypatch: pytest.MonkeyPatch
) -> None:
    followed, asked = around.descend_all, list[tuple[float, int]]()

    def seen(problem: Problem, free: Any, width: Any, counts: Any, active: Any, stopping: Stopping) -> Descent:
        asked.append((float(stopping.near), int(np.sum(active))))
        return followed(problem, free, width, counts, active, stopping)

    monkeypatch.setattr(around, "descend_all", seen)
    searched_nearby(task.problem, found.starts, task.counts[-1:])
    assert asked == [(FOR_A_HORIZON, STARTS_AT_ONCE)]
    asked.clear()
    # Where another minimum is lower, those that come into it are followed to its end.
    led, _ = in_wrong_minimum
    lower = searched_nearby(led.problem, searched(led), led.counts[-1:])
    assert {near for near, _ in asked} == {FOR_A_HORIZON, TO_THE_END}
    normal = gram_at(led.problem, lower.values[int(np.argmin(lower.cost))])
    errors = rough_errors(led.problem, lower.values[int(np.argmin(lower.cost))], float(lower.cost.min()))
    step = np.linalg.lstsq(normal[:-1, :-1] * np.outer(errors, errors), normal[:-1, -1] * errors, rcond=1e-10)[0]
    assert np.abs(step).max() < 0.1


def test_where_nothing_is_lower_all_stays_as_it_is(task: Task, found: Identification) -> None:
    assert searched_nearby(task.problem, found.starts, task.counts[-1:]) is found.starts
