"""The checks a fit is put to."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fibrefit.fitting.estimates import NOT_ARRIVED, Why
from fibrefit.fitting.identifiability import Weakness
from fibrefit.fitting.misfit.alternative import Alternative
from fibrefit.fitting.misfit.discrepancy import Doubtful
from fibrefit.fitting.misfit.outweighed import Outweighed
from fibrefit.fitting.result import Gap, Starts, total
from fibrefit.fitting.thresholds import (
    AGREEMENT,
    AT_BOUND,
    CHANCE,
    DIVERGED,
    FACTOR,
    FEW_STARTS,
    FIT_TOLERANCE,
    GRAVITY_OFF,
    INPUT_ERROR,
    LATE_FORCE,
    LESS_PROBABLE,
    MINIMA_KNOWN,
    ROUGHLY,
    STARTS_AGREED,
    UNEXPLAINED,
    USELESS,
    WORSE,
)
from fibrefit.problem.diagnose.newton import Gravity, Lag
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.layout import Range
from fibrefit.problem.thresholds import GAP_OF_NOISE
from fibrefit.study.summaries.check import OTHERWISE, SIZE, Check
from fibrefit.study.summaries.results import ChannelGap, InputErrorSummary

CONVERGED = "convergence"
COMPLETION = "completion"
EXPLAINED = "explained_share"
AGREED = "starts"
DOUBTFUL = "doubtful_value"
BARS = "error_bars"
SECOND: dict[str, Any] = {"identifier": "second_solver", "quantity": "agreement with a second solver"}


def converged(predicted_decrease: float, success: bool, rough: bool = False) -> Check:
    """Whether the solver has arrived: its own word, and what another step would still gain.

    Parameters
    ----------
    rough : bool
        Whether errors of measured inputs, or noise and differences between records, were fitted too.
    """
    enough = ROUGHLY if rough else FIT_TOLERANCE
    return Check(
        name="the solver converged",
        passed=bool(success and predicted_decrease <= enough),
        statistic=predicted_decrease,
        threshold=enough,
        fatal=not predicted_decrease <= DIVERGED,
        identifier=CONVERGED,
        quantity=NOT_ARRIVED,
    )


def finite(values: np.ndarray, trouble: np.ndarray, records: tuple[str, ...]) -> Check:
    """Whether simulation of the solution is sound."""
    sound = bool(np.isfinite(values).all())
    bad = tuple(name for name, flag in zip(records, trouble, strict=True) if flag)
    return Check(
        name="the simulation is sound",
        passed=sound and not bad,
        statistic=float(len(bad)) if sound else None,
        threshold=0.0 if sound else None,
        fatal=True,
        identifier="simulation",
        quantity="soundness of the simulation",
        facts={"finite": sound, "records": bad},
    )


def second_solver(distance: float, gain: float) -> Check:
    """Whether another solver, with other coordinates, ends at the same place."""
    passed = distance <= AGREEMENT and gain <= FIT_TOLERANCE
    return Check(
        name="a second solver agrees",
        passed=passed,
        statistic=distance,
        threshold=AGREEMENT,
        facts={"gain": gain, "nats": None},
        **SECOND,
    )


def led_by_second_solver(distance: float, nats: float) -> Check:
    """Whether the likelihood, followed from where another solver ended, leads to the same values or to worse ones.

    Parameters
    ----------
    nats : float
        By how many its end is less probable.
    """
    # Both ends are a fifth of a standard error from a minimum at most, see `ROUGHLY`.
    most = 2.0 * ROUGHLY**0.5
    return Check(
        name="a second solver agrees",
        passed=(distance <= most and nats > -LESS_PROBABLE) or nats > LESS_PROBABLE,
        statistic=distance,
        threshold=most,
        facts={"gain": 0.0, "nats": nats},
        **SECOND,
    )


def no_second_solver() -> Check:
    """The check where no second solver was run."""
    return Check(name="a second solver agrees", passed=False, **SECOND)


def interrupted(starts: Starts) -> Check:
    """What is said of a fit that was not let to its end."""
    return Check(
        name="the fit ran to its end",
        passed=False,
        statistic=float(starts.tried),
        threshold=float(starts.planned or starts.tried),
        identifier=COMPLETION,
        quantity="completion of the fit",
    )


def undecided(starts: Starts, noise: bool) -> bool:
    """Whether few starts found what leaves only noise, and residuals do not tell it from the next minimum."""
    few = FEW_STARTS <= starts.agreeing < STARTS_AGREED * starts.tried
    return noise and few and _excess(starts) <= WORSE


def _excess(starts: Starts) -> float:
    """Residuals of the next minimum over those of the best."""
    others = starts.basin > 0
    return float(np.sqrt(starts.cost[others].min() / starts.cost.min())) if others.any() else np.inf


def known_minima(starts: Starts) -> float:
    """Probability that a further start ends in a minimum that is known.

    Of so many starts that ended and minima they found, all numbers and shares of minima being as likely beforehand.

    Source
    ------
    Boender and Rinnooy Kan, Math. Program. 37 (1987): bayesian stopping rules for multistart.
    """
    ended, minima = int(np.sum(starts.basin >= 0)), len(set(starts.basin[starts.basin >= 0].tolist()))
    return max(1.0 - minima * (minima + 1.0) / (ended * (ended - 1.0)), 0.0) if ended > 1 else 0.0


def starts_agree(starts: Starts, noise: bool = False, nats: float | None = None) -> Check:
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
    share = starts.agreeing / starts.tried
    excess = _excess(starts)
    clear = starts.agreeing >= FEW_STARTS and excess > WORSE if nats is None else nats > LESS_PROBABLE
    few = noise and clear
    # One start agrees with itself, whatever it came to.
    lonely = not starts.followed and int(np.sum(starts.basin >= 0)) < FEW_STARTS
    others, lost, known = int(np.sum(starts.basin > 0)), int(np.sum(starts.basin < 0)), known_minima(starts)
    exhausted = starts.agreeing >= FEW_STARTS and known >= MINIMA_KNOWN
    counts = {"agreeing": starts.agreeing, "tried": starts.tried, "lost": lost, "known": known}
    return Check(
        name="the best minimum was found",
        passed=(share >= STARTS_AGREED and not lonely) or few or exhausted,
        statistic=share,
        threshold=STARTS_AGREED,
        identifier=AGREED,
        quantity="agreement of the starts (multistart)",
        facts=counts
        | {
            "others": others if np.isfinite(excess) else 0,
            "excess": excess,
            "noise": few,
            "nats": nats,
            "least": LESS_PROBABLE,
            "lonely": lonely,
        },
    )


def determined(weak: tuple[Weakness, ...]) -> Check:
    """Whether the records determine every parameter."""
    return Check.none_of(
        weak,
        name="every parameter is determined",
        identifier="identifiability",
        quantity="identifiability of the parameters",
        facts={"weak": weak},
    )


def gap_is_noise(gap: Gap, expected: float = 1.0) -> Check:
    """Whether what is left is no larger than the noise.

    Parameters
    ----------
    expected : float
        Gap of a perfect model: less than 1 where errors of inputs are fitted, more where noise grows with the load.
    """
    ratio, limit = total(gap), GAP_OF_NOISE * expected
    named: dict[str, Any] = {"identifier": SIZE, "quantity": "residual size", "about": "model"}
    return Check(name="the gap is noise", passed=ratio <= limit, statistic=ratio, threshold=limit, **named)


def signal_explained(gaps: Gap) -> Check:
    """Whether what is left beyond the noise is small against each signal.

    Parameters
    ----------
    gaps : Gap
        That of a driving force has no noise.
    """
    shares = {name: _unexplained(gap.explained, gap) for name, gap in gaps.items() if gap.explained is not None}
    worst = max(shares, key=lambda name: shares[name], default="")
    share = shares.get(worst, 0.0)
    # A driving force is not simulated: the balance it is known by knows the acceleration badly.
    unusable = any(left > USELESS for name, left in shares.items() if gaps[name].noise is not None)
    return Check(
        name="the signal is explained",
        passed=share <= UNEXPLAINED,
        statistic=share,
        threshold=UNEXPLAINED,
        fatal=unusable,
        identifier=EXPLAINED,
        quantity="share of the signal that is explained",
        facts={"channel": worst, "unusable": unusable, "useless": USELESS},
    )


def useless(check: Check, weight: Outweighed | None) -> Check:
    """A signal that is not explained, where what is left outweighs a value.

    Parameters
    ----------
    check : Check
        As `signal_explained` has it.
    weight : Outweighed or None
        Which value; None where there is none.
    """
    if check.passed or check.fatal or weight is None:
        return check
    return check.model_copy(update={"fatal": True, "facts": {**check.facts, "outweighed": weight}})


def falls_freely(found: Gravity) -> Check:
    """Whether gravity in free flight is the one the study states, beyond what chance and place may make of it."""
    facts = {"excess": found.excess, "error": found.error}
    name, quantity = "free flight has the stated gravity", "gravity in free flight"
    return _beyond_chance(facts, GRAVITY_OFF, name=name, identifier="free_flight", quantity=quantity)


def measured_at_once(found: Lag) -> Check:
    """Whether force and position are of the same time by Newton's law, chance and friction allowed for."""
    facts = {"late": found.late, "error": found.error}
    name, quantity = "force and position are of the same time", "time between force and position"
    return _beyond_chance(facts, LATE_FORCE, name=name, identifier="lag", quantity=quantity)


