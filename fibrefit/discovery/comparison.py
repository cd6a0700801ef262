"""One round's comparison: a model with each further effect, all compared in one noise."""

from __future__ import annotations

import itertools
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from fibrefit.core.limits import OutOfTimeError, beyond_limits, in_time, time_left, time_limit
from fibrefit.discovery.engine.candidates import fit_all
from fibrefit.discovery.engine.effort import (
    COMPARED,
    FAR_BEHIND,
    PARTNERS,
    PROMISING,
    compared_again,
    in_wrong_minimum,
    least_of_singular,
    looking_time,
    noise_is_taken_again,
)
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, ENOUGH, NAMED
from fibrefit.discovery.search.alarms import alarms_of
from fibrefit.discovery.search.inputs import Confirmation, fitted_about, overdispersion_corrected, overdispersion_of
from fibrefit.discovery.search.search import Search, Tried
from fibrefit.laws.catalogue import is_costly
from fibrefit.laws.law import Effect


@dataclass(frozen=True)
class Comparison:
    """Candidates of one round, all compared alike.

    Parameters
    ----------
    search : Search
        With the noise they were compared in.
    parent : LaplaceFit
        Refitted from where each of the best candidates led.
    found : tuple of LaplaceFit
        The most probable first.
    compared : frozenset of tuple of str
        Names of those that were compared in the same noise as the parent; the others are far behind.
    untried : tuple of Effect classes
        Candidates that the time did not suffice for.
    moved : bool
        Whether the parent was led to where it is far more probable than where it was.
    shares : mapping of tuple of str to float
        Of those seen only with readings linearised about another model than the parent is: what they left there of
        the gap that the parent left there. Their own gap is counted in another noise.
    seconds : float
        Time it took, in s.
    gained : float
        Nats that the parent's effects gained when they were found, the most of any.
    others : int
        Candidates that were looked at, led nowhere and do not stand among those found: each might have by chance.
    """

    search: Search
    parent: LaplaceFit
    found: tuple[LaplaceFit, ...]
    compared: frozenset[tuple[str, ...]] = frozenset()
    untried: tuple[type[Effect], ...] = ()
    moved: bool = False
    shares: Mapping[tuple[str, ...], float] = field(default_factory=dict)
    seconds: float = 0.0
    gained: float = 0.0
    others: int = 0

    def gap_of(self, one: LaplaceFit) -> float:
        """Gap that one of them leaves, as the parent's is counted: Rms of residuals over the noise."""
        # What was not followed is its parent, and leaves the same.
        if one is self.parent or not one.evidence.mode.steps:
            return self.gap
        share = self.shares.get(one.names)
        return self.search.gap_left(one) if share is None else self.gap * share

    @cached_property
    def gap(self) -> float:
        """That of the parent."""
        return self.search.gap_left(self.parent)

    def gain(self, one: LaplaceFit) -> float:
        """Logarithm of the Bayes factor over the parent."""
        return one.log - self.parent.log


def comparison_of(
    search: Search, parent: LaplaceFit, what: str, first: Comparison | None = None, near: LaplaceFit | None = None
) -> Comparison:
    """A parent with each further effect, all compared in the noise that the best one of them leaves.

    Where candidates lead the parent to a place that makes all of them wrong minima, they begin anew from there.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
    what : str
        What is said of it while it goes on.
    first : Comparison, optional
        Of effects one by one: what gained most there is tried first, in case the time ends.
    near : LaplaceFit, optional
        A model before the parent that lacks little of it, in which slopes may be taken.
    """
    began = time.monotonic()
    comparison = _looked_at(search, parent, what, first, near)
    if comparison.moved and _all_left_behind(comparison):
        anew, _ = in_time(partial(_looked_at, comparison.search, comparison.parent, what, first), None)
        comparison = comparison if anew is None else replace(anew, moved=True)
    return replace(comparison, seconds=time.monotonic() - began)


