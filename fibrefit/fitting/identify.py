"""Least-squares identification from start to verdict."""

from __future__ import annotations

import math
import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from itertools import count
from typing import NamedTuple

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Progress, cuts_noted, in_time, quiet, refuse_seed, refuse_starts
from fibrefit.core.programs import all_compilations
from fibrefit.fitting import checks as judge
from fibrefit.fitting.advice import Advice, advice, with_lone_samples
from fibrefit.fitting.error_bars import error_bars, error_inflation, estimates
from fibrefit.fitting.gls import cost_with_one_held, error_of_objective
from fibrefit.fitting.identifiability import weaknesses
from fibrefit.fitting.minima import Minima, SecondSolver
from fibrefit.fitting.misfit.agreement import records_agree
from fibrefit.fitting.misfit.alternative import best_alternative
from fibrefit.fitting.misfit.at_bounds import BOUNDS, with_ends
from fibrefit.fitting.misfit.discrepancy import most_doubtful
from fibrefit.fitting.misfit.lone_samples import lone_samples
from fibrefit.fitting.misfit.outweighed import outweighed
from fibrefit.fitting.misfit.slack_zero import judge_zero, slack_zeros
from fibrefit.fitting.profile import Cost, plain_cost, profile_interval
from fibrefit.fitting.reported import Reported, reported
from fibrefit.fitting.result import Gap, Identification, PlainEstimate, Starts, record_sizes, total
from fibrefit.fitting.search.around import rough_errors, searched_nearby, with_further_starts
from fibrefit.fitting.search.each_by_itself import each_by_itself, loses
from fibrefit.fitting.search.multistart import (
    HorizonSchedule,
    Searched,
    as_probable,
    collected,
    latin_hypercube_starts,
    search,
)
from fibrefit.fitting.search.optimum import Ended, Optimum, optimum
from fibrefit.fitting.search.second_opinion import second_opinion
from fibrefit.fitting.search.solve import Descent, descend, widths
from fibrefit.fitting.search.starts_from_base_model import starts_from_base_model
from fibrefit.fitting.thresholds import FIT_TOLERANCE
from fibrefit.laws.families import instants
from fibrefit.problem.diagnose.channels import are_exchanged
from fibrefit.problem.diagnose.motion import ResidualSet
from fibrefit.problem.diagnose.newton import ForceBalance, Gravity, Lag
from fibrefit.problem.inputs.errors_in_variables import corrected, input_errors
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import ChannelGap, ParameterSummary

Stop = Callable[[], bool]
Width = Callable[[], np.ndarray]
"""Steps ``(n_free,)`` that suit a solver at the start; found when one first asks."""


class How(NamedTuple):
    """How a task is identified.

    Parameters
    ----------
    robust, profile : bool
        Let residuals beyond `SOFT_BEYOND` times the noise count less; give shared parameters profile intervals.
    whiten : bool
        Whether to whiten where inputs are noisy too, which takes long.
    rivals : bool
        Whether to see, where inputs are noisy, what other minima, each record by itself and models with one law more
        are worth, which takes as long as all the rest.
    often : bool
        Whether many tasks of like shapes follow, so that it is worth while to compile more programs for them.
    ended : Ended, optional
        Where a search ended, at the values of the start: the likelihood begins from there as well, and where errors of
        measured inputs are known, nothing is searched anew.
    """

    robust: bool = False
    profile: bool = False
    whiten: bool = True
    rivals: bool = True
    often: bool = False
    ended: Ended | None = None

    @property
    def known(self) -> Ended | None:
        """Where a search ended that found errors of measured inputs too; None where it is searched for."""
        return None if self.ended is None or self.ended.coefficients is None else self.ended


