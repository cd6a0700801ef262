"""The page of a discovery: what the model lacked, and how it was found."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.report.confusion import strength
from fibrefit.report.discovery import (
    EVIDENCE,
    UNFINISHED,
    alike_sentence,
    evidence_text,
    law_sentences,
    not_in_the_gap,
    others_listed,
    unfinished_parts,
    verdict_line,
)
from fibrefit.report.page.blocks import Block, PageContent, Records, Result, Step, Story, TableBlock, Words
from fibrefit.report.page.common import ARROW, changed, gaps_table, page_content, records_table, values_tables
from fibrefit.report.page.records import CourseModel, Sight, fit_bands, records_block, simulated
from fibrefit.report.text import with_error
from fibrefit.study.summaries.discovery import Candidate, DiscoverySummary, listed_candidates
from fibrefit.study.summaries.part import Groups
from fibrefit.study.summaries.results import Gap
from fibrefit.study.thresholds import LEAST_LISTED

MOST_CANDIDATES = 8
STATUS = {"named": "ok", "nothing_missing": "ok", "unexplained": "suspect", "not_trusted": "failed"}
FROM_BEST = ("ok", "suspect", "failed")
"""Each is worse than the one before."""


def discovery_page(result: Result) -> PageContent:
    """A search: its verdict, the rounds that led there, and the records before and after."""
    summary = result.summary
    assert isinstance(summary, DiscoverySummary)
    view = view_of_search(result)
    keys = [] if view is None else [str(model["key"]) for model in view.view["models"]]
    before = summary.before if summary.added else None
    blocks: list[Block | None] = [
        Words(UNFINISHED, unfinished_parts(summary), listed=True),
        Words("What it amounts to", [*(found.says for found in summary.weights), *not_in_the_gap(summary)]),
        Words("What to do next", summary.advice, listed=True),
        _law(summary),
        _alike(summary),
        *values_tables(summary, before.parameters if before else None),
        _story(summary, keys),
        view,
        gaps_table(
            {name: one.gap for name, one in summary.records.items()},
            summary.gap,
            before.records if before else None,
            before.gap if before else None,
        ),
        records_table(summary.records),
        _left_out(summary),
        _tried(summary),
        _detectable(summary),
    ]
    said = summary.reason if summary.verdict != "not_trusted" else ""
    return page_content(result, blocks, verdict_line(summary), said, _facts(summary), _status(summary))


def _status(summary: DiscoverySummary) -> str:
    """The worse of what the verdict and the final fit amount to: a name is of no use where the fit of it failed."""
    return max(STATUS[summary.verdict], summary.status, key=FROM_BEST.index)


def _facts(summary: DiscoverySummary) -> list[tuple[str, str]]:
    expected = 1.0 if summary.expected_gap is None else summary.expected_gap
    before = summary.before.gap if summary.before and summary.added else None
    label = f"gap before{ARROW}after" if before else "gap"
    facts = [(f"{label}: residual RMS over noise, {expected:.2f} expected", changed(_total(before), summary.gap.total))]
    facts += [
        (f"gap of the {name}", changed(before.ratio_of(name) if before else None, one.ratio))
        for name, one in summary.gap.channels.items()
        if one.ratio is not None
    ]
    if summary.rounds:
        facts.append(("rounds of the search", str(len(summary.rounds))))
    return facts


def _total(gap: Gap | None) -> float | None:
    return None if gap is None else gap.total


def _law(summary: DiscoverySummary) -> TableBlock | None:
    """The law that was composed for what no effect accounts for."""
    law = summary.proposed_law
    if law is None:
        return None
    rows = [(one.symbol, name, *with_error(one.value, one.std_error, one.unit)) for name, one in law.parameters.items()]
    note = " ".join([f"{law.expression}.", *law_sentences(law)])
    return TableBlock("What is missing, as a law", ("", "", "value", "±", "unit"), rows, frozenset({2, 3}), note)


def _alike(summary: DiscoverySummary) -> Block | None:
    said = [alike_sentence(names) for names in summary.cannot_tell_apart]
    said += [one.says for one in summary.separated_by]
    return Words("What cannot be distinguished", said, listed=True) if said else None


def _story(summary: DiscoverySummary, keys: Sequence[str]) -> Story | None:
    """Each round with its candidates, and the models to compare in the view of the records."""
    if not summary.rounds:
        return None
    steps = []
    for number, found in enumerate(summary.rounds, 1):
        last = number == len(summary.rounds)
        models = ("first" if number == 1 else f"round{number - 1}", "final" if last else f"round{number}")
        steps.append(
            Step(
                f"Round {number}: {found.added or 'nothing'} is added",
                found.sentence,
                found.gap_before,
                found.gap_after,
                _candidates("", found.ranking, found.added),
                models if set(models) <= set(keys) else (),
            )
        )
    expected = 1.0 if summary.expected_gap is None else summary.expected_gap
    return Story("How it was found", steps, expected, max(step.before for step in steps))


def _candidates(heading: str, ranking: Sequence[Candidate], added: str | None = None) -> TableBlock:
    ranked = listed_candidates(ranking, MOST_CANDIDATES, added or "")
    rows = [
        (
            one.effect,
            f"{one.gap_after:.3f}",
            evidence_text(one),
            "; ".join(_value(name, one) for name in one.parameters),
        )
        for one in ranked.shown
    ]
    others = others_listed(ranked)
    note = f"{EVIDENCE}{f' {others[:1].upper()}{others[1:]}.' if ranked.others else ''}"
    return TableBlock(heading, ("effect", "gap after", "evidence", "its values"), rows, frozenset({1, 2}), note)


def _value(name: str, candidate: Candidate) -> str:
    found = candidate.parameters[name]
    value, error, unit = with_error(found.value, found.std_error, found.unit)
    shown = "" if unit == "-" else f" {unit}"
    return f"{name.rpartition('.')[2].replace('_', ' ')} {value}{f' ± {error}' if error else ''}{shown}"


def _left_out(summary: DiscoverySummary) -> TableBlock | None:
    if not summary.held_out:
        return None
    rows = [(held.record, f"{held.gap_before:.2f}", f"{held.gap_after:.2f}") for held in summary.held_out]
    note = "Each record predicted from a fit to the others; only its own zero and start are fitted."
    return TableBlock("Each record left out in turn", ("record", "before", "after"), rows, frozenset({1, 2}), note)


def _tried(summary: DiscoverySummary) -> TableBlock | None:
    if summary.rounds or not summary.ranking:
        return None
    return _candidates("What was tried", summary.ranking)


def _detectable(summary: DiscoverySummary) -> TableBlock | None:
    if not summary.detectable:
        return None
    rows = [
        (one.effect, one.parameter.rpartition(".")[2].replace("_", " "), strength(one)) for one in summary.detectable
    ]
    note = "Smallest strength that these records would have shown; a weaker effect may be there."
    return TableBlock("What would have been found", ("effect", "parameter", "shows from"), rows, frozenset({2}), note)


def view_of_search(result: Result) -> Records | None:
    """The records with the first model, the model after each round, the final one, and the candidates tried."""
    summary, groups = result.summary, result.groups
    assert isinstance(summary, DiscoverySummary)
    final = simulated(groups, "predictions")
    if not final:
        return None
    gaps = {name: one.gap for name, one in summary.records.items()}
    models = [CourseModel("final", "final model" if summary.added else "model", "final", True, final)]
    if summary.added:
        first = simulated(groups, "predictions_before")
        models = [CourseModel("first", "first model", "first", True, first), *_between(summary, groups), *models]
    said = f"95 % interval of a new measurement by the {models[-1].label}: noise and errors of the values"
    return records_block(Sight(groups, gaps, models, fit_bands(groups, final, gaps), said, summary.places))


def _between(summary: DiscoverySummary, groups: Groups) -> list[CourseModel]:
    """Models of the rounds, and candidates that were not added; from what they leave.

    Results of earlier versions do not say of what noise that is a multiple.
    """
    rounds = groups.get("rounds", {})
    if "left" not in rounds or "noise" not in rounds:
        return []
    found = []
    for number, left in zip(rounds["round"].values.astype(int), rounds["left"].values, strict=True):
        if number > 1:
            added = summary.rounds[number - 2].added
            label = f"after round {number - 1}: {added}"
            found.append(CourseModel(f"round{number - 1}", label, "round", False, _readings(left, groups)))
    looks = enumerate(summary.rounds, 1)
    gaining = {(n, one.effect) for n, look in looks for one in look.ranking if one.evidence >= LEAST_LISTED}
    for i, (number, effect) in enumerate(zip(rounds["tried_in"].values, rounds["effect"].values, strict=True)):
        if summary.rounds[int(number) - 1].added != effect and (int(number), effect) in gaining:
            label = f"round {number} with {effect} instead"
            left = rounds["left_with"].values[i]
            found.append(CourseModel(f"tried{i}", label, "tried", False, _readings(left, groups)))
    return found


def _readings(left: np.ndarray, groups: Groups) -> dict[str, np.ndarray]:
    """Simulated readings from residuals ``(n_record, n_channel, n_time)`` in units of the noise of each reading."""
    observed, rounds = groups["observed_data"], groups["rounds"]
    apart = left * rounds["noise"].values
    return {name: observed[name].values + apart[:, i] for i, name in enumerate(map(str, rounds["channel"].values))}
