"""Two effects at once, where one after the other they gain too little or end in wrong minima; what says so."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fibrefit.core.limits import OutOfTimeError, check_time, in_time, time_left
from fibrefit.discovery.comparison import Comparison, in_same_noise
from fibrefit.discovery.curves.free_form import FittedCurve, probe_all
from fibrefit.discovery.engine.effort import PROMISING, is_partner, probing_time, side_search_time
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.laplace_inference import LaplaceInference
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search.alarms import alarms_of
from fibrefit.discovery.search.inputs import fitted_about, overdispersion_corrected, overdispersion_of
from fibrefit.discovery.search.search import Search, Tried
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect


def curves_beyond(search: Search, best: LaplaceFit, before: Identification) -> list[FittedCurve]:
    """Free curves that explain more than a model does, best first.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
    before : Identification
        Of the model the search began with.

    Raises
    ------
    OutOfTimeError
        If not all could be drawn: what was not is not known to explain nothing.
    """
    found = probe_all(search, best, before, NAMED)
    check_time()
    return found


def incomplete(comparison: Comparison, before: Identification) -> tuple[bool, Sequence[FittedCurve] | None]:
    """Whether something is missing though no effect gains enough, and the free curves, None where no time was left.

    Two effects that partly undo each other gain little one by one, and what they leave looks like noise. Where the time
    did not suffice for curves it is not known that nothing is.
    """
    search, parent = comparison.search, comparison.parent
    curves, _ = in_time(partial(curves_beyond, search, parent, before), None, probing_time(time_left()))
    return curves is None or bool(curves or alarms_of(search, parent)), curves


def best_pair(comparison: Comparison, instead: LaplaceFit) -> Comparison | None:
    """Two effects together that are more than chance, need each other and gain more than what they take the place of.

    Beyond a single effect they have to gain what the best of so many pairs gains by chance. Beyond two that were found
    one after the other they need not: these are one of the pairs, no more probable than any before it is looked at.

    Parameters
    ----------
    comparison : Comparison
        Of effects one by one: the pairs are those of the best of them.
    instead : LaplaceFit
        What was found one by one, with two effects at the most.

    Returns
    -------
    Comparison or None
        The pair first; None where there is none.

    Raises
    ------
    OutOfTimeError
        If there is none among those that the time sufficed for, and it did not for all.
    """
    search, found, number, all_tried = comparison.search, list[LaplaceFit](), 0, True
    best, beside = [one for i, one in enumerate(comparison.found) if is_partner(i)], _beside(comparison, instead)
    reached, likely = max([comparison.parent.log, *(one.log for one in beside)]), [one.effects[-1] for one in best]
    # Slopes about infinity are no numbers: what has no place is the second of its pairs, and two such are none.
    firsts = [one for one in best if one.has_a_place]

    def partners(first: LaplaceFit, done: Sequence[type[Effect]]) -> Tried:
        # What undoes a part of the first gains nothing by itself: all whose slopes cost little are tried.
        further = [each for each in search.extensions(first) if each in likely or search.shares_a_program(each)]
        # A pair has to gain more than what was found one by one: slopes predict a fair share of that.
        least = PROMISING * (reached - first.log)
        return search.tried(first, [each for each in further if each not in done], "trying effects in pairs", least)

    for i, first in enumerate(firsts):
        done = [one.effects[-1] for one in firsts[:i]]
        (some, untried), came = in_time(partial(partners, first, done), Tried([]), side_search_time(time_left()))
        all_tried &= came and not untried
        number += len(some)
        found += [one for one in some if one.evidence.mode.steps]
    others = [one for one in found if set(one.names) != set(instead.names)]
    pairs = in_same_noise(search, comparison.parent, [*others, *beside])
    most = next((one for one in pairs.found[:1] if set(one.names) != set(instead.names)), None)
    least = max([pairs.parent.log, *(one.log for one in pairs.found if len(one.effects) == 1)])
    beyond_chance = NAMED + np.log(max(number, 1))
    if most is not None and most.log > least + beyond_chance and pruned(pairs.search.inference, most) is most:
        return replace(pairs, others=number - len(found))
    if not all_tried:
        raise OutOfTimeError
    return None


def _beside(comparison: Comparison, instead: LaplaceFit) -> list[LaplaceFit]:
    """What pairs are held against: the single effect that was found, or two that were found one after the other.

    These were compared in the noise of another round, whose nats say nothing here.
    """
    if not instead.effects:
        return []
    here = next((one for one in comparison.found if set(one.names) == set(instead.names)), None)
    return [fitted_about(comparison.search, instead) if here is None else here]


def pruned(inference: LaplaceInference, best: LaplaceFit) -> LaplaceFit:
    """A hypothesis without the effects a later one has made needless."""
    if len(best.effects) < 2:
        return best
    # Its evidence may be divided by an overdispersion, and that of what is left without an effect is not.
    whole = inference.again(best)
    for effect in best.effects:
        rest = tuple(other for other in best.effects if other is not effect)
        if any(effect.name in other.needs for other in rest):
            continue
        lesser = inference.without(whole, rest)
        seen = overdispersion_corrected(lesser, whole, overdispersion_of(inference, lesser, whole))
        if seen.log - lesser.log <= NAMED:
            return pruned(inference, lesser)
    return best
