"""The checks a fit is put to, and what each outcome means in plain words."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from fibrefit.core.check import Check
from fibrefit.fitting.identifiability import Weakness
from fibrefit.fitting.result import ChannelMisfit, Gap, InputError, Starts, total
from fibrefit.fitting.thresholds import (
    AGREEMENT,
    ASTRAY,
    AT_BOUND,
    DECIDED,
    FEW_STARTS,
    INPUT_ERROR,
    SETTLED,
    STARTS,
    UNEXPLAINED,
    USELESS,
    WORSE,
)
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.problem.statement.transform import Range
from fibrefit.problem.thresholds import GAP

CONVERGED = "convergence"
COMPLETION = "completion"
EXPLAINED = "explained_share"
SECOND: dict[str, Any] = {"identifier": "second_solver", "quantity": "agreement with a second solver"}


def converged(promised: float, success: bool) -> Check:
    """Whether the solver has arrived: its own word, and what another step would still gain."""
    passed = bool(success and promised <= SETTLED)
    says = (
        "The solver arrived at a minimum."
        if passed
        else f"The cost would fall by {promised:.3g} in another step; at most {SETTLED:g} is expected. The solver "
        "ended at a kink, where a bounce begins or ceases, or short of the minimum."
    )
    return Check(
        "the solver converged",
        passed,
        says,
        promised,
        SETTLED,
        fatal=not promised <= ASTRAY,
        identifier=CONVERGED,
        quantity="convergence of the solver",
    )


def finite(values: np.ndarray, trouble: np.ndarray, records: tuple[str, ...]) -> Check:
    """Whether simulation of the solution is sound."""
    named: dict[str, Any] = {"identifier": "simulation", "quantity": "soundness of the simulation"}
    if not np.isfinite(values).all():
        return Check("the simulation is sound", False, "The best simulation is not finite.", fatal=True, **named)
    bad = [name for name, flag in zip(records, trouble, strict=True) if flag]
    says = (
        f"The motion simulated for {', '.join(bad)} switches faster than can be followed."
        if bad
        else "All switches of the simulated motion were located."
    )
    return Check("the simulation is sound", not bad, says, float(len(bad)), 0.0, fatal=True, **named)


def second_solver(distance: float, gain: float) -> Check:
    """Whether another solver, with other coordinates, ends at the same place."""
    passed = distance <= AGREEMENT and gain <= SETTLED
    says = (
        "A second, independent solver ends at the same values."
        if passed
        else f"A second solver ends {distance:.2g} standard errors away, with a cost {abs(gain):.3g} "
        f"{'lower' if gain > 0 else 'higher'}; at most {AGREEMENT:g} is expected. The minimum is not a plain one."
    )
    return Check("a second solver agrees", passed, says, distance, AGREEMENT, **SECOND)


def no_second_solver() -> Check:
    """What is said where a second solver was not asked."""
    return Check("a second solver agrees", False, "A second solver was not asked.", **SECOND)


def interrupted(starts: Starts) -> Check:
    """What is said of a fit that was not let to its end."""
    planned = starts.planned or starts.tried
    says = f"Interrupted: {starts.tried} of {planned} starts came to an end"
    says += "; what should follow them was cut short." if starts.tried == planned else "; the best of them is kept."
    return Check(
        "the fit ran to its end",
        False,
        says,
        float(starts.tried),
        float(planned),
        identifier=COMPLETION,
        quantity="completion of the fit",
    )


def undecided(starts: Starts, noise: bool) -> bool:
    """Whether few starts found what leaves only noise, and residuals do not tell it from the next minimum."""
    few = FEW_STARTS <= starts.agreeing < STARTS * starts.tried
    return noise and few and _excess(starts) <= WORSE


def _excess(starts: Starts) -> float:
    """Residuals of the next minimum over those of the best."""
    others = starts.basin > 0
    return float(np.sqrt(starts.cost[others].min() / starts.cost.min())) if others.any() else np.inf


def starts_agree(starts: Starts, noise: bool = False, nats: float = 0.0) -> Check:
    """Whether most starts end in the best minimum, and what became of the others.

    A few are enough where the best one leaves only `noise` and the others clearly more: there is none below it.

    Parameters
    ----------
    starts : Starts
    noise : bool
    nats : float
        By how many the next minimum is less probable, errors of measured inputs taken off both; 0 where not known.
    """
    share = starts.agreeing / starts.tried
    says = f"{starts.agreeing} of {starts.tried} starts ended in the best minimum."
    excess = _excess(starts)
    if np.isfinite(excess):
        others = int(np.sum(starts.basin > 0))
        says += f" {others} ended in others, the nearest with residuals {excess:.3g} times as large"
        says += ": bounces matched in the wrong order are such minima."
    if (lost := int(np.sum(starts.basin < 0))) > 0:
        says += f" {lost} led nowhere and {'was' if lost == 1 else 'were'} given up."
    few = noise and starts.agreeing >= FEW_STARTS and (excess > WORSE or nats > DECIDED)
    if few and share < STARTS:
        says += " The best one leaves only noise: none can lie below it."
    elif share < STARTS:
        says += f" At least {100 * STARTS:.0f} % are expected: a better minimum may have been missed."
    return Check(
        "starts agree",
        share >= STARTS or few,
        says,
        share,
        STARTS,
        identifier="starts",
        quantity="agreement of the starts (multistart)",
    )


def inside_bounds(at_bound: list[str]) -> Check:
    """Whether no parameter was stopped by a bound."""
    says = (
        f"{', '.join(at_bound)} stopped at the bound: the data want a value beyond it, "
        "so the model or the bound is wrong."
        if at_bound
        else "No parameter lies at a bound."
    )
    return Check(
        "no parameter at a bound",
        not at_bound,
        says,
        float(len(at_bound)),
        0.0,
        identifier="bounds",
        quantity="distance of the parameters from their bounds",
    )


def determined(weak: tuple[Weakness, ...]) -> Check:
    """Whether the records determine every shared parameter."""
    says = " ".join(weakness.says for weakness in weak) or "The records determine every parameter."
    return Check(
        "every parameter is determined",
        not weak,
        says,
        float(len(weak)),
        0.0,
        identifier="identifiability",
        quantity="identifiability of the parameters",
    )


def gap_is_noise(gap: Gap, expected: float = 1.0) -> Check:
    """Whether what is left is no larger than the noise.

    Parameters
    ----------
    gap : Gap
    expected : float
        Gap of a perfect model: less than 1 where errors of inputs are fitted, more where noise grows with the load.
    """
    ratio, limit = total(gap), GAP * expected
    passed = ratio <= limit
    says = f"The residual RMS is {ratio:.3g} times the noise; at most {limit:.3g} is expected. "
    says += "There is nothing to explain." if passed else "The model lacks something."
    named: dict[str, Any] = {"identifier": "residual_size", "quantity": "residual size", "about": "model"}
    return Check("the gap is noise", passed, says, ratio, limit, **named)


def signal_explained(gaps: Mapping[str, ChannelMisfit]) -> Check:
    """Whether what is left beyond the noise is small against each signal.

    Parameters
    ----------
    gaps : mapping of channel to ChannelMisfit
        That of a driving force has no noise.
    """
    shares = {name: _unexplained(gap) for name, gap in gaps.items() if np.isfinite(gap.explained)}
    worst = max(shares, key=lambda name: shares[name], default="")
    share = shares.get(worst, 0.0)
    # A driving force is not simulated: the balance it is told by knows the acceleration badly.
    hopeless = any(left > USELESS for name, left in shares.items() if np.isfinite(gaps[name].noise))
    passed = share <= UNEXPLAINED
    says = f"Of no signal is more than {100.0 * UNEXPLAINED:g} % of the variance left beyond its noise."
    if not passed:
        says = (
            f"{100.0 * share:.2g} % of the variance of the {worst} is left beyond its noise; at most "
            f"{100.0 * UNEXPLAINED:g} % passes. So much may be taken up by the values: they may mislead."
        )
        if hopeless:
            says += f" Beyond {100.0 * USELESS:g} % they are of no use: a fault in what the study states is likelier."
    named: dict[str, Any] = {"identifier": EXPLAINED, "quantity": "share of the signal that is explained"}
    return Check("the signal is explained", passed, says, share, UNEXPLAINED, fatal=hopeless, **named)


def useless(check: Check, says: str) -> Check:
    """A signal that is not explained, where what is left outweighs a value.

    Parameters
    ----------
    check : Check
        As `signal_explained` has it.
    says : str
        Which value; empty where there is none.
    """
    return check if check.passed or check.fatal or not says else replace(check, fatal=True, says=f"{check.says} {says}")


def exchanged() -> Check:
    """What is said of records whose force is the smoother one, and which the model does not explain."""
    says = (
        "Force and position look exchanged: the position is rougher than the force, of which it is the double integral."
    )
    return Check(
        "force and position are in their places",
        False,
        f"{says} Exchange their columns under [channels], or their headings.",
        fatal=True,
        identifier="exchanged_channels",
        quantity="columns of force and position",
    )


def _unexplained(gap: ChannelMisfit) -> float:
    """Share of the variance of a signal that is left and is not noise."""
    noise = gap.noise if np.isfinite(gap.noise) else 0.0
    return (1.0 - gap.explained) * max(1.0 - (GAP * noise / gap.rms) ** 2, 0.0) if gap.rms > 0.0 else 0.0


def inputs_within_noise(errors: Mapping[str, InputError]) -> list[Check]:
    """Whether what had to be taken off each measured input is no larger than its noise."""
    checks = []
    for name, error in errors.items():
        ratio = error.rms / error.noise
        passed = 0.0 < ratio <= INPUT_ERROR
        if passed:
            says = f"The measured {name} was corrected within its noise."
        elif ratio == 0.0:
            says = f"The {name} was taken as it was measured: the model lacks more than an error of it could explain."
        else:
            says = (
                f"The error of the {name} would have to be {ratio:.3g} times its noise; at most {INPUT_ERROR:g} is "
                "expected. The model lacks something."
            )
        checks.append(
            Check(
                f"the {name} is as measured",
                passed,
                says,
                ratio,
                INPUT_ERROR,
                identifier=f"{name}_error",
                quantity=f"error of the measured {name}",
                about="model",
            )
        )
    return checks


def noise_seen(noise: dict[str, Noise], given: tuple[str, ...]) -> Check:
    """Whether the noise was measured, not guessed."""
    guessed = [channel for channel, seen in noise.items() if seen.samples == 0 and channel not in given]
    says = (
        f"The records hold no rest: noise of {', '.join(guessed)} is taken from fast changes alone and may be larger. "
        "State it under [noise] if it is known."
        if guessed
        else "Noise is known from records at rest or from the study."
    )
    return Check(
        "the noise is known",
        not guessed,
        says,
        float(len(guessed)),
        0.0,
        identifier="noise_level",
        quantity="noise level",
        about="model",
    )


def at_bound(value: float, error: float, limits: Range) -> bool:
    """Whether an estimate is stopped by a limit: nearer to it than a tenth of its error."""
    tolerance = AT_BOUND * error if np.isfinite(error) else 0.0
    return limits.at_bound(value, max(tolerance, 1e-9 * limits.scale))
