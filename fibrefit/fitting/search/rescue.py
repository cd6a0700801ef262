"""Better minima than the one where most starts end: around it, by a second solver, and of each record by itself.

Starts that follow a motion contact by contact are led alike, and may all be led into the same wrong order of small late
bounces, or past a turn at which the guide holds the weight. From far off its error bars, and over the whole record at
once, a descent may come down on the other side. Values that all records share lose bounces of those that differ by half
a percent, and with the bounce all that comes after it: a record by itself is followed to its end.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from contextvars import copy_context
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.core.arrays import gram_root
from fibrefit.core.threads import THREADS, thread_pool
from fibrefit.fitting.residuals import evaluate
from fibrefit.fitting.result import Gap, Starts, total
from fibrefit.fitting.search.optimum import Ended, Optimum, optimum
from fibrefit.fitting.search.solve import (
    FOR_A_HORIZON,
    TO_THE_END,
    Descent,
    Stopping,
    descend,
    descend_all,
    gram_at,
    widths,
)
from fibrefit.fitting.search.starts import STARTS_AT_ONCE, Searched, basins_of, collected, with_rows
from fibrefit.fitting.thresholds import FIT_TOLERANCE, LOSES
from fibrefit.problem import GAP_OF_NOISE, InputCoefficients, Layout, Problem, Task, input_errors

ROUNDS = 3
"""How often there is a look around what is the best minimum by then, and a second solver from there."""

AWAY = 60.0
"""Distance of the places it is looked from, in standard errors for white noise. Of 160 drops four had a lower minimum
beside that of all starts: 60 finds all of them, 25 three and 10 two."""


def searched_nearby(problem: Problem, starts: Starts, whole: np.ndarray) -> Starts:
    """Starts with those from around their best minimum, if one of these ended lower; then around that one, too.

    Parameters
    ----------
    problem : Problem
    starts : Starts
    whole : (1, n_record) int
        Samples of each record.
    """
    layout, counts = problem.layout, np.repeat(whole, STARTS_AT_ONCE, axis=0)
    low, high = (np.array([getattr(slot.range, end) for slot, _ in layout.entries]) for end in ("lower", "upper"))
    for number in range(ROUNDS):
        values, cost = starts.best
        # Ways from a place, of one and minus one: Walsh functions, other ones at each look.
        rows, places = np.arange(1, STARTS_AT_ONCE // 2 + 1) + number * STARTS_AT_ONCE // 2, range(len(values))
        odd = np.array([[(int(row) & place).bit_count() % 2 for place in places] for row in rows])
        signs = np.concatenate([1.0 - 2.0 * odd, 2.0 * odd - 1.0])
        began = np.clip(values + AWAY * rough_errors(problem, values, cost) * signs, low, high)
        width, best = widths(problem, layout.free(values)), layout.free(values)
        every = np.ones(STARTS_AT_ONCE, dtype=bool)
        found = descend_all(problem, layout.free(began), width, counts, every, Stopping(np.asarray(FOR_A_HORIZON)))
        # What comes back to the best place is followed no further than that.
        further = ~(np.max(np.abs(np.asarray(found.free) - best) / width, axis=-1) < 1.0)
        if further.any():
            free = layout.free(began)
            ends = descend_all(problem, free, width, counts, further, Stopping(np.asarray(TO_THE_END)))
            pairs = zip(map(np.asarray, found), map(np.asarray, ends), strict=True)
            found = Descent(*(with_rows(old, further, new[further]) for old, new in pairs))
        lower = cost - np.asarray(found.cost).min() > FIT_TOLERANCE
        if not lower and not number:
            return starts
        starts = with_further_starts(starts, layout, began, Descent(*map(np.asarray, found)))
        if not lower:
            break
    return starts


def with_further_starts(starts: Starts, layout: Layout, began: np.ndarray, found: Descent) -> Starts:
    """The starts with others, that began at `began` ``(n, n_free)``."""
    further = collected(layout, began, Searched(found, np.ones(len(began), dtype=bool)))
    costs = np.append(starts.cost, further.cost)
    return replace(
        starts,
        began=np.concatenate([starts.began, further.began]),
        ended=np.concatenate([starts.ended, further.ended]),
        values=np.concatenate([starts.values, further.values]),
        cost=costs,
        steps=np.append(starts.steps, further.steps),
        basin=basins_of(costs),
        planned=starts.planned + len(began),
    )


def rough_errors(problem: Problem, values: np.ndarray, cost: float) -> np.ndarray:
    """Standard errors ``(n_free,)`` under white noise of the residuals' size; a small step where data see nothing."""
    root = gram_root(gram_at(problem, values))[:, :-1]
    scale = np.linalg.norm(root, axis=0)
    seen = scale > 0.0
    inverse = np.linalg.pinv(root / np.where(seen, scale, 1.0), rcond=1e-8) / np.where(seen, scale, 1.0)[:, None]
    errors = np.linalg.norm(inverse, axis=1) * np.sqrt(cost / problem.n_measured)
    return np.where(seen & (errors > 0.0), errors, np.maximum(1e-3 * np.abs(values), 1e-9))


