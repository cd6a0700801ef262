"""Forward selection: what is added in each round, and why no more is."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

import numpy as np

from fibrefit.core.statement import Statement
from fibrefit.core.time_limit import beyond_limits, in_time, time_left, time_limit
from fibrefit.discovery.design.rivals import Rivals
from fibrefit.discovery.engine.effort import COMPARED, PROMISING, is_partner, weighed_again
from fibrefit.discovery.engine.marginal import Scales
from fibrefit.discovery.engine.supermodel import coefficients_at
from fibrefit.discovery.engine.thresholds import (
    APART,
    BEYOND_DOUBT,
    CARRIED,
    ENOUGH,
    NAMED,
    PRICE,
    SIMPLER,
    false_alarm,
    occam,
)
from fibrefit.discovery.engine.weighed import Weighed
from fibrefit.discovery.model.finding import TracedRound
from fibrefit.discovery.residuals import where
from fibrefit.discovery.residuals.innovations import tests_of
from fibrefit.discovery.residuals.residuals import residual_set_at
from fibrefit.discovery.search.inputs import relinearised
from fibrefit.discovery.search.search import Search, Tried
from fibrefit.fitting.result import Identification
from fibrefit.laws.catalogue import is_costly
from fibrefit.laws.law import Effect
from fibrefit.problem.diagnose.residuals import ResidualSet
from fibrefit.problem.inputs.errors_in_variables import corrected, input_errors
from fibrefit.study.summaries.discovery import Candidate, Round
from fibrefit.study.summaries.summaries import ParameterSummary

LISTED = 8
"""Candidates whose parameters are shown with errors."""
NOISES = 2
"""Times the noise of a round is taken from what its best candidate leaves."""

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
    """

    max_effects: int = 3
    seed: int = 0
    choose: Callable[[Sequence[Candidate]], str | None] | None = None
    seconds: float = SECONDS
    folder: Path | None = None


@dataclass(frozen=True)
class Comparison:
    """Candidates of one round, all weighed alike.

    Parameters
    ----------
    search : Search
        With the scales they were weighed by.
    parent : Weighed
        Refitted from where each of the best candidates led.
    found : tuple of Weighed
        The most probable first.
    compared : frozenset of tuple of str
        Names of those that were weighed in the same noise as the parent; the others are far behind.
    untried : tuple of Effect classes
        Candidates that the time did not suffice for.
    """

    search: Search
    parent: Weighed
    found: tuple[Weighed, ...]
    compared: frozenset[tuple[str, ...]] = frozenset()
    untried: tuple[type[Effect], ...] = ()

    def gain(self, one: Weighed) -> float:
        """Logarithm of the Bayes factor over the parent."""
        return one.log - self.parent.log


@dataclass(frozen=True)
class Selection:
    """Where a search has come to.

    Parameters
    ----------
    search : Search
    best : Weighed
    steps : tuple of TracedRound
    look : Comparison or None
        The last one.
    rivals : tuple of Rivals
        What was added, each with an effect that does as well.
    cut_short : bool
        Whether the time ended before a look at what else might be missing.
    """

    search: Search
    best: Weighed
    steps: tuple[TracedRound, ...] = ()
    look: Comparison | None = None
    rivals: tuple[Rivals, ...] = ()
    cut_short: bool = False


def forward_select(search: Search, base: Weighed, before: Identification, limits: Limits) -> Selection:
    """Add effects while the records ask for them.

    Parameters
    ----------
    search : Search
    base : Weighed
        The model the search began with.
    before : Identification
        Of it.
    limits : Limits
    """
    at = Selection(search, base)
    while len(at.best.effects) < limits.max_effects:
        further, came = in_time(partial(_further, at, before, limits), None)
        if not came:
            return replace(at, cut_short=True)
        assert further is not None
        at, grown = further
        if not grown:
            return at
    return at


