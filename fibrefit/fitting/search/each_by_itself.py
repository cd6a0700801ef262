"""Records of a measured drive that differ, each fitted by itself.

Values that all records share lose bounces of those that differ by half a percent, and with the bounce all that comes
after it. A record by itself is followed to its end, errors of its inputs included: from there all go on together.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextvars import copy_context

import numpy as np

from fibrefit.core.programs.side_by_side import THREADS, threads
from fibrefit.fitting.evaluate import evaluate
from fibrefit.fitting.result import Starts, total
from fibrefit.fitting.search.optimum import Ended, Optimum, optimum
from fibrefit.fitting.thresholds import LOSES
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, input_errors
from fibrefit.problem.statement.layout import Layout
from fibrefit.problem.task import Task


def each_by_itself(task: Task, search: Callable[[Task], Starts], shared: Sequence[float]) -> Ended | None:
    """Where each record of a task with noisy inputs is best by itself; None where that does not follow the motion.

    Parameters
    ----------
    task : Task
    search : callable
        Ends of a search from many starts, of a task of one record.
    shared : (n_record,)
        Gap of each record where all have the same values. The one that these lose first by far is fitted first: what a
        model lacks it lacks in a record by itself, too, and then the others are not tried.
    """
    alone = [task.alone(record) for record in range(len(task.traces))]
    worst, *others = (int(record) for record in np.argsort(shared)[::-1])
    ends = {worst: _end(alone[worst], search)}
    if not _follows(alone[worst], ends[worst], shared[worst]):
        return None
    with threads(THREADS) as pool:
        # A limit of time holds for what is done in other threads too.
        running = {one: pool.submit(copy_context().run, _end, alone[one], search) for one in others}
        ends |= {one: future.result() for one, future in running.items()}
    best = [end for record in range(len(alone)) if (end := ends[record]) is not None]
    if len(best) < len(alone):
        return None
    coefficients = _together(task, alone, [end.coefficients for end in best])
    return Ended(np.concatenate([end.local for end in best]), True, coefficients)


def _end(one: Task, search: Callable[[Task], Starts]) -> Optimum | None:
    """Where a record by itself is best; None where no motion follows from any start."""
    found = search(one)
    return optimum(one, found.values[int(np.argmin(found.cost))]) if np.isfinite(found.cost).any() else None


def _follows(one: Task, end: Optimum | None, alike: float) -> bool:
    """Whether the record that shared values lose first by far is no longer lost by itself."""
    return end is not None and loses(alike, total(evaluate(one, end.problem, end.local).gap))


def loses(alike: float, own: float) -> bool:
    """Whether values that all records share lose a bounce, by the gaps that they and values of each record leave."""
    return alike > LOSES * own


def means(layout: Layout, local: np.ndarray) -> np.ndarray:
    """Free values ``(n_free,)`` of records that differ ``(n_record, n_local)``: of shared ones the mean."""
    column = {name: i for i, name in enumerate(layout.names)}
    return np.array(
        [local[slice(None) if record is None else record, column[slot.name]].mean() for slot, record in layout.entries]
    )


def _together(task: Task, alone: list[Task], found: list[InputCoefficients]) -> InputCoefficients:
    """Errors of inputs of records by themselves, as those of all: a wave is known by its number of half periods."""
    together = {}
    for name, of in input_errors(task).items():
        waves = np.zeros(of.size.shape)
        for record, (one, own) in enumerate(zip(alone, found, strict=True)):
            there = input_errors(one)[name].numbers[0]
            _, here, its = np.intersect1d(of.numbers[record], there, return_indices=True)
            waves[record, here] = np.asarray(own[name])[0, its]
        together[name] = waves
    return together
