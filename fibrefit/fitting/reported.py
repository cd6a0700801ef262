"""Which estimate is reported: that of the likelihood with deviations between records, or the plain one, and why."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import numpy as np

from fibrefit.core.limits import in_time, note_cut
from fibrefit.fitting.checks import CONVERGED, DECIDING, checks_of
from fibrefit.fitting.error_bars import convergence_unit, error_bars, estimates, ratio, with_discrepancy
from fibrefit.fitting.evaluated import EvaluatedEstimate, SearchEnd
from fibrefit.fitting.gls import GlsEstimate, gls_estimate, problem_at
from fibrefit.fitting.residuals import evaluate
from fibrefit.fitting.result import Why, total
from fibrefit.fitting.search.optimum import Optimum, optimum_of_each
from fibrefit.fitting.search.rescue import loses
from fibrefit.fitting.uncertainty import ErrorBars
from fibrefit.problem.estimate.gls import HausmanTest
from fibrefit.problem.noise.whittle import noise_of_residuals
from fibrefit.problem.thresholds import GAP_OF_NOISE
from fibrefit.study.summaries.check import SIZE, Check


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
    # Values that all share lose bounces of records that differ: what leaves less stands; what failed is reported. So
    # does what leaves noise by its size or by its structure where values that all share do not: a spectrum that is not
    # quite right is no reason to take records for alike that are not, nor is noise that is a little louder than at
    # rest, as slow noise is. What a model lacks shows in both, whichever values it has.
    fits_alone = (found.passed(SIZE) and not alike.passed(SIZE)) or (found.like_noise and not alike.like_noise)
    lost = fits_alone or loses(total(alike.seen.gap), total(found.seen.gap))
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
