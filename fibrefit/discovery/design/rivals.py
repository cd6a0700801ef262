"""Explanations that do equally well, and the further record of which they predict the most different things.

Source
------
Measuring where rival models, each at its best, disagree most is Hunter and Reiner, Technometrics 7 (1965).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.discovery.design.menu import batches, menu_of, records_of
from fibrefit.discovery.engine.candidates import Hypothesis, own_task
from fibrefit.discovery.engine.refit import difference_steps
from fibrefit.discovery.model.finding import Choice, separation
from fibrefit.discovery.search.search import Search
from fibrefit.problem.statement.observations import Observations
from fibrefit.problem.task import Task
from fibrefit.study.summaries.discovery import Separation


@dataclass(frozen=True)
class Rivals:
    """What was added, and what would have explained the records as well in its place.

    Parameters
    ----------
    names : (str, str)
    models : (Hypothesis, Hypothesis)
        With the one and with the other.
    """

    names: tuple[str, str]
    models: tuple[Hypothesis, Hypothesis]


def separating_experiment(search: Search, rivals: Rivals) -> Separation | None:
    """The record of the menu on which two explanations differ most; None where the rig has no menu.

    Each keeps the values it was found with but for a record's own zero and start. Inputs count as known.
    """
    if not (menu := menu_of(search.task)):
        return None
    models = [own_task(search.task, hypothesis) for hypothesis in rivals.models]
    records = search.task.problem.layout.records
    before, after = _apart(models, search.context.each, menu)
    if not (np.isfinite(before).any() and np.isfinite(after).any()):
        return None
    best = int(np.nanargmax(after))
    measures = {"apart_before": float(np.nanmax(before)), "apart_after": float(after[best])}
    return separation(rivals.names, menu[best], records[menu[best].record], **measures)


def _apart(
    models: list[tuple[Task, np.ndarray]], each: tuple[str, ...], menu: list[Choice]
) -> tuple[np.ndarray, np.ndarray]:
    """Rms difference of two models in units of the noise, in records at hand and of a menu; nan for no motion."""
    problems = [task.problem for task, _ in models]
    values = [np.asarray(task.problem.layout.local(free)) for task, free in models]
    further: list[float] = []
    for batch in batches(menu, len(values[0])):
        taken = [records_of(problem, local, batch) for problem, local in zip(problems, values, strict=True)]
        further += list(_of_records(models, each, taken[0][0], [local for _, local in taken]))
    before = _of_records(models, each, problems[0].observations, values)
    return before, np.array(further[: len(menu)])


def _of_records(
    models: list[tuple[Task, np.ndarray]], each: tuple[str, ...], data: Observations, values: list[np.ndarray]
) -> np.ndarray:
    first, second = values
    here, there = _readings(models[0][0], first, data), _readings(models[1][0], second, data)
    slopes = [_readings(models[0][0], moved, data) - here for moved in _moved(models[0][0], first, each)]
    number = sum(np.count_nonzero(np.asarray(weight), axis=-1) for weight in data.weight.values())
    apart = np.full(len(first), np.nan)
    for r, change in enumerate(there - here):
        own = np.array([slope[r] for slope in slopes]).T
        if np.isfinite(change).all() and np.isfinite(own).all():
            remaining = change - own @ np.linalg.lstsq(own, change, rcond=None)[0] if slopes else change
            apart[r] = np.sqrt(remaining @ remaining / number[r])
    return apart


def _moved(task: Task, local: np.ndarray, each: tuple[str, ...]) -> list[np.ndarray]:
    """Values with each of a record's own ones a little further."""
    declared, moved = task.problem.layout.names, []
    for name in each:
        changed, j = local.copy(), declared.index(name)
        scale = task.problem.layout.slots[j].range.scale
        changed[:, j] += difference_steps(changed[:, j], scale)
        moved.append(changed)
    return moved


def _readings(task: Task, local: np.ndarray, data: Observations) -> np.ndarray:
    """What a model says of records in units of the noise, ``(n_record, n_channel * n_time)``; 0 where none counts."""
    problem = eqx.tree_at(lambda p: p.observations, task.problem, data)
    return np.asarray(_fitted(problem, jnp.asarray(local)))


@eqx.filter_jit
def _fitted(problem: Any, local: jax.Array) -> jax.Array:
    data = problem.observations
    readings = problem.predict(local, data.experiment)
    channels = [readings[channel] * data.weight[channel] for channel in problem.model.rig.channels]
    return jnp.concatenate(channels, axis=-1)
