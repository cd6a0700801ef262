"""The last step of a fit: the likelihood that the search for effects compares hypotheses by, at its mode.

Plain least squares is honest under autocorrelated noise, but wasteful, and it takes all records for alike. From where
it ended, each sample is weighed by what it adds to those before it, each record may deviate in the rig's own
parameters, and errors of measured inputs are eliminated with what is known of them beforehand. Where what is left is
not noise, the plain estimate stands.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import in_time, note_cut, time_for
from fibrefit.fitting.estimates import ErrorBars, GlsEstimate, interval_of_shared
from fibrefit.fitting.search.optimum import Ended, Optimum
from fibrefit.fitting.search.with_input_errors import as_predicted, linearised_in_errors, still_gains
from fibrefit.fitting.thresholds import MISSED_LINEARISED, MODE_REACHED, MOST_LINEARISATIONS, ROUGHLY
from fibrefit.problem.estimate.evidence import MarginalLikelihood, laplace_evidence
from fibrefit.problem.estimate.gauss_newton import mode, record_wise_start
from fibrefit.problem.inputs.errors_in_variables import corrected, input_errors, instant_weights
from fibrefit.problem.linear_model.normal_equations import Arrowhead
from fibrefit.problem.linear_model.unknowns import Place, Unknowns
from fibrefit.problem.linear_model.view import DRAWS_OF_ERRORS, View
from fibrefit.problem.noise.rounding import with_noise_before_rounding, with_steps
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.noise.whittle import noise_of_residuals, whitening_of
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.study.summaries.part import Z_95

LEAST = 0.25
"""Least share of the noise's power that is taken to be left where errors of inputs are fitted."""
ROUNDS, MOST_ROUNDS = 2, 6
"""How often the noise is taken from what is left, the second time with what was fitted put back; and how often at the
most where the mode is crept up to, as that of readings in coarse steps beside noisy inputs is."""


def gls_estimate(task: Task, plain: Optimum, bars: ErrorBars, ended: Ended | None = None) -> GlsEstimate | None:
    """The estimate of the likelihood, from a plain one; None where no mode is reached from there.

    Parameters
    ----------
    task : Task
    plain : Optimum
    bars : ErrorBars
        Of the plain estimate.
    ended : Ended, optional
        From which to begin as well: where records differ, the plain estimate may lie in another minimum, and take what
        they differ by for errors of their inputs.
    """
    unknowns = Unknowns.of_fit(plain.problem.layout, plain.values, bars.errors["white"])
    seen = View(plain.problem) if plain.view is None else plain.view
    place = unknowns.place_of(plain.local)
    if not len(unknowns.columns):
        return None
    apart_already = plain.view is not None and ended is not None and ended.differ
    if len(unknowns.scattering) and not apart_already:
        further = () if ended is None else (unknowns.place_of(ended.local),)
        place = record_wise_start(unknowns, (place, *further), seen, task.horizons)
    if apart_already:
        seen = replace(seen, beforehand=seen)
    if task.steps:
        seen = _in_steps(task, plain, seen, unknowns.local_of(place))
    return _relinearised(task, bars, _at_mode(bars, unknowns, place, seen), apart_already)


class _Linearisation(NamedTuple):
    """An estimate, the share of the samples that count in it, and the mean square of what it leaves of all of them.

    That is in units of what noise leaves.
    """

    found: GlsEstimate
    bends: bool
    share: float
    left: float


def _relinearised(task: Task, bars: ErrorBars, found: GlsEstimate | None, searched: bool) -> GlsEstimate | None:
    """An estimate, readings linearised in the errors of inputs again and again until they are as predicted.

    Parameters
    ----------
    task : Task
    bars : ErrorBars
        Of the plain estimate.
    found : GlsEstimate or None
        With the first look.
    searched : bool
        Whether that is one of a search, made with what is known of the errors beforehand alone.
    """
    linearisations: list[_Linearisation] = []
    took = 0.0
    while found is not None and found.seen.raw is not None:
        linearisations.append(_linearisation(task, found))
        # Another look takes as long as the last one.
        if not _tells_more(linearisations, searched) or not time_for(took):
            break
        began = time.monotonic()
        # One that the time ends on the way takes nothing from those before it.
        found, came = in_time(partial(_next_look, task, bars, found), None)
        took = time.monotonic() - began
        if not came:
            note_cut()
    return min(linearisations, key=lambda one: one.left).found if linearisations else found


def _next_look(task: Task, bars: ErrorBars, found: GlsEstimate) -> GlsEstimate | None:
    mode = found.evidence.mode
    return _at_mode(bars, mode.unknowns, mode.place, _seen(task, found), mode.sigma)