def _further(at: Selection, before: Identification, limits: Limits) -> tuple[Selection, bool]:
    """A selection after one more look, and whether an effect was added."""
    if at.best.effects and (anew := relinearised(at.search, at.best)) is not None:
        at = replace(at, search=anew[0], best=anew[1])
    look = looked(at.search, at.best, f"trying each effect, round {len(at.steps) + 1}")
    at = replace(at, search=look.search, look=look)
    chosen = _chosen(look, limits)
    alone = not at.best.effects and limits.max_effects > 1 and limits.choose is None
    if chosen is None and alone and not look.untried and is_incomplete(look.search, look.parent):
        look, chosen = _pair(look)
    if chosen is None:
        return replace(at, best=look.parent), False
    with beyond_limits():
        found, rivals = _round(look, before, chosen), rivals_of(look, chosen)
        at = replace(at, best=chosen, look=look, steps=(*at.steps, found), rivals=(*at.rivals, *rivals))
        if limits.choose is None:
            at = replace(at, best=pruned(at.search.scales, at.best))
    return at, True


LOOKING = 0.8
"""Share of the time left that candidates are given; what remains is for weighing the best ones in one noise."""


def looked(search: Search, parent: Weighed, what: str) -> Comparison:
    """A parent with each further effect, all weighed in the noise that the best one of them leaves.

    Parameters
    ----------
    search : Search
    parent : Weighed
    what : str
        What is said of it while it goes on.
    """
    effects = search.extensions(parent)
    swift = [effect for effect in effects if not is_costly(effect)]
    costly = [effect for effect in effects if is_costly(effect)]
    with time_limit(LOOKING * time_left()):
        tried, _ = in_time(partial(search.tried, parent, swift, what), Tried([], tuple(swift)))
    look = _in_one_noise(search, parent, tried)
    if not costly:
        return look
    least, _ = in_time(partial(_worth_following, look), -np.inf)
    if least == np.inf:
        return look
    with time_limit(LOOKING * time_left()):
        more, _ = in_time(partial(look.search.tried, look.parent, costly, what, least), Tried([], tuple(costly)))
    found = sorted([*look.found, *more.found], key=lambda one: -one.log)
    return _in_one_noise(look.search, look.parent, Tried(found, (*tried.untried, *more.untried)))


def _in_one_noise(search: Search, parent: Weighed, tried: Tried) -> Comparison:
    """Candidates weighed in the noise of the best; in that of the parent where the time ends."""
    look, _ = in_time(partial(_same_noise, search, parent, tried.found), Comparison(search, parent, tuple(tried.found)))
    return replace(look, untried=tried.untried)


def is_incomplete(search: Search, weighed: Weighed) -> bool:
    """Whether tests of the innovations say that something is missing."""
    tested = tests_of(search.scales, weighed, search.task.traces, search.task.problem.model.rig.channels)
    return any(test.raised for test in tested)


def _worth_following(look: Comparison) -> float:
    """Nats that slopes have to promise of an effect that takes long to simulate: not far less than was found.

    Without end where an effect was named before and nothing says that more is missing: then none of them is looked at.
    """
    gain, gap = look.gain(look.found[0]) if look.found else 0.0, look.search.gap(look.search.plain(look.parent))
    if gain <= NAMED:
        return np.inf if look.parent.effects and gap <= ENOUGH else -np.inf
    if look.search.gap(look.search.plain(look.found[0])) > ENOUGH:
        return -np.inf
    return PROMISING * gain


