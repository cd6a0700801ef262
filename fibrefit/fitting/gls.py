"""The last step of a fit: the likelihood that the search for effects compares hypotheses by, at its mode.

Plain least squares is honest under autocorrelated noise, but wasteful, and it takes all records for alike. From where
it ended, each sample is weighed by what it adds to those before it, each record may deviate in the rig's own
parameters, and errors of measured inputs are eliminated with what is known of them beforehand. Where what is left is
not noise, the plain estimate stands.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import in_time, note_cut, time_for
from fibrefit.fitting.search.optimum import Ended, Optimum, as_predicted, linearised_in_errors, still_gains
from fibrefit.fitting.thresholds import MISSED_LINEARISED, MODE_REACHED, MOST_LINEARISATIONS, ROUGHLY
from fibrefit.fitting.uncertainty import ErrorBars
from fibrefit.problem import (
    DRAWS_OF_ERRORS,
    Arrowhead,
    InputCoefficients,
    MarginalLikelihood,
    Noise,
    Place,
    Problem,
    Task,
    Unknowns,
    View,
    corrected,
    input_errors,
    instant_weights,
    laplace_evidence,
    mode,
    noise_of_residuals,
    record_wise_start,
    whitening_of,
    with_noise_before_rounding,
    with_steps,
)
from fibrefit.study.summaries.part import Z_95
from fibrefit.study.summaries.results import BetweenRecordsSummary


def interval_of_shared(evidence: MarginalLikelihood, index: int) -> tuple[float, float]:
    """Ends of the 95 % interval of a shared value in SI units, over all standard deviations between records.

    Parameters
    ----------
    evidence : MarginalLikelihood
    index : int
        Of the value among the shared ones.
    """
    mean, here = evidence.mean, np.arange(len(evidence.mean)) == index
    ends = (evidence.mode.unknowns.value(np.where(here, z, mean))[index] for z in evidence.interval_95(index))
    # The typical value of a strength may lie below its null: its coordinate falls then as it rises.
    low, high = sorted(map(float, ends))
    return low, high


def kind_of_interval(name: str, between: Mapping[str, BetweenRecordsSummary]) -> str:
    """Of what the interval of a shared value is: of the mean of a population where records differ in it.

    Parameters
    ----------
    name : str
    between : mapping of str to BetweenRecordsSummary
        How much records differ, for each value that may.
    """
    return "population" if name in between and between[name].found else "normal"


@dataclass(frozen=True)
class GlsEstimate:
    """The estimate at the mode of the likelihood.

    Parameters
    ----------
    values : (n_free,) in SI units
        Shared ones: means over the standard deviations between records; the records' own at the mode.
    local : (n_record, n_local) in SI units
        Values of each record, its deviations in them.
    residuals : (n_record, n_channel, n_time) in units of the noise
        There, errors of the inputs at their best.
    intervals : (n_free, 2) in SI units
        Of 95 %.
    between : mapping of name to BetweenRecordsSummary
        How much records differ.
    noise : tuple of Noise
        Of each channel, in SI units.
    coefficients : mapping of input to (n_record, n_wave)
    expected_gap : float
        Of a perfect model.
    """

    values: np.ndarray
    local: np.ndarray
    residuals: np.ndarray
    bars: ErrorBars
    intervals: np.ndarray
    between: Mapping[str, BetweenRecordsSummary]
    noise: tuple[Noise, ...]
    evidence: MarginalLikelihood
    seen: View
    coefficients: InputCoefficients
    expected_gap: float

    @property
    def records_differ(self) -> bool:
        """Whether records differ."""
        return any(one.found for one in self.between.values())


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
    if task.steps and seen.raw is None:
        seen = View(with_steps(plain.problem, dict(task.steps)))
    elif task.steps and seen.raw is not None:
        # The likelihood of readings in coarse steps, linearised in the errors of inputs that are known.
        local, known = unknowns.local_of(place), input_errors(task)
        coefficients, roots = seen.residuals(local)[1], seen.raw.roots()
        there = corrected(with_steps(task.problem, dict(task.steps)), known, coefficients)
        whole = with_steps(task.problem, with_noise_before_rounding(there, local).observations.steps)
        view = linearised_in_errors(whole, known, local, coefficients, roots)
        seen = replace(view, beforehand=seen.beforehand)
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
        found, came = in_time(partial(_linearised_again, task, bars, found), None)
        took = time.monotonic() - began
        if not came:
            note_cut()
    return min(linearisations, key=lambda one: one.left).found if linearisations else found


def _linearised_again(task: Task, bars: ErrorBars, found: GlsEstimate) -> GlsEstimate | None:
    """The estimate with readings linearised in the errors of inputs that were found."""
    assert found.seen.sensitivities is not None
    roots = found.seen.sensitivities.roots()
    problem = with_noise_before_rounding(problem_at(task, found), found.local)
    whole = with_steps(task.problem, problem.observations.steps)
    view = linearised_in_errors(whole, input_errors(task), found.local, found.coefficients, roots)
    mode = found.evidence.mode
    return _at_mode(bars, mode.unknowns, mode.place, replace(view, beforehand=found.seen.beforehand), mode.sigma)


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
    # By what a look gains, not by whether values rest: where none moved by a quarter of what records differ by, five
    # more looks gained 430 nats.
    return still_gains([one.share for one in linearisations], [one.left for one in linearisations], last.bends)


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


def _estimate(plain_bars: ErrorBars, evidence: MarginalLikelihood, seen: View, noise: tuple[Noise, ...]) -> GlsEstimate:
    """The estimate at a mode, with its error bars."""
    found, layout = evidence.mode, seen.problem.layout
    unknowns, local = found.unknowns, evidence.mode.local
    evidence = evidence.refined()
    places, sizes = unknowns.places_in(layout)
    shared = np.array([record is None for _, record in layout.entries])
    each = len(unknowns.free) * len(unknowns.each)
    unit = np.concatenate([unknowns.slope(evidence.mean), np.ones(each)])[places] * sizes
    cautious = evidence
    if seen.beforehand is not None:
        # Once the readings have said much of the errors of inputs, samples beyond bounces are predicted by linear laws
        # too, and lead to better values. How sure these are they do not tell: beyond a bounce the likelihood is rough,
        # and each of its many minima is far narrower than they are apart. So covariances are those of what was known
        # beforehand, values as they are.
        view = seen.beforehand.through(whitening_of(seen.beforehand.problem, noise))
        there = replace(found, normal=Arrowhead.at(unknowns, found.place, view.gram(unknowns)))
        cautious = replace(evidence, mode=there, covariance=MarginalLikelihood.of(there, evidence.axes).covariance)
    covariance = cautious.covariance_of_all()[np.ix_(places, places)] * np.outer(unit, unit)
    # If the records did not differ: of the shared values; of the others as it is.
    alike, index = covariance.copy(), np.flatnonzero(shared)
    inside = cautious.covariance[0][np.ix_(places[index], places[index])] * np.outer(unit[index], unit[index])
    alike[np.ix_(index, index)] = inside
    # What no record determines is not determined by a flat prior either.
    lost = ~np.isfinite(np.diag(plain_bars.covariance))
    for matrix in (covariance, alike):
        matrix[np.diag_indices_from(matrix)] = np.where(lost, np.inf, np.diag(matrix))
    values = unknowns.free_values(layout, unknowns.value(evidence.mean), found.place.own)
    bars = ErrorBars({"white": plain_bars.covariances["white"], "alike": alike, "whitened": covariance}, "whitened")
    errors = bars.errors["whitened"]
    intervals = values[:, None] + Z_95 * errors[:, None] * np.array([-1.0, 1.0])
    for i in np.flatnonzero(shared & np.isfinite(errors)):
        intervals[i] = interval_of_shared(cautious, int(places[i]))
    residuals, coefficients = seen.residuals(local, DRAWS_OF_ERRORS)
    expected_gap = 1.0
    if len(residuals) > 1:
        # Errors of inputs that are fitted take noise along, of each sample as much as it counts: draws put it back.
        counts = residuals[0] != 0.0
        share = counts if seen.raw is None else counts * np.square(seen.raw.downweight)
        taken = np.sum((residuals[1:] - residuals[0]) ** 2, axis=(1, 3))
        taken = taken / np.maximum(np.sum(share, axis=(0, 2)), LEAST)
        expected_gap = float(np.sqrt(np.mean(np.maximum(1.0 - taken, LEAST))))
    return GlsEstimate(
        values=values,
        local=local,
        residuals=residuals[0],
        bars=bars,
        intervals=intervals,
        between=evidence.between_records(),
        noise=noise,
        evidence=evidence,
        seen=seen,
        coefficients=coefficients,
        expected_gap=expected_gap,
    )


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
        return mode(found.unknowns.fixed_at(place, z), found.place._replace(z=z), gram, found.sigma).objective

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