TOLERANCE = 1e-10
"""Share of the cost that ends the search: a step that gains less moves no value by a hundredth of its error."""


class SecondOpinion(NamedTuple):
    """Where the other solver ended.

    Parameters
    ----------
    values : (n_free,) in SI units
    cost : float
        Sum of squared residuals.
    """

    values: np.ndarray
    cost: float


def second_opinion(problem: Problem, start: np.ndarray, scale: np.ndarray) -> SecondOpinion:
    """Fit again, in SI units with true bounds.

    Parameters
    ----------
    problem : Problem
    start : (n_free,) in SI units
    scale : (n_free,) in SI units
        A small step of each value.
    """
    from scipy.optimize import least_squares

    ranges = [slot.range for slot, _ in problem.layout.entries]
    lower, upper = np.array([r.lower for r in ranges]), np.array([r.upper for r in ranges])
    # A step where the data see nothing can be wider than the range itself.
    margin = 1e-9 * np.minimum(scale, upper - lower)
    known: dict[bytes, np.ndarray] = {}

    def root(values: np.ndarray) -> np.ndarray:
        """Residuals and Jacobian of the size of the problem; SciPy asks for both at the same place."""
        if values.tobytes() not in known:
            gram = gram_at(problem, values)
            known.clear()
            # Where a motion runs away there are no residuals: SciPy takes a shorter step.
            there = bool(np.isfinite(gram).all())
            known[values.tobytes()] = gram_root(gram) if there else np.full_like(gram, np.nan)
        return known[values.tobytes()]

    begun = np.clip(start, lower + margin, upper - margin)
    if not np.isfinite(root(begun)).all():
        return SecondOpinion(begun, np.inf)
    found = least_squares(
        lambda x: root(x)[:, -1],
        begun,
        jac=lambda x: root(x)[:, :-1],
        bounds=(lower, upper),
        x_scale=scale,
        method="trf",
        xtol=TOLERANCE,
        ftol=TOLERANCE,
        gtol=TOLERANCE,
        max_nfev=100,
    )
    return SecondOpinion(found.x, float(2.0 * found.cost))


class SecondSolver(NamedTuple):
    """Where another solver ended.

    Parameters
    ----------
    values : (n_free,) in SI units
    distance : float
        From the best values, in standard errors for white noise.
    gain : float
        By how much its cost is lower, in units of the residual variance.
    """

    values: np.ndarray
    distance: float
    gain: float


def with_second_solver(
    task: Task, width: Callable[[], np.ndarray], starts: Starts, stop: Callable[[], bool]
) -> tuple[Starts, SecondSolver | None]:
    """Starts, and where another solver ends; if it ends lower, the search goes on from there, as one start more."""
    problem, whole = task.problem, task.counts[-1:]
    if stop():
        return starts, None
    for _ in range(ROUNDS):
        values, cost = starts.best
        errors = rough_errors(problem, values, cost)
        other = second_opinion(problem, values + 3.0 * errors * (-1.0) ** np.arange(len(values)), errors)
        if not cost - other.cost > FIT_TOLERANCE:
            break
        found = descend(problem, problem.layout.free(other.values), width(), whole)
        end = Descent(*(np.asarray(leaf)[None] for leaf in found))
        starts = with_further_starts(starts, problem.layout, other.values[None], end)
    values, cost = starts.best
    gain = cost - other.cost
    # What is left may be far more than noise: a fall of the cost counts in units of that.
    variance = max(cost / max(problem.n_measured, 1), 1.0)
    return starts, SecondSolver(other.values, float(np.max(np.abs(other.values - values) / errors)), gain / variance)


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
    alone = [task.of_record(record) for record in range(len(task.traces))]
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


def record_that_lost_a_bounce(before: Mapping[str, Gap], after: Mapping[str, Gap]) -> str | None:
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