def _beyond_chance(facts: dict[str, float], limit: float, **named: str) -> Check:
    """Whether what was found, with its standard error, is within a limit but for what chance may make of it."""
    off, error = facts.values()
    beyond = max(abs(off) - CHANCE * error, 0.0)
    return Check(passed=beyond <= limit, statistic=beyond, threshold=limit, facts=facts, **named)


def explained_otherwise(found: Alternative) -> Check:
    """What is said of records that one thing more explains: by how much a value would be another."""
    return Check(
        name="nothing else explains the records",
        passed=False,
        fatal=found.factor > FACTOR,
        statistic=found.factor,
        threshold=FACTOR,
        identifier=OTHERWISE,
        quantity="what else explains the records",
        facts={"alternative": found},
    )


def known_to_a_factor(found: Doubtful) -> Check:
    """Whether what the model lacks leaves every value of use: the error bars that allow for it tell."""
    most = 1.0 - 1.0 / FACTOR
    return Check(
        name="no value may be off by a factor",
        passed=found.share <= most,
        fatal=True,
        statistic=found.share,
        threshold=most,
        identifier=DOUBTFUL,
        quantity="size of the values",
        facts={"doubtful": found, "factor": FACTOR},
    )


def bars_too_small(why: Why) -> list[Check]:
    """What is said of an estimate whose error bars are for noise alone, though what it leaves is not; else nothing."""
    if why.identifier != "loses_less" or not why.left:
        return []
    failed = Check(
        name="error bars allow for what is left",
        passed=False,
        identifier=BARS,
        quantity="size of the error bars",
        facts={"failed": why.left},
    )
    return [failed]


