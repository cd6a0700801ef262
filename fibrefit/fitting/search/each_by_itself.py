"""Records of a measured drive that differ, each fitted by itself.

Values that all records share lose bounces of those that differ by half a percent, and with the bounce all that comes
after it. A record by itself is followed to its end, errors of its inputs included: from there all go on together.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextvars import copy_context
from typing import NamedTuple

import numpy as np

from fibrefit.core.threads import THREADS, thread_pool
from fibrefit.fitting.evaluate import evaluate
from fibrefit.fitting.result import Gap, Starts, total
from fibrefit.fitting.search.optimum import Ended, Optimum, optimum
from fibrefit.fitting.thresholds import LOSES
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, input_errors
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import GAP_OF_NOISE


class _End(NamedTuple):
    """Where a record by itself is best, and the gap that is left there."""

    there: Optimum
    gap: float

    @property
    def excess(self) -> float:
        """That gap over that of a perfect model; infinite where a motion is lost."""
        return self.gap / self.there.expected_gap if np.isfinite(self.gap) else np.inf

    @property
    def is_noise(self) -> bool:
        """Whether no more is left than noise."""
        return self.excess <= GAP_OF_NOISE


def each_by_itself(
    task: Task, search: Callable[[Task], Starts], shared: Sequence[float], thoroughly: bool = False
) -> Ended | None:
    """Where each record of a task with noisy inputs is best by itself; None where that does not follow the motion.

    Parameters
    ----------
    task : Task
    search : callable
        Ends of a search from many starts, of a task of one record.
    shared : (n_record,)
        Gap of each record where all have the same values. The one that these lose first by far is fitted first: what a
        model lacks it lacks in a record by itself, too, and then the others are not tried.
    thoroughly : bool
        Whether they are all the same; then at least half of all have to be followed, as one may be a hard one.
    """
    alone = [task.alone(record) for record in range(len(task.traces))]
    worst, *others = (int(record) for record in np.argsort(shared)[::-1])
    ends = {worst: _end(alone[worst], search)}
    if not (thoroughly or _follows(ends[worst], shared[worst])):
        return None
    with thread_pool(THREADS) as pool:
        # A limit of time holds for what is done in other threads too.
        running = {one: pool.submit(copy_context().run, _end, alone[one], search) for one in others}
        ends |= {one: future.result() for one, future in running.items()}
    if thoroughly and 2 * sum(_follows(end, shared[one]) for one, end in ends.items()) < len(ends):
        return None
    best = [end.there for record in range(len(alone)) if (end := ends[record]) is not None]
    if len(best) < len(alone):
        return None
    coefficients = _together(task, alone, [end.coefficients for end in best])
    return Ended(np.concatenate([end.local for end in best]), True, coefficients)


def _end(one: Task, search: Callable[[Task], Starts]) -> _End | None:
    """Where a record by itself is best; None where no motion follows from any start.

    As measured, an input leaves residuals in every minimum: where the best one turns out to leave more than noise
    without its errors, it may be the next one that leaves no more.
    """
    found = search(one)
    if not np.isfinite(found.cost).any():
        return None
    best: _End | None = None
    for values in (found.best[0], *found.others()):
        there = optimum(one, values)
        end = _End(there, total(evaluate(one, there.problem, there.local).gap))
        best = end if best is None or end.excess < best.excess else best
        if best.is_noise:
            break
    return best


def _follows(end: _End | None, alike: float) -> bool:
    """Whether a record by itself is followed to its end, or at least is no longer lost as by shared values."""
    return end is not None and (end.is_noise or loses(alike, end.gap))


def loses(alike: float, own: float) -> bool:
    """Whether values that all records share lose a bounce, by the gaps that they and values of each record leave."""
    return alike > LOSES * own


def lost_beside(before: Mapping[str, Gap], after: Mapping[str, Gap]) -> str | None:
    """The record of which a fit loses a bounce that another one of the same records does not lose; None where none is.

    Fits whose estimators differ leave some percent more or less of every record. A bounce is of one.

    Parameters
    ----------
    before, after : mapping of str to Gap
        What the other one and the one leave of each record.
    """
    ratios = {name: total(gap) / total(before[name]) for name, gap in after.items()}
    worst = max(ratios, key=lambda name: ratios[name])
    return worst if loses(total(after[worst]), total(before[worst])) else None


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
