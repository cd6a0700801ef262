"""A mistake in what the study states, asked before any effect where measured inputs leave a motion that is lost.

Up to the first bounces little speaks for a slope or a clock that is wrong; beyond them, where readings linearised in
errors of the inputs say nothing, all does. Each mistake is led from there through whole records in plain squares, which
takes a second, and the one that leaves least is what readings are linearised about.
"""

from __future__ import annotations

from functools import partial

import numpy as np

from fibrefit.core.time_limit import in_time
from fibrefit.discovery.choice import Believed, among_rivals
from fibrefit.discovery.comparison import Comparison
from fibrefit.discovery.engine.candidates import Hypothesis, fit_all, transferred, with_values
from fibrefit.discovery.engine.effort import is_near, leads_through
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import Refit
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search.inputs import confirmed, through_all_bounces
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
    found = [_as_found(search, parent, end, before) for end in ends if end is not None and _leads(end, before)]
    if not found:
        return None
    found.sort(key=lambda one: -one.log)
    # Nats of plain squares say which are as good as the best there, and nothing of the others where it is asked about.
    found = [one for i, one in enumerate(found) if is_near(i, one.log - found[0].log)]
    seen, _ = in_time(partial(confirmed, search, parent, found[0]), None)
    if seen is None or seen.gain <= NAMED:
        return None
    return among_rivals(Believed(Comparison(search, parent, tuple(found)), found[0], seen))


def _states(effect: type[Effect]) -> bool:
    """Whether it is a mistake in what the study says of all records."""
    return effect.name.startswith("study.") and not effect.family


def _led(search: Search, parent: LaplaceFit, effects: tuple[type[Effect], ...]) -> Hypothesis:
    """A parent with effects, led through all bounces from where it is or else from what the data suggest."""
    supermodel = search.supermodel_for(effects[0]) if effects else parent.supermodel
    here = transferred(supermodel, parent.supermodel, parent.local)
    starts = here, with_values(supermodel, here, search.context.data_start)
    ends = [through_all_bounces(search, Hypothesis(effects, Refit(start, np.inf), supermodel)) for start in starts]
    return min(ends, key=lambda end: end.fit.cost)


def _leads(end: Hypothesis, before: Hypothesis) -> bool:
    return leads_through(end.fit.cost, before.fit.cost)


def _as_found(search: Search, parent: LaplaceFit, end: Hypothesis, before: Hypothesis) -> LaplaceFit:
    """Where a mistake led, as probable beside the parent as plain squares of whole records make it."""
    supermodel = search.supermodel_for(end.effects[0])
    local = transferred(supermodel, end.supermodel, end.fit.local)
    there = search.inference.without_descent(supermodel, end.effects, local, parent)
    return there.with_log(parent.log + 0.5 * (before.fit.cost - end.fit.cost))
