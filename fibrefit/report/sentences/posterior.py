"""Sentences of the checks of a posterior, by their identifiers: quantity, number, threshold, consequence."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

from fibrefit.core.declarations import Statement
from fibrefit.core.formatting import in_words
from fibrefit.report.sentences.fit import differ_within_sentence, hausman_sentence, worded
from fibrefit.report.sentences.thresholds import HEAVY_TAILS
from fibrefit.study.summaries.check import Check

if TYPE_CHECKING:
    from fibrefit.sampling.density.likelihood import NoiseModel
    from fibrefit.sampling.density.prior import Prior

VALUES_NAMED = 3
"""Values by which a mode is described."""


def posterior_sentence(check: Check) -> str:
    """What a check of a posterior found."""
    return SENTENCES[check.identifier](check)


def posterior_checks(checks: tuple[Check, ...]) -> tuple[Check, ...]:
    """Checks of a posterior with the sentences that explain them."""
    return tuple(worded(check, posterior_sentence(check)) for check in checks)


def remark(found: Statement) -> str:
    """What a reader should know besides the checks."""
    return REMARKS[found.identifier](found)


def _gls_gains(found: Statement) -> str:
    factors = ", ".join(f"{name} {share:.2f}" for share, name in found.facts["factors"])
    return (
        "Noise is autocorrelated: the standard errors of generalised least squares (GLS) are below those of ordinary "
        f"least squares (OLS) on the same records, by these factors: {factors}."
    )


REMARKS: dict[str, Callable[[Statement], str]] = {
    "records_alike": lambda found: (
        "Records are taken for alike: no values were found that are most probable if they may differ. Where fibrefit "
        "fit finds that they differ, these intervals are too narrow and values may be off by several of them."
    ),
    "inputs_moving": lambda found: (
        f"Errors of the measured inputs still moved by {found.facts['moving']:.2g} of their standard deviations when "
        "readings were last linearised in them: values may be off by as large a share of their errors."
    ),
    "gls_gains": _gls_gains,
}
"""By identifier."""


def likelihood_sentence(model: NoiseModel) -> str:
    """Which likelihood was taken, and why."""
    words, numbers = model.described()
    words = f"Likelihood: {words % numbers}"
    if model.requested != "auto":
        as_what = "a fit finds it from what the model leaves" if model.requested == "fit" else "requested"
        return f"{words}, as {as_what}.{_tails(model)}"
    best = model.scores[model.kind]
    others = [f"{name} is {best - score:.4g}" for name, score in model.scores.items() if name != model.kind]
    return (
        f"{words}; chosen because it explains the residuals best: {in_words(others)} less likely (log likelihood, "
        f"corrected for the numbers each contains).{_tails(model)}"
    )


def _tails(model: NoiseModel) -> str:
    """A remark where residuals have heavier tails than a normal law."""
    if model.likelihood.heavy:
        return f" Student's t likelihood, as requested (excess kurtosis {model.kurtosis:.2g})."
    if model.kurtosis < HEAVY_TAILS:
        return ""
    return (
        f" Residuals have heavier tails than normal noise (excess kurtosis {model.kurtosis:.2g}): where no missing "
        "physics explains this, Student's t is the better likelihood."
    )


def prior_words(prior: Prior, unit: str) -> str:
    """A prior in words; `unit` is the SI unit of its numbers."""
    unit = "" if unit == "-" else f" {unit}"
    limits = f"{prior.lower:.4g} to {prior.upper:.4g}{unit}"
    if prior.even:
        return f"{'log-uniform' if prior.log else 'uniform'}, {limits}"
    half = not prior.log and prior.centre == prior.lower == 0.0
    if prior.log:
        text = f"log-normal, median {prior.centre:.4g}{unit}, factor {math.exp(prior.spread):.4g}"
    elif half:
        text = f"half-normal, sd {prior.spread:.4g}{unit}"
    else:
        text = f"normal, {prior.centre:.4g} +/- {prior.spread:.4g}{unit}"
    natural = 0.0 if prior.log or half else -math.inf
    return text if prior.lower == natural and prior.upper == math.inf else f"{text}, within {limits}"


def _convergence(check: Check) -> str:
    most, worst = check.threshold, check.facts["worst"]
    if check.passed:
        number = check.facts["ensembles"]
        return f"R-hat between {number} ensembles is at most {check.statistic:.4f} ({worst}), threshold {most:g}."
    return (
        f"R-hat between ensembles is {check.statistic:.4g} for {worst}, threshold {most:g}: the chains have not "
        "converged within the budget. Resume with a larger one, or look for several modes."
    )


def _effective_sample_size(check: Check) -> str:
    size, end = f"{check.statistic:.4g} at least ({check.facts['worst']})", "."
    if not check.passed:
        end = ": the budget ended before there were enough draws. Resume with a larger one."
    return f"The bulk/tail effective sample size is {size}, threshold {check.threshold:g}{end}"


def _walker_mixing(check: Check) -> str:
    facts, value = check.facts, f"R-hat between walkers is {check.statistic:.3g}"
    if facts["stuck"]:
        return (
            f"The acceptance of {100 * facts['stuck']:.2g} % of the walkers is below {100 * facts['least']:g} %: their "
            "draws are those of the start."
        )
    if check.passed:
        return f"{value} at most, threshold {check.threshold:g}; acceptance OK."
    return (
        f"{value} for {facts['worst']}, threshold {check.threshold:g}: there are several modes, or a strong "
        "correlation, and their weights depend on where the walkers started."
    )


def _second_mode(check: Check) -> str:
    others = check.facts["others"]
    if not others:
        return "No other mode was found."
    if check.passed:
        return f"{others} other mode{'s' * (others > 1)} found, of a weight below {check.threshold:.2g} together."
    listed = "; ".join(_mode(weight, values) for weight, values in check.facts["modes"])
    return (
        f"The posterior is multimodal: {listed}. Values and intervals are those of the first mode alone, never an "
        "average; another record must tell which is right."
    )


def _mode(weight: float, values: tuple[tuple[str, float, str], ...]) -> str:
    named = ", ".join(f"{name} = {value:.4g} {unit}" for name, value, unit in values[:VALUES_NAMED])
    return f"weight {weight:.2g} at {named}{', ...' if len(values) > VALUES_NAMED else ''}"


def _contraction(check: Check) -> str:
    facts = check.facts
    if not check.passed:
        return (
            f"Posterior / prior width of {', '.join(facts['nothing'])} exceeds {check.threshold:g} (largest "
            f"{check.statistic:.2f}): the data tell nothing of it, and what is reported is the prior."
        )
    if not facts["matters"]:
        return f"Posterior / prior width is {check.statistic:.2g} at most: prior influence is negligible."
    matters = ", ".join(facts["matters"])
    return f"Posterior / prior width is {check.statistic:.2f} at most: the prior of {matters} matters."


def _posterior_correlation(check: Check) -> str:
    if check.passed:
        return f"The strongest posterior |correlation| is {check.statistic:.2f}, threshold {check.threshold:g}."
    return (
        f"The posterior |correlation| of {in_words(check.facts['pair'])} is {check.statistic:.4f}, threshold "
        f"{check.threshold:g}: only a combination of them is determined, and the interval of either alone says little."
    )


def _distance_from_fit(check: Check) -> str:
    begin = f"The posterior mean is {check.statistic:.3g} standard deviations from what the fit reports, threshold"
    if check.passed:
        return f"{begin} {check.threshold:.3g}."
    return (
        f"{begin} {check.threshold:.3g} (most of it in {check.facts['worst']}): the fit is not at its best, or OLS and "
        "GLS estimates differ."
    )


def _proper_priors(check: Check) -> str:
    if check.passed:
        return "Every prior is proper."
    return (
        f"The prior of {', '.join(check.facts['parameters'])} is improper (unbounded). The posterior is proper only "
        "because the data bound it, and there is no marginal likelihood to compare models by."
    )


def _truncation(check: Check) -> str:
    if check.passed:
        return "No posterior is truncated by a bound."
    truncated = ", ".join(check.facts["parameters"])
    return f"The posterior of {truncated} is truncated by a bound: read its interval as one-sided."


def _residual_size(check: Check) -> str:
    if check.passed:
        size = f"largest normalised residual RMS {check.statistic:.3g}, threshold {check.threshold:g}"
        return f"No channel exceeds its noise level: {size}."
    return (
        f"The normalised residual RMS of {check.facts['channel']} is {check.statistic:.3g}, expected 1: what the model "
        "lacks is counted as noise, and the intervals are those of a wrong model. Run discover."
    )


def _nuts(check: Check) -> str:
    facts = check.facts
    says = (
        f"The means and standard deviations of the ensembles and of NUTS {'agree' if facts['alike'] else 'differ'}: by "
        f"{check.statistic:.2g} Monte-Carlo standard errors at most ({facts['of']} of {facts['worst']})."
    )
    (r_hat, worst, most), (divergent, draws, share) = facts["r_hat"], facts["divergent"]
    converged = f"R-hat of NUTS is {r_hat:.4g} at most ({worst}), threshold {most:g}"
    says = f"{says} {converged}{'.' if r_hat < most else ': its chains have not converged.'}"
    if not divergent:
        return says
    end = f", more than {100 * share:g} %: it misses a part of the posterior." if divergent > share * draws else "."
    return f"{says} {divergent} of {draws} transitions of NUTS were divergent{end}"


def _initial_fit(check: Check) -> str:
    end = "" if check.passed else " See what fibrefit fit says of this study."
    return f"The status of the fit the walkers are initialised around is {check.facts['status']}.{end}"


SENTENCES: dict[str, Callable[[Check], str]] = {
    "convergence": _convergence,
    "effective_sample_size": _effective_sample_size,
    "walker_mixing": _walker_mixing,
    "second_mode": _second_mode,
    "contraction": _contraction,
    "posterior_correlation": _posterior_correlation,
    "distance_from_fit": _distance_from_fit,
    "proper_priors": _proper_priors,
    "truncation": _truncation,
    "residual_size": _residual_size,
    "nuts": _nuts,
    "initial_fit": _initial_fit,
    "hausman": hausman_sentence,
    "between_records": differ_within_sentence,
}
"""By identifier."""