def exchanged() -> Check:
    """What is said of records whose force is the smoother one, and which the model does not explain."""
    return Check(
        name="force and position are in their places",
        passed=False,
        fatal=True,
        identifier="exchanged_channels",
        quantity="columns of force and position",
    )


def _unexplained(explained: float, gap: ChannelGap) -> float:
    """Share of the variance of a signal that is left and is not noise."""
    noise = gap.noise or 0.0
    return (1.0 - explained) * max(1.0 - (GAP_OF_NOISE * noise / gap.rms) ** 2, 0.0) if gap.rms > 0.0 else 0.0


def inputs_within_noise(errors: Mapping[str, InputErrorSummary]) -> list[Check]:
    """Whether what had to be taken off each measured input is no larger than its noise, where that is looked for.

    Errors are looked for at the frequencies that move the weight: a logger's noise at all the others is no excuse.
    """
    return [
        Check(
            name=f"the {name} is as measured",
            passed=0.0 < error.times_expected <= INPUT_ERROR,
            statistic=error.times_expected,
            threshold=INPUT_ERROR,
            identifier=f"{name}_error",
            quantity=f"error of the measured {name}",
            about="model",
        )
        for name, error in errors.items()
    ]


def noise_seen(noise: dict[str, Noise], given: tuple[str, ...]) -> Check:
    """Whether the noise was measured, not guessed."""
    guessed = tuple(channel for channel, seen in noise.items() if seen.samples == 0 and channel not in given)
    return Check.none_of(
        guessed,
        name="the noise is known",
        identifier="noise_level",
        quantity="noise level",
        about="model",
        facts={"channels": guessed},
    )


def at_bound(value: float, error: float, limits: Range) -> bool:
    """Whether an estimate is stopped by a limit: nearer to it than a tenth of its error."""
    tolerance = AT_BOUND * error if np.isfinite(error) else 0.0
    return limits.at_bound(value, max(tolerance, 1e-9 * limits.scale))
