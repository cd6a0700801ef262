"""Sentences of the checks of a fit, by their identifiers: quantity, number, threshold, consequence."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import PurePath
from typing import TYPE_CHECKING

from fibrefit.core.formatting import format_quantity, in_words
from fibrefit.report.sentences.advised import lone_samples_advice, slack_zero_advice, slack_zero_sentence
from fibrefit.report.sentences.minima import completion_sentence, second_solver_sentence, starts_sentence
from fibrefit.report.sentences.otherwise import correct_advice, doubtful_sentence, otherwise_sentence
from fibrefit.report.sentences.residuals import (
    loudest_record_sentence,
    residual_phase_sentence,
    residual_spectrum_sentence,
    residual_state_sentence,
)
from fibrefit.study.summaries.check import Check

if TYPE_CHECKING:
    from fibrefit.fitting.result import Advice, Why
    from fibrefit.fitting.values import AtBound, Weakness

ERROR_OF_INPUT = "_error"
"""End of the identifier of a check of a measured input, which begins with its name."""


def fit_sentence(check: Check) -> str:
    """What a check of a fit found."""
    of = _input_error if check.identifier.endswith(ERROR_OF_INPUT) else SENTENCES[check.identifier]
    return of(check)


def fit_checks(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Checks of a fit with the sentences that explain them."""
    return tuple(worded(check, fit_sentence(check)) for check in checks)


def worded(check: Check, says: str) -> Check:
    """A check with the sentence that explains it."""
    return check.model_copy(update={"says": says})


def _convergence(check: Check) -> str:
    if check.passed:
        return "The solver arrived at a minimum."
    return (
        f"The cost would fall by {check.statistic:.3g} in another step; at most {check.threshold:g} is expected. The "
        "solver ended at a kink, where a bounce begins or ceases, or short of the minimum."
    )


def _simulation(check: Check) -> str:
    if not check.facts["finite"]:
        return "The best simulation is not finite."
    if check.passed:
        return "All switches of the simulated motion were located."
    return f"The motion simulated for {', '.join(check.facts['records'])} switches faster than can be followed."


def _bounds(check: Check) -> str:
    by_chance = [_one_sided(one) for one in check.facts["by_chance"]]
    if check.passed:
        return " ".join(by_chance) or "No parameter lies at a bound."
    stopped = ", ".join(map(_of_record, check.facts["parameters"]))
    says = (
        f"{stopped} stopped at the bound: the data want a value beyond it, by {check.statistic:.3g} standard errors; "
        f"chance explains {check.threshold:g} at the most. The model or the bound is wrong."
    )
    return " ".join([says, *by_chance])


def _one_sided(found: AtBound) -> str:
    """What is known of a value that chance may have brought to its bound."""
    limit, end = (format_quantity(value, found.unit, 3) for value in (found.limit, found.end))
    says = f"{_of_record(found.name)} is not distinguishable from {limit}"
    return f"{says}, at {'most' if found.above else 'least'} {end} (95 %)." if math.isfinite(found.end) else f"{says}."


def _identifiability(check: Check) -> str:
    return " ".join(map(weakness_sentence, check.facts["weak"])) or "The records determine every parameter."


MOST_SHARE = 10.0
"""Error over its value from which the number says nothing more."""


def weakness_sentence(weak: Weakness) -> str:
    """What the records do not determine."""
    *others, last = map(_of_record, weak.names)
    first = ", ".join(others)
    if weak.kind == "invisible":
        return f"{last} is not visible in these records: any value fits equally well."
    if weak.kind == "vague":
        share = f"{100 * weak.share:.0f} % of" if weak.share < MOST_SHARE else "far larger than"
        return f"{last} is hardly visible: its error is {share} its value."
    if weak.kind == "tied":
        return (
            f"Only a combination of {first} and {last} is determined (correlation {weak.correlation:.3f}): each unit "
            f"of {first} can be traded for {weak.slope:.3g} of {last}."
        )
    if not first:
        return f"{last} cannot be distinguished from the values that each record has for itself."
    return f"Only a combination of {first} and {last} is determined: they move the readings in the same way."