def _all_left_behind(comparison: Comparison) -> bool:
    """Whether all that were compared are far less probable than the parent, which they contain."""
    compared = [one for one in comparison.found if one.names in comparison.compared]
    return all(in_wrong_minimum(one.log, comparison.parent.log) for one in compared)


def _looked_at(
    search: Search, parent: LaplaceFit, what: str, first: Comparison | None, near: LaplaceFit | None = None
) -> Comparison:
    """A parent with each further effect, from where the parent is."""
    gains = {} if first is None else {one.effects[-1]: first.gain(one) for one in first.found}
    effects = sorted(search.extensions(parent), key=lambda effect: -gains.get(effect, 0.0))
    known = {one.effects[-1] for one in first.found if one.evidence.mode.steps} if first is not None else set()
    # What explained much by itself does not wait for what did not.
    costly = [each for each in effects if is_costly(each) and not (each in known and gains[each] > BEYOND_DOUBT)]
    swift = [each for each in effects if each not in costly]
    with time_limit(looking_time(time_left())):
        look = partial(search.tried, parent, swift, what, near=near, of_singular=-np.inf if near is None else 0.0)
        tried, _ = in_time(look, Tried([], tuple(swift)))
        if first is not None and near is None:
            tried, _ = in_time(partial(_from_first, search, parent, tried, first.parent, swift, what), tried)
    comparison = in_one_noise(search, parent, tried)
    if near is not None:
        # Slopes say little of what changes a model's kind, and a program for each parent takes long to compile.
        unlike = {one.effects[-1] for one in tried.found if one.effects[-1].singular and not one.evidence.mode.steps}
        costly += [each for each in swift if each in unlike]
    if not costly:
        return comparison
    least, _ = in_time(partial(_worth_following, comparison), -np.inf)
    if least == np.inf:
        return comparison
    # Noise that the best of the others leaves holds what it does not explain: what explains that is nothing in it.
    begun = comparison if comparison.moved else Comparison(search, parent, tuple(tried.found))
    with time_limit(looking_time(time_left())):
        # Where what was found leaves no more than noise, what slopes predict little of is not what is missing.
        hardly = least_of_singular(least) if near is None else least
        look = partial(begun.search.tried, begun.parent, costly, what, least, near=near, of_singular=hardly)
        more, _ = in_time(look, Tried([], tuple(costly)))
    return _with_costly(comparison, begun, more)


def _from_first(
    search: Search, parent: LaplaceFit, tried: Tried, base: LaplaceFit, effects: Sequence[type[Effect]], what: str
) -> Tried:
    """What was tried, and what effects gain from where the search began, the parent's hardly there.

    An effect that was added first has taken up a part of the next one, at values and shapes that suit it alone: slopes
    beside it may say nothing of what both gain together.
    """
    begun = search.inference.begun_anew(parent, base)
    best = max([parent.log, *(one.log for one in tried.found)])
    more = search.tried(begun, effects, what, best + NAMED - begun.log)
    found = {one.names: one for one in tried.found}
    better = [one for one in more.found if one.evidence.mode.steps and one.log > best]
    found |= {one.names: one for one in better}
    return Tried(sorted(found.values(), key=lambda one: -one.log), tried.untried)


def _with_costly(comparison: Comparison, begun: Comparison, more: Tried) -> Comparison:
    """A comparison with the effects that were looked at last.

    Parameters
    ----------
    comparison : Comparison
        Of all others, and of what slopes predict nothing of.
    begun : Comparison
        These as they were found, in the noise in which the last ones were looked at.
    more : Tried
        The last ones.
    """
    followed, looked = [one for one in more.found if one.evidence.mode.steps], {one.names for one in more.found}
    comparison, begun = (
        replace(one, found=tuple(each for each in one.found if each.names not in looked)) for one in (comparison, begun)
    )
    if max((begun.gain(one) for one in followed), default=-np.inf) > max(map(begun.gain, begun.found), default=0.0):
        found = [*begun.found, *more.found]
    else:
        # What they gained there they would gain here at the most.
        there = [one.with_log(comparison.parent.log + begun.gain(one)) for one in more.found]
        begun, found = comparison, [*comparison.found, *there]
    whole = Tried(sorted(found, key=lambda one: -one.log), (*comparison.untried, *more.untried))
    if not followed:
        # None was followed: there is nothing to compare, and the noise is what it was.
        return replace(comparison, found=tuple(whole.found), untried=whole.untried)
    joined = in_one_noise(begun.search, begun.parent, whole)
    if comparison.compared and not joined.compared:
        # The time ended: what was compared before is not lost for that, and of the last ones nothing is decided.
        late = tuple(one.effects[-1] for one in followed)
        return replace(comparison, untried=tuple(dict.fromkeys((*whole.untried, *late))))
    return replace(joined, moved=comparison.moved or joined.moved)