def _linearisation(task: Task, found: GlsEstimate) -> _Linearisation:
    assert found.seen.raw is not None
    counts, downweight = instant_weights(task.problem), found.seen.raw.downweight
    left = np.asarray(problem_at(task, found).linearised_at(found.local).residuals)
    share = float(instant_weights(task.problem, downweight).sum() / counts.sum())
    # Readings in coarse steps leave nothing as long as they lie in theirs: a complete model leaves far less than one.
    leaves = float(np.sum(found.residuals**2))
    scale = leaves / (share * counts.sum()) if task.steps and leaves > 0.0 else 1.0
    bends = not as_predicted(left * downweight, found.residuals, scale)
    return _Linearisation(found, bends, share, float(np.sum(left**2) / counts.sum()) / scale)


def _tells_more(linearisations: Sequence[_Linearisation], searched: bool) -> bool:
    """Whether one look more may tell more: of samples beyond a bounce, once more is known of what leads there."""
    last = linearisations[-1]
    if len(linearisations) >= MOST_LINEARISATIONS:
        return False
    if len(linearisations) == 1 or last.left < 1.0 + MISSED_LINEARISED:
        return last.bends or (searched and last.left > 1.0 + MISSED_LINEARISED)
    return still_gains([one.share for one in linearisations], [one.left for one in linearisations], last.bends)


def _in_steps(task: Task, plain: Optimum, seen: View, local: np.ndarray) -> View:
    """Records seen with the likelihood of readings in coarse steps."""
    steps = dict(task.steps)
    if seen.raw is None:
        return View(with_steps(plain.problem, steps))
    known, coefficients = input_errors(task), seen.residuals(local)[1]
    there = corrected(with_steps(task.problem, steps), known, coefficients)
    whole = with_steps(task.problem, with_noise_before_rounding(there, local).observations.steps)
    roots = seen.raw.roots()
    return replace(linearised_in_errors(whole, known, local, coefficients, roots), beforehand=seen.beforehand)


def _at_mode(
    bars: ErrorBars, unknowns: Unknowns, place: Place, seen: View, sigma: np.ndarray | None = None
) -> GlsEstimate | None:
    """The mode in the noise that is left there; standard deviations between records begin at `sigma`.

    One that was reached as well as `MODE_REACHED` asks stands where it cannot be come nearer to.
    """
    evidence: MarginalLikelihood | None = None
    found: GlsEstimate | None = None
    for number in range(1, MOST_ROUNDS + 1):
        if seen.raw is None:
            seen = replace(seen, problem=with_noise_before_rounding(seen.problem, unknowns.local_of(place)))
        left = (
            seen.residuals(unknowns.local_of(place), DRAWS_OF_ERRORS)[0]
            if evidence is None
            else seen.residuals_with_noise_power(evidence.mode, evidence.posterior_roots(), DRAWS_OF_ERRORS)
        )
        noise = noise_of_residuals(seen.problem, left)
        seen = seen.through(whitening_of(seen.problem, noise))
        evidence = _laplace_evidence(unknowns, place, seen, sigma)
        if evidence is None:
            break
        place, sigma = evidence.mode.place, evidence.mode.sigma
        if number >= ROUNDS:
            found = _estimate(bars, evidence, seen, noise)
            if evidence.mode.predicted_reduction <= ROUGHLY:
                break
    return found


def _laplace_evidence(
    unknowns: Unknowns, place: Place, seen: View, sigma: np.ndarray | None
) -> MarginalLikelihood | None:
    with np.errstate(all="ignore"):
        try:
            found = laplace_evidence(unknowns, place, seen.gram(unknowns), sigma)
        except np.linalg.LinAlgError:
            return None
    sound = np.isfinite(found.log) and np.isfinite(found.spread).all() and found.mode.predicted_reduction < MODE_REACHED
    return found if sound else None


def _seen(task: Task, found: GlsEstimate) -> View:
    """A task with noisy inputs, linearised in their errors at those found."""
    assert found.seen.sensitivities is not None
    roots = found.seen.sensitivities.roots()
    problem = with_noise_before_rounding(problem_at(task, found), found.local)
    whole = with_steps(task.problem, problem.observations.steps)
    view = linearised_in_errors(whole, input_errors(task), found.local, found.coefficients, roots)
    return replace(view, beforehand=found.seen.beforehand)


def _estimate(plain_bars: ErrorBars, evidence: MarginalLikelihood, seen: View, noise: tuple[Noise, ...]) -> GlsEstimate:
    found, layout = evidence.mode, seen.problem.layout
    unknowns = found.unknowns
    evidence = evidence.refined()
    places, sizes = unknowns.places_in(layout)
    shared = np.array([record is None for _, record in layout.entries])
    slopes = np.concatenate([unknowns.slope(evidence.mean), np.ones(covariance_size(unknowns) - len(unknowns.shared))])
    unit = slopes[places] * sizes
    cautious = evidence if seen.beforehand is None else _cautious(evidence, seen.beforehand, noise)
    covariance = cautious.covariance_of_all()[np.ix_(places, places)] * np.outer(unit, unit)
    alike = _alike(cautious, places, unit, covariance, shared)
    # What no record determines is not determined by a flat prior either.
    lost = ~np.isfinite(np.diag(plain_bars.covariance))
    for matrix in (covariance, alike):
        matrix[np.diag_indices_from(matrix)] = np.where(lost, np.inf, np.diag(matrix))
    values = unknowns.free_values(layout, unknowns.value(evidence.mean), found.place.own)
    bars = ErrorBars({"white": plain_bars.covariances["white"], "alike": alike, "whitened": covariance}, "whitened")
    local = found.local
    residuals, coefficients = seen.residuals(local, DRAWS_OF_ERRORS)
    return GlsEstimate(
        values=values,
        local=local,
        residuals=residuals[0],
        bars=bars,
        intervals=_intervals(cautious, places, values, bars.errors["whitened"], shared),
        between=evidence.between_records(),
        noise=noise,
        evidence=evidence,
        seen=seen,
        coefficients=coefficients,
        expected_gap=_expected_gap(residuals, seen),
    )