def estimator_sentence(why: Why) -> str:
    """Which estimate is reported, and why it is this one."""
    if why.identifier == "gls":
        return (
            "Generalised least squares (GLS, residuals pre-whitened with the fitted noise spectrum): each sample "
            "counts by what it adds to those before it, and records may differ in the rig's parameters. Error bars are "
            f"{why.ratio:.2g} times those of ordinary least squares in that noise."
        )
    if why.identifier == "loses_less":
        left = f" Residuals are not noise alone (failed: {', '.join(why.left)}): error bars are too small."
        return (
            "Generalised least squares (GLS): records differ, and values that all of them share lose bounces."
            f"{left if why.left else ''}{_not_arrived(why)}"
        )
    if why.identifier == "louder":
        return (
            "Generalised least squares (GLS): residuals have the structure of noise, which is louder than at rest "
            f"(failed: {', '.join(why.failed)}); error bars are for the noise that is left."
        )
    if why.identifier == "not_noise":
        left = f": what it leaves is not noise alone (failed: {', '.join(why.left)})"
        return (
            "Ordinary least squares (OLS). Generalised least squares (GLS) was set aside"
            f"{left if why.left else ''}.{_not_arrived(why)}"
        )
    return f"Ordinary least squares (OLS), no GLS step: {NO_GLS[why.identifier]}"


def _not_arrived(why: Why) -> str:
    return " Its search did not quite come to its end." if len(why.left) < len(why.failed) else ""


NO_GLS = {
    "robust": "a robust (soft-L1) loss was requested.",
    "no_end": "the search came to no end.",
    "no_time": "the time given ended before it was done.",
    "in_a_search": "a search weighs the evidence of what it adds itself.",
    "not_converged": "it did not converge.",
}
"""Why there is no GLS step."""


def advice_sentence(advice: Advice) -> str:
    """What to do next."""
    facts = advice.facts
    if advice.identifier == "force_alone":
        found = facts["determined"]
        each = [f"{name} over mass, {x:.4g} {unit} within {100.0 * e:.2g} %" for name, x, unit, e in found.per_mass]
        return (
            f"Force alone determines {in_words(each)}: stiffness, damping and friction themselves are as sure as "
            f"the mass that is stated, by which the load at rest is {found.load:.4g} N."
        )
    if advice.identifier == "correct":
        return correct_advice(facts["alternative"])
    if advice.identifier == "lone_samples":
        return lone_samples_advice(facts["alone"], facts["robust"])
    if advice.identifier == "slack_zero":
        return slack_zero_advice(facts["zeros"])
    if advice.identifier == "widen":
        names = ", ".join(facts["parameters"])
        return (
            f"Widen the bound of {names} under [parameters] if it was a guess, and fit again. If it is physics, the "
            "model lacks something: fibrefit discover."
        )
    if advice.identifier == "further_record":
        shown = [f"{name.replace('_', ' ')} {_condition(value, unit)}" for name, value, unit in facts["conditions"]]
        share = f"{100 * facts['share']:.0f} % of what it is"
        return f"A further record with {', '.join(shown)} would bring the largest relative error down to {share}."
    return ADVICE[advice.identifier]


def taken_for_exact(name: str, record: str, constant: bool) -> str:
    """What to do where record says how well a condition is known; constant is whether the rig may state it too."""
    said = (
        f'This fit takes {name} for exact, though record "{record}" says how well it is known: error bars leave that '
        "out."
    )
    instead = " State it under [rig] with its uncertainty: it is a parameter then, and widens what depends on it."
    return f"{said}{instead if constant else ' Trends of a series weigh it.'}"


def prior_not_weighed(name: str, shared: bool) -> str:
    """What is said of a prior that a fit leaves out; shared is whether all records have one value."""
    reason = "it says nothing but limits" if shared else "each record has a value of its own (shared = false)"
    instead = "State bounds where a fit is to keep within limits" if shared else "State bounds, or share the value"
    return f"This fit does not weigh the prior of {name}: {reason}. {instead}; fibrefit sample weighs it."


