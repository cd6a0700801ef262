"""Least-squares identification from start to verdict, and which estimate is reported.

That is the one of the likelihood, with deviations between records, or the plain one.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from functools import cache, partial
from itertools import count

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.core.limits import Progress, cuts_noted, in_time, note_cut, quiet, refuse_seed, refuse_starts
from fibrefit.core.programs import all_compilations
from fibrefit.fitting.advice import advice
from fibrefit.fitting.checks import AGREED, BARS, BOUNDS, COMPLETION, CONVERGED, DECIDING, SECOND, check, checks_of
from fibrefit.fitting.error_bars import (
    convergence_unit,
    error_bars,
    error_inflation,
    estimates,
    plain_cost,
    profile_interval,
    ratio,
    with_discrepancy,
)
from fibrefit.fitting.evaluated import EvaluatedEstimate, How, SearchEnd
from fibrefit.fitting.gls import GlsEstimate, cost_with_one_held, error_of_objective, gls_estimate, problem_at
from fibrefit.fitting.residuals import evaluate
from fibrefit.fitting.result import Found, Identification, Starts, Why, record_sizes, total
from fibrefit.fitting.search.optimum import Ended, Optimum, optimum, optimum_of_each
from fibrefit.fitting.search.rescue import SecondSolver, each_by_itself, loses, searched_nearby, with_second_solver
from fibrefit.fitting.search.solve import Descent, widths
from fibrefit.fitting.search.starts import (
    STARTS_AT_ONCE,
    HorizonSchedule,
    Searched,
    as_probable,
    collected,
    latin_hypercube_starts,
    search,
    starts_from_base_model,
)
from fibrefit.fitting.uncertainty import ErrorBars
from fibrefit.fitting.values import with_ends
from fibrefit.problem import GAP_OF_NOISE, HausmanTest, Problem, Task, corrected, input_errors, noise_of_residuals
from fibrefit.study.summaries.check import SIZE, Check
from fibrefit.study.summaries.results import ParameterSummary

Stop = Callable[[], bool]

Width = Callable[[], np.ndarray]
"""Steps ``(n_free,)`` that suit a solver at the start; found when one first asks."""


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
    if how.robust:
        problem = task.problem
        task = replace(task, problem=Problem(problem.model, problem.layout, problem.observations, SOFT_BEYOND))
    tell("compiling", 0.0)
    width = cache(partial(widths, task.problem, task.problem.layout.free(task.start)))
    ended = how.known
    schedule = HorizonSchedule.of(task, how.often)
    if ended is None or ended.coefficients is None:
        found = _search(task, starts, seed, tell, stop, schedule)
    else:
        # The one place where a search for effects ended, as a start that is where it goes to.
        there = corrected(task.problem, input_errors(task), ended.coefficients)
        cost = float(np.sum(np.square(there.linearised_at(ended.local).residuals)))
        layout, none = task.problem.layout, np.zeros(1, dtype=int)
        followed = Descent(layout.free(task.start)[None], np.array([cost]), none, none == 0)
        found = replace(collected(layout, task.start[None], Searched(followed, none == 0)), followed=True)
    if not np.isfinite(found.cost).any():
        do = "Check lift, mass and noise, and the initial values and bounds of the parameters."
        names = ", ".join(task.problem.layout.records[:3])
        raise DataError(names, "no start of the search can be simulated", "values that a motion follows from", do)
    # As measured, a noisy input leaves residuals in every minimum: those are weighed with its errors taken off.
    exact = ended is None and not task.noisy_inputs
    if exact and not stop():
        found = searched_nearby(task.problem, found, task.counts[-1:])
    tell("second solver", 0.87)
    values, second = task.start, None
    if ended is None:
        found, second = with_second_solver(task, width, found, stop)
        values = found.best[0]
    found = as_probable(found, task.problem.n_measured) if exact else found
    tell("uncertainty", 0.9)
    found_all = _concluded(task, found, values, second, how)
    if ended is None:
        number = count()

        def alone(one: Task) -> Starts:
            tell("fitting each record by itself", 0.92 + 0.03 * next(number) / len(task.traces))
            return _search(one, min(starts, STARTS_AT_ONCE), seed, quiet, stop, schedule)

        def together(there: Ended) -> Identification:
            means = task.problem.layout.means_of(there.local)
            return _concluded(task, found, means, second, how._replace(ended=there))

        found_all = _rescued(task, found_all, how, alone, together, stop)
    if how.profile:
        tell("profiles", 0.95)
        found_all = _profiled(found_all, width, task.counts[-1:], stop)
    if stop():
        planned = float(found.planned or found.tried)
        interrupted = check(COMPLETION, Found(float(found.tried), passed=False, instead={"threshold": planned}))
        found_all = replace(found_all, checks=(interrupted, *found_all.checks))
    return found_all


SOFT_BEYOND = 3.0

TRIED_APART = ("not_noise", "not_converged", "loses_less", "louder")
"""Why an estimate is reported (see `Why`) beside which each record is fitted by itself."""


def _rescued(
    task: Task,
    alike: Identification,
    how: How,
    alone: Callable[[Task], Starts],
    together: Callable[[Ended], Identification],
    stop: Stop,
) -> Identification:
    """The estimate from where each record is best by itself, if that of shared values loses a bounce beside it.

    Values of each record may follow a motion that shared ones lose; errors of inputs do the rest. What is lost may be
    taken up by these: what is left then is not large, but is not noise either. In a fit, the estimate of each is taken
    also if there is less to hold against it.

    Parameters
    ----------
    alone, together : callable
        Search of a record by itself; the estimate of all from where each ended.
    """
    several = len(task.traces) > 1 and any(record is None for _, record in task.problem.layout.entries)
    doubted = loses(total(alike.gap), alike.expected_gap) or (how.rivals and alike.why.identifier in TRIED_APART)
    if not (several and alike.input_errors and doubted) or stop():
        return alike
    shared = list(record_sizes(alike.record_gaps).values())
    ended, _ = in_time(partial(each_by_itself, task, alone, shared, how.rivals), None)
    if ended is None or stop():
        return alike
    own = together(ended)
    # What became of the search that both began from is no doubt of either, nor is what its error bars are.
    doubts, others = (
        {check.identifier for check in found.checks if not check.passed} - {AGREED, SECOND, BARS}
        for found in (own, alike)
    )
    return own if loses(total(alike.gap), total(own.gap)) or (how.rivals and doubts < others) else alike


def _profiled(found: Identification, width: Width, whole: np.ndarray, stop: Stop) -> Identification:
    """Profile intervals in place of those of error bars, of the kind of estimate that is reported."""
    profiled, gls = list(found.estimates), found.gls
    for i, (_, record) in enumerate(found.problem.layout.entries):
        # Standard deviations between records are held in a profile: it knows too much of a mean of the population.
        one = profiled[i].found
        if record is None and one.std_error is not None and one.interval_kind != "population" and not stop():
            if gls is None:
                cost, own = plain_cost(found.problem, found.values, i, width(), whole)
            else:
                cost, own = cost_with_one_held(gls, i), error_of_objective(gls, i)
            interval = profile_interval(found.problem, found.values, i, cost, own, one.std_error)
            profile = {"interval_95": interval, "interval_kind": "profile likelihood"}
            profiled[i] = profiled[i]._replace(found=ParameterSummary.model_validate({**dict(one), **profile}))
    checks = list(found.checks)
    for i, one_check in enumerate(checks):
        if one_check.identifier == BOUNDS:
            ends = with_ends(one_check.facts["by_chance"], found.problem.layout, profiled)
            checks[i] = one_check.model_copy(update={"facts": {**one_check.facts, "by_chance": ends}})
    return replace(found, estimates=tuple(profiled), checks=tuple(checks))


def _search(task: Task, number: int, seed: int, tell: Progress, stop: Stop, schedule: HorizonSchedule) -> Starts:
    problem = task.problem
    began = starts_from_base_model(
        task, latin_hypercube_starts(problem.layout, task.start, task.spread, number, seed), seed, stop
    )
    on_progress = lambda share: tell("searching from many starts", 0.05 + 0.8 * share)  # noqa: E731
    free = problem.layout.free(began)
    return collected(problem.layout, began, search(problem, free, task.horizons, on_progress, stop, schedule))


def _concluded(task: Task, starts: Starts, values: np.ndarray, second: SecondSolver | None, how: How) -> Identification:
    """The estimate that is reported, put to all checks."""
    plain = optimum(task, values, how.ended)
    bars = error_bars(plain.problem, plain.scores, task.rate)
    best = reported(SearchEnd(task, how, starts, second, plain, bars))
    checks = checks_of(best)
    return Identification(
        problem=best.problem,
        values=best.values,
        covariance=best.bars.covariance,
        method=best.bars.method,
        error_inflation=error_inflation(best.problem, best.bars),
        estimates=best.estimates,
        gap=best.seen.gap,
        expected_gap=best.expected_gap,
        input_errors=best.input_errors,
        coefficients=best.coefficients,
        record_gaps=best.seen.record_gaps,
        noise=task.noise,
        readings=best.seen.motion.readings,
        residuals=best.residuals,
        motion=best.seen.motion,
        starts=starts,
        checks=checks,
        advice=advice(best, checks),
        seconds=0.0,
        estimator=best.estimator,
        why=best.why,
        plain=best.plain_estimate,
        gls=best.gls,
        balance=best.balance_gap,
    )


def reported(search: SearchEnd) -> EvaluatedEstimate:
    """Go from a plain estimate to that of the likelihood, if there is one to be believed."""
    task, plain, bars, how = search.task, search.plain, search.bars, search.how
    doubt = None
    if task.problem.soft_beyond is not None:
        doubt = Why("robust")
    elif not search.success:
        doubt = Why("no_end")
    elif plain.input_errors and not how.whiten:
        doubt = Why("in_a_search")
    gls = None
    if doubt is None:
        gls, came = in_time(partial(gls_estimate, task, plain, bars, how.ended), None)
        if not came:
            note_cut()
            doubt = Why("no_time")
    if gls is None:
        alike, ended = _of_plain(search, plain, bars), how.ended
        if ended is not None and ended.differ and not plain.differ:
            # The search ended with records that differ: that of each record stands if it leaves less.
            apart = optimum_of_each(plain, ended.local)
            own = _of_plain(search, apart, error_bars(apart.problem, apart.scores, task.rate))
            alike = own if total(own.seen.gap) < total(alike.seen.gap) else alike
        return replace(alike, why=doubt or Why("not_converged"))
    compared = _compared(search, gls)
    found = replace(_of_gls(search, gls), hausman=compared)
    # What says that residuals are not noise. A value at its bound is named; the noise is what it is there too.
    failed = [check.quantity for check in checks_of(found, DECIDING) if not found.passed(check.identifier)]
    failed += [check.quantity for check in compared if not check.passed]
    if not failed:
        return replace(
            found, why=Why("gls", ratio(plain.problem, gls.bars.errors["whitened"], bars.errors[bars.method]))
        )
    several = bool(plain.input_errors) or gls.records_differ
    if several and found.passed(CONVERGED) and found.like_noise and found.may_be_noise:
        # Plain least squares would take what a rest does not show of the noise for errors of the inputs, and
        # records that differ for alike. Error bars are those of the noise that is left, however loud rests are.
        return replace(found, why=Why("louder", failed=tuple(failed)))
    loses_less = replace(found, why=Why("loses_less", failed=tuple(failed)))
    if plain.input_errors and how.ended is not None and how.ended.differ:
        # There is no estimate of values that all share: what is plain lies at those of each record.
        return loses_less
    alike = replace(_of_plain(search, plain, bars), why=Why("not_noise", failed=tuple(failed)), hausman=compared)
    # Values that all share lose bounces of records that differ: what leaves less stands; what failed is reported.
    lost = found.is_noise_unlike(alike) or loses(total(alike.seen.gap), total(found.seen.gap))
    return loses_less if gls.records_differ and lost else alike


def _compared(search: SearchEnd, gls: GlsEstimate) -> tuple[Check, ...]:
    """Whether both estimates agree, in the values that no bound stops.

    A plain one that takes records for alike may well differ where they are not, and one that takes errors of rounding
    for noise where readings are coarse.
    """
    plain = search.plain
    if plain.input_errors or gls.records_differ or gls.seen.whitening is None or gls.seen.problem.observations.steps:
        return ()
    layout = plain.problem.layout
    found = estimates(plain.problem, plain.values, search.bars)[: layout.size]
    moving = np.array([not one.found.at_bound for one in found])
    return (
        HausmanTest.at(layout, plain.linear, gls.seen.whitening, None, plain.scores.belief, moving).check(
            layout.free_names
        ),
    )


def _of_gls(search: SearchEnd, gls: GlsEstimate) -> EvaluatedEstimate:
    """The estimate of the likelihood, put to the checks that decide whether it leaves noise."""
    task, plain = search.task, search.plain
    problem, coefficients = problem_at(task, gls), gls.coefficients
    seen = evaluate(task, problem, gls.local)
    if coefficients and not total(seen.gap) <= GAP_OF_NOISE * gls.expected_gap:
        # Samples of which the linearised problem tells little say nothing in it. A motion that bounces there is that of
        # the plain estimate, an error bar away, whose errors of the inputs were brought to explain all samples; those
        # of noise that has a memory, too.
        for local in (gls.local, *(() if gls.records_differ else (plain.local,))):
            other = evaluate(task, plain.problem, local)
            if total(other.gap) < total(seen.gap):
                problem, seen, coefficients = plain.problem, other, plain.coefficients
    # Noise and differences between records are found with the values: their mode is looked for as roughly.
    promised = gls.evidence.mode.predicted_reduction
    found = EvaluatedEstimate(
        search, plain, problem, gls.values, gls.residuals, gls.noise, gls.bars, gls, seen, coefficients, promised
    )
    checks_of(found, DECIDING)
    return found


def _of_plain(search: SearchEnd, plain: Optimum, bars: ErrorBars) -> EvaluatedEstimate:
    """A plain estimate, put to the same checks; where it leaves more than noise, error bars allow for that."""
    task, problem, residuals = search.task, plain.problem, plain.linear.residuals
    sound = bool(np.isfinite(residuals).all())
    noise = noise_of_residuals(problem, residuals) if sound else tuple(task.noise.values())
    moving = [not one.found.at_bound for one in estimates(problem, plain.values, bars)]
    promised = plain.predicted_reduction(moving) / convergence_unit(problem, bars) ** 2
    seen = evaluate(task, problem, plain.local)
    found = EvaluatedEstimate(
        search, plain, problem, plain.values, residuals, noise, bars, None, seen, plain.coefficients, promised
    )
    checks_of(found, DECIDING)
    if sound and not found.passed(SIZE):
        return replace(found, bars=with_discrepancy(bars, plain.scores, seen.motion))
    return found
