"""Forward selection: what is added in each round, and why no more is."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from fibrefit.core.declarations import Statement
from fibrefit.core.limits import OutOfTimeError, beyond_limits, in_time, time_left
from fibrefit.core.programs import longest_compilation
from fibrefit.discovery.choice import Believed, Choose, believed, candidates
from fibrefit.discovery.comparison import Comparison, comparison_of
from fibrefit.discovery.curves.free_form import FittedCurve
from fibrefit.discovery.design.rivals import Rivals
from fibrefit.discovery.engine.candidates import own_task_by_record
from fibrefit.discovery.engine.effort import COMPARED, LINEARISED_ANEW, settles, side_search_time
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import (
    BEYOND_DOUBT,
    CARRIED,
    NAMED,
)
from fibrefit.discovery.exchange import is_better, rivals_beside, rivals_of, with_exchanges
from fibrefit.discovery.mistakes import mistaken
from fibrefit.discovery.model.finding import TracedRound
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.discovery.pairs import best_pair, incomplete, pruned
from fibrefit.discovery.residuals import where
from fibrefit.discovery.residuals.residuals import residual_set_at
from fibrefit.discovery.search.alarms import alarms_of, most_nats
from fibrefit.discovery.search.inputs import (
    coefficients_of,
    is_held_back,
    led_through_bounces,
    relinearised,
    residuals_left,
)
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.time_budget import kept_for_conclusion, slowdown, time_to_use
from fibrefit.discovery.unnamed import (
    Unnamed,
    effects_as_good,
    law_before_effects,
    law_beside_choice,
    law_without_choice,
)
from fibrefit.fitting.result import Identification
from fibrefit.problem import ResidualSet, corrected, input_errors
from fibrefit.study.summaries.discovery import Round

SECONDS = 300.0
"""Time a search is given unless said."""


@dataclass(frozen=True)
class Limits:
    """How far a search may go.

    Parameters
    ----------
    max_effects : int
    seed : int
    choose : callable, optional
        Given a round's ranking, names the effect to add; None lets the search decide.
    seconds : float
        After which there is an answer, whatever was not tried then.
    folder : pathlib.Path, optional
        Where what was found is kept for a search that goes on from there.
    least : float
        Smallest effect of interest: rms of what it explains, in units of the noise rms.
    """

    max_effects: int = 3
    seed: int = 0
    choose: Choose | None = None
    seconds: float = SECONDS
    folder: Path | None = None
    least: float = 0.0


@dataclass(frozen=True)
class Selection:
    """Where a search has come to.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
    steps : tuple of TracedRound
    comparison : Comparison or None
        The last one.
    rivals : tuple of Rivals
        What was added, each with an effect that does as well.
    cut_short : bool
        Whether the time ended before a round that looks for what else is missing.
    singles : Comparison or None
        The first round: effects one by one.
    curves : sequence of FittedCurve or None
        What free curves explain beyond the best model; None where they were not drawn on it.
    about : LaplaceFit or None
        Model that readings are linearised about, where inputs have errors.
    paired : bool
        Whether pairs of the best effects of the first round were tried.
    law : (LaplaceFit, ProposedLaw) or None
        A law of no name that accounts for all that the best model lacks.
    undone : tuple of str
        What the last round's time did not suffice for.
    gained : tuple of float
        Nats by which each that was added is more probable than the model it was added to.
    """

    search: Search
    best: LaplaceFit
    steps: tuple[TracedRound, ...] = ()
    comparison: Comparison | None = None
    rivals: tuple[Rivals, ...] = ()
    cut_short: bool = False
    singles: Comparison | None = None
    curves: Sequence[FittedCurve] | None = None
    about: LaplaceFit | None = None
    paired: bool = False
    law: tuple[LaplaceFit, ProposedLaw] | None = None
    undone: tuple[str, ...] = ()
    gained: tuple[float, ...] = ()

    def took(self, what: str, came: bool) -> Selection:
        """With a part of the round as not done, unless it came in time."""
        return self if came else replace(self, undone=(*self.undone, what))


def forward_select(search: Search, base: LaplaceFit, before: Identification, limits: Limits) -> Selection:
    """Add effects while the records ask for them.

    Parameters
    ----------
    search : Search
    base : LaplaceFit
        The model the search began with.
    before : Identification
        Of it.
    limits : Limits
    """
    at = Selection(search, base)
    while len(at.best.effects) < limits.max_effects:
        more = _more_to_conclude(at, before, time_to_use(limits.seconds))
        further, came = in_time(partial(_further, at, before, limits), None, time_left() - more)
        if not came:
            return replace(at, cut_short=True)
        assert further is not None
        names, (at, grown) = set(at.best.names), further
        # What was added may be needless beside the others: another round would find the same.
        if not grown or set(at.best.names) == names:
            return at
    return at


def _more_to_conclude(at: Selection, before: Identification, given: float) -> float:
    """Time in s that a conclusion takes beyond the least: curves and a law while nothing is named, then what was found.

    A model that is slower to simulate takes longer. Its final fit makes a program of its own, as large as any so far,
    and nothing ends that on the way.
    """
    least = kept_for_conclusion(before.running, given)
    if not at.best.effects:
        return kept_for_conclusion(before.running, given, named=False) - least
    slower = slowdown(at.search, at.best) * before.running
    return kept_for_conclusion(slower, given) - least + longest_compilation()


def _further(at: Selection, before: Identification, limits: Limits) -> tuple[Selection, bool]:
    """A selection after one more round, and whether an effect was added."""
    if at.best.effects and at.best is not at.about and (anew := relinearised(at.search, at.best)) is not None:
        at = replace(at, search=anew[0], best=anew[1])
    comparison: Comparison | None = None
    if not at.best.effects and limits.choose is None:
        mistake, _ = in_time(partial(mistaken, at.search, at.best), None, side_search_time(time_left()))
        if mistake is not None:
            return _settled_there(_grown(at, mistake, mistake.comparison, before, limits)), True
        at = _led_on(at)
        law_first, _ = in_time(partial(law_before_effects, at.search, at.best, before), None)
        if law_first is not None and law_first[0] is not None:
            return _ended_by(law_first[0], replace(at, comparison=law_first[1])), False
        comparison = None if law_first is None else law_first[1]
    if comparison is None:
        what, near = f"trying each effect, round {len(at.steps) + 1}", _near(at, at.singles, at.comparison, at.gained)
        comparison = comparison_of(at.search, at.best, what, at.singles, near)
    comparison = replace(comparison, gained=max(at.gained, default=0.0))
    single, found = at.singles or comparison, believed(comparison, limits.choose)
    at, found = _where_it_is(
        replace(at, undone=(), search=comparison.search, best=comparison.parent, comparison=found.comparison), found
    )
    if limits.choose is None:
        try:
            law = law_beside_choice(*found, single, before, _near_choice(at, found, single))
        except OutOfTimeError:
            return replace(at, cut_short=True), False
        if law is not None:
            return _ended_unless_known(law, at, single, before, limits)
    missing = True
    if found.chosen is None and limits.choose is None:
        unknown: tuple[bool, Sequence[FittedCurve] | None] = True, None
        (missing, curves), _ = in_time(partial(incomplete, found.comparison, before), unknown)
        at = replace(at, curves=curves)
        # A law is sooner tried than pairs of effects, and has to leave nothing, as they need not.
        law, came = in_time(partial(law_without_choice, at.search, at.best, before, curves), None)
        at = at.took("law", came)
        if law is not None:
            return _ended_unless_known(law, at, single, before, limits)
    if found.chosen is not None and at.best.effects and limits.choose is None:
        at, found = _exchanged(at, found, single)
    elif found.chosen is None and (missing or _doubtful(at)):
        at, found = _together(at, found, single, limits)
    if found.chosen is not None:
        return _grown(at, found, single, before, limits), True
    return at, False


def _near(
    at: Selection, single: Comparison | None, last: Comparison | None, gained: Sequence[float]
) -> LaplaceFit | None:
    """The first model that lacks little of the best one: slopes are nearly the same there, and its programs known.

    Of one that was held to what comes before the first bounces it is not known how little it lacks of whole records.
    """
    steps = ((single, sum(gained)), (last, gained[-1])) if gained else ()
    for before, gain in steps:
        if before is not None and not is_held_back(before.parent) and at.search.lacks_little(before.parent, gain):
            return before.parent
    return None


def _near_choice(at: Selection, found: Believed, single: Comparison) -> LaplaceFit | None:
    """The same of a model with what was just chosen; None where nothing was."""
    if found.chosen is None:
        return None
    return _near(at, single, found.comparison, (*at.gained, found.comparison.gain(found.chosen)))


def _led_on(at: Selection) -> Selection:
    """A selection with the model it began with led through the bounces that its first fit lost, where it leads."""
    anew, _ = in_time(partial(led_through_bounces, at.search, at.best), None, side_search_time(time_left()))
    return at if anew is None else replace(at, search=anew[0], best=anew[1])


def _settled_there(at: Selection) -> Selection:
    """A selection with what was led there from afar: its readings are linearised once more about where it is."""
    anew, _ = in_time(partial(relinearised, at.search, at.best), None)
    return at if anew is None else replace(at, search=anew[0], best=anew[1], about=anew[1])


def _ended_by(law: Unnamed, at: Selection) -> Selection:
    """A selection that ends with a law of no name."""
    return replace(at, search=law.search, best=law.parent, curves=law.curves, law=law.law)


def _ended_unless_known(
    law: Unnamed, at: Selection, single: Comparison, before: Identification, limits: Limits
) -> tuple[Selection, bool]:
    """A selection that ends with a law of no name, or has an effect added that makes the records as probable."""
    known, _ = in_time(partial(effects_as_good, law), None, side_search_time(time_left()))
    found = None if known is None else believed(known)
    if known is None or found is None or found.chosen is None:
        return _ended_by(law, at), False
    there = replace(at, search=known.search, best=known.parent)
    # What a round at effects one by one said was of readings that it saw: here others are seen.
    return _grown(there, found, single if at.best.effects else known, before, limits), True


def _where_it_is(at: Selection, found: Believed) -> tuple[Selection, Believed]:
    """Where no effect is added, a model that was led elsewhere is tested, and curves are drawn, about where it is.

    So is one that a test objects to: what readings linearised in errors of their inputs miss looks like a change.
    """
    comparison = found.comparison
    search, parent = comparison.search, comparison.parent
    if found.chosen is not None or parent.supermodel.sensitivities is None:
        return at, found
    with beyond_limits():
        alarms = alarms_of(search, parent)
        anew = relinearised(search, parent) if comparison.moved or alarms else None
    if anew is None:
        return at, found
    anew = _settled(*anew, most_nats(alarms) or np.inf)
    there = found._replace(comparison=replace(comparison, search=anew[0], parent=anew[1]))
    return replace(at, search=anew[0], best=anew[1]), there


def _settled(search: Search, parent: LaplaceFit, objected: float) -> tuple[Search, LaplaceFit]:
    """Readings linearised about a model again, as long as that takes away what tests object by, in nats.

    Once more whatever the time is, as it was begun: what is an error of linearisation is not told as one of the model.
    """
    ends = time.monotonic() + time_left()
    with beyond_limits():
        for number in range(LINEARISED_ANEW):
            left = most_nats(alarms_of(search, parent))
            if not left or not settles(objected, left) or (number and time.monotonic() > ends):
                break
            if (anew := relinearised(search, parent)) is None:
                break
            (search, parent), objected = anew, left
    return search, parent


def _together(at: Selection, found: Believed, single: Comparison, limits: Limits) -> tuple[Selection, Believed]:
    """Two effects at once, where something is missing that none accounts for by itself."""
    if limits.max_effects < 2 or len(at.best.effects) > 2 or at.paired or limits.choose or found.comparison.untried:
        return at, found
    pairs, came = in_time(partial(best_pair, single, at.best), None)
    together = found if pairs is None else believed(replace(pairs, seconds=found.comparison.seconds))
    another = together.chosen is not None and set(together.chosen.names) != set(at.best.names)
    return replace(at.took("pairs", came), paired=came), together if another else found


def _exchanged(at: Selection, found: Believed, single: Comparison) -> tuple[Selection, Believed]:
    """What was found, or with some of its effects exchanged, and rivals of all but the last beside that one."""
    assert found.chosen is not None
    models, came = in_time(partial(with_exchanges, single, found.comparison, found.chosen, at.rivals), None)
    at = at.took("exchange", came)
    if models is None:
        return at, found
    at = replace(at, rivals=rivals_beside(at.rivals, models, found.chosen))
    if not is_better(models, found.chosen):
        return at, found
    others = believed(replace(models, untried=found.comparison.untried, seconds=found.comparison.seconds))
    another = others.chosen is not None and set(others.chosen.names) != set(found.chosen.names)
    return at, others if another else found


def _doubtful(at: Selection) -> bool:
    """Whether the second of two effects says little: the first may stand in for two others, and leave it so much.

    That is asked last: an exchange tells it sooner, and a third effect is sooner found.
    """
    return len(at.best.effects) == 2 and at.gained[-1] < BEYOND_DOUBT


def _grown(at: Selection, found: Believed, single: Comparison, before: Identification, limits: Limits) -> Selection:
    """A selection with what was found."""
    comparison, chosen, seen = found
    assert chosen is not None
    search, best = (comparison.search, chosen) if seen is None else (seen.search, seen.found)
    best = best.undivided
    with beyond_limits():
        return replace(
            at,
            best=best if limits.choose is not None else pruned(search.inference, best),
            search=search,
            comparison=comparison,
            singles=single,
            steps=(*at.steps, _round(comparison, before, chosen)),
            rivals=(*at.rivals, *rivals_of(comparison, chosen)),
            curves=None,
            about=best,
            gained=(*at.gained, comparison.gain(chosen)),
        )


def _round(comparison: Comparison, before: Identification, chosen: LaplaceFit) -> TracedRound:
    parent, search = comparison.parent, comparison.search
    ranking = candidates(comparison)
    added = " + ".join(name for name in chosen.names if name not in parent.names)
    gaps = comparison.gap, search.gap_left(chosen)
    residual_set = before.residual_set if not parent.effects else remaining_residuals(search, parent)
    residuals_with = tuple(residuals_left(search, one) for one in comparison.found[:COMPARED])
    summary = Round(
        added=added, gap_before=gaps[0], gap_after=gaps[1], where=where.places(residual_set), ranking=ranking
    )
    chance = next((one.false_alarm for one in ranking if one.effect == added), None)
    facts = {"effects": added, "gaps": gaps, "gain": comparison.gain(chosen), "threshold": NAMED, "chance": chance}
    grown = Statement("added", facts | {"changes": _changes(parent, chosen)})
    return TracedRound(summary, residual_set.residuals, residuals_with, (where.most_of(residual_set), grown))


def remaining_residuals(search: Search, fitted: LaplaceFit) -> ResidualSet:
    """What a hypothesis leaves of each record at its own values, the errors of noisy inputs taken off them."""
    task, local = own_task_by_record(search.task, search.plain(fitted))
    problem, coefficients = task.problem, coefficients_of(search, fitted)
    if coefficients is not None:
        problem = corrected(problem, input_errors(task), coefficients)
    return residual_set_at(problem, local, search.task.noise)


def _changes(parent: LaplaceFit, chosen: LaplaceFit) -> tuple[tuple[str, float, float, str], ...]:
    """Base parameters that had carried much in place of the effect: name, value before and with it, unit."""
    after = chosen.shared
    moved = [(name, old, after.get(name, old)) for name, old in parent.shared.items()]
    return tuple(
        (name, old, new, chosen.supermodel.declared[name].unit)
        for name, old, new in moved
        if abs(new - old) > CARRIED * abs(old)
    )
