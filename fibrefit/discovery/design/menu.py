"""Further records that a rig could be asked for, and the values that a model has in each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.discovery.model.finding import Choice
from fibrefit.problem.statement.observations import Observations
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import ORDER, Experiment, known_conditions

FACTORS = (0.5, 2.0)
"""On pace and size of an input."""


def menu_of(task: Task) -> list[Choice]:
    """Records that could be measured: all combinations of conditions, each input faster, slower, larger and smaller.

    Those at hand once more are not among them.
    """
    rig, experiment = task.problem.model.rig, task.problem.observations.experiment
    stated = {name: np.asarray(values, dtype=float) for name, values in experiment.conditions.items()}
    menu = []
    for conditions in rig.menu(stated):
        same = {name: np.isclose(stated[name], value) for name, value in conditions.items()}
        again = np.all(list(same.values()), axis=0)
        # Driven as the first one it is another record than one under its conditions that was driven otherwise.
        if not (again[0] if rig.inputs else again.any()):
            menu.append(Choice(0, {name: value for name, value in conditions.items() if not same[name][0]}))
    # What is made of the measured motion itself cannot be run at will.
    driven = bool(rig.inputs) and rig.anchor is None and not rig.derived
    for record in range(len(task.problem.layout.records) if driven else 0):
        menu += [Choice(record, {}, pace=factor) for factor in FACTORS]
        menu += [Choice(record, {}, size=factor) for factor in FACTORS]
    return menu


def batches(menu: Sequence[Choice], records: int) -> Iterator[list[Choice]]:
    """Records of a menu, as many at a time as a study has; the last one fills the end."""
    for start in range(0, len(menu), records):
        yield [menu[min(start + r, len(menu) - 1)] for r in range(records)]


def records_of(problem: Problem, local: np.ndarray, batch: Sequence[Choice]) -> tuple[Observations, np.ndarray]:
    """Records of a menu as they would be taken, each the next one of the series, and the values of a model in them.

    Parameters
    ----------
    problem : Problem
        Of the study.
    local : (n_record, n_local) in SI units
        Values of the records at hand.
    batch : sequence of Choice

    Returns
    -------
    observations : Observations
        Leaves ``(n_choice, ...)``; what they measure is not known.
    values : (n_choice, n_local) in SI units
        A condition that is a value of each record is the one that is chosen, and the start is that of a rig at rest.
    """
    rows = np.array([choice.record for choice in batch])
    data: Observations = jax.tree.map(lambda leaf: leaf[rows], problem.observations)
    before = data.experiment
    after = before._replace(
        conditions=_conditions(before.conditions, batch, len(local) + 1), inputs=_driven(before, batch)
    )
    names, values = problem.layout.names, local[rows]
    for r, choice in enumerate(batch):
        started = _planned(problem, values[r], before, r)
        for name, value in choice.conditions.items():
            if name in names:
                values[r, names.index(name)] = value
        for name, value in _planned(problem, values[r], after, r).items():
            if name in names:
                j = names.index(name)
                limits = problem.layout.slots[j].range
                values[r, j] = np.clip(values[r, j] + value - started[name], limits.lower, limits.upper)
    return data._replace(experiment=after), values


def _planned(problem: Problem, row: np.ndarray, experiment: Experiment, record: int) -> Mapping[str, float]:
    """Nuisances by which the rig would start at rest under the conditions that a model has in a record."""
    values = dict(zip(problem.layout.names, row, strict=True))
    stated = {name: np.asarray(each)[record] for name, each in experiment.conditions.items()}
    laws = problem.model.laws(values)
    return problem.model.rig.planned(known_conditions(values, laws, experiment._replace(conditions=stated)))


def _conditions(stated: Mapping[str, Any], batch: Sequence[Choice], order: int) -> dict[str, Any]:
    changed = {name: np.array(values) for name, values in stated.items()}
    changed[ORDER][:] = order
    for r, choice in enumerate(batch):
        for name, value in choice.conditions.items():
            changed[name][r] = value
    return {name: jnp.asarray(values) for name, values in changed.items()}


def _driven(experiment: Any, batch: Sequence[Choice]) -> dict[str, Signals]:
    """Inputs of records run at another pace and size, about where they begin; held where they end."""
    times, counts = np.asarray(experiment.times), np.asarray(experiment.count)
    driven = {}
    for name, signals in experiment.inputs.items():
        values, slopes = np.array(signals.values), np.array(signals.slopes)
        for r, choice in enumerate(batch):
            known = slice(0, counts[r])
            there = times[r, 0] + choice.pace * (times[r] - times[r, 0])
            moved = np.interp(there, times[r, known], values[r, known])
            values[r] = values[r, 0] + choice.size * (moved - values[r, 0])
            steep = np.interp(there, times[r, known], slopes[r, known], right=0.0)
            slopes[r] = choice.size * choice.pace * steep
        driven[name] = Signals(jnp.asarray(values), jnp.asarray(slopes))
    return driven
