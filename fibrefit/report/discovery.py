"""The terminal report of a discovery: the verdict, how it was reached, and what the records say before and after."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence

import numpy as np

from fibrefit.core.formatting import from_to, in_words, or_others, shown_unit
from fibrefit.report.checks import GLOSSARY
from fibrefit.report.confusion import strength
from fibrefit.report.layout import (
    LONGEST_RECORD_NAME,
    items,
    numbered,
    paragraph,
    section,
    shortened,
    shortened_names,
    table,
    titled,
)
from fibrefit.report.sentences.discovery import by_chance
from fibrefit.report.text import (
    ABOUT_RECORDS,
    GAP,
    MOST_RECORDS,
    about_records,
    doubts,
    earlier_value,
    input_noise,
    parameter_row,
    quantity_text,
    said_of_values,
    size_of,
    tables_by_record,
    with_error,
)
from fibrefit.report.text_plot import WIDTH as ACROSS
from fibrefit.report.text_plot import text_plot
from fibrefit.study.summaries.discovery import (
    Before,
    Candidate,
    DiscoverySummary,
    ListedCandidates,
    ProposedLawSummary,
    listed_candidates,
)
from fibrefit.study.summaries.results import Gap, ParameterSummary

MOST_CANDIDATES = 6
"""Candidates of a round that are listed; the rest are counted."""
LONGEST_CURVE = 68
ARROW = " -> "
EVIDENCE = (
    "Evidence: natural logarithm of the Bayes factor against the model before. An effect is named from 5 on: it makes "
    "the records 150 times as probable; how many were tried is counted in what is said of chance. Of candidates far "
    "behind the best it is that which they were found with, times the share that the best one kept of its own."
)


ROUNDS = (
    "Values of a round are those of the search, which fits all models in one noise; those of the first and the final "
    "fit stand below."
)

NOT_IN_THE_GAP = (
    "So the residuals do not show what was added: without it, errors of measured inputs, differences between records "
    "or slow noise take it up. What these cost counts in the Bayes factor, and the name rests on that."
)


def discovery_report(summary: DiscoverySummary) -> str:
    """Report of a discovery in at most 80 columns; no line break at its end."""
    sections = [
        titled(paragraph(verdict_line(summary))),
        paragraph(_opening(summary)),
        section("What the records say", items(summary.statements)),
        section("How it was found", _rounds(summary)),
        section("Effect size", items(found.says for found in summary.weights)),
        section("Where the first model goes wrong", _places(summary)),
        section("What is missing, as a law", _law(summary)),
        section("What is missing, as a curve", _curves(summary)),
        section("The gap before and after" if summary.added else "The gap", _gaps(summary)),
        *_tried(summary),
        section(UNFINISHED, items(unfinished_parts(summary))),
        section("Detection limits: smallest strength that these records would show", _detectable(summary)),
        section("What cannot be distinguished", items(map(alike_sentence, summary.cannot_tell_apart))),
        section("What it does to the parameters" if summary.added else "The parameters", _parameters(summary)),
        section(ABOUT_RECORDS, about_records(summary.records)),
        section("What to doubt", doubts(summary)),
        section("What to do next", items(summary.advice)),
        GLOSSARY,
    ]
    return "\n\n".join(filter(None, sections))


UNFINISHED = "What the time did not suffice for"
MOST_NAMED = 12
"""Effects that are named one by one."""


def unfinished_parts(summary: DiscoverySummary) -> list[str]:
    """What a search that ran out of time did not come to, in sentences; nothing where it came to its end."""
    names = _in_short(summary.untried)
    if not (summary.rounds or summary.ranking):
        names = f"any of the {len(summary.untried)} effects that make sense on this rig"
    untried = [f"Not tried: {names}."] if summary.untried else []
    said = [*untried, *(f"Not done: {part}." for part in summary.undone)]
    return [*said, "--time gives more, and --resume goes on from what was found."] if said else []


def _in_short(names: Sequence[str]) -> str:
    """Names of effects; of many, how many act in each place."""
    if len(names) <= MOST_NAMED:
        return ", ".join(names)
    places = Counter(name.partition(".")[0] for name in names)
    counts = ", ".join(f"{number} {place}.*" for place, number in places.items())
    return f"{len(names)} effects, {counts}; summary.json lists them under untried"


def verdict_line(summary: DiscoverySummary) -> str:
    """The verdict in one line, e.g. ``NAMED: guide.viscous_friction``."""
    if summary.verdict == "named":
        return f"NAMED: {in_words(or_others(name, summary.cannot_tell_apart) for name in summary.added)}"
    if summary.verdict == "unexplained":
        if summary.proposed_law is not None:
            return f"UNEXPLAINED: {_asked_for(summary.proposed_law)}"
        looks = summary.unexplained.looks_like if summary.unexplained else None
        return f"UNEXPLAINED: looks like {looks}" if looks else "UNEXPLAINED"
    if summary.verdict == "not_trusted":
        return f"NOT TRUSTED: {summary.reason}"
    return "NOTHING MISSING"


def _asked_for(law: ProposedLawSummary) -> str:
    """What the records ask for, in words."""
    return f"the records ask for {law.says[:1].lower()}{law.says[1:].rstrip('.')}"


def _opening(summary: DiscoverySummary) -> str:
    number = len(summary.records)
    said = [f"{summary.study}, {number} record{'s' * (number != 1)}."]
    if summary.verdict != "not_trusted":
        said.append(summary.reason)
    after = summary.gap.total
    before = summary.before.gap.total if summary.before else None
    expected = "1" if summary.expected_gap is None else f"{summary.expected_gap:.2f}"
    if summary.added and before is not None and after is not None:
        said.append(f"The normalised residual RMS (gap) {from_to(before, after, '.2f')}, expected {expected}.")
        said += not_in_the_gap(summary)
    elif after is not None:
        said.append(f"The normalised residual RMS (gap) is {after:.2f}, expected {expected}.")
    if summary.verdict == "unexplained" and summary.added:
        said.append(f"{in_words(summary.added)} helped, but that is not the whole of it.")
    if summary.provenance is not None and summary.provenance.seconds is not None:
        said.append(f"The search took {_duration(summary.provenance.seconds)}.")
    return " ".join(said)


def not_in_the_gap(summary: DiscoverySummary) -> list[str]:
    """What is said where residuals do not show what was added."""
    before, after = None if summary.before is None else summary.before.gap.total, summary.gap.total
    if not summary.added or before is None or after is None or round(after, 2) < round(before, 2):
        return []
    return [NOT_IN_THE_GAP]


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"


def _rounds(summary: DiscoverySummary) -> list[str]:
    """What each round added, and whose values its sentence tells."""
    rounds = numbered(found.sentence for found in summary.rounds)
    return [*rounds, paragraph(ROUNDS)] if rounds else []


def _places(summary: DiscoverySummary) -> list[str]:
    short = shortened_names(dict.fromkeys(place.record for place in summary.places), LONGEST_RECORD_NAME - 6)
    rows = [
        (
            short[place.record],
            place.channel,
            f"{place.from_s:.3f}",
            f"{place.to_s:.3f}",
            place.phase,
            f"{100 * place.share:.0f} %",
        )
        for place in summary.places
    ]
    return table(("record", "channel", "from / s", "to / s", "phase", "share"), rows, right={2, 3, 5})


def _law(summary: DiscoverySummary) -> list[str]:
    """The law that was composed, with its numbers, and how it does beside others."""
    law = summary.proposed_law
    if law is None:
        return []
    rows = [
        (one.symbol, name, value, error, "" if unit == "-" else unit)
        for name, one in law.parameters.items()
        for value, error, unit in [with_error(one.value, one.std_error, one.unit)]
    ]
    shown = [f"    {law.expression}", "", *table(("", "", "value", "+/-", "unit"), rows, right={2, 3}), ""]
    first, *others = law_sentences(law)
    return [paragraph(first), "", *shown, *map(paragraph, others)]


def law_sentences(law: ProposedLawSummary) -> list[str]:
    """What is said of a law that was composed: how it does first, then what its equation and its file are."""
    numbers = law.parameters.values()
    told = (f"{one.symbol} = {quantity_text(one.value, one.std_error, one.unit)}" for one in numbers)
    said = f"No catalogued effect does it; {_asked_for(law)}, {', '.join(told)}. "
    said += f"With it, the gap {from_to(law.gap_before, law.gap_after, '.3g')} "
    said += f"(logarithm of the Bayes factor {law.evidence:.3g}"
    said += f"{by_chance(law.false_alarm, 'some law')})"
    if law.gap_left_out is not None and law.gap_left_out_before is not None:
        said += f"; records predicted from the others leave {law.gap_left_out:.3g}, without it "
        said += f"{law.gap_left_out_before:.3g}"
        if law.elpd_left_out is not None:
            said += f", and are {law.elpd_left_out:.3g} nats more probable with it"
    else:
        said += "; it was not held against records left out, as there is one alone, or the time ended"
    first, *second = law.variables
    where = f"x is the {first}"
    if law.valid_range is not None:
        low, high = law.valid_range
        where += (
            f", which the records saw from {low:.3g} to {high:.3g} {law.variable_units[0]}; beyond that it is a guess"
        )
    if second:
        where += f"; y is the {second[0]}"
        if second[0] == "direction":
            where += " (1 in the direction of +, -1 against it)"
        elif law.second_at_most is not None and len(law.variable_units) > 1:
            where += f", which the records saw up to {law.second_at_most:.3g} {law.variable_units[1]}"
        where += "; the picture has the law where y is 0"
    nearest = [f"Next: {one.says} It is {-one.evidence:.3g} nats behind." for one in law.runners_up[:1]]
    file = f"As an effect of your own: {law.effect}, used by study.toml beside this result (--trust runs it)."
    return [f"{said}.", f"{where}.", *nearest, file]


def _curves(summary: DiscoverySummary) -> list[str]:
    """The best curve in letters, and how the others did; nothing where there is none."""
    curves = summary.unexplained.curves if summary.unexplained else ()
    if not curves:
        return []
    best = curves[0]
    unit, worth = shown_unit(float(np.max(np.abs(best.knots))), best.unit)
    high, size = shown_unit(float(np.max(np.abs(best.heights))), best.height_unit)
    x = np.linspace(best.knots[0], best.knots[-1], ACROSS)
    heights = np.interp(x, best.knots, best.heights) / size
    errors = [error / size for error in best.std_errors if error is not None]
    said = f"{best.says[:1].upper()}{best.says[1:]}: with it, the gap is {best.gap_after:.2f}."
    if errors:
        good = f"{np.median(errors):.2g} {high}".removesuffix(" -")
        said += f" The heights are good to {good} (median standard error)."
    lines = [paragraph(said), *text_plot(f"{best.variable} / {unit}", high, x / worth, np.zeros(ACROSS), heights), ""]
    others = [(shortened(curve.says, LONGEST_CURVE), f"{curve.gap_after:.3f}") for curve in curves[1:]]
    return lines + table(("other curves", "gap after"), others, right={1})


def _gaps(summary: DiscoverySummary) -> list[str]:
    """One row a record, worst first, and one for all: each channel, and leave-one-record-out."""
    before = summary.before if summary.added else None
    held = {item.record: (item.gap_before, item.gap_after) for item in summary.held_out}
    channels = list(summary.gap.channels)
    worst = sorted(summary.records, key=lambda name: -_size(summary, before, name))
    short = shortened_names(worst[:MOST_RECORDS], LONGEST_RECORD_NAME)
    rows = [
        (
            short[name],
            *_ratios(before.records[name] if before else None, summary.records[name].gap, channels),
            _change(*held[name]) if name in held else "",
        )
        for name in worst[:MOST_RECORDS]
    ]
    rows.append(("all records", *_ratios(before.gap if before else None, summary.gap, channels), ""))
    lines = table(("gap (RMS / noise)", *channels, "left out"), rows, right=set(range(1, len(channels) + 2)))
    if len(worst) > len(rows) - 1:
        lines.insert(-2, f"and {len(worst) - len(rows) + 1} more records with smaller gaps")
    lines.append(paragraph(GAP))
    lines += input_noise(summary)
    if held:
        lines.append(
            paragraph(
                '"Left out": leave-one-record-out cross-validation, that record predicted from a fit to the others; '
                "only its own zero and start are fitted."
            )
        )
    return lines


def _size(summary: DiscoverySummary, before: Before | None, name: str) -> float:
    return size_of(before.records[name] if before else summary.records[name].gap)


def _ratios(before: Gap | None, after: Gap, channels: Sequence[str]) -> list[str]:
    cells = []
    for channel in channels:
        now = after.ratio_of(channel)
        then = before.ratio_of(channel) if before else None
        cells.append("" if now is None else f"{now:.2f}" if then is None else _change(then, now))
    return cells


def _change(before: float, after: float) -> str:
    return f"{before:.2f}{ARROW}{after:.2f}"


def _detectable(summary: DiscoverySummary) -> list[str]:
    """A row for each effect that would have been found had it been there."""
    rows = [(one.effect, one.parameter, strength(one)) for one in summary.detectable]
    return table(("effect", "parameter", "would show from"), rows, right={2})


def _tried(summary: DiscoverySummary) -> list[str]:
    """The candidates of each round; those of the last look where none was added."""
    if not summary.rounds:
        return [section("What was tried", _candidates(summary.ranking))]
    if len(summary.rounds) == 1:
        return [section("What was tried", _candidates(summary.rounds[0].ranking, summary.rounds[0].added))]
    return [
        section(f"What was tried in round {number}", _candidates(found.ranking, found.added))
        for number, found in enumerate(summary.rounds, 1)
    ]


def _candidates(ranking: Sequence[Candidate], added: str | None = None) -> list[str]:
    ranked = listed_candidates(ranking, MOST_CANDIDATES, added or "")
    rows = [row for candidate in ranked.shown for row in _candidate_rows(candidate)]
    lines = table(("effect", "gap after", "evidence", "its values"), rows, right={1, 2})
    if ranked.others:
        lines.insert(-1, others_listed(ranked))
    return [*lines, paragraph(EVIDENCE)] if lines else []


def others_listed(ranked: ListedCandidates) -> str:
    """What is said of candidates that are not listed one by one."""
    gain = "gains" if ranked.others == 1 else "gain"
    return f"and {ranked.others} more {'with less evidence' if ranked.gain else f'that {gain} nothing'}"


def evidence_text(candidate: Candidate) -> str:
    """Evidence without decimals, and without the sign of what rounds to nothing."""
    return f"{round(candidate.evidence) or 0:d}"


def _candidate_rows(candidate: Candidate) -> list[tuple[str, ...]]:
    names = candidate.effect.split(" + ")
    values = [_value(parameter) for parameter in candidate.parameters.values()]
    numbers = (f"{candidate.gap_after:.3f}", evidence_text(candidate))
    lines = max(len(names), len(values), 1)
    named = [name if i == 0 else f"+ {name}" for i, name in enumerate(names)] + [""] * (lines - len(names))
    said = values + [""] * (lines - len(values))
    return [(named[i], *(numbers if i == 0 else ("", "")), said[i]) for i in range(lines)]


def _value(parameter: ParameterSummary) -> str:
    """A value with its error; the name is left out, the unit tells."""
    return quantity_text(parameter.value, parameter.std_error, parameter.unit)


def alike_sentence(names: Sequence[str]) -> str:
    """That records do not tell some effects apart."""
    return f"These records do not tell {' from '.join(names)}."


def _parameters(summary: DiscoverySummary) -> list[str]:
    """Values before and after, with the intervals of the final ones; those of an effect under its name."""
    before = summary.before.parameters if summary.before and summary.added else {}
    rows: list[tuple[str, ...]] = []
    headings: dict[int, str] = {}
    for i, (name, parameter) in enumerate(summary.parameters.items()):
        effect, _, last = name.rpartition(".")
        if effect and effect not in headings.values():
            headings[i] = effect
        label, value, error, unit, interval = parameter_row(f"  {last}" if effect else name, parameter)
        then = before.get(name)
        rows.append((label, earlier_value(then, parameter, error) if then else "", value, error, unit, interval))
    lines = table(("", "before", "after" if before else "value", "+/-", "unit", "95 % interval"), rows, right={1, 2, 3})
    # A name beside the columns would push them over the edge.
    for i, effect in reversed(headings.items()):
        lines.insert(i + 1, effect)
    return [*lines, *tables_by_record(summary), *map(paragraph, said_of_values(summary))]