ADVICE = {
    "search": 'Run "fibrefit discover" on this study: it looks for what the model lacks and names it.',
    "rest": "Let a record begin before the motion and run on after it: rests tell the noise.",
    "way_back": "Motion in one direction tells the sum of friction and force_offset alone: record the way back too, or "
    'hold one of them, for example [parameters.force_offset] fixed = "0 N".',
    "another_test": "No further record of the usual kind would help much: the parameter needs another kind of test.",
}
"""By identifier."""


def _condition(value: float, unit: str) -> str:
    return f"{math.degrees(value):.3g} deg" if unit == "rad" else format_quantity(value, unit, 3)


def _residual_size(check: Check) -> str:
    end = "There is nothing to explain." if check.passed else "The model lacks something."
    size = f"{check.statistic:.3g} times the noise; at most {check.threshold:.3g} is expected"
    return f"The residual RMS is {size}. {end}"


def _explained_share(check: Check) -> str:
    facts, most = check.facts, 100.0 * (check.threshold or 0.0)
    if check.passed:
        return f"Of no signal is more than {most:g} % of the variance left beyond its noise."
    says = (
        f"{_percent(check.statistic or 0.0)} of the variance of the {facts['channel']} is left beyond its noise; "
        f"at most {most:g} % passes. So much may be taken up by the values: they may mislead."
    )
    if facts["unusable"]:
        limit = 100.0 * facts["useless"]
        says += f" Beyond {limit:g} % they are of no use: a fault in what the study states is likelier."
    if (weight := facts.get("outweighed")) is not None:
        name, value = weight.name.rpartition(".")[2].replace("_", " "), format_quantity(weight.value, weight.unit, 2)
        says += (
            f" What is left is {weight.ratio:.2g} times what the {name} of {value} does in the readings, at most "
            f"{weight.most:g} passes: this value may be off by a factor, and the fit is of no use."
        )
    return says


def _error_bars(check: Check) -> str:
    return (
        "The error bars are those of noise alone, and what is left is not noise alone (failed: "
        f"{', '.join(check.facts['failed'])}): they are too small, by how much is not known. Run discover for what the "
        "model lacks; until it has that, the scatter of values between records fitted one by one (batch) says more."
    )


def differ_within_sentence(check: Check) -> str:
    """How much more records may differ than is looked for, and what to do."""
    name, between, most = (check.facts[key] for key in ("parameter", "between", "most"))
    name, least = name.rpartition(".")[2].replace("_", " "), between.interval_95[0]
    if check.passed:
        return f"Records differ in the {name}, by less than the {100.0 * most:.0f} % that are looked for at the most."
    return (
        f"The {name} differs from record to record by at least {100.0 * least:.2g} %, and more than the "
        f"{100.0 * most:.0f} % that are looked for is as likely: the records make those {check.statistic:.2g} times as "
        f"probable as beforehand, at most {check.threshold:g} times passes. The interval of its mean is too narrow. "
        "Fit the records one by one (batch) or in groups that are alike, and look for a condition that is stated wrong."
    )


def _percent(share: float) -> str:
    return f"{100.0 * share:.2g} %" if share < 1.0 else f"{100.0 * share:.0f} %"


def _exchanged(check: Check) -> str:
    return (
        "Force and position look exchanged: the position is rougher than the force, of which it is the double "
        "integral. Exchange their columns under [channels], or their headings."
    )


def _free_flight(check: Check) -> str:
    excess, error = (100.0 * check.facts[name] for name in ("excess", "error"))
    found = (
        f"While the fibre is slack, the positions show a gravity along the guide {abs(excess):.2g} +/- {error:.1g} % "
        f"{'larger' if excess > 0.0 else 'smaller'} than the one that follows from the study"
    )
    if check.passed:
        return f"{found}: what is stated of clock, positions and slope agrees with the flights."
    return (
        f"{found}; chance allowed for, at most {100.0 * (check.threshold or 0.0):g} % passes. A clock or sampling rate "
        f"that is {abs(excess) / 2.0:.2g} % {'slow' if excess > 0.0 else 'fast'}, a wrong scale of the positions or a "
        "wrong slope, which study.inclination finds, would do so, and the values take it up: they may mislead."
    )


