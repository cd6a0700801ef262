"""Starts from what the records say without the effects: a model with all of them has many more poor minima."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from fibrefit.fitting.search.multistart import HorizonSchedule, latin_hypercube_starts, search
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task

FEW = 4
"""Number of starts up to which they are all left where they are."""
AS_DRAWN = 4
"""One start in so many is left where it is, the first of all among them: the effects may have much to say."""
LEADERS = 4
"""Starts of the fit without effects."""


def starts_from_base_model(task: Task, starts: np.ndarray, seed: int, stop: Callable[[], bool]) -> np.ndarray:
    """Starts of which most have the base values that a fit without the effects ends at.

    Parameters
    ----------
    task : Task
    starts : (n_start, n_free) in SI units
    seed : int
        Of the scatter of the starts of that fit.
    stop : callable

    Returns
    -------
    (n_start, n_free) in SI units
        As they were where there is no such fit: few starts, no effects, or none that may vanish.
    """
    plain = without_effects(task)
    if len(starts) <= FEW or plain is None or stop():
        return starts
    problem, layout = plain.problem, plain.problem.layout
    began = layout.free(latin_hypercube_starts(layout, plain.start, plain.spread, LEADERS, seed))
    found = search(problem, began, plain.horizons, lambda share: None, stop, HorizonSchedule.of(plain)).descent
    if not np.isfinite(found.cost).any():
        return starts
    led = starts.copy()
    rows = np.flatnonzero(np.arange(len(starts)) % AS_DRAWN)
    led[np.ix_(rows, columns_in(task.problem.layout, layout))] = layout.values(found.free[np.argmin(found.cost)])
    return led


def without_effects(task: Task) -> Task | None:
    """The task without effects whose strength is free, and what needs them; None where there are none."""
    problem, layout = task.problem, task.problem.layout
    free = {slot.name for slot, _ in layout.entries}
    gone = {
        effect.name for effect in problem.model.effects if free & {f"{effect.name}.{name}" for name in effect.strength}
    }
    if not gone:
        return None
    while more := {e.name for e in problem.model.effects if gone & set(e.needs)} - gone:
        gone |= more
    model = replace(problem.model, effects=tuple(e for e in problem.model.effects if e.name not in gone))
    slots = tuple(slot for slot in layout.slots if slot.name.rpartition(".")[0] not in gone)
    plain = Layout(slots, layout.records)
    return replace(
        task,
        problem=Problem(model, plain, problem.observations, problem.soft_beyond),
        start=task.start[columns_in(layout, plain)],
        spread={name: factor for name, factor in task.spread.items() if name in plain.names},
    )


def columns_in(layout: Layout, part: Layout) -> np.ndarray:
    """Where the free values of a part of a layout are among all of them, ``(n_part,)``; their order is the same."""
    return np.flatnonzero([slot.name in part.names for slot, _ in layout.entries])
