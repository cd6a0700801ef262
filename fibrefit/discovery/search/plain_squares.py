"""Effects followed from where plain squares over growing horizons lead: where slopes say too little of what is far."""

from __future__ import annotations

from functools import partial

import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis, Trial, fit_all, trial_of
from fibrefit.discovery.engine.effort import in_wrong_minimum, is_searched_widely, promising
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.screening import PredictedGains
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.search.base import SearchState
from fibrefit.discovery.search.followed import at_likeliest_instants, extended
from fibrefit.discovery.search.screen import Screen
from fibrefit.discovery.search.starts import has_valleys, starting_values

SCREENING_SHARE = 0.7
"""Share of a round's time in which all candidates take their first steps."""


def from_plain_squares(
    search: SearchState, parent: LaplaceFit, plain: Hypothesis, predictions: PredictedGains, what: str
) -> list[LaplaceFit]:
    """A parent with each effect, from where plain squares led: in full those that are promising there."""
    ends = sorted(_in_plain_squares(search, plain, predictions, what), key=lambda end: end.fit.cost)
    near = promising(plain.fit.cost, [end.fit.cost for end in ends])
    fit = partial(_fitted, search, parent, predictions)
    jobs = [
        search.recalled(
            "fitted",
            parent,
            (end.names, end.fit.cost, is_near, predictions[end.effects[-1]].gain),
            partial(fit, end, is_near),
        )
        for end, is_near in zip(ends, near, strict=True)
    ]
    share = 1.0 - SCREENING_SHARE
    found = fit_all(jobs, lambda done: search.tell(what, SCREENING_SHARE + share * done / max(len(jobs), 1)))
    return [one for one in found if one is not None]


def _fitted(
    search: SearchState, parent: LaplaceFit, predictions: PredictedGains, end: Hypothesis, near: bool
) -> LaplaceFit:
    """A parent with an effect: from where plain squares led, or where that is no good, from where it is weak."""
    lead = search.inference.fitted if near else partial(search.inference.without_descent, parent=parent)
    found = lead(end.supermodel, end.effects, end.fit.local)
    effect = end.effects[-1]
    if near:
        found = at_likeliest_instants(search.inference, parent, found)
    # What is over within a few samples is nothing in plain squares, and much where noise is slow.
    missed = predictions[effect].gain > NAMED and found.log <= parent.log
    if not missed and not (near and in_wrong_minimum(found.log, parent.log)):
        return found
    screen = Screen(search.inference, parent, search.inference.slopes(parent))
    prediction = screen.predicted(end.supermodel, [effect])[effect]
    if not np.isfinite(prediction.gain):
        return found
    return max(found, extended(search.inference, parent, end.supermodel, effect, prediction), key=lambda one: one.log)


def _in_plain_squares(
    search: SearchState, plain: Hypothesis, predictions: PredictedGains, what: str
) -> list[Hypothesis]:
    """Each effect on top of a hypothesis, where plain squares over growing horizons lead."""
    begun = {
        effect: () if is_searched_widely(i) and not has_valleys(effect) else starting_values(prediction)
        for i, (effect, prediction) in enumerate(predictions.items())
    }
    jobs = [
        search.recalled(
            "screening", plain, (effect.name, starts),
            partial(trial_of, search.supermodel_for(effect, plain.effects), search.context, plain, (effect,), starts),
        )
        for effect, starts in begun.items()
    ]  # fmt: skip
    tell = lambda done: search.tell(what, 0.6 * SCREENING_SHARE * done / max(len(jobs), 1))  # noqa: E731
    trials: list[Trial] = [trial for trial in fit_all(jobs, tell) if trial is not None]
    trials.sort(key=lambda trial: trial.fits[0].cost)
    close = promising(plain.fit.cost, [trial.fits[0].cost for trial in trials])
    near = [trial for trial, is_near in zip(trials, close, strict=True) if is_near]
    further = [
        search.recalled(
            "refitted", plain, (trial.effects[-1].name, trial.fits[0].cost), partial(trial.refitted, search.context)
        )
        for trial in near
    ]
    ends = fit_all(further, lambda done: None)
    found = [trial.as_it_is() if end is None else end for trial, end in zip(near, ends, strict=True)]
    return [*found, *(trial.as_it_is() for trial in trials[len(near) :])]