def _lag(check: Check) -> str:
    late, error = (1e3 * check.facts[name] for name in ("late", "error"))
    found = (
        f"In the contacts the force is {abs(late):.2g} +/- {error:.1g} ms {'later' if late > 0.0 else 'earlier'} than "
        "what the positions ask for by Newton's law, beyond what the model has"
    )
    if check.passed:
        return f"{found}: the two are of the same time."
    return (
        f"{found}; chance allowed for, at most {1e3 * (check.threshold or 0.0):g} ms passes. A delay or a filter in "
        "one of the two channels would do so, or a friction that the model lacks; damping takes it up and may mislead."
    )


def _input_error(check: Check) -> str:
    name = check.identifier.removesuffix(ERROR_OF_INPUT)
    if check.passed:
        return f"The measured {name} was corrected within its noise."
    if check.statistic == 0.0:
        return f"The {name} was taken as it was measured: the model lacks more than an error of it could explain."
    return (
        f"The error of the {name} would have to be {check.statistic:.3g} times its noise at the frequencies at "
        f"which it is looked for; at most {check.threshold:g} is expected. The model lacks something."
    )


def _noise_level(check: Check) -> str:
    if check.passed:
        return "Noise is known from records at rest or from the study."
    return (
        f"The records hold no rest: noise of {', '.join(check.facts['channels'])} is taken from fast changes alone and "
        "may be larger. State it under [noise] if it is known."
    )


def _agreement(check: Check) -> str:
    if check.passed:
        return "Single records ask for the same values, within their error bars."
    facts = check.facts
    ends = [format_quantity(end, facts["unit"], 3) for end in (facts["low"], facts["high"])]
    return (
        f"The {facts['parameter'].rpartition('.')[2].replace('_', ' ')} goes from {ends[0]} to {ends[1]} from record "
        f"to record, {facts['ratio']:.2g} times their error bars; a chance of {check.statistic:.2g}, at least "
        f"{check.threshold:g} is expected. What the model lacks changes this value with the conditions: it may mislead."
    )


def _force_balance(check: Check) -> str:
    return (
        f"Up to {check.facts['below']:g} Hz, {100.0 * (check.statistic or 0.0):.2f} % of the measured force is not "
        f"explained by inverse dynamics; at most {100.0 * (check.threshold or 0.0):g} % is expected."
    )


def hausman_sentence(check: Check) -> str:
    """Whether OLS and GLS estimates agree."""
    if check.passed:
        return "Plain and whitened estimates agree within their errors: the noise model hides no physics that shows."
    worst = ", ".join(f"{_of_record(name)} by {score:.2g}" for name, score in check.facts["worst"])
    return (
        f"Plain and whitened estimates differ with a probability of {check.statistic:.2g} by chance; at least "
        f"{check.threshold:g} is expected ({worst} standard errors of the difference). The model lacks something, and "
        "the noise model is explaining it away: run discover before you trust this."
    )


def _of_record(name: str) -> str:
    """``lift of "Fall 10mm"``, the record without its folder, for ``lift[../Mai/Fall 10mm.csv]``."""
    value, bracket, record = name.removesuffix("]").partition("[")
    return f'{value} of "{PurePath(record).stem}"' if bracket else name


SENTENCES: dict[str, Callable[[Check], str]] = {
    "convergence": _convergence,
    "simulation": _simulation,
    "second_solver": second_solver_sentence,
    "completion": completion_sentence,
    "starts": starts_sentence,
    "bounds": _bounds,
    "identifiability": _identifiability,
    "residual_size": _residual_size,
    "explained_share": _explained_share,
    "exchanged_channels": _exchanged,
    "slack_zero": slack_zero_sentence,
    "free_flight": _free_flight,
    "lag": _lag,
    "otherwise": otherwise_sentence,
    "doubtful_value": doubtful_sentence,
    "error_bars": _error_bars,
    "between_records": differ_within_sentence,
    "noise_level": _noise_level,
    "residual_spectrum": residual_spectrum_sentence,
    "residual_phase": residual_phase_sentence,
    "residual_state": residual_state_sentence,
    "loudest_record": loudest_record_sentence,
    "records_agree": _agreement,
    "force_balance": _force_balance,
    "hausman": hausman_sentence,
}
"""By identifier."""
