"""The terminal report of a posterior: what is known of each parameter, how it was learnt, what to doubt."""

from __future__ import annotations

import textwrap
from collections.abc import Sequence

from fibrefit.core.units import shown_unit
from fibrefit.report.layout import WIDTH, items, paragraph, section, shortened, table
from fibrefit.report.text import LONGEST_NAME, with_error
from fibrefit.study.summaries.summaries import CheckSummary, ComparedModel, PosteriorParameter, PosteriorSummary

VERDICTS = {
    "ok": "The chains agree and every check passed: this posterior can be believed as far as its model can.",
    "suspect": "Read this posterior with care: the chains came to an end, but not all checks passed.",
    "failed": "Do not use these numbers: the chains have not found the posterior.",
}

KINDS = {"equal_tailed": "equal tails", "highest_density": "highest density"}

MATTERS = 0.3
"""Share of the prior's width left, from which the prior is told beside the parameter."""

DECISIVE = 2.0
"""Standard errors by which one of two models must foretell better."""

#: What to do where a check failed, by its name.
REMEDIES = {
    "the residuals are noise": "Run fibrefit discover on this study: it looks for what the model lacks.",
    "plain and whitened estimates agree": "Run fibrefit discover on this study: it looks for what the model lacks.",
    "the fit before it held": "Look at fibrefit fit first: a posterior cannot be better than what it begins around.",
    "there is one mode": "Measure one more record that tells the modes apart; fibrefit confuse says which conditions "
    "differ most.",
    "parameters are told apart": "Hold one of the parameters that stand for one another, give it a prior, or measure "
    "under other conditions.",
    "the data taught every parameter": "Hold what the data do not see at a known value, or measure what shows it.",
    "no posterior leans against a limit": "Try the model without what leans against nil, and set the two against each "
    "other with --compare: these records may not show it at all.",
    "the posterior lies at the fit": "Look at the records of fibrefit fit: where plain and whitened residuals want "
    "different values, something is missing or the search ended elsewhere.",
    "every prior is proper": "Give the parameters without an end a prior of the study, or bounds on both sides.",
    "NUTS finds the same posterior": "Resume with a larger --ess and ask for --nuts again; if they still differ, "
    "believe neither.",
}


def posterior_report(summary: PosteriorSummary) -> str:
    """Report of a posterior in at most 80 columns.

    Parameters
    ----------
    summary : PosteriorSummary
        Content of ``summary.json``.

    Returns
    -------
    str
        Lines without a final line break.
    """
    sections = [
        _title(summary),
        paragraph(VERDICTS[summary.status]),
        section("What is known", _known(summary)),
        section("How it was learnt", _learnt(summary)),
        section("How well it foretells", _foretells(summary)),
        section("What to doubt", _doubts(summary)),
        section("What to do next", items(summary.advice)),
    ]
    return "\n\n".join(filter(None, sections))


def advice(checks: Sequence[CheckSummary], converged: bool, asked_nuts: bool) -> tuple[str, ...]:
    """What to do next, the most useful first.

    Parameters
    ----------
    checks : sequence of CheckSummary
    converged : bool
    asked_nuts : bool
    """
    said = [REMEDIES[check.name] for check in checks if not check.passed and check.name in REMEDIES]
    if not converged:
        said.append(
            "Go on with --resume and a larger --max-steps or --max-seconds: the chains are kept beside this result."
        )
    if not said and not asked_nuts:
        said.append("Where much depends on it, ask for a second opinion with --nuts.")
    return tuple(dict.fromkeys(said))


def _title(summary: PosteriorSummary) -> str:
    status = summary.status.upper()
    name = textwrap.shorten(summary.study, WIDTH - len(status) - 2, placeholder="...")
    return f"{name}{status:>{WIDTH - len(name)}}\n{'=' * WIDTH}"


def _known(summary: PosteriorSummary) -> list[str]:
    rows = [row for name, found in summary.parameters.items() for row in _rows(name, found)]
    interval = f"{100 * summary.interval_probability:g} % interval"
    lines = table(("", "mean", "sd", "unit", interval), rows, right={1, 2})
    lines.append(paragraph(f"Intervals have {KINDS[summary.interval_kind]}."))
    if summary.effects:
        lines.append(paragraph(f"The model: the base model and {', '.join(summary.effects)}."))
    alone = sorted({name for found in summary.records.values() for name in found})
    if alone:
        lines.append(paragraph(f"Each record has its own {' and '.join(alone)}: see summary.json."))
    return lines + _priors(summary)


