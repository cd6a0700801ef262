"""The terminal report of a fit: what was found, how sure it is, what to doubt, what to do next.

Our own words are plain ASCII, so that any terminal shows them; names that come from files stay as they are.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping
from functools import partial

from fibrefit.core.formatting import format_quantity, format_share, shown_unit
from fibrefit.report.checks import GLOSSARY, failures, notes_on_records, passes
from fibrefit.report.layout import (
    LONGEST_RECORD_NAME,
    decimals_of,
    items,
    paragraph,
    section,
    shortened,
    shortened_names,
    table,
    titled,
)
from fibrefit.report.sentences.alike import between_sentence, taken_alike_sentence
from fibrefit.report.sentences.minima import multistart_sentence
from fibrefit.sampling.thresholds import PRIOR_MATTERS, SAME_WIDTH
from fibrefit.study.summaries.check import OTHERWISE, above_noise, failed_model_checks
from fibrefit.study.summaries.results import (
    ChannelGap,
    ConditionSummary,
    FitResultSummary,
    Gap,
    ParameterSummary,
    RecordSummary,
)

#: Longest name of a parameter that leaves room for its numbers.
LONGEST_NAME = 28

ABOUT_RECORDS = "Records and their conditions"

#: Records listed by name; the rest are counted.
MOST_RECORDS = 12

VERDICTS = {
    "ok": "Every check of the numbers passed.",
    "suspect": "Read these numbers with care: the fit came to an end, but not all of its checks passed.",
    "failed": "Do not use these numbers: the fit itself cannot be relied on.",
}

#: How the standard errors were found.
ERROR_METHODS = {
    "white": "Standard errors assume white noise.",
    "spectrum": "Standard errors follow from the residual spectrum, taken as white + 1/f (pink) noise.",
    "newey_west": "Standard errors allow for autocorrelated noise (Newey-West).",
    "windows": "Standard errors allow for errors that grow along each window (windows drawn anew).",
    "whitened": "Standard errors are those of the whitened likelihood (GLS), differences between records allowed for.",
    "discrepancy": "Standard errors allow for what the model lacks: residuals alike at like states count as one "
    "(cluster-robust sandwich).",
    "block_bootstrap": "Standard errors come from a block bootstrap of the residuals.",
}


#: What the reported standard errors are compared with.
NAIVE = "under white noise"
NAIVE_OF_GLS = "those of ordinary least squares (OLS) under white noise"
GLS = "generalised least squares"

#: One line that says what the gap is.
GAP = "Gap: normalised residual RMS, measured minus simulated over the noise; 1 is expected."


def fit_report(summary: FitResultSummary) -> str:
    """Report of a fit in at most 80 columns; no line break at its end."""
    sections = [
        titled(summary.study, summary.status),
        paragraph(f"{headline(summary)} {_verdict(summary)} {_left(summary)}".strip()),
        section("What was found", _found(summary)),
        section("How sure it is", _sure(summary)),
        section(ABOUT_RECORDS, about_records(summary.records)),
        section("What to doubt", doubts(summary)),
        section("What to do next", items(summary.advice)),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


def _verdict(summary: FitResultSummary) -> str:
    """What the status means; where one thing more explains the records, that."""
    cause = next((one for one in summary.checks if one.identifier == OTHERWISE and not one.passed and one.fatal), None)
    return VERDICTS[summary.status] if cause is None else f"Do not use these numbers. {cause.says}"


def headline(summary: FitResultSummary) -> str:
    """What share of each signal is explained, and how far model and measurement differ; empty where it is not known."""
    said = [
        f"{explained_told(gap.explained, channel)}, within {format_quantity(gap.rms, gap.unit, 3)} rms"
        for channel, gap in summary.gap.channels.items()
        if gap.explained is not None and math.isfinite(gap.rms)
    ]
    return f"The model explains {'; '.join(said)}." if said else ""


def explained_told(share: float, channel: str) -> str:
    """What share of a channel is explained; that there is none, where its mean does better."""
    return f"{format_share(share)} of the {channel}" if share >= 0.0 else f"less of the {channel} than its mean does"


def known_quantity(value: float, unit: str, digits: int = 3) -> str:
    """A quantity in SI in the unit a person would choose, or that it is not known, as where nothing was simulated."""
    return format_quantity(value, unit, digits) if math.isfinite(value) else "not known"


def _left(summary: FitResultSummary) -> str:
    """Whether what is left is noise."""
    found = failed_model_checks(summary.checks)
    total = "" if summary.gap.total is None else f" ({summary.gap.total:.3g} times it)"
    if summary.status == "failed":
        return ""
    if not found:
        return "What is left is noise." if summary.status == "ok" else ""
    if not above_noise(found):
        return f"What is left is no larger than the noise{total}; what is to be doubted all the same stands below."
    bars = "error bars allow for it, and " if summary.bars_allow else ""
    return f"What is left is more than the noise{total}: {bars}the model lacks something."


def with_error(value: float, error: float | None, unit: str) -> tuple[str, str, str]:
    """Value and error bar to the digits that mean something, in the unit a person would choose.

    Parameters
    ----------
    value, error : float
        In `unit`; no error bar where `error` is None.
    unit : str
        SI unit.

    Returns
    -------
    tuple of str
        Value, error bar (empty if there is none) and unit.
    """
    chosen, worth = shown_unit(value if value else error or 0.0, unit)
    value = value / worth
    if not error:
        return f"{value:.5g}", "", chosen
    decimals = decimals_of(error / worth)
    return f"{value:.{decimals}f}", f"{error / worth:.{decimals}f}", chosen


def quantity_text(value: float, error: float | None, unit: str) -> str:
    """``14.69 +/- 0.03 kN/m``; a pure number has no unit, and what has no error bar none."""
    shown, bar, chosen = with_error(value, error, unit)
    return f"{shown}{f' +/- {bar}' if bar else ''}{'' if chosen == '-' else f' {chosen}'}"


def _found(summary: FitResultSummary) -> list[str]:
    rows = [
        row
        for name, parameter in summary.parameters.items()
        for row in rows_of(name, partial(parameter_row, parameter=parameter))
    ]
    lines = table(("", "value", "+/-", "unit", "95 % interval"), rows, right={1, 2})
    lines += tables_by_record(summary)
    if summary.effects:
        lines += [paragraph(f"The model: the base model and {', '.join(summary.effects)}.")]
    return lines + list(map(paragraph, said_of_values(summary)))


def tables_by_record(summary: FitResultSummary) -> list[str]:
    """Tables of parameters that each record has for itself."""
    return [line for name in summary.own_parameters for line in _by_record(name, summary.records)]


def said_of_values(summary: FitResultSummary) -> list[str]:
    """What is said of a table of values: of means, of priors, of how records differ, and what else was found."""
    said = (
        population_sentence(summary.parameters),
        *prior_sentences(summary.parameters),
        between_sentence(summary.between_records),
        taken_alike_sentence(summary),
        *summary.findings,
    )
    return [one for one in said if one]


def _by_record(name: str, records: Mapping[str, RecordSummary]) -> list[str]:
    """Table of a parameter that each record has for itself."""
    found = {record: one.parameters[name] for record, one in records.items() if name in one.parameters}
    short = shortened_names(list(found)[:MOST_RECORDS], LONGEST_NAME)
    rows = [parameter_row(label, found[record]) for record, label in short.items()]
    lines = table((f"{name} of", "value", "+/-", "unit", "95 % interval"), rows, right={1, 2})
    others = len(found) - len(rows)
    return lines + ([paragraph(f"and of {others} more, as summary.json lists them.")] if others else [])


def population_sentence(parameters: Mapping[str, ParameterSummary]) -> str:
    """What the mark of a mean says in a table of parameters; empty where none has it."""
    if not any(map(_is_mean, parameters.values())):
        return ""
    return (
        "Value and interval of a parameter marked (mean) are those of the mean of the population of records; all "
        "others are those of a value that all records share."
    )


def _is_mean(parameter: ParameterSummary) -> bool:
    """Whether value and interval are those of the mean of the population of records."""
    return parameter.interval_kind == "population"


def prior_sentences(parameters: Mapping[str, ParameterSummary]) -> list[str]:
    """For each parameter with a prior, how much of its error bar the records leave of it."""
    said = []
    for name, one in parameters.items():
        if one.prior_centre is None or not one.prior_error or one.std_error is None:
            continue
        share = one.std_error / one.prior_error
        prior = quantity_text(one.prior_centre, one.prior_error, one.unit)
        word = "is held by" if share > SAME_WIDTH else "rests also on" if share > PRIOR_MATTERS else "hardly hangs on"
        width = f"{100.0 * share:.0f} %" if share < 1.0 else "all"
        said.append(f"{name} {word} its prior, {prior}: its error is {width} of the prior's.")
    return said


def rows_of(name: str, row: Callable[[str], tuple[str, ...]]) -> list[tuple[str, ...]]:
    """The `row` of a name; a name that would make the table too wide stands in two rows."""
    effect, dot, last = name.rpartition(".")
    return [row(name)] if len(name) <= LONGEST_NAME else [(f"{effect}{dot}", "", "", "", ""), row(f"  {last}")]


def parameter_row(name: str, parameter: ParameterSummary) -> tuple[str, ...]:
    """Name, value, error bar, unit and interval of a parameter, or what stands in place of the interval.

    The name of one that records differ in says that it is their mean.
    """
    name = f"{name} (mean)" if _is_mean(parameter) else name
    value, error, unit = with_error(parameter.value, parameter.std_error, parameter.unit)
    shown = "" if unit == "-" else unit
    if not parameter.free:
        return name, value, "", shown, "held"
    if parameter.std_error is None or parameter.interval_95 is None:
        # What a prediction takes over is known to its error, and has no interval of its own.
        unknown = "not determined" if parameter.std_error is None else ""
        return name, value, error, shown, "at its bound" if parameter.at_bound else unknown
    low, high = alike_in_digits(parameter.interval_95, parameter.value, parameter.std_error, parameter.unit)
    if parameter.at_bound:
        below, above = (abs(parameter.value - limit) for limit in parameter.interval_95)
        return name, value, error, shown, f"at most {high}" if below <= above else f"at least {low}"
    return name, value, error, shown, f"{low} to {high}"


def alike_in_digits(numbers: Iterable[float], value: float, error: float, unit: str) -> tuple[str, ...]:
    """Further numbers in the unit, and to the digits, in which a value stands with its error bar; all in `unit`."""
    worth = shown_unit(value if value else error, unit)[1]
    decimals = len(with_error(value, error, unit)[1].partition(".")[2])
    return tuple(f"{number / worth:.{decimals}f}" for number in numbers)


def earlier_value(then: ParameterSummary, now: ParameterSummary, error: str) -> str:
    """An earlier value in the unit, and to the digits, of the later one and its error bar."""
    if error and now.std_error is not None:
        return alike_in_digits([then.value], now.value, now.std_error, now.unit)[0]
    worth = shown_unit(now.value if now.value else now.std_error or 0.0, now.unit)[1]
    return f"{then.value / worth:.5g}"


def _sure(summary: FitResultSummary) -> list[str]:
    lines = _gap_table(summary)
    lines += _records(summary)
    lines += input_noise(summary)
    if summary.estimator_says:
        lines += [paragraph(summary.estimator_says)]
    if summary.error_method:
        method = ERROR_METHODS.get(summary.error_method, f"Method of the error bars: {summary.error_method}.")
        factor = summary.error_inflation
        naive = NAIVE_OF_GLS if summary.estimator == GLS else NAIVE
        wider = "" if factor is None else f" They are {factor:.1f} times as wide as {naive}."
        lines += [paragraph(method + wider)]
    lines += [paragraph(text) for text in (_correlated(summary), _counted(summary)) if text]
    if summary.starts is not None:
        lines += [paragraph(multistart_sentence(summary.starts))]
    return lines


def _correlated(summary: FitResultSummary) -> str:
    """Pairs that records determine together; which fits of other kinds of result do not tell."""
    if not summary.correlations:
        return ""
    named = ", ".join(f"{a} and {b} {pair.correlation:+.2f}" for pair in summary.correlations for a, b in [pair.pair])
    return f"Correlated beyond 0.7, so that their error bars belong together: {named}."


def _counted(summary: FitResultSummary) -> str:
    counts = summary.statistics
    if counts is None:
        return ""
    bic = "" if counts.bic is None else f", BIC {counts.bic:,.0f} (for models of the same records)"
    size = f"{counts.samples:,} samples, {counts.free_values} free values"
    return f"{size}: chi-square {counts.chi_square:,.0f}{bic}."


def _gap_table(summary: FitResultSummary) -> list[str]:
    rows = [_gap_row(channel, gap) for channel, gap in summary.gap.channels.items()]
    if summary.gap.total is not None:
        rows.append(("total", "", "", "", f"{summary.gap.total:.2f}"))
    lines = table(("residuals", "explained", "rms", "noise", "gap"), rows, right={1, 2, 3, 4})
    return [*lines[:-1], paragraph(GAP), ""] if lines else []


def _gap_row(channel: str, gap: ChannelGap) -> tuple[str, ...]:
    noise = "" if gap.noise is None else format_quantity(gap.noise, gap.unit, 3)
    explained = "" if gap.explained is None else format_share(gap.explained)
    ratio = "" if gap.ratio is None else f"{gap.ratio:.2f}"
    return channel, explained, known_quantity(gap.rms, gap.unit), noise, ratio


def size_of(gap: Gap) -> float:
    """The gap by which records are put in order, worst first: none is worse than one that is not known."""
    return math.inf if gap.total is None else gap.total


def _records(summary: FitResultSummary) -> list[str]:
    """Gap of each record, worst first; nothing where there is only one."""
    if len(summary.records) < 2:
        return []
    worst = sorted(summary.records.items(), key=lambda item: -size_of(item[1].gap))
    channels = list(summary.gap.channels)
    rows, short = [], shortened_names([name for name, _ in worst[:MOST_RECORDS]], LONGEST_RECORD_NAME)
    for name, record in worst[:MOST_RECORDS]:
        gaps = [record.gap.channels.get(channel) for channel in channels]
        ratios = [f"{gap.ratio:.2f}" if gap is not None and gap.ratio is not None else "" for gap in gaps]
        masked = str(record.masked) if record.masked else ""
        rows.append((short[name], *ratios, masked))
    lines = table(("gap by record, worst first", *channels, "masked"), rows, right=set(range(1, len(channels) + 2)))
    others = len(worst) - len(rows)
    return lines + ([paragraph(f"and {others} more with smaller gaps.")] if others else [])


def conditions_told(records: Mapping[str, RecordSummary]) -> tuple[str, dict[str, dict[str, str]]]:
    """Conditions that all records have alike, in a sentence, and by name those of each record in which they differ."""
    told = {
        record: {name.replace("_", " "): _condition(one) for name, one in of.conditions.items()}
        for record, of in records.items()
    }
    first, *others = told.values()
    alike = {name: text for name, text in first.items() if others and all(of.get(name) == text for of in others)}
    said = ", ".join(f"{name} {text}" for name, text in alike.items())
    own = {record: {name: text for name, text in of.items() if name not in alike} for record, of in told.items()}
    return f"All records: {said}." if said else "", own


def _condition(one: ConditionSummary) -> str:
    """``10 mm``, with its error where it has one; of one that no study states it is said."""
    told = format_quantity(one.value, one.unit, 6)
    told = quantity_text(one.value, one.std_error, one.unit) if one.std_error else told
    return f"{told} (found)" if one.found else told


def about_records(records: Mapping[str, RecordSummary]) -> list[str]:
    """What all records have alike, then the files and the conditions of each; nothing where neither is known."""
    shown = [name for name, one in records.items() if one.files or one.conditions][:MOST_RECORDS]
    if not shown:
        return []
    (alike, own), short = conditions_told(records), shortened_names(shown, LONGEST_RECORD_NAME)
    lines = [paragraph(alike)] if alike else []
    for name in shown:
        files = [shortened(file, LONGEST_RECORD_NAME) for file in records[name].files if file != name]
        place = f" ({', '.join(files)})" if files else ""
        said = ", ".join(f"{condition} {text}" for condition, text in own[name].items())
        lines += items([f"{short[name]}{place}: {said}".removesuffix(": ")])
    others = len(records) - len(shown)
    return lines + ([f"and {others} more, as summary.json lists them."] if others else [])


def input_noise(summary: FitResultSummary) -> list[str]:
    """The correction of each measured input (errors in variables), and the gap expected then."""
    lines = []
    for name, error in summary.input_errors.items():
        rms, noise = (format_quantity(value, error.unit, 2) for value in (error.rms, error.noise))
        text = f"The measured {name} was corrected by {rms} rms (errors in variables); its noise is {noise}"
        if error.looked_for is not None:
            text += f", {format_quantity(error.looked_for, error.unit, 2)} of it where errors are looked for"
        text += "."
        if error.rms == 0.0:
            text = f"The {name} was taken as it was measured; its noise is {noise}."
        if not math.isfinite(error.rms):
            text = f"What the measured {name} was corrected by is not known; its noise is {noise}."
        if summary.expected_gap is not None:
            text += f" The expected gap of a perfect model is {summary.expected_gap:.2f}."
        lines.append(paragraph(text))
    return lines


def doubts(summary: FitResultSummary) -> list[str]:
    """Checks that failed, notes on records, and the names of checks that passed."""
    return failures(summary.checks) + items(notes_on_records(summary.records)) + passes(summary.checks)