def _same_noise(search: Search, parent: Weighed, found: Sequence[Weighed]) -> Comparison:
    """Candidates and parent weighed in the noise of the most probable of them."""
    ranked, behind = sorted(found, key=lambda one: -one.log), {one.names: one.log - parent.log for one in found}
    again: list[Weighed] = []
    for _ in range(NOISES):
        richest = ranked[0] if ranked and ranked[0].log > parent.log else parent
        scales = Scales(search.context, search.scales.reference, search.scales.refined(richest))
        search = search.weighed_with(scales)
        once_more = weighed_again([one.log for one in ranked], richest.log > parent.log + NAMED)
        parent = scales.again(parent)
        near = [one for one, is_near in zip(ranked, once_more, strict=True) if is_near]
        again = sorted((scales.again(one) for one in near if one.evidence.mode.steps), key=lambda one: -one.log)
        led = [scales.without(one, parent.effects) for one in again[:COMPARED] if one.log > parent.log]
        alike = [scales.again(scales.agreeing(parent))] if parent.evidence.mode.sigma.any() else []
        parent = max([parent, *alike, *led], key=lambda one: one.log)
        if not again or again[0].names == ranked[0].names:
            break
        ranked = [*again, *(one for one in ranked if one.names not in {other.names for other in again})]
    for one in sorted(ranked, key=lambda one: -behind[one.names]):
        # What other noise said of it is not held against what this noise says of the rest.
        if behind[one.names] <= max([NAMED, *(other.log - parent.log for other in again)]):
            break
        if one.evidence.mode.steps and all(one.names != other.names for other in again):
            again.append(scales.again(one))
    weighed = {one.names: _sobered(scales, parent, one) for one in again}
    # The others keep what they were found to be behind.
    others = [one.moved_to(parent.log + behind[one.names]) for one in ranked if one.names not in weighed]
    ranked = sorted([*weighed.values(), *others], key=lambda one: -one.log)
    return Comparison(search, parent, tuple(ranked), frozenset(weighed))


def _sobered(scales: Scales, parent: Weighed, one: Weighed) -> Weighed:
    """A candidate whose gain counts for less where the innovations scatter more than they are taken to."""
    gain = one.log - parent.log
    if not 0.0 < gain < BEYOND_DOUBT:
        return one
    added = [effect for effect in one.effects if effect not in parent.effects]
    inflation = scales.inflation(one, [f"{effect.name}.{name}" for effect in added for name in effect.strength])
    cost = max(occam(parent.evidence, one.evidence), 0.0)
    return one.moved_to(parent.log + (gain + cost) / inflation - cost)


def _chosen(look: Comparison, limits: Limits) -> Weighed | None:
    """What is added: what a person chooses, or the most probable if it is more than chance; None for nothing."""
    if limits.choose is not None:
        name = limits.choose(candidates(look)[:LISTED])
        return next((one for one in look.found[:LISTED] if name in one.names), None)
    # Where the time ended before candidates were weighed in one noise, what little they differ by is not known.
    if not look.found or look.gain(look.found[0]) <= (NAMED if look.compared else BEYOND_DOUBT):
        return None
    near = [one for one in look.found if one.log > look.found[0].log - SIMPLER]
    return min(near, key=lambda one: (sum(len(effect.parameters) for effect in one.effects), _new(one, look), -one.log))


def _new(one: Weighed, look: Comparison) -> bool:
    """Whether it is more than a mistake in what the study says: those come before any physics is invented."""
    return any(not effect.name.startswith("study.") for effect in one.effects if effect not in look.parent.effects)


def _pair(look: Comparison) -> tuple[Comparison, Weighed | None]:
    """The best of two effects together that are more than chance and need each other; None where there is none."""
    found: list[Weighed] = []
    search = look.search
    for first in look.found[:COMPARED]:
        effects = [
            one.effects[-1] for one in look.found if one is not first and one.effects[-1] is not first.effects[0]
        ]
        partners = [effect for i, effect in enumerate(effects) if is_partner(i)]
        allowed = [effect for effect in search.extensions(first) if effect in partners]
        found += search.tried(first, allowed, "trying effects in pairs").found
    pairs = _same_noise(search, look.parent, found)
    best = pairs.found[0] if pairs.found else None
    if best is None or pairs.gain(best) <= NAMED + np.log(max(len(found), 1)):
        return look, None
    return (pairs, best) if pruned(pairs.search.scales, best) is best else (look, None)


def pruned(scales: Scales, best: Weighed) -> Weighed:
    """A hypothesis without the effects a later one has made needless."""
    if len(best.effects) < 2:
        return best
    for effect in best.effects:
        rest = tuple(other for other in best.effects if other is not effect)
        if any(effect.name in other.needs for other in rest):
            continue
        lesser = scales.without(best, rest)
        if best.log - lesser.log <= NAMED:
            return pruned(scales, lesser)
    return best


