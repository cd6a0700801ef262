"""Which estimate is reported: that of the likelihood with deviations between records, or the plain one, and why."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import in_time, note_cut
from fibrefit.fitting import checks as judge
from fibrefit.fitting.error_bars import ErrorBars, convergence_unit, error_bars, estimates, ratio
from fibrefit.fitting.estimates import GlsEstimate, Why
from fibrefit.fitting.evaluate import Evaluation, evaluate, readings_at_rest
from fibrefit.fitting.gls import gls_estimate, problem_at
from fibrefit.fitting.misfit.at_bounds import at_bounds, inside_bounds, pulls_of_gls, pulls_of_plain
from fibrefit.fitting.misfit.discrepancy import with_discrepancy
from fibrefit.fitting.misfit.loudest_record import loudest_record
from fibrefit.fitting.misfit.structure import loudness, structure_checks
from fibrefit.fitting.result import record_sizes, total
from fibrefit.fitting.search.each_by_itself import loses
from fibrefit.fitting.search.optimum import Ended, Optimum, optimum_of_each
from fibrefit.fitting.thresholds import LOUDER_THAN_AT_REST
from fibrefit.problem.diagnose.motion import ResidualSet
from fibrefit.problem.estimate.gls import HausmanTest
from fibrefit.problem.inputs.errors_in_variables import InputCoefficients, error_rms, input_errors
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_residuals
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.problem.thresholds import GAP_OF_NOISE
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.results import InputErrorSummary

NOT_COMPARED = Why("not_converged")


class Sound(NamedTuple):
    """Checks that must hold before residuals are taken for noise.

    Parameters
    ----------
    converged, inside, gap : Check
        Of the search, of its end inside the bounds, and of the size of the residuals.
    structure : tuple of Check
        Of the spectrum of the residuals, and of what they depend on.
    records : tuple of Check
        Of the size of the residuals of single records, which is told and decides nothing.
    """

    converged: Check
    inside: Check
    gap: Check
    structure: tuple[Check, ...]
    records: tuple[Check, ...] = ()

    @property
    def failed(self) -> list[Check]:
        """Those that say residuals are not noise. A value at its bound is named; the noise is what it is there too."""
        return [check for check in (self.converged, self.gap, *self._asked) if not check.passed]

    @property
    def like_noise(self) -> bool:
        """Whether residuals have the structure of noise, however loud they are."""
        return all(check.passed for check in self._asked)

    @property
    def _asked(self) -> list[Check]:
        """Of the structure, but for what too few readings say nothing of."""
        return [check for check in self.structure if check.facts.get("tried", True)]


@dataclass(frozen=True)
class Reported:
    """The estimate that is reported, and why it is this one.

    Parameters
    ----------
    problem : Problem
        Errors found taken off its inputs.
    values : (n_free,) in SI units
    residuals : (n_record, n_channel, n_time) in units of the noise
    gls : GlsEstimate or None
        None where the plain estimate stands.
    input_errors : mapping of input to InputErrorSummary
    coefficients : mapping of input to (n_record, n_wave)
    expected_gap : float
        Of a perfect model.
    checks : tuple of Check
        Whether both estimates agree, where they could be compared.
    """

    problem: Problem
    values: np.ndarray
    residuals: np.ndarray
    bars: ErrorBars
    gls: GlsEstimate | None
    seen: Evaluation
    sound: Sound
    input_errors: Mapping[str, InputErrorSummary]
    coefficients: InputCoefficients
    expected_gap: float
    why: Why = NOT_COMPARED
    checks: tuple[Check, ...] = ()

    @property
    def may_be_noise(self) -> bool:
        """Whether residuals are noise by their size, or have its structure and are a little louder in any record.

        Slow noise is louder than a rest shows. A record that is not followed to its end leaves more.
        """
        loudest = max(record_sizes(self.seen.record_gaps).values())
        louder = self.sound.like_noise and loudest <= LOUDER_THAN_AT_REST * self.expected_gap
        return self.sound.gap.passed or louder

    @property
    def of_intervals(self) -> tuple[Check, ...]:
        """Checks of error bars and intervals, where there is a reason to ask."""
        return *judge.bars_too_small(self.why), *(
            () if self.gls is None else self.gls.evidence.between_records_checks()
        )

    @property
    def estimator(self) -> str:
        """Name of the method."""
        return "ordinary least squares" if self.gls is None else "generalised least squares"


def reported(
    task: Task, plain: Optimum, bars: ErrorBars, success: bool, whiten: bool = True, ended: Ended | None = None
) -> Reported:
    """Go from a plain estimate to that of the likelihood, if there is one to be believed.

    Parameters
    ----------
    bars : ErrorBars
        Of the plain estimate.
    success : bool
        Whether the search found an end at all.
    whiten : bool
        Whether to whiten where inputs are noisy too, which takes long.
    ended : Ended, optional
        See `gls_estimate`.
    """
    doubt = _doubt(task, success, whiten or not plain.input_errors)
    checks: tuple[Check, ...] = ()
    gls, came = (None, True) if doubt else in_time(partial(gls_estimate, task, plain, bars, ended), None)
    if not came:
        note_cut()
        doubt = Why("no_time")
    if gls is not None:
        found = _of_gls(task, plain, gls)
        checks = _compared(plain, gls, bars)
        failed = tuple(check.quantity for check in (*found.sound.failed, *checks) if not check.passed)
        if not failed:
            why = Why("gls", ratio(plain.problem, gls.bars.errors["whitened"], bars.errors[bars.method]))
            return replace(found, why=why, checks=checks)
        several = bool(plain.input_errors) or gls.records_differ
        if several and found.sound.converged.passed and found.sound.like_noise and found.may_be_noise:
            # Plain least squares would take what a rest does not show of the noise for errors of the inputs, and
            # records that differ for alike. Error bars are those of the noise that is left, however loud rests are.
            return replace(found, why=Why("louder", failed=failed), checks=checks)
        if plain.input_errors and ended is not None and ended.differ:
            # There is no estimate of values that all share: what is plain lies at those of each record.
            return replace(found, why=Why("loses_less", failed=failed), checks=checks)
        alike = replace(_of_plain(task, plain, bars, success), why=Why("not_noise", failed=failed), checks=checks)
        # Values that all share lose bounces of records that differ: what leaves less stands; what failed is reported.
        if gls.records_differ and (_fits_alone(alike, found) or loses(total(alike.seen.gap), total(found.seen.gap))):
            return replace(found, why=Why("loses_less", failed=failed), checks=checks)
        return alike
    return replace(_without_likelihood(task, plain, bars, success, ended), why=doubt or NOT_COMPARED, checks=checks)


def _without_likelihood(task: Task, plain: Optimum, bars: ErrorBars, success: bool, ended: Ended | None) -> Reported:
    """The plain estimate; where a search ended with records that differ, that of each record if it leaves less."""
    alike = _of_plain(task, plain, bars, success)
    if ended is None or not ended.differ or plain.differ:
        return alike
    apart = optimum_of_each(plain, ended.local)
    own = _of_plain(task, apart, error_bars(apart.problem, apart.scores, task.rate), success)
    return own if total(own.seen.gap) < total(alike.seen.gap) else alike


def _fits_alone(alike: Reported, own: Reported) -> bool:
    """Whether values of each record leave noise by its size or by its structure where values that all share do not.

    A spectrum that is not quite right is no reason to take records for alike that are not, nor is noise that is a
    little louder than at rest, as slow noise is. What a model lacks shows in both, whichever values it has.
    """
    noise_by = (lambda sound: sound.gap.passed, lambda sound: sound.like_noise)
    return any(passed(own.sound) and not passed(alike.sound) for passed in noise_by)


def _doubt(task: Task, success: bool, whiten: bool) -> Why | None:
    """Why the likelihood is not used; None where it is."""
    if task.problem.soft_beyond is not None:
        return Why("robust")
    if not success:
        return Why("no_end")
    return None if whiten else Why("in_a_search")


def _compared(plain: Optimum, gls: GlsEstimate, bars: ErrorBars) -> tuple[Check, ...]:
    """Whether both estimates agree, in the values that no bound stops.

    A plain one that takes records for alike may well differ where they are not, and one that takes errors of rounding
    for noise where readings are coarse.
    """
    if plain.input_errors or gls.records_differ or gls.seen.whitening is None or gls.seen.problem.observations.steps:
        return ()
    layout = plain.problem.layout
    moving = np.array([not one.found.at_bound for one in estimates(plain.problem, plain.values, bars)[: layout.size]])
    found = HausmanTest.at(layout, plain.linear, gls.seen.whitening, None, plain.scores.belief, moving)
    return (found.check(layout.free_names),)


def _of_gls(task: Task, plain: Optimum, gls: GlsEstimate) -> Reported:
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
    moving = judge.converged(gls.evidence.mode.predicted_reduction, True, rough=True)
    expected, found = gls.expected_gap, estimates(problem, gls.values, gls.bars, gls=gls)
    inside = inside_bounds(at_bounds(problem.layout, found, partial(pulls_of_gls, gls)))
    sound = Sound(moving, inside, *_of_residuals(task, seen, gls.residuals, gls.noise, expected))
    errors = _errors(task, plain, coefficients)
    values, left, bars = gls.values, gls.residuals, gls.bars
    return Reported(problem, values, left, bars, gls, seen, sound, errors, coefficients, expected)


def _of_plain(task: Task, plain: Optimum, bars: ErrorBars, success: bool) -> Reported:
    problem = plain.problem
    seen, residuals = evaluate(task, problem, plain.local), plain.linear.residuals
    noise = noise_of_residuals(problem, residuals) if np.isfinite(residuals).all() else tuple(task.noise.values())
    found = estimates(problem, plain.values, bars)
    decrease = plain.predicted_reduction([not estimate.found.at_bound for estimate in found])
    arrived = judge.converged(decrease / convergence_unit(problem, bars) ** 2, success, bool(plain.input_errors))
    inside = inside_bounds(at_bounds(problem.layout, found, partial(pulls_of_plain, problem, plain.scores, task.rate)))
    errors, expected = plain.input_errors, plain.expected_gap
    sound = Sound(arrived, inside, *_of_residuals(task, seen, residuals, noise, expected))
    if not sound.gap.passed and np.isfinite(residuals).all():
        bars = with_discrepancy(bars, plain.scores, seen.motion)
    return Reported(problem, plain.values, residuals, bars, None, seen, sound, errors, plain.coefficients, expected)


def _of_residuals(
    task: Task, seen: Evaluation, residuals: np.ndarray, noise: Sequence[Noise], expected: float
) -> tuple[Check, tuple[Check, ...], tuple[Check, ...]]:
    """Checks of the size of the residuals, of their structure, and of those of single records."""
    fitted = dict(zip(task.problem.model.rig.channels, noise, strict=True))
    rests, stated = readings_at_rest(task), task.noise_given
    left = ResidualSet(task.problem, residuals, seen.motion, task.noise, fitted, rests, stated)
    loud = np.sqrt(np.mean([loudness(left, c) ** 2 for c in range(len(left.channels))]))
    single = loudest_record(record_sizes(seen.record_gaps), left, expected)
    return judge.gap_is_noise(seen.gap, expected * float(loud)), structure_checks(left), single


def _errors(task: Task, plain: Optimum, coefficients: InputCoefficients) -> Mapping[str, InputErrorSummary]:
    if not coefficients:
        return plain.input_errors
    rms = error_rms(task.problem, input_errors(task), coefficients)
    return {name: error.model_copy(update={"rms": rms[name]}) for name, error in plain.input_errors.items()}
