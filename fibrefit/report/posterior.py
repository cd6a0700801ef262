"""The terminal report of a posterior: parameters, sampling, predictive performance, failed checks."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

from scipy.special import ndtri, stdtrit

from fibrefit.core.formatting import in_words
from fibrefit.report.checks import GLOSSARY, failures, passes
from fibrefit.report.layout import items, paragraph, section, shortened, table, titled
from fibrefit.report.sentences.alike import between_sentence
from fibrefit.report.text import alike_in_digits, rows_of, with_error
from fibrefit.sampling.thresholds import PARETO_K, PRIOR_MATTERS
from fibrefit.series.thresholds import SIGNIFICANT
from fibrefit.study.summaries.check import Check
from fibrefit.study.summaries.part import Measure
from fibrefit.study.summaries.results import ComparedModel, PosteriorParameter, PosteriorSummary

VERDICTS = {
    "ok": "The chains converged and every check passed: this posterior can be believed as far as its model can.",
    "suspect": "Read this posterior with care: not all of its checks passed.",
    "failed": "Do not use these numbers: the chains have not converged to the posterior.",
}

KINDS = {"equal_tailed": "equal-tailed", "highest_density": "highest-density"}

ENDS = {"converged": "Converged", "budget": "Stopped by the budget before convergence", None: "Ended"}

#: What to do where a check failed, by its identifier.
REMEDIES = {
    "residual_size": "Run fibrefit discover on this study: it looks for what the model lacks.",
    "hausman": "Run fibrefit discover on this study: it looks for what the model lacks.",
    "initial_fit": "Look at fibrefit fit first: the chains are initialised around that fit.",
    "second_mode": "Measure one more record that tells the modes apart; fibrefit distinguish says which "
    "conditions differ most.",
    "posterior_correlation": "Hold one of the correlated parameters, give it a prior, or measure under other "
    "conditions.",
    "contraction": "Hold what the data do not determine at a known value, or measure under conditions that show it.",
    "truncation": "Try the model without the effect whose strength reaches zero, and compare "
    "both with --compare: these records may not show it at all.",
    "distance_from_fit": "Look at the records of fibrefit fit: where OLS and GLS estimates differ, an "
    "effect is missing or the search ended in another minimum.",
    "proper_priors": "Give the parameters with an improper prior one in the study, or bounds on both sides.",
    "nuts": "Resume with a larger --ess and cross-check with --nuts again; if they still differ, believe neither.",
}


def posterior_report(summary: PosteriorSummary) -> str:
    """Report of a posterior in at most 80 columns; no line break at its end."""
    sections = [
        titled(summary.study, summary.status),
        paragraph(VERDICTS[summary.status]),
        section("What is known", _known(summary)),
        section("Sampling", _sampling(summary)),
        section("Predictive performance (cross-validation)", _predictive(summary)),
        section("What to doubt", failures(summary.checks) + passes(summary.checks)),
        section("What to do next", items(summary.advice)),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


def posterior_advice(checks: Sequence[Check], converged: bool, with_nuts: bool) -> tuple[str, ...]:
    """What to do next, the most useful first."""
    said = [REMEDIES[check.identifier] for check in checks if not check.passed and check.identifier in REMEDIES]
    if not converged:
        said.append(
            "Go on with --resume and a larger --max-steps or --max-seconds: the chains are kept beside this result."
        )
    if not said and not with_nuts:
        said.append("Where much depends on it, cross-check with NUTS: --nuts.")
    return tuple(dict.fromkeys(said))


def _known(summary: PosteriorSummary) -> list[str]:
    known = summary.parameters.items()
    rows = [row for name, found in known for row in rows_of(name, partial(posterior_row, found=found))]
    interval = f"{100 * summary.interval_probability:g} % interval"
    lines = table(("", "mean", "sd", "unit", interval), rows, right={1, 2})
    kind = KINDS[summary.interval_kind]
    lines.append(paragraph(f"{100 * summary.interval_probability:g} % {kind} credible intervals."))
    if summary.effects:
        lines.append(paragraph(f"The model: the base model and {', '.join(summary.effects)}."))
    lines += [paragraph(said) for said in filter(None, [between_sentence(summary.between_records)])]
    own = sorted({name for found in summary.records.values() for name in found})
    if own:
        lines.append(paragraph(f"Each record has its own {in_words(own)}: see summary.json."))
    return lines + _priors(summary)


def posterior_row(name: str, found: PosteriorParameter) -> tuple[str, ...]:
    """Name, mean, standard deviation, unit and interval of a value, all numbers in that unit."""
    value, error, unit = with_error(found.mean, found.sd, found.unit)
    low, high = alike_in_digits(found.interval, found.mean, found.sd, found.unit)
    return name, value, error, "" if unit == "-" else unit, f"{low} to {high}"


def _priors(summary: PosteriorSummary) -> list[str]:
    own = {f"{name}[{record}]": one for record, values in summary.records.items() for name, one in values.items()}
    strong = [
        f"The prior of {name} matters: {found.prior}; posterior / prior width {100 * found.prior_share:.0f} %."
        for name, found in {**summary.parameters, **own}.items()
        if found.prior_share is not None and found.prior_share >= PRIOR_MATTERS
    ]
    assumed = "; ".join(f"{name}: {found.prior}" for name, found in summary.parameters.items() if found.prior)
    lines = [paragraph(f"Priors: {assumed}.")] if assumed else []
    every = [*summary.parameters.values(), *own.values()]
    shares = [found.prior_share for found in every if found.prior_share is not None]
    said = "No prior has a width that could be compared with the posterior's."
    if shares:
        said = f"Prior influence is negligible: posterior / prior width ({100 * max(shares):.2g} % or less for all)."
    return lines + (items(strong) or [paragraph(said)])


def _sampling(summary: PosteriorSummary) -> list[str]:
    every = [*summary.parameters.values(), *(found for own in summary.records.values() for found in own.values())]
    worst_r = max((p.r_hat for p in every if p.r_hat is not None), default=None)
    ess = min((min(p.ess_bulk, p.ess_tail) for p in every if p.ess_bulk and p.ess_tail), default=None)
    steps = "" if summary.steps is None else f", {summary.steps} steps (warm-up of {summary.warm_up} discarded)"
    lines = [paragraph(f"{summary.ensembles} ensembles of {summary.walkers} walkers{steps}.")]
    said = [ENDS[summary.ended]]
    if worst_r is not None and ess is not None:
        said.append(f"max. R-hat {worst_r:.4f}, min. bulk/tail ESS {ess:.0f}")
    if summary.acceptance is not None:
        said.append(f"acceptance {100 * summary.acceptance:.0f} %")
    lines.append(paragraph("; ".join(said) + "."))
    if summary.likelihood_says:
        lines.append(paragraph(summary.likelihood_says))
    lines += [paragraph(remark) for remark in summary.remarks]
    return lines


def _predictive(summary: PosteriorSummary) -> list[str]:
    lines = []
    if summary.covered:
        shares = ", ".join(f"{100 * share:.1f} % of {channel}" for channel, share in summary.covered.items())
        lines.append(paragraph(f"Posterior predictive check, samples inside the 90 % band: {shares}."))
    if summary.cross_validation is not None:
        ahead = summary.cross_validation
        lines.append(
            paragraph(
                f"PSIS-LOO over {ahead.blocks} time blocks, each left out in turn: elpd_loo = {ahead.total.value:.1f} "
                f"+/- {ahead.total.error:.1f}, p_loo = {ahead.effective_parameters:.1f}; Pareto k > {PARETO_K:g} in "
                f"{ahead.unsure} block{'s' * (ahead.unsure != 1)}."
            )
        )
    if summary.log_evidence is not None:
        evidence = summary.log_evidence
        lines.append(paragraph(f"Log marginal likelihood: {evidence.value:.2f} +/- {evidence.error:.2f}."))
    return lines + _rivals(summary.compared)


def _rivals(rivals: Sequence[ComparedModel]) -> list[str]:
    rows, said = [], []
    for rival in rivals:
        evidence = "" if rival.log_evidence is None else f"{rival.log_evidence.value:+.1f}"
        name = shortened(", ".join(rival.effects) or f"base model, {rival.result}", 30)
        rows.append((name, _with_its_error(rival.elpd), evidence, better_model(rival)))
        said += [f"Against {name}: {one}" for one in _doubts(rival)]
    lines = table(("this model against", "delta elpd_loo", "log Bayes factor", "better"), rows, right={1, 2})
    return ["", *lines, *map(paragraph, said)] if lines else []


def better_model(rival: ComparedModel) -> str:
    """Which of two models predicts better; unreliable where that rests on blocks whose figure is."""
    whole = _better_by(rival.elpd, rival.blocks)
    if not rival.unsure or rival.blocks is None:
        return whole
    sure = None if rival.elpd_sure is None else _better_by(rival.elpd_sure, rival.blocks - rival.unsure)
    return whole if whole == sure else "unreliable"


def _better_by(difference: Measure, blocks: int | None) -> str:
    """Which one predicts better, by a difference that is known from how it scatters between so many blocks."""
    share = 1.0 - 0.5 * SIGNIFICANT
    most = float(ndtri(share) if blocks is None else stdtrit(blocks - 1, share)) * difference.error
    return "alike" if abs(difference.value) <= most else "this one" if difference.value > 0.0 else "the other"


def _with_its_error(measure: Measure) -> str:
    return f"{measure.value:+.1f} +/- {measure.error:.1f}"


def _doubts(rival: ComparedModel) -> list[str]:
    """What a comparison does not rest on, and how it would be without."""
    said = []
    if rival.unsure:
        others = "too few others" if rival.elpd_sure is None else f"the others: {_with_its_error(rival.elpd_sure)}"
        said.append(f"Pareto k > {PARETO_K:g} under one of both in {rival.unsure} of {rival.blocks} blocks; {others}.")
    if not rival.same_noise:
        said.append(
            "noise is of another kind there, and marginal likelihoods do not pay for the numbers of its spectrum: they "
            "are not compared. Sample both with the same --noise."
        )
    return said