def rivals_of(look: Comparison, best: Weighed) -> tuple[Rivals, ...]:
    """What was added, and each effect that would have explained the records as well in its place."""
    pairs: dict[tuple[str, str], Rivals] = {}
    plain = look.search.plain
    for other in look.found:
        mine = [name for name in best.names if name not in other.names]
        theirs = [name for name in other.names if name not in best.names]
        if abs(other.log - best.log) < APART and len(mine) == len(theirs) == 1:
            pairs.setdefault((mine[0], theirs[0]), Rivals((mine[0], theirs[0]), (plain(best), plain(other))))
    return tuple(pairs.values())


def candidates(look: Comparison) -> tuple[Candidate, ...]:
    """How the candidates of a round did over their parent, the most probable first."""
    return tuple(candidate(look, one) for one in look.found)


def candidate(look: Comparison, one: Weighed) -> Candidate:
    """How a hypothesis did over its parent; parameters with their standard errors."""
    added = [effect for effect in one.effects if effect not in look.parent.effects]
    shared, errors = one.shared, one.errors
    parameters = {
        name: ParameterSummary(value=shared[name], std_error=errors[name], unit=parameter.unit)
        for effect in one.effects
        for parameter in effect.parameters
        for name in [f"{effect.name}.{parameter.name}"]
        if np.isfinite(shared[name])
    }
    others = [(sum(len(e.parameters) for e in o.effects if e not in look.parent.effects), o) for o in look.found]
    # What was not weighed in the same noise costs what is usual.
    chances = [
        (size, occam(look.parent.evidence, o.evidence) if o.names in look.compared else PRICE * size)
        for size, o in others
    ]
    return Candidate(
        effect=" + ".join(effect.name for effect in added) or "nothing",
        gap_after=look.search.gap(look.search.plain(one)),
        evidence=look.gain(one),
        parameters=parameters,
        false_alarm=false_alarm(look.gain(one), chances),
    )


def _round(look: Comparison, before: Identification, chosen: Weighed) -> TracedRound:
    parent, search = look.parent, look.search
    ranking = candidates(look)
    added = " + ".join(name for name in chosen.names if name not in parent.names)
    gaps = search.gap(search.plain(parent)), search.gap(search.plain(chosen))
    residual_set = before.residual_set if not parent.effects else what_is_left(search, parent)
    residuals_with = tuple(what_is_left(search, one).residuals for one in look.found[:COMPARED])
    summary = Round(
        added=added, gap_before=gaps[0], gap_after=gaps[1], where=where.places(residual_set), ranking=ranking
    )
    facts = {"effects": added, "gaps": gaps, "gain": look.gain(chosen), "threshold": NAMED}
    grown = Statement("added", facts | {"changes": _changes(parent, chosen)})
    return TracedRound(summary, residual_set.residuals, residuals_with, (where.most_of(residual_set), grown))


def what_is_left(search: Search, weighed: Weighed) -> ResidualSet:
    """What a hypothesis leaves, the errors of noisy inputs taken off them."""
    task, values = search.task_with(weighed)
    problem, sensitivities = task.problem, weighed.frame.sensitivities
    if sensitivities is not None:
        problem = corrected(problem, input_errors(task), coefficients_at(task, values, sensitivities))
    return residual_set_at(problem, values, search.task.noise)


def _changes(parent: Weighed, chosen: Weighed) -> tuple[tuple[str, float, float, str], ...]:
    """Base parameters that had carried much in place of the effect: name, value before and with it, unit."""
    after = chosen.shared
    moved = [(name, old, after.get(name, old)) for name, old in parent.shared.items()]
    return tuple(
        (name, old, new, chosen.frame.declared[name].unit)
        for name, old, new in moved
        if abs(new - old) > CARRIED * abs(old)
    )