def identify(
    task: Task,
    starts: int = 32,
    seed: int = 0,
    how: How | None = None,
    *,
    progress: Progress | None = None,
    stop: Stop = lambda: False,
) -> Identification:
    """Fit from many starts, measure the uncertainty, and put the result to its checks.

    Parameters
    ----------
    starts : int
        Number of starts, the one from the data included.
    seed : int
        Of the scatter of starts.
    progress : callable, optional
        Called with what is being done and the share that is finished, now and then from another thread.
    stop : callable
        Called now and then: whether to conclude with what there is; the result then fails a check that says so.

    Raises
    ------
    DataError
        If the model cannot be simulated from any start.
    UsageError
        If there are no starts, or more than memory holds; if the seed is none.
    KeyboardInterrupt
        If it is stopped before anything is known.
    """
    refuse_starts(starts)
    refuse_seed(seed)
    began, compiled = time.perf_counter(), all_compilations()
    with cuts_noted() as cuts:
        found = _identified(task, starts, seed, how or How(), progress or quiet, stop)
    compiling = all_compilations() - compiled
    return replace(found, seconds=time.perf_counter() - began, compiling=compiling, cut_short=bool(cuts))


def _identified(task: Task, starts: int, seed: int, how: How, tell: Progress, stop: Stop) -> Identification:
    task = _with_soft_l1(task) if how.robust else task
    tell("compiling", 0.0)
    width = cache(partial(widths, task.problem, task.problem.layout.free(task.start)))
    ended = how.known
    schedule = HorizonSchedule.of(task, how.often)
    found = _search(task, starts, seed, tell, stop, schedule) if ended is None else _as_it_ended(task, ended)
    _refuse_if_lost(found, task.problem.layout.records)
    # As measured, a noisy input leaves residuals in every minimum: those are weighed with its errors taken off.
    exact = ended is None and not task.noisy_inputs
    if exact and not stop():
        found = searched_nearby(task.problem, found, task.counts[-1:])
    tell("second solver", 0.87)
    values, second = task.start, None
    if ended is None:
        found, second = _settled(task, width, found, stop)
        values = found.best[0]
    found = as_probable(found, task.problem.n_measured) if exact else found
    tell("uncertainty", 0.9)
    found_all = _concluded(task, found, values, second, how)
    if ended is None and _may_lose_bounces(task, found_all, how) and not stop():
        alone = partial(_search, number=min(starts, STARTS_ALONE), seed=seed, tell=quiet, stop=stop, schedule=schedule)
        ended = _each(task, found_all, how, alone, tell)
        found_all = found_all if ended is None or stop() else _apart(task, found, second, found_all, how, ended)
    if how.profile:
        tell("profiles", 0.95)
        found_all = _profiled(found_all, width, task.counts[-1:], stop)
    if stop():
        found_all = replace(found_all, checks=(judge.interrupted(found), *found_all.checks))
    return found_all


SOFT_BEYOND = 3.0
STARTS_ALONE = 4
"""Of a record by itself: all searched from in one go, by one core."""


def _may_lose_bounces(task: Task, found: Identification, how: How) -> bool:
    """Whether values of each record may follow a motion that shared ones lose; errors of inputs do the rest.

    What is lost may be taken up by errors of the inputs: what is left then is not large, but is not noise either.
    """
    several = len(task.traces) > 1 and any(record is None for _, record in task.problem.layout.entries)
    if not several or not found.input_errors:
        return False
    return loses(total(found.gap), found.expected_gap) or (how.rivals and found.why.identifier in TRIED_APART)


TRIED_APART = ("not_noise", "not_converged", "loses_less", "louder")
"""Why an estimate is reported (see `Why`) beside which each record is fitted by itself."""


def _each(
    task: Task, alike: Identification, how: How, search: Callable[[Task], Starts], tell: Progress
) -> Ended | None:
    number = count()

    def told(one: Task) -> Starts:
        tell("fitting each record by itself", 0.92 + 0.03 * next(number) / len(task.traces))
        return search(one)

    shared = list(record_sizes(alike.record_gaps).values())
    return in_time(partial(each_by_itself, task, told, shared, how.rivals), None)[0]


def _apart(
    task: Task, starts: Starts, second: SecondSolver | None, alike: Identification, how: How, ended: Ended
) -> Identification:
    """The estimate from where each record is best by itself, if that of shared values loses a bounce beside it.

    In a fit, also if there is less to hold against it.
    """
    own = _concluded(task, starts, task.problem.layout.means_of(ended.local), second, how._replace(ended=ended))
    lost = loses(total(alike.gap), total(own.gap))
    return own if lost or (how.rivals and _held_against(own) < _held_against(alike)) else alike