def _cautious(evidence: MarginalLikelihood, seen: View, noise: tuple[Noise, ...]) -> MarginalLikelihood:
    """The evidence with the covariance of a view, values as they are.

    Once the readings have said much of the errors of inputs, samples beyond bounces are predicted by linear laws too,
    and lead to better values. How sure these are they do not tell: beyond a bounce the likelihood is rough, and each of
    its many minima is far narrower than they are apart.
    """
    found = evidence.mode
    view = seen.through(whitening_of(seen.problem, noise))
    there = replace(found, normal=Arrowhead.at(found.unknowns, found.place, view.gram(found.unknowns)))
    return replace(evidence, mode=there, covariance=MarginalLikelihood.of(there, evidence.axes).covariance)


def _expected_gap(residuals: np.ndarray, seen: View) -> float:
    """Gap a perfect model leaves: errors of inputs that are fitted take noise along, which draws of them put back.

    They do so of each sample as much as it counts.
    """
    share = (residuals[0] != 0.0) if seen.raw is None else (residuals[0] != 0.0) * np.square(seen.raw.downweight)
    number = np.maximum(np.sum(share, axis=(0, 2)), LEAST)
    taken = np.sum((residuals[1:] - residuals[0]) ** 2, axis=(1, 3)) / number
    return float(np.sqrt(np.mean(np.maximum(1.0 - taken, LEAST)))) if len(residuals) > 1 else 1.0


def covariance_size(unknowns: Unknowns) -> int:
    """Number of shared coordinates and of all records' own ones."""
    return len(unknowns.shared) + len(unknowns.free) * len(unknowns.each)


def _alike(
    evidence: MarginalLikelihood, places: np.ndarray, unit: np.ndarray, covariance: np.ndarray, shared: np.ndarray
) -> np.ndarray:
    """Covariance if the records did not differ, of the shared values; of the others as it is."""
    same = covariance.copy()
    index = np.flatnonzero(shared)
    inside = evidence.covariance[0][np.ix_(places[index], places[index])] * np.outer(unit[index], unit[index])
    same[np.ix_(index, index)] = inside
    return same


def _intervals(
    evidence: MarginalLikelihood, places: np.ndarray, values: np.ndarray, errors: np.ndarray, shared: np.ndarray
) -> np.ndarray:
    """Intervals of 95 %, ``(n_free, 2)`` in SI units."""
    found = values[:, None] + Z_95 * errors[:, None] * np.array([-1.0, 1.0])
    for i in np.flatnonzero(shared & np.isfinite(errors)):
        found[i] = interval_of_shared(evidence, int(places[i]))
    return found


def cost_with_one_held(gls: GlsEstimate, index: int) -> Callable[[np.ndarray], float]:
    """Smallest objective with the value at `index` held, as a function of values ``(n_free,)`` in SI units.

    Standard deviations between records stay what they are.
    """
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    place = found.unknowns.places_in(layout)[0][index]
    gram = gls.seen.gram(found.unknowns)

    def cost(values: np.ndarray) -> float:
        shared = found.values
        shared[place] = values[index]
        z = found.unknowns.coordinate(shared)
        return mode(found.unknowns.holding(place, z), found.place._replace(z=z), gram, found.sigma).objective

    return cost


def error_of_objective(gls: GlsEstimate, index: int) -> float:
    """Standard error in SI units that a shared value has by the objective of `cost_with_one_held`.

    Records differ there as is most probable, and readings tell of errors of inputs what they do in the end: what is
    reported of the value knows less.
    """
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    # What is reported may be summed over a grid without that of the mode, which is one of the usual levels.
    evidence = MarginalLikelihood.of(found)
    place = found.unknowns.places_in(layout)[0][index]
    row = int(np.flatnonzero(np.all(evidence.grid == found.sigma, axis=1))[0])
    return float(np.sqrt(evidence.covariance[row][place, place]) * abs(found.unknowns.slope(found.place.z)[place]))


def problem_at(task: Task, gls: GlsEstimate) -> Problem:
    """The task's problem with the errors found taken off its inputs."""
    problem = with_steps(task.problem, gls.seen.problem.observations.steps)
    return corrected(problem, input_errors(task), gls.coefficients) if gls.coefficients else problem