def in_one_noise(search: Search, parent: LaplaceFit, tried: Tried) -> Comparison:
    """Candidates compared in the noise of the best; in that of the parent where the time ends."""
    comparison, _ = in_time(partial(in_same_noise, search, parent, tried.found), None)
    return replace(comparison or _as_found(search, parent, tried.found), untried=tried.untried)


def _as_found(search: Search, parent: LaplaceFit, found: Sequence[LaplaceFit]) -> Comparison:
    """Candidates as they were found; what is beyond doubt has to be so over the parent from where it led, too."""
    if found and found[0].log > parent.log + BEYOND_DOUBT:
        with beyond_limits():
            parent = max(parent, search.inference.without(found[0], parent.effects), key=lambda one: one.log)
    return Comparison(search, parent, tuple(found))


def _worth_following(comparison: Comparison) -> float:
    """Nats that slopes have to predict of an effect that takes long to simulate: not far less than was found.

    Without end where an effect was named before and neither gap nor tests of the innovations say that more is missing:
    then none of them is looked at.
    """
    search, parent = comparison.search, comparison.parent
    gain = comparison.gain(comparison.found[0]) if comparison.found else 0.0
    if gain <= NAMED:
        noise = parent.effects and comparison.gap <= ENOUGH and not alarms_of(search, parent)
        return np.inf if noise else -np.inf
    if search.gap_left(comparison.found[0]) > ENOUGH:
        return -np.inf
    return PROMISING * gain


def in_same_noise(search: Search, parent: LaplaceFit, found: Sequence[LaplaceFit]) -> Comparison:
    """Candidates and parent, all fitted by the search as it is, compared in the noise of the most probable of them.

    Raises
    ------
    OutOfTimeError
        If the time is over before all that are near have been compared.
    """
    ranked, behind = sorted(found, key=lambda one: -one.log), {one.names: one.log - parent.log for one in found}
    again: list[LaplaceFit] = []
    moved = False
    for turn in itertools.count(1):
        richest = ranked[0] if ranked and ranked[0].log > parent.log else parent
        inference = search.inference.in_noise_of(richest)
        search = search.with_inference(inference)
        once_more = compared_again([one.log for one in ranked], richest.log > parent.log + NAMED)
        parent = inference.again(parent)
        near = [one for one, is_near in zip(ranked, once_more, strict=True) if is_near]
        jobs = [partial(inference.again, one) for one in near if one.evidence.mode.steps]
        again = sorted(_all_of(jobs), key=lambda one: -one.log)
        better = [one for one in again[:COMPARED] if one.log > parent.log]
        # From the one that may get its name to the end; from others as long as it takes to see where they lead.
        ways = [partial(inference.without, one, parent.effects) for one in better[:1]]
        ways += [partial(_warm_started, inference, one, parent) for one in better[1:]]
        if parent.evidence.mode.sigma.any():
            ways.append(partial(_pooled, inference, parent))
        here, parent = parent.log, max([parent, *_all_of(ways)], key=lambda one: one.log)
        moved |= parent.log > here + NAMED
        same = not again or again[0].names == ranked[0].names
        leading = max([parent, *again[:1]], key=lambda one: one.log)
        if not noise_is_taken_again(turn, same, partial(inference.settled_about, leading)):
            break
        ranked = [*again, *(one for one in ranked if one.names not in {other.names for other in again})]
    for one in sorted(ranked, key=lambda one: -behind[one.names]):
        # What other noise said of it is not held against what this noise says of the rest.
        if behind[one.names] <= max([NAMED, *(other.log - parent.log for other in again)]):
            break
        if one.evidence.mode.steps and all(one.names != other.names for other in again):
            again.append(inference.again(one))
    # Innovations that scatter more with the best one do so with all. Of two that explain the same, the one that happens
    # to have less of it would win: of a few stretches that tell something, it is known to a half of itself or so.
    best = max(again, key=lambda one: one.log, default=None)
    factor = 1.0 if best is None else overdispersion_of(inference, parent, best)
    fitted = {one.names: overdispersion_corrected(parent, one, factor) for one in again}
    # The others keep what they were found to explain of what the best of these did, in the noise they were found in.
    lead = max(fitted, key=lambda names: behind[names], default=())
    kept = _share_left(behind[lead], fitted[lead].log - parent.log) if lead else 1.0
    rest = [(one, behind[one.names]) for one in ranked if one.names not in fitted]
    others = [one.with_log(parent.log + gain * (kept if gain > 0.0 else 1.0)) for one, gain in rest]
    ranked = sorted([*fitted.values(), *others], key=lambda one: -one.log)
    return Comparison(search, parent, tuple(ranked), frozenset(fitted), moved=moved)


