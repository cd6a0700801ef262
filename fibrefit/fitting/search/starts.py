"""Where a search begins, and how it goes on: many starts, horizon by horizon.

A solver's success is a claim; agreement of independent starts is the evidence.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from concurrent.futures import Executor
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.threads import THREADS, thread_pool
from fibrefit.fitting.result import Starts
from fibrefit.fitting.search.solve import (
    FOR_A_HORIZON,
    MAX_STEPS,
    ROUGH_STEPS,
    TO_THE_END,
    Descent,
    Stopping,
    descend_all,
    widths,
)
from fibrefit.fitting.thresholds import LESS_PROBABLE, SAME_BASIN
from fibrefit.problem import LENGTH_STEP, Layout, Problem, Task

STARTS_AT_ONCE = 4
"""Starts that are searched from in one go, by one core; so few are all left where they are drawn."""

AS_DRAWN = 4
"""One start in so many is left where it is, the first of all among them: the effects may have much to say."""


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
    if len(starts) <= STARTS_AT_ONCE or plain is None or stop():
        return starts
    problem, layout = plain.problem, plain.problem.layout
    began = layout.free(latin_hypercube_starts(layout, plain.start, plain.spread, STARTS_AT_ONCE, seed))
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


FAR_ABOVE = 100.0
"""Factor on the cost of a sample at the best start beyond which another is given up."""

WORTH_A_PROGRAM = 1_000_000
"""Samples of all starts and records beyond a horizon from which it has arrays of its own: ten steps through so many
take a second of processor time, as much as their program takes to compile."""


def latin_hypercube_starts(
    layout: Layout, centre: np.ndarray, spread: Mapping[str, float], number: int, seed: int
) -> np.ndarray:
    """Starting values ``(number, n_free)`` in SI units: the centre, then a Latin hypercube around it.

    Parameters
    ----------
    layout : Layout
    centre : (n_free,) in SI units
    spread : mapping of name to factor
        A shared parameter is multiplied by a factor between 1/spread and spread; others stay.
    number, seed : int

    Source
    ------
    McKay, Beckman and Conover, Technometrics 21 (1979).
    """
    moved = [
        i for i, (slot, record) in enumerate(layout.entries) if record is None and spread.get(slot.name, 1.0) > 1.0
    ]
    starts = np.tile(centre, (number, 1))
    if number < 2 or not moved:
        return starts
    random = np.random.default_rng(seed)
    strata = random.permuted(np.tile(np.arange(number - 1), (len(moved), 1)), axis=1)
    for i, share in zip(moved, (strata + random.random(strata.shape)) / (number - 1), strict=True):
        slot = layout.entries[i][0]
        value = centre[i] * spread[slot.name] ** (2.0 * share - 1.0)
        starts[1:, i] = np.clip(value, slot.range.lower, slot.range.upper)
    return starts


class HorizonSchedule(NamedTuple):
    """How a search goes through its horizons.

    Parameters
    ----------
    steps : int
        Of a start in one horizon, at the most.
    spared : int
        Samples that arrays of a horizon's own have to spare; none where so many searches like it follow that a program
        is made for all of them.
    """

    steps: int = MAX_STEPS
    spared: int = WORTH_A_PROGRAM

    @classmethod
    def of(cls, task: Task, often: bool = False) -> HorizonSchedule:
        """That of a task, see `ROUGH_STEPS`; `often` where many tasks of the same shapes follow."""
        return cls(ROUGH_STEPS if task.noisy_inputs else MAX_STEPS, 0 if often else WORTH_A_PROGRAM)


class Searched(NamedTuple):
    """Where starts ended, and which of them came to an end before someone stopped the search.

    Parameters
    ----------
    descent : Descent
        NumPy, leaves ``(n_start, ...)``.
    ended : (n_start,) bool
    """

    descent: Descent
    ended: np.ndarray


def search(
    problem: Problem,
    starts: np.ndarray,
    horizons: np.ndarray,
    on_progress: Callable[[float], None],
    stop: Callable[[], bool] = lambda: False,
    schedule: HorizonSchedule | None = None,
) -> Searched:
    """Descents from many starts, horizon by horizon, on all cores.

    Starts that have come to the same place by the end of a horizon go on as one: what follows would be the same. One
    that is far from explaining what another explains is given up, with an infinite cost.

    Parameters
    ----------
    problem : Problem
    starts : (n_start, n_free) free coordinates
    horizons : (n_way, n_stage, n_record) int
        Ways to lengthen the horizon, taken in turn: a model that lacks something may follow one into a poor minimum and
        another into a better one.
    on_progress : callable
        Called with the share that is done.
    stop : callable
        Called now and then: whether to leave it at that. Then what has come to its end is returned; if nothing has, the
        best start so far, followed to its end.
    schedule : HorizonSchedule, optional

    Raises
    ------
    KeyboardInterrupt
        If it is stopped before anything is known of any start.
    """
    schedule = schedule or HorizonSchedule()
    number, stages = len(starts), horizons.shape[1]
    way = np.arange(number) % len(horizons)
    counts, leader, zero = horizons[way], np.arange(number), np.zeros(number, dtype=int)
    found = Descent(starts, np.full(number, np.inf), zero, zero.astype(bool))
    lost = np.zeros(number, dtype=bool)

    def follow(found: Descent, width: np.ndarray, stage: int) -> Run:
        """Descents from where starts are by now, over horizon number `stage`."""
        near = TO_THE_END if stage == stages - 1 else FOR_A_HORIZON
        whole, stopping = as_long_as_needed(problem, counts[:, stage], schedule.spared), np.asarray(near)
        return partial(_part, whole, found.free, width, counts[:, stage], Stopping(stopping, schedule.steps))

    with thread_pool(THREADS) as pool:
        for stage in range(stages):
            # Where a motion bounces on, steps that suit the whole record are far too small for a part.
            best = int(np.argmin(found.cost))
            width = widths(problem.until(counts[best, stage]), found.free[best])
            tell = lambda share, stage=stage: on_progress((stage + share) / stages)  # noqa: E731
            ended, done = _stage(pool, follow(found, width, stage), found, np.unique(leader[~lost]), tell, stop)
            reached = lost | np.isin(leader, done)
            # One start alone is followed to its end in any case.
            if not reached.all() or (stage < stages - 1 and number > 1 and stop()):
                # Those that were reached are where their leaders are, the others as they were before.
                at = np.where(reached, leader, number + np.arange(number))
                known = Descent(*(np.concatenate([new, old])[at] for old, new in zip(found, ended, strict=True)))
                if stage == stages - 1 and np.isfinite(known.cost[reached]).any():
                    return Searched(known, reached)
                return _best_alone(partial(follow, width=width), known, range(stage, stages), reached)
            found = Descent(*(leaf[leader] for leaf in ended))
            if stage < stages - 1:
                lost |= _far_above_best(found.cost / counts[:, stage].sum(axis=-1))
                found = found._replace(cost=np.where(lost, np.inf, found.cost))
            # Ways are alike that have this horizon and all further ones in common.
            rows = horizons[:, stage:].reshape(len(horizons), -1)
            alike = np.unique(rows, axis=0, return_inverse=True)[1].reshape(-1)
            leader = _leaders(found, width, alike[way])
    return Searched(found, np.ones(number, dtype=bool))


Run = Callable[[np.ndarray], Descent]
"""Descents from the starts of these numbers over one horizon."""


def as_long_as_needed(problem: Problem, counts: np.ndarray, spared: int) -> Problem:
    """The problem in arrays that hold a horizon ``(n_start, n_record)``, where that spares more samples than `spared`.

    What is done besides simulating, from readings to products of their slopes, is done for whole arrays.
    """
    whole = problem.observations.experiment.times.shape[1]
    needed = int(counts.max())
    length = LENGTH_STEP * 2 ** max(math.ceil(math.log2(needed / LENGTH_STEP)), 0)
    return problem.shortened(length) if counts.size * (whole - length) > spared else problem


def _stage(
    pool: Executor,
    run: Run,
    found: Descent,
    going: np.ndarray,
    on_progress: Callable[[float], None],
    stop: Callable[[], bool],
) -> tuple[Descent, np.ndarray]:
    """Descents from the starts `going` over one horizon, and those that were reached before it was stopped."""
    parts = [going[i : i + STARTS_AT_ONCE] for i in range(0, len(going), STARTS_AT_ONCE)]
    ended = found._replace(steps=np.zeros_like(found.steps))
    futures, done = [pool.submit(run, part) for part in parts], 0
    for part, future in zip(parts, futures, strict=True):
        descent = future.result()
        ended = Descent(*(with_rows(old, part, new) for old, new in zip(ended, descent, strict=True)))
        done += 1
        on_progress(done / len(parts))
        if done < len(parts) and stop():
            break
    for future in futures[done:]:
        future.cancel()
    return ended._replace(steps=found.steps + ended.steps), np.concatenate(parts[:done])


class NowhereYet(KeyboardInterrupt):
    """A search was stopped before any of its starts had come anywhere."""


def _best_alone(follow: Callable[..., Run], known: Descent, stages: range, reached: np.ndarray) -> Searched:
    """The best start of all that got as far as any, followed to its end, from the first of these horizons."""
    ahead = reached & np.isfinite(known.cost)
    cost = np.where(ahead, known.cost, np.inf) if ahead.any() else known.cost
    if not np.isfinite(cost).any():
        stopped = NowhereYet()
        stopped.add_note("No start of the search had come anywhere yet; nothing was written.")
        raise stopped
    best = np.array([int(np.argmin(cost))])
    for stage in stages[1:] if ahead.any() else stages:
        end = follow(known, stage=stage)(best)
        end = end._replace(steps=known.steps[best] + end.steps)
        known = Descent(*(with_rows(old, best, new) for old, new in zip(known, end, strict=True)))
    return Searched(known, np.arange(len(reached)) == best[0])


def with_rows(old: np.ndarray, rows: np.ndarray, new: np.ndarray) -> np.ndarray:
    """A copy of an array with some of its rows replaced."""
    whole = old.copy()
    whole[rows] = new
    return whole


def _part(
    problem: Problem, frees: np.ndarray, width: np.ndarray, counts: np.ndarray, stopping: Stopping, part: np.ndarray
) -> Descent:
    """Descents from the starts `part`; a short part is filled up, since one of another length is another program."""
    rows = np.resize(part, STARTS_AT_ONCE)
    active = np.arange(STARTS_AT_ONCE) < len(part)
    ended = descend_all(problem, frees[rows], width, counts[rows], active, stopping)
    return Descent(*(np.asarray(leaf)[: len(part)] for leaf in ended))


def _far_above_best(cost: np.ndarray) -> np.ndarray:
    """Starts ``(n_start,)`` whose cost of a sample is far above the lowest; none where none has a cost."""
    return np.isfinite(cost.min()) & ~(cost <= FAR_ABOVE * cost.min())


def _leaders(found: Descent, width: np.ndarray, way: np.ndarray) -> np.ndarray:
    """For each start the first of those on its way that came to the same place."""
    leader = np.arange(len(way))
    for i in np.flatnonzero(np.isfinite(found.cost)):
        for j in np.unique(leader[:i][np.isfinite(found.cost[:i])]):
            same = way[i] == way[j] and abs(found.cost[i] - found.cost[j]) <= SAME_BASIN * found.cost[j]
            if same and np.max(np.abs(found.free[i] - found.free[j]) / width) < 1.0:
                leader[i] = j
                break
    return leader


def collected(layout: Layout, began: np.ndarray, searched: Searched) -> Starts:
    """Where the starts ended that came to an end, sorted into basins."""
    found, began = Descent(*(leaf[searched.ended] for leaf in searched.descent)), began[searched.ended]
    shared = [i for i, (_, record) in enumerate(layout.entries) if record is None]
    cost = np.asarray(found.cost)
    with np.errstate(invalid="ignore"):
        values = layout.values(np.asarray(found.free))
    return Starts(
        names=tuple(layout.entries[i][0].name for i in shared),
        began=began[:, shared],
        ended=values[:, shared],
        values=values,
        cost=cost,
        steps=np.asarray(found.steps),
        basin=basins_of(cost),
        planned=len(searched.ended),
    )


def as_probable(starts: Starts, readings: int) -> Starts:
    """Starts in one minimum only where their ends are about as probable, of costs that so many readings tell apart.

    Noise as large as the residuals makes a cost ``c`` of n readings ``n d / (2 c)`` nats less probable for each `d`
    above it. Of measured inputs whose errors are not taken off a cost is no likelihood.
    """
    alike = min(SAME_BASIN, 2.0 * LESS_PROBABLE / max(readings, 1))
    return replace(starts, basin=basins_of(starts.cost, alike))


def basins_of(cost: np.ndarray, alike: float | None = None) -> np.ndarray:
    """Minima that starts of a cost ``(n_start,)`` ended in, by cost from 0; -1 where there is none.

    Parameters
    ----------
    alike : float, optional
        Relative difference in cost below which two are the same; `SAME_BASIN` by default.
    """
    alike = SAME_BASIN if alike is None else alike
    basin = np.full(len(cost), -1)
    label, level = -1, -np.inf
    for i in np.argsort(cost):
        if not np.isfinite(cost[i]):
            break
        if cost[i] > level * (1.0 + alike) or label < 0:
            label, level = label + 1, cost[i]
        basin[i] = label
    return basin
