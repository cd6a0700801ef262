"""A mistake in what the study states, asked before any effect where measured inputs leave a motion that is lost.

Up to the first bounces little speaks for a slope or a clock that is wrong; beyond them, where readings linearised in
errors of the inputs say nothing, all does. Each mistake is led from there through whole records in plain squares, which
takes a second, and those that leave least are asked about themselves, until one is more than chance and leaves hardly
more than noise. One that explains a part is a candidate among all others: a missing effect loses bounces, too.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from fibrefit.core.limits import in_time
from fibrefit.discovery.choice import Believed, among_rivals
from fibrefit.discovery.comparison import Comparison
from fibrefit.discovery.engine.candidates import Hypothesis, fit_all, transferred, with_values
from fibrefit.discovery.engine.effort import COMPARED, leads_through, meets_all_bounces, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED
from fibrefit.discovery.search.inputs import Confirmation, confirmed, through_all_bounces
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect


def mistaken(search: Search, parent: LaplaceFit) -> Believed | None:
    """The mistake that leads through the bounces which a model with noisy inputs loses; None where none does.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
        The model the search began with.
    """
    if (known := parent.supermodel.sensitivities) is None or not known.far:
        return None
    search.tell("leading mistakes of the study through all bounces", None)
    mistakes = [effect for effect in search.extensions(parent) if _states(effect)]
    led = [partial(_led, search, parent, effects) for effects in ((), *((effect,) for effect in mistakes))]
    before, *ends = fit_all(led, lambda done: None)
    if before is None:
        return None
    met = [end for end in ends if end is not None and meets_all_bounces(end.fit.cost, search.task.problem.n_measured)]
    found = [_as_found(search, parent, end) for end in _that_lead(before, met)]
    for i, one in enumerate(found):
        seen, _ = in_time(partial(confirmed, search, parent, one, lead=True), None)
        if seen is not None and seen.gain > NAMED and slopes_tell(seen.search.gap_left(seen.found)):
            return _believed(Comparison(search, parent, tuple(found), others=len(mistakes) - len(found)), one, seen)
        found[i] = one.with_log(parent.log + (0.0 if seen is None else seen.gain))
    return None


def _believed(comparison: Comparison, one: LaplaceFit, seen: Confirmation) -> Believed:
    """What is believed of mistakes that lead: one alone, with what it gains, where no time is left for the others."""
    found = among_rivals(Believed(comparison, one, seen))
    if found.comparison is not comparison:
        return found
    alone = one.with_log(comparison.parent.log + seen.gain)
    others = comparison.others + len(comparison.found) - 1
    return Believed(replace(comparison, found=(alone,), others=others), alone, seen)


def _states(effect: type[Effect]) -> bool:
    """Whether it is a mistake in what the study says of all records."""
    return effect.name.startswith("study.") and not effect.family


def _led(search: Search, parent: LaplaceFit, effects: tuple[type[Effect], ...]) -> Hypothesis:
    """A parent with effects, led through all bounces from where it is or else from what the data suggest."""
    supermodel = search.supermodel_for(effects[0]) if effects else parent.supermodel
    here = transferred(supermodel, parent.supermodel, parent.local)
    starts = here, with_values(supermodel, here, search.context.data_start)
    ends = [through_all_bounces(search, Hypothesis(effects, Refit(start, np.inf), supermodel)) for start in starts]
    end = min(ends, key=lambda end: end.fit.cost)
    return Hypothesis(effects, Refit(transferred(supermodel, end.supermodel, end.fit.local), end.fit.cost), supermodel)


def _that_lead(before: Hypothesis, ends: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The mistakes that may lead through the bounces, those that leave least first, and no more than are compared."""
    ranked = sorted(ends, key=lambda end: end.fit.cost)
    leading = [end for end in ranked if leads_through(end.fit.cost, before.fit.cost)]
    return [end for end in leading[:COMPARED] if not leads_through(leading[0].fit.cost, end.fit.cost)]


def _as_found(search: Search, parent: LaplaceFit, end: Hypothesis) -> LaplaceFit:
    """Where a mistake led. Plain squares hold the errors of the input, and say no more than that it is likely."""
    there = search.inference.without_descent(end.supermodel, end.effects, end.fit.local, parent)
    return there.with_log(parent.log + BEYOND_DOUBT)