def _held_against(found: Identification) -> frozenset[str]:
    """What an estimate is doubted for; that of the search it began from does not count, nor what its error bars are."""
    aside = (judge.AGREED, judge.SECOND["identifier"], judge.BARS)
    return frozenset(check.identifier for check in found.checks if not check.passed and check.identifier not in aside)


def _refuse_if_lost(found: Starts, records: tuple[str, ...]) -> None:
    if not np.isfinite(found.cost).any():
        do = "Check lift, mass and noise, and the initial values and bounds of the parameters."
        names = ", ".join(records[:3])
        raise DataError(names, "no start of the search can be simulated", "values that a motion follows from", do)


def _with_soft_l1(task: Task) -> Task:
    problem = task.problem
    return replace(task, problem=Problem(problem.model, problem.layout, problem.observations, SOFT_BEYOND))


def _profiled(found: Identification, width: Width, whole: np.ndarray, stop: Stop) -> Identification:
    profiled = list(found.estimates)
    for i, (_, record) in enumerate(found.problem.layout.entries):
        # Standard deviations between records are held in a profile: it knows too much of a mean of the population.
        one = profiled[i].found
        if record is None and one.std_error is not None and one.interval_kind != "population" and not stop():
            cost, own = _cost_of(found, i, width, whole)
            interval = profile_interval(found.problem, found.values, i, cost, own, one.std_error)
            profile = {"interval_95": interval, "interval_kind": "profile likelihood"}
            profiled[i] = profiled[i]._replace(found=ParameterSummary.model_validate({**dict(one), **profile}))
    checks = tuple(
        with_ends(check, found.problem.layout, profiled) if check.identifier == BOUNDS else check
        for check in found.checks
    )
    return replace(found, estimates=tuple(profiled), checks=checks)


def _cost_of(found: Identification, index: int, width: Width, whole: np.ndarray) -> tuple[Cost, float]:
    """Cost of the best fit with a value held, of the kind that gave the estimate, and its standard error by that."""
    if found.gls is not None:
        return cost_with_one_held(found.gls, index), error_of_objective(found.gls, index)
    return plain_cost(found.problem, found.values, index, width(), whole)


def _search(task: Task, number: int, seed: int, tell: Progress, stop: Stop, schedule: HorizonSchedule) -> Starts:
    problem = task.problem
    began = starts_from_base_model(
        task, latin_hypercube_starts(problem.layout, task.start, task.spread, number, seed), seed, stop
    )
    on_progress = lambda share: tell("searching from many starts", 0.05 + 0.8 * share)  # noqa: E731
    free = problem.layout.free(began)
    return collected(problem.layout, began, search(problem, free, task.horizons, on_progress, stop, schedule))


def _as_it_ended(task: Task, ended: Ended) -> Starts:
    """The one place where a search for effects ended, as a start that is where it goes to."""
    assert ended.coefficients is not None
    layout, there = task.problem.layout, corrected(task.problem, input_errors(task), ended.coefficients)
    cost = float(np.sum(np.square(there.linearised_at(ended.local).residuals)))
    free, none = layout.free(task.start)[None], np.zeros(1, dtype=int)
    found = collected(layout, task.start[None], Searched(Descent(free, np.array([cost]), none, none == 0), none == 0))
    return replace(found, followed=True)