def _rows(name: str, found: PosteriorParameter) -> list[tuple[str, ...]]:
    """Row of a parameter; a name that would make the table too wide stands in two rows."""
    effect, dot, last = name.rpartition(".")
    if len(name) <= LONGEST_NAME:
        return [_row(name, found)]
    return [(f"{effect}{dot}", "", "", "", ""), _row(f"  {last}", found)]


def _row(name: str, found: PosteriorParameter) -> tuple[str, ...]:
    value, error, unit = with_error(found.mean, found.sd, found.unit)
    worth = shown_unit(found.mean if found.mean else found.sd, found.unit)[1]
    decimals = len(error.partition(".")[2])
    low, high = (f"{limit / worth:.{decimals}f}" for limit in found.interval)
    return name, value, error, "" if unit == "-" else unit, f"{low} to {high}"


def _priors(summary: PosteriorSummary) -> list[str]:
    everything = {**summary.parameters}
    told = [
        f"The prior of {name} matters: {found.prior}; {100 * found.prior_share:.0f} % of its width is left."
        for name, found in everything.items()
        if found.prior_share is not None and found.prior_share >= MATTERS
    ]
    assumed = "; ".join(f"{name}: {found.prior}" for name, found in everything.items() if found.prior)
    lines = [paragraph(f"Priors: {assumed}.")] if assumed else []
    return lines + (items(told) or [paragraph("No prior matters: the data say far more of every parameter.")])


def _learnt(summary: PosteriorSummary) -> list[str]:
    every = [*summary.parameters.values(), *(found for own in summary.records.values() for found in own.values())]
    worst_r = max((p.r_hat for p in every if p.r_hat is not None), default=None)
    ess = min((min(p.ess_bulk, p.ess_tail) for p in every if p.ess_bulk and p.ess_tail), default=None)
    ended = {"converged": "They ran until they agreed", "budget": "The budget ended the run", None: "They ended"}
    steps = "" if summary.steps is None else f" of {summary.steps} steps, the first {summary.warm_up} left out"
    lines = [paragraph(f"{summary.ensembles} ensembles of {summary.walkers} walkers{steps}.")]
    said = [ended[summary.ended]]
    if worst_r is not None and ess is not None:
        said.append(f"R-hat at most {worst_r:.4f}, effective draws {ess:.0f} or more")
    if summary.acceptance is not None:
        said.append(f"{100 * summary.acceptance:.0f} % of the moves accepted")
    lines.append(paragraph("; ".join(said) + "."))
    if summary.likelihood_says:
        lines.append(paragraph(summary.likelihood_says))
    lines += [paragraph(remark) for remark in summary.remarks]
    return lines


def _foretells(summary: PosteriorSummary) -> list[str]:
    lines = []
    if summary.covered:
        shares = ", ".join(f"{100 * share:.1f} % of {channel}" for channel, share in summary.covered.items())
        lines.append(paragraph(f"Samples inside the 90 % bands of new measurements: {shares}."))
    if summary.foresight is not None:
        ahead = summary.foresight
        lines.append(
            paragraph(
                f"Log density of {ahead.blocks} blocks of time, each left out in turn: {ahead.total.value:.1f} +/- "
                f"{ahead.total.error:.1f}, with {ahead.effective_parameters:.1f} effective parameters"
                + (f"; {ahead.unsure} of them cannot be relied on." if ahead.unsure else ".")
            )
        )
    if summary.log_evidence is not None:
        evidence = summary.log_evidence
        lines.append(paragraph(f"Log marginal likelihood: {evidence.value:.2f} +/- {evidence.error:.2f}."))
    return lines + _rivals(summary.compared)


def _rivals(rivals: Sequence[ComparedModel]) -> list[str]:
    rows = []
    for rival in rivals:
        difference, error = rival.foresight.value, rival.foresight.error
        better = "alike" if abs(difference) <= DECISIVE * error else "this one" if difference > 0.0 else "the other"
        evidence = "" if rival.log_evidence is None else f"{rival.log_evidence.value:+.1f}"
        name = shortened(", ".join(rival.effects) or f"base model, {rival.result}", 32)
        rows.append((name, f"{difference:+.1f} +/- {error:.1f}", evidence, better))
    lines = table(("this model against", "left out", "evidence", "better"), rows, right={1, 2})
    return ["", *lines] if lines else []


def _doubts(summary: PosteriorSummary) -> list[str]:
    failed = [check for check in summary.checks if not check.passed]
    passed = [check.name for check in summary.checks if check.passed]
    lines = items(f"{check.name}: {check.says}" for check in failed)
    if passed:
        lines.append(paragraph(f"{'Passed' if failed else 'All checks passed'}: {'; '.join(passed)}."))
    return lines
