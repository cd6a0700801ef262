"""The checks a fit is put to, as a table, and what they compare."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial
from typing import Any, Literal, NamedTuple

import numpy as np

from fibrefit.core.limits import in_time
from fibrefit.fitting.error_bars import estimates
from fibrefit.fitting.evaluated import EvaluatedEstimate
from fibrefit.fitting.gls import GlsEstimate
from fibrefit.fitting.misstatements import Alternative, best_alternative, slack_zeros
from fibrefit.fitting.residuals import loudest_record, phases, spectrum, states
from fibrefit.fitting.result import NOT_ARRIVED, Found, Gap, Starts, Why, record_sizes, total
from fibrefit.fitting.search.optimum import optimum
from fibrefit.fitting.search.solve import linearised
from fibrefit.fitting.thresholds import (
    CHANCE,
    DIVERGED,
    FACTOR,
    FEW_STARTS,
    FIT_TOLERANCE,
    GAP_OF_PART,
    GRAVITY_OFF,
    LATE_FORCE,
    LESS_PROBABLE,
    LOUDER_THAN_AT_REST,
    MINIMA_KNOWN,
    ROUGHLY,
    SPECTRUM_RATIO,
    STARTS_AGREED,
    STATE_SHARE,
    UNEXPLAINED,
    UNNOTICED,
    USELESS,
    WORSE,
)
from fibrefit.fitting.values import (
    Doubtful,
    Outweighed,
    at_bounds,
    beyond_bounds,
    most_doubtful,
    outweighed,
    pulls_of_gls,
    pulls_of_plain,
    records_agree,
    with_ends,
)
from fibrefit.problem import (
    BALANCE,
    GAP_OF_NOISE,
    LAST_LEVEL_RATIO,
    UNLIKELY,
    Gravity,
    InputCoefficients,
    Lag,
    Noise,
    Problem,
    force_and_position_exchanged,
    mode,
)
from fibrefit.study.summaries.check import OTHERWISE, SIZE, Check
from fibrefit.study.summaries.results import InputErrorSummary

CONVERGED, COMPLETION, EXPLAINED = "convergence", "completion", "explained_share"
AGREED, SECOND, DOUBTFUL, BARS, BOUNDS = "starts", "second_solver", "doubtful_value", "error_bars", "bounds"
"""Identifiers that others ask for."""


class CheckRow(NamedTuple):
    """A check, as data and one function of the estimate.

    Parameters
    ----------
    identifier : str
        Stable name, by which `fibrefit.report.sentences` words it.
    name : str
        What is true where it passed.
    quantity : str
        What it tests.
    finds : callable
        What it finds in an estimate, from what it needs of it: one or several `Found`, or checks that `problem` makes;
        None where it has nothing to ask.
    threshold : float, optional
        Up to which the statistic passes, unless `Found` has another.
    applies : callable
        When it is asked.
    about : str
        See `Check`.
    fatal : bool
        Whether the result cannot be used where it failed.
    decides : bool
        Whether it has to hold before residuals are taken for noise: it is asked of every estimate that may be reported.
    remedy : str
        Identifier of the `Advice` for where it failed.
    """

    identifier: str
    name: str
    quantity: str
    finds: Callable[[EvaluatedEstimate], Found | Sequence[Found | Check] | None]
    threshold: float | None = None
    applies: Callable[[EvaluatedEstimate], bool] = lambda estimate: True
    about: Literal["numbers", "model"] = "numbers"
    unit: str = "-"
    fatal: bool = False
    decides: bool = False
    remedy: str = ""

    def judged(self, found: Found) -> Check:
        """The check, given what it found."""
        passed = found.passed
        if passed is None:
            passed = found.statistic is not None and self.threshold is not None and found.statistic <= self.threshold
        fields: dict[str, Any] = {
            "name": self.name.format(found.of),
            "passed": bool(passed),
            "statistic": found.statistic,
            "threshold": self.threshold,
            "unit": self.unit,
            "fatal": self.fatal,
            "identifier": self.identifier.format(found.of),
            "quantity": self.quantity.format(found.of),
            "about": self.about,
            "facts": found.facts,
        }
        return Check(**(fields | dict(found.instead)))


def of_plain(estimate: EvaluatedEstimate) -> bool:
    """A check of plain least squares."""
    return estimate.gls is None


def of_several_records(estimate: EvaluatedEstimate) -> bool:
    """A check that compares records."""
    return len(estimate.seen.record_gaps) > 1


def compares_solvers(estimate: EvaluatedEstimate) -> bool:
    """Where a search ended nothing is searched anew: a second solver is asked for a likelihood alone."""
    search = estimate.search
    return not search.how.known or not (search.second is None or estimate.gls is None)


def unexplained_and_exchanged(estimate: EvaluatedEstimate) -> bool:
    """Force and position look exchanged, and the model does not explain them."""
    return not estimate.passed(EXPLAINED) and force_and_position_exchanged(estimate.search.task.traces)


def in_doubt(estimate: EvaluatedEstimate) -> bool:
    """Something is left, or contradicts what is stated, and no exchange of channels is the reason."""
    sound = estimate.passed(EXPLAINED, SIZE, "{}_error", "free_flight", "lag")
    return estimate.search.how.rivals and not sound and not estimate.outcomes["exchanged_channels"]


def checks_of(estimate: EvaluatedEstimate, rows: Sequence[CheckRow] | None = None) -> tuple[Check, ...]:
    """Put an estimate to the checks of a table, from top to bottom; the whole one by default.

    What it was put to before is not asked again.
    """
    rows = CHECKS if rows is None else rows
    for row in rows:
        if row.identifier not in estimate.outcomes:
            found = row.finds(estimate) if row.applies(estimate) else None
            several = [found] if isinstance(found, Found) else found or ()
            estimate.outcomes[row.identifier] = tuple(
                row.judged(one) if isinstance(one, Found) else one for one in several
            )
    return tuple(check for row in rows for check in estimate.outcomes[row.identifier])


def check(identifier: str, found: Found) -> Check:
    """The check of an identifier, given what it found."""
    return next(row for row in CHECKS if row.identifier == identifier).judged(found)


def converged(predicted_decrease: float, success: bool, rough: bool = False) -> Found:
    """Whether the solver has arrived: its own word, and what another step would still gain.

    Parameters
    ----------
    rough : bool
        Whether errors of measured inputs, or noise and differences between records, were fitted too.
    """
    enough = ROUGHLY if rough else FIT_TOLERANCE
    passed, fatal = success and predicted_decrease <= enough, not predicted_decrease <= DIVERGED
    return Found(predicted_decrease, passed=passed, instead={"threshold": enough, "fatal": fatal})


def finite(values: np.ndarray, trouble: np.ndarray, records: tuple[str, ...]) -> Found:
    """Whether simulation of the solution is sound."""
    sound = bool(np.isfinite(values).all())
    bad = tuple(name for name, flag in zip(records, trouble, strict=True) if flag)
    facts = {"finite": sound, "records": bad}
    return Found(float(len(bad)), facts) if sound else Found(None, facts, instead={"threshold": None})


def second_solver(distance: float, gain: float) -> Found:
    """Whether another solver, with other coordinates, ends at the same place."""
    passed = distance <= UNNOTICED and gain <= FIT_TOLERANCE
    return Found(distance, {"gain": gain, "nats": None}, passed)


def second_solver_by_likelihood(distance: float, nats: float) -> Found:
    """Whether the likelihood, followed from where another solver ended, leads to the same values or to worse ones.

    Parameters
    ----------
    nats : float
        By how many its end is less probable.
    """
    # Both ends are a fifth of a standard error from a minimum at most, see `ROUGHLY`.
    most = 2.0 * ROUGHLY**0.5
    passed = (distance <= most and nats > -LESS_PROBABLE) or nats > LESS_PROBABLE
    return Found(distance, {"gain": 0.0, "nats": nats}, passed, {"threshold": most})


def second_solver_agrees(estimate: EvaluatedEstimate) -> Found:
    """Whether another solver ends at the same values, or at less probable ones."""
    search, second = estimate.search, estimate.search.second
    if second is None:
        return Found(None, passed=False, instead={"threshold": None})
    found = second_solver(second.distance / search.unit, second.gain)
    followed = search.how.rivals and search.plain.input_errors
    if estimate.gls is None or not followed or (found.passed and not search.plain.differ):
        return found
    return second_solver_by_likelihood(*likelihood_continued_from(estimate.gls, second.values))


def undecided(starts: Starts, noise: bool) -> bool:
    """Whether few starts found what leaves only noise, and residuals do not tell it from the next minimum."""
    few = FEW_STARTS <= starts.agreeing < STARTS_AGREED * starts.tried
    return noise and few and starts.excess <= WORSE


def known_minima(starts: Starts) -> float:
    """Probability that a further start ends in a minimum that is known.

    Of so many starts that ended and minima they found, all numbers and shares of minima being as likely beforehand.

    Source
    ------
    Boender and Rinnooy Kan, Math. Program. 37 (1987): bayesian stopping rules for multistart.
    """
    ended, minima = int(np.sum(starts.basin >= 0)), len(set(starts.basin[starts.basin >= 0].tolist()))
    return max(1.0 - minima * (minima + 1.0) / (ended * (ended - 1.0)), 0.0) if ended > 1 else 0.0


def starts_agree(starts: Starts, noise: bool = False, nats: float | None = None) -> Found:
    """Whether most starts end in the best minimum or all minima are known, and what became of the others.

    A few are enough where the best one leaves only `noise` and the others clearly more: there is none below it. So they
    are where many starts have found few minima. Of a single start that came to an end nothing is known, unless it
    follows a search. Where the next ones were followed to their ends, these decide in
    place of how many found the best one.

    Parameters
    ----------
    nats : float, optional
        By how many the next minimum is less probable, errors of measured inputs taken off both; None where that was
        not looked at.
    """
    share, excess, known = starts.agreeing / starts.tried, starts.excess, known_minima(starts)
    clear = starts.agreeing >= FEW_STARTS and excess > WORSE if nats is None else nats > LESS_PROBABLE
    few = noise and clear
    # One start agrees with itself, whatever it came to.
    lonely = not starts.followed and int(np.sum(starts.basin >= 0)) < FEW_STARTS
    exhausted = starts.agreeing >= FEW_STARTS and known >= MINIMA_KNOWN
    facts = {
        "agreeing": starts.agreeing,
        "tried": starts.tried,
        "lost": int(np.sum(starts.basin < 0)),
        "known": known,
        "others": int(np.sum(starts.basin > 0)) if np.isfinite(excess) else 0,
        "excess": excess,
        "noise": few,
        "nats": nats,
        "least": LESS_PROBABLE,
        "lonely": lonely,
    }
    return Found(share, facts, (share >= STARTS_AGREED and not lonely) or few or exhausted)


def best_minimum(estimate: EvaluatedEstimate) -> Found:
    """Whether other starts end where the best one does, or are less probable.

    Measured inputs leave residuals in every minimum of plain least squares, and so do records that differ: there starts
    end in many places, none of which is where the likelihood has its mode. What they say of that shows once it is
    followed from each of them.
    """
    noise, may_be_noise = estimate.passed(SIZE), estimate.may_be_noise
    starts, plain, gls = estimate.search.starts, estimate.search.plain, estimate.gls
    found, compared = starts_agree(starts, noise), estimate.search.how.rivals and bool(plain.input_errors)
    others = starts.others()
    if compared and gls is not None:
        if not plain.differ and (found.passed or not (others and may_be_noise)):
            return found
        # Where more than noise is left, something better is known to be missing.
        led = [likelihood_continued_from(gls, end) for end in (starts.best[0], *others)] if may_be_noise else None
        # Ends that differ by less than their error bars say the same, but for one that the estimate has missed.
        elsewhere = None if led is None else [n for distance, n in led if distance > 1.0 or n < -LESS_PROBABLE]
        nats = None if elsewhere is None else min(elsewhere, default=np.inf)
        # If each record was followed by itself, no start of all of them ended at what is reported.
        return starts_agree(starts.ended_elsewhere() if plain.differ else starts, may_be_noise, nats)
    if not (compared and noise and not found.passed and others) and not undecided(starts, noise):
        return found
    # By plain least squares, errors of measured inputs taken off; not known where minima are not compared.
    nats = None
    if not plain.input_errors:
        # The two bounces that a wrong minimum misses may be few samples of many, and still more than noise.
        nats = 0.5 * float(starts.cost[starts.basin > 0].min() - starts.cost.min()) / estimate.search.unit**2
    elif estimate.search.how.rivals:
        errors = estimate.search.bars.errors[estimate.search.bars.method]
        ends = [optimum(estimate.search.task, values) for values in others]
        away = [one for one in ends if np.any(np.abs(one.values - plain.values) > errors)]
        best, *further = (objective(one.problem, one.local, one.coefficients) for one in (plain, *away))
        nats = 0.5 * (min(further, default=np.inf) - best) / estimate.search.unit**2
    return starts_agree(starts, noise, nats)


def likelihood_continued_from(gls: GlsEstimate, values: np.ndarray) -> tuple[float, float]:
    """Where the likelihood of an estimate leads from values ``(n_free,)``; not known where it leads nowhere.

    Readings are linearised in the errors of inputs that the estimate has.

    Returns
    -------
    tuple of float
        Largest distance of the means over the records from those at the mode, in standard errors of the values they
        share; and by how many nats it is less probable there, at least.
    """
    found, layout = gls.evidence.mode, gls.seen.problem.layout
    start, gram = found.unknowns.place_of(np.asarray(layout.local(values))), gls.seen.gram(found.unknowns)
    end, _ = in_time(partial(mode, found.unknowns, start, gram, found.sigma), None)
    if end is None or not np.isfinite(end.objective):
        return np.inf, 0.0
    # What a further step would gain is still to be gained: the end is no less probable than that.
    nats = 0.5 * (end.objective - np.nan_to_num(end.predicted_reduction, nan=np.inf) - found.objective)
    # A mean and deviations from it may still creep against each other where the records are at rest.
    here, there = (layout.means_of(one.local) for one in (found, end))
    errors, shared = gls.bars.errors[gls.bars.method], np.array([record is None for _, record in layout.entries])
    known = shared & np.isfinite(errors) & (errors > 0.0)
    return float(np.max(np.abs(there - here)[known] / errors[known], initial=0.0)), float(nats)


def objective(problem: Problem, local: np.ndarray, coefficients: InputCoefficients) -> float:
    """Sum of squares of what is left and of the errors that were taken off the inputs, each in units of its own."""
    errors = sum(float(np.sum(np.square(waves))) for waves in coefficients.values())
    left = float(np.sum(np.square(linearised(problem, local).residuals)))
    return left + errors if np.isfinite(left) else np.inf  # where a motion is lost there are no numbers


def none_of(**found: Sequence[Any]) -> Found:
    """Passed where nothing was found; the statistic is how many were."""
    return Found(float(len(*found.values())), found)


def gap_is_noise(gap: Gap, expected: float = 1.0) -> Found:
    """Whether what is left is no larger than the noise.

    Parameters
    ----------
    expected : float
        Gap of a perfect model: less than 1 where errors of inputs are fitted, more where noise grows with the load.
    """
    ratio, limit = total(gap), GAP_OF_NOISE * expected
    return Found(ratio, passed=ratio <= limit, instead={"threshold": limit})


def signal_explained(gaps: Gap, weight: Callable[[], Outweighed | None] = lambda: None) -> Found:
    """Whether what is left beyond the noise is small against each signal.

    Parameters
    ----------
    gaps : Gap
        That of a driving force has no noise.
    weight : callable
        Which value is outweighed by what is left of a signal that is not explained: it is of no use then either.
    """
    # Of the variance of each signal, that which is left and is not noise.
    shares = {
        name: (1.0 - gap.explained) * max(1.0 - (GAP_OF_NOISE * (gap.noise or 0.0) / gap.rms) ** 2, 0.0)
        if gap.rms > 0.0
        else 0.0
        for name, gap in gaps.items()
        if gap.explained is not None
    }
    worst = max(shares, key=lambda name: shares[name], default="")
    share = shares.get(worst, 0.0)
    # A driving force is not simulated: the balance it is known by knows the acceleration badly.
    unusable = any(left > USELESS for name, left in shares.items() if gaps[name].noise is not None)
    facts: dict[str, Any] = {"channel": worst, "unusable": unusable, "useless": USELESS}
    outweighs = None if share <= UNEXPLAINED or unusable else weight()
    if outweighs is not None:
        facts["outweighed"] = outweighs
    return Found(share, facts, instead={"fatal": unusable or outweighs is not None})


def beyond_chance(found: Gravity | Lag | None) -> Found | None:
    """How far off something is, with a standard error, less what chance may make of it."""
    if found is None:
        return None
    off, error = found
    return Found(max(abs(off) - CHANCE * error, 0.0), found._asdict())


def explained_otherwise(found: Alternative) -> Found:
    """What is said of records that one thing more explains: by how much a value would be another."""
    return Found(found.factor, {"alternative": found}, False, {"fatal": found.factor > FACTOR})


def known_to_a_factor(found: Doubtful | None) -> Found | None:
    """Whether what the model lacks leaves every value of use: the error bars that allow for it tell."""
    return (
        None
        if found is None
        else Found(found.share, {"doubtful": found, "factor": FACTOR}, found.share <= 1.0 - 1.0 / FACTOR)
    )


def bars_too_small(why: Why) -> Found | None:
    """What is said of an estimate whose error bars are for noise alone, though what it leaves is not; else nothing."""
    return Found(None, {"failed": why.left}, False) if why.identifier == "loses_less" and why.left else None


def inputs_within_noise(errors: Mapping[str, InputErrorSummary]) -> list[Found]:
    """Whether what had to be taken off each measured input is no larger than its noise, where that is looked for.

    Errors are looked for at the frequencies that move the weight: a logger's noise at all the others is no excuse.
    """
    return [
        Found(error.times_expected, passed=0.0 < error.times_expected <= GAP_OF_PART, of=name)
        for name, error in errors.items()
    ]


def noise_seen(noise: Mapping[str, Noise], given: tuple[str, ...]) -> Found:
    """Whether the noise was measured, not guessed."""
    return none_of(channels=tuple(name for name, seen in noise.items() if seen.samples == 0 and name not in given))


def bounds(estimate: EvaluatedEstimate) -> Found:
    """Whether the records ask for no value beyond a bound, chance allowed for."""
    problem, gls = estimate.problem, estimate.gls
    if gls is None:
        pulls = partial(pulls_of_plain, problem, estimate.optimum.scores, estimate.search.task.rate)
    else:
        pulls = partial(pulls_of_gls, gls)
    found = estimates(problem, estimate.values, estimate.bars_of_noise, gls=gls)
    # Ends are those of the intervals that are reported, which are often wider than those of noise alone.
    return beyond_bounds(with_ends(at_bounds(problem.layout, found, pulls), problem.layout, estimate.estimates))


def explained_signals(estimate: EvaluatedEstimate) -> Found:
    """Whether the signals are explained; where they are not, whether the values are of use all the same."""
    plain = estimate.search.plain
    return signal_explained(estimate.gaps, partial(outweighed, plain.problem.layout, plain.values, plain.scores))


def one_thing_more(estimate: EvaluatedEstimate) -> Found | None:
    """What one law more makes of the values, if it explains the records."""
    other = in_time(partial(best_alternative, estimate.search.task, estimate.values), None)[0]
    return None if other is None else explained_otherwise(other)


def agreeing_records(estimate: EvaluatedEstimate) -> Found | None:
    """Whether single records ask for the same values."""
    plain, bars, rate = estimate.search.plain, estimate.search.bars, estimate.search.task.rate
    return records_agree(plain.problem, plain.values, plain.scores, bars, rate)


CHECKS: tuple[CheckRow, ...] = (
    # Of the search; the first is put before the others where a fit is stopped.
    CheckRow(COMPLETION, "the fit ran to its end", "completion of the fit", lambda e: None),
    CheckRow(
        "simulation", "the simulation is sound", "soundness of the simulation",
        lambda e: finite(e.residuals, e.seen.motion.trouble, e.problem.layout.records), 0.0, fatal=True,
    ),
    CheckRow(
        CONVERGED, "the solver converged", NOT_ARRIVED,
        lambda e: converged(e.predicted_decrease, e.search.success, e.rough), FIT_TOLERANCE, decides=True,
    ),
    CheckRow(
        SECOND, "a second solver agrees", "agreement with a second solver",
        second_solver_agrees, UNNOTICED, applies=compares_solvers,
    ),
    CheckRow(
        AGREED, "the best minimum was found", "agreement of the starts (multistart)", best_minimum, STARTS_AGREED
    ),
    # Of the values.
    CheckRow(
        BOUNDS, "no parameter is stopped by a bound", "distance of the parameters from their bounds",
        bounds, CHANCE, remedy="widen",
    ),
    CheckRow(
        "identifiability", "every parameter is determined", "identifiability of the parameters",
        lambda e: none_of(weak=e.weak), 0.0, remedy="further_record",
    ),
    # Of the residuals.
    CheckRow(
        "noise_level", "the noise is known", "noise level",
        lambda e: noise_seen(e.search.task.noise, e.search.task.noise_given), 0.0, about="model", remedy="rest",
    ),
    CheckRow(
        SIZE, "the gap is noise", "residual size",
        lambda e: gap_is_noise(e.seen.gap, e.expected_in_motion), GAP_OF_NOISE,
        about="model", decides=True, remedy="search",
    ),
    CheckRow(
        "{}_error", "the {} is as measured", "error of the measured {}",
        lambda e: inputs_within_noise(e.input_errors), GAP_OF_PART, about="model",
    ),
    CheckRow(
        "residual_spectrum", "residuals have the noise's spectrum", "residual spectrum",
        lambda e: spectrum(e.residual_set), SPECTRUM_RATIO, about="model", decides=True, remedy="search",
    ),
    CheckRow(
        "residual_phase", "no phase stands out", "residuals by phase",
        lambda e: phases(e.residual_set), GAP_OF_PART, about="model", decides=True, remedy="search",
    ),
    CheckRow(
        "residual_state", "residuals do not depend on the state", "residuals vs state",
        lambda e: states(e.residual_set), STATE_SHARE, about="model", decides=True, remedy="search",
    ),
    CheckRow(
        "loudest_record", "no record stands out", "residuals of single records",
        lambda e: loudest_record(record_sizes(e.seen.record_gaps), e.residual_set, e.expected_gap),
        LOUDER_THAN_AT_REST, applies=of_several_records, about="model", remedy="search",
    ),
    CheckRow(
        "hausman", "plain and whitened estimates agree", "OLS against GLS estimate (Hausman test)",
        lambda e: e.hausman, UNLIKELY, about="model",
    ),
    # Of the study against the records.
    CheckRow(
        EXPLAINED, "the signal is explained", "share of the signal that is explained", explained_signals, UNEXPLAINED
    ),
    CheckRow(
        "exchanged_channels", "force and position are in their places", "columns of force and position",
        lambda e: Found(None, passed=False), applies=unexplained_and_exchanged, fatal=True,
    ),
    CheckRow(
        "free_flight", "free flight has the stated gravity", "gravity in free flight",
        lambda e: beyond_chance(Gravity.in_flight(e.search.task, e.values, e.seen.motion)), GRAVITY_OFF,
    ),
    CheckRow(
        "lag", "force and position are of the same time", "time between force and position",
        lambda e: beyond_chance(Lag.in_contacts(e.search.task, e.values, e.seen.motion)), LATE_FORCE,
    ),
    CheckRow(
        "slack_zero", "the force is zero while the fibre is slack", "zero of the force",
        lambda e: slack_zeros(e.search.task), unit="N", remedy="slack_zero",
    ),
    CheckRow(
        OTHERWISE, "nothing else explains the records", "what else explains the records",
        one_thing_more, FACTOR, applies=in_doubt, remedy="correct",
    ),
    # Of what the values are worth where the model lacks something.
    CheckRow(
        DOUBTFUL, "no value may be off by a factor", "size of the values",
        lambda e: known_to_a_factor(most_doubtful(e.problem.layout, e.values, e.bars)), 1.0 - 1.0 / FACTOR, fatal=True,
    ),
    CheckRow(
        BARS, "error bars allow for what is left", "size of the error bars",
        lambda e: bars_too_small(e.why),
    ),
    CheckRow(
        "between_records", "records differ by no more than is looked for", "difference between records",
        lambda e: None if e.gls is None else e.gls.evidence.between_records_checks(), LAST_LEVEL_RATIO,
    ),
    CheckRow(
        "records_agree", "single records agree", "agreement of the records",
        agreeing_records, UNLIKELY, applies=of_plain,
    ),
    CheckRow(
        "force_balance", "the force is the one the motion asks for", "force balance (inverse dynamics)",
        lambda e: None if e.balance is None else [e.balance.check()], BALANCE,
    ),
)  # fmt: skip
"""All checks of a fit, in the order in which they are made and reported.

A row reads its quantity from an estimate (`EvaluatedEstimate`), and passes up to its threshold; `hausman`,
`between_records` and `force_balance` are made in `problem`, of posteriors too.
"""

DECIDING = tuple(row for row in CHECKS if row.decides)
"""Those that must hold before residuals are taken for noise."""