def _share_left(before: float, after: float) -> float:
    """Share of a gain that is left in better known noise, both in nats; no more than it was."""
    return float(np.clip(after / before, 0.0, 1.0)) if before > 0.0 else 1.0


def compared_about(comparison: Comparison, seen: Confirmation) -> Comparison | None:
    """A comparison with readings linearised about the best candidate: of the others, those that are near are too.

    None where the time does not suffice.

    Parameters
    ----------
    comparison : Comparison
    seen : Confirmation
        Of the candidate.
    """
    mine, first = seen.found.names, max(comparison.gain(one) for one in comparison.found)
    likely = [
        one
        for one in comparison.found
        if one.names != mine and one.evidence.mode.steps and comparison.gain(one) > NAMED
    ]
    near = [one for one in likely if comparison.gain(one) > first - FAR_BEHIND][:PARTNERS]
    there = fit_all([partial(_about, seen, one) for one in near], lambda done: None)
    if any(one is None for one in there):
        return None
    fitted = {mine: seen.found} | {one.names: one for one in there}
    others = [
        one.with_log(seen.parent.log + comparison.gain(one)) for one in comparison.found if one.names not in fitted
    ]
    found = tuple(sorted([*fitted.values(), *others], key=lambda one: -one.log))
    before = comparison.gap_of(comparison.parent)
    shares = {one.names: comparison.gap_of(one) / before for one in comparison.found if one.names not in fitted}
    return replace(
        comparison, search=seen.search, parent=seen.parent, found=found, compared=frozenset(fitted), shares=shares
    )


def _about(seen: Confirmation, other: LaplaceFit) -> LaplaceFit:
    """Another candidate where readings are linearised about the best one."""
    found = fitted_about(seen.search, other, seen.led)
    return overdispersion_corrected(seen.parent, found, seen.overdispersion)


def _all_of(jobs: Sequence[Callable[[], LaplaceFit]]) -> list[LaplaceFit]:
    """Results of all jobs, side by side.

    Raises
    ------
    OutOfTimeError
        If one of them found no time.
    """
    found = fit_all(jobs, lambda done: None)
    if any(one is None for one in found):
        raise OutOfTimeError
    return found


def _warm_started(inference: LaplaceInference, one: LaplaceFit, parent: LaplaceFit) -> LaplaceFit:
    """A parent refitted from where a candidate led: in full only if that begins better."""
    begun = inference.warm_started_without(one, parent.effects)
    return inference.again(begun) if begun.log > parent.log else begun


def _pooled(inference: LaplaceInference, parent: LaplaceFit) -> LaplaceFit:
    """A parent refitted from where its records do not differ."""
    return inference.again(inference.pooled(parent))
