"""Further records that a rig could be asked for, and the values that a model has in each."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.discovery.model.finding import Choice
from fibrefit.problem import Observations, Problem, Task
from fibrefit.rigs.thresholds import FARTHER
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import ORDER, Experiment


def menu_of(task: Task) -> list[Choice]:
    """Records that could be measured: all combinations of conditions, each input faster, slower, larger and smaller.

    All within the reach of the rig, see `reach_of`. Those at hand once more are not among them.
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
    for record, (paces, sizes) in enumerate(zip(*_factors(task), strict=True)):
        menu += [Choice(record, {}, pace=factor) for factor in paces if factor != 1.0]
        menu += [Choice(record, {}, size=factor) for factor in sizes if factor != 1.0]
    return menu


def reach_of(task: Task) -> dict[str, tuple[float, float]]:
    """Least and most of what a further record could have, in SI units: of conditions, and of each input that is run.

    As the study says that the rig can do; where it says nothing what was measured, wider by a factor at either end.
    """
    rig, found = task.problem.model.rig, task.problem.model.rig.reach(task.problem.observations.experiment.conditions)
    for name, known in motions_of(task).items():
        found[name] = rig.possible.get(name) or (float(known.min()) / FARTHER, float(known.max()) * FARTHER)
    return found


def motions_of(task: Task) -> dict[str, np.ndarray]:
    """Travel and largest speed ``(n_record,)``, in SI units, of each input that can be run at will.

    By names such as ``drive_travel``, ``drive_speed``. What is made of the measured motion itself is not among them.
    """
    rig, experiment = task.problem.model.rig, task.problem.observations.experiment
    if rig.anchor is not None or rig.derived:
        return {}
    found = {}
    for name, signals in experiment.inputs.items():
        inside = np.arange(experiment.times.shape[1]) < np.asarray(experiment.count)[:, None]
        values, slopes = np.asarray(signals.values), np.abs(np.asarray(signals.slopes))
        first = values[:, :1]
        found[f"{name}_travel"] = np.ptp(np.where(inside, values, first), axis=1)
        found[f"{name}_speed"] = np.max(np.where(inside, slopes, 0.0), axis=1)
    return found


def _factors(task: Task) -> tuple[list[tuple[float, float]], list[tuple[float, float]]]:
    """Factors by which inputs of each record could run slower and faster, and less and more far; 1 where they cannot.

    A record is changed by no more than one further record may go beyond all of them: how hard it accelerates grows with
    the square of its pace, and its shape is known about its own pace alone.
    """
    reach, known = reach_of(task), motions_of(task)
    paces, sizes = [], []
    for record in range(len(task.problem.layout.records) if known else 0):
        room = {name: np.array(reach[name]) / each[record] for name, each in known.items() if each[record] > 0.0}
        speeds = [ends for name, ends in room.items() if name.endswith("_speed")]
        paces.append(_within(speeds))
        sizes.append(_within(list(room.values())))
    return paces, sizes


def _within(room: Sequence[np.ndarray]) -> tuple[float, float]:
    """The least factor and the largest one that all limits leave, 1 between them; 1 of an input that stands still."""
    if not room:
        return 1.0, 1.0
    low, high = max(1.0 / FARTHER, *(ends[0] for ends in room)), min(FARTHER, *(ends[1] for ends in room))
    return min(float(low), 1.0), max(float(high), 1.0)


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
        times=_times(before, batch),
        conditions=_conditions(before.conditions, batch, len(local) + 1),
        inputs=_driven(before, batch),
        duration=jnp.array([duration_of(problem.observations.experiment, choice) for choice in batch]),
    )
    of = lambda experiment, r: {name: np.asarray(each)[r] for name, each in experiment.conditions.items()}  # noqa: E731
    values = [
        problem.values_elsewhere(local[choice.record], of(before, r), of(after, r), choice.conditions)
        for r, choice in enumerate(batch)
    ]
    return data._replace(experiment=after), np.stack(values)


def _conditions(stated: Mapping[str, Any], batch: Sequence[Choice], order: int) -> dict[str, Any]:
    changed = {name: np.array(values) for name, values in stated.items()}
    changed[ORDER][:] = order
    for r, choice in enumerate(batch):
        for name, value in choice.conditions.items():
            changed[name][r] = value
    return {name: jnp.asarray(values) for name, values in changed.items()}


def duration_of(experiment: Experiment, choice: Choice) -> float:
    """How long a further record lasts, in s: one whose input runs slower as much longer."""
    times, last = np.asarray(experiment.times)[choice.record], int(np.asarray(experiment.count)[choice.record]) - 1
    return float(times[last] - times[0]) / min(choice.pace, 1.0)


def _times(experiment: Experiment, batch: Sequence[Choice]) -> jax.Array:
    """Instants of the samples: one whose input runs slower has as many, over a longer time.

    Noise that is white, or 1/f, is the same then from sample to sample.
    """
    times = np.array(experiment.times)
    paces = np.array([[min(choice.pace, 1.0)] for choice in batch])
    return jnp.asarray(times[:, :1] + (times - times[:, :1]) / paces)


def _driven(experiment: Experiment, batch: Sequence[Choice]) -> dict[str, Signals]:
    """Inputs of records run at another pace and size, about where they begin; one that ends early is held there."""
    times, counts = np.asarray(experiment.times), np.asarray(experiment.count)
    driven = {}
    for name, signals in experiment.inputs.items():
        values, slopes = np.array(signals.values), np.array(signals.slopes)
        for r, choice in enumerate(batch):
            known = slice(0, counts[r])
            # A slower one is the same from sample to sample, see `_times`.
            there = times[r, 0] + max(choice.pace, 1.0) * (times[r] - times[r, 0])
            moved = np.interp(there, times[r, known], values[r, known])
            values[r] = values[r, 0] + choice.size * (moved - values[r, 0])
            steep = np.interp(there, times[r, known], slopes[r, known], right=0.0)
            slopes[r] = choice.size * choice.pace * steep
        driven[name] = Signals(jnp.asarray(values), jnp.asarray(slopes))
    return driven