def _concluded(task: Task, starts: Starts, values: np.ndarray, second: SecondSolver | None, how: How) -> Identification:
    plain = optimum(task, values, how.ended)
    bars = error_bars(plain.problem, plain.scores, task.rate)
    best = reported(task, plain, bars, bool(np.isfinite(starts.cost.min())), how.whiten, how.ended)
    problem, seen, sound, normal = best.problem, best.seen, best.sound, plain.scores.normal_matrix()
    minima = Minima(task, starts, second, plain, bars, best, how.rivals)
    weak = weaknesses(problem.layout, best.values, best.bars.covariance, normal, _unjudged(problem))
    force = ForceBalance.of(task, best.values)
    balance = None if force is None else ChannelGap.against_noise(math.nan, force.rms, "N", force.explained)
    doubtful = most_doubtful(problem.layout, best.values, best.bars)
    explained = _explained(plain, seen.gap if balance is None else {"force": balance, **seen.gap})
    agree = None if best.gls is not None else records_agree(plain.problem, plain.values, plain.scores, bars, task.rate)
    aside = PlainEstimate(plain.values, bars.errors[bars.method], plain.local, plain.differ)
    told = estimates(problem, best.values, best.bars, None if best.gls is None else aside, best.gls)
    checks = (
        judge.finite(best.residuals, seen.motion.trouble, problem.layout.records),
        sound.converged,
        *(() if how.known and (second is None or best.gls is None) else (minima.second_solver_agrees(),)),
        minima.starts_agree(),
        with_ends(sound.inside, problem.layout, told),
        judge.determined(weak),
        judge.noise_seen(dict(task.noise), task.noise_given),
        sound.gap,
        *judge.inputs_within_noise(best.input_errors),
        *sound.structure,
        *sound.records,
        *best.checks,
        explained,
        *_as_stated(task, best, explained, how.rivals),
        *(() if doubtful is None else (judge.known_to_a_factor(doubtful),)),
        *best.of_intervals,
        *(() if agree is None else (agree,)),
        *(() if force is None else (force.check(),)),
    )
    return Identification(
        problem=problem,
        values=best.values,
        covariance=best.bars.covariance,
        method=best.bars.method,
        error_inflation=error_inflation(problem, best.bars),
        estimates=told,
        gap=seen.gap,
        expected_gap=best.expected_gap,
        input_errors=best.input_errors,
        coefficients=best.coefficients,
        record_gaps=seen.record_gaps,
        noise=task.noise,
        readings=seen.motion.readings,
        residuals=best.residuals,
        motion=seen.motion,
        starts=starts,
        checks=checks,
        advice=_with_samples(task, best, advice(problem, best.values, normal, best.bars.covariance, weak, checks)),
        seconds=0.0,
        estimator=best.estimator,
        why=best.why,
        plain=aside,
        gls=best.gls,
        balance=balance,
    )


def _unjudged(problem: Problem) -> set[str]:
    """Values that are not asked for: instants, of which slopes say nothing, and nuisances of each record."""
    declared = {parameter.name for parameter in problem.model.parameters}
    return {*instants(problem.model.effects), *(set(problem.layout.names) - declared)}


def _with_samples(task: Task, best: Reported, found: tuple[Advice, ...]) -> tuple[Advice, ...]:
    """Advice with the few samples, if so, that carry most of a gap that is more than noise."""
    left = ResidualSet(best.problem, best.residuals, best.seen.motion, task.noise)
    alone = None if best.sound.gap.passed else lone_samples(left)
    return with_lone_samples(found, alone, best.problem.soft_beyond is not None)


def _explained(plain: Optimum, gaps: Gap) -> Check:
    """Whether the signals are explained; where they are not, whether the values are of use all the same."""
    check = judge.signal_explained(gaps)
    return check if check.passed else judge.useless(check, outweighed(plain.problem.layout, plain.values, plain.scores))


def _as_stated(task: Task, best: Reported, explained: Check, rivals: bool) -> tuple[Check, ...]:
    """Whether channels, clock, scale and slope are what the study says, and what one thing more makes of the values."""
    swapped = (judge.exchanged(),) if not explained.passed and are_exchanged(task.traces) else ()
    gravity = Gravity.in_flight(task, best.values, best.seen.motion)
    lag = Lag.in_contacts(task, best.values, best.seen.motion)
    stated = () if gravity is None else (judge.falls_freely(gravity),)
    stated = stated if lag is None else (*stated, judge.measured_at_once(lag))
    inputs = judge.inputs_within_noise(best.input_errors)
    doubted = not all(check.passed for check in (explained, best.sound.gap, *inputs, *stated))
    sought = doubted and not swapped and rivals
    other = in_time(partial(best_alternative, task, best.values), None)[0] if sought else None
    zeros = slack_zeros(task)
    stated = stated if zeros is None else (*stated, judge_zero(zeros))
    return (*swapped, *stated, *(() if other is None else (judge.explained_otherwise(other),)))


def _settled(task: Task, width: Width, starts: Starts, stop: Stop) -> tuple[Starts, SecondSolver | None]:
    """Starts, and where another solver ends; if it ends lower, the search goes on from there, as one start more."""
    problem, whole = task.problem, task.counts[-1:]
    if stop():
        return starts, None
    for _ in range(SECOND_CHANCES):
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


SECOND_CHANCES = 3
