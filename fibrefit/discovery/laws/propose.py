"""A law for a free curve: proposed by regressions, decided by the likelihood.

Free curves show where something acts and on what it depends. A handful of forms that follow them best are written as
effects and fitted in full, with all base parameters, in the likelihood of the search. How many forms were looked at is
paid for. The best one has to account for the records as well as the best free curve does, as far as the two are
distinguished: it says as much in fewer numbers.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.time_limit import in_time, time_left
from fibrefit.discovery.curves.free_form import Reading, shape_of
from fibrefit.discovery.engine.candidates import (
    BLOWN,
    GENTLER,
    SMALL,
    Hypothesis,
    fit_all,
    strengthened,
    transferred,
    trial_of,
)
from fibrefit.discovery.engine.effort import FAR_BEHIND
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import predictor_step
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import APART, NAMED
from fibrefit.discovery.laws.forms import FORMS, forms_of
from fibrefit.discovery.laws.places import PLACES
from fibrefit.discovery.laws.source import Composed, composed, effect_of_law, start_of_law
from fibrefit.discovery.laws.two_variables import Ranked, with_second_variables
from fibrefit.discovery.search.alarms import alarms_of
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.starts import little_is_missing
from fibrefit.fitting.result import Identification

CURVES = 3
"""Free curves that laws are looked for in, the best ones."""
TRIED = 6
"""Laws that are fitted in full."""
SECOND_LOOK = 0.5
"""Share of the time left in which second variables are looked for."""
PRICE_OF_LOOKS = float(np.log(len(FORMS) * len(PLACES)))
"""Nats: any place and any form could have been the one."""


class Proposal(NamedTuple):
    """Laws for what a model lacks.

    Parameters
    ----------
    parent : LaplaceFit
        The model that lacks something.
    ranked : sequence of (LaplaceFit, Composed)
        It with each law, the most probable first.
    readings : sequence of Reading
        The curves they were composed from.
    """

    parent: LaplaceFit
    ranked: Sequence[tuple[LaplaceFit, Composed]]
    readings: Sequence[Reading]

    @property
    def best(self) -> LaplaceFit:
        """The model with the best of them."""
        return self.ranked[0][0]


def proposed(
    search: Search, parent: LaplaceFit, readings: Sequence[Reading], before: Identification | None = None
) -> Proposal | None:
    """The best laws for what a model lacks; None where a free curve does better.

    Where a curve does better than those of one variable, or more than noise is left with them, it is looked at whether
    they change with a second one.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
        The model that lacks something.
    readings : sequence of Reading
        Free curves on top of it, the best first.
    before : Identification, optional
        Of the model the search began with; without it, laws are of one variable.
    """
    laws = _composed(search, parent, readings)
    if not laws:
        return None
    search.tell("fitting laws to the free curves", None)
    effects = [effect_of_law(law) for law in laws]
    supermodel = supermodel_of(search.task, (*parent.effects, *effects), parent.supermodel.sensitivities)
    plain = search.plain(parent)
    near = little_is_missing(search.gap(plain), readings[0].gain)
    follow = partial(_near, search, supermodel, parent) if near else partial(_far, search, supermodel, parent, plain)
    sources = [law.source for law in laws]
    jobs = [search.recalled("law", parent, (sources, law.name, near), partial(follow, law), supermodel) for law in laws]
    ends = fit_all(jobs, lambda done: search.tell("fitting laws to the free curves", done / len(jobs)))
    ranked: Ranked = sorted(
        ((end, law) for end, law in zip(ends, laws, strict=True) if end is not None and np.isfinite(end.log)),
        key=lambda pair: -pair[0].log,
    )
    # Of a law and a curve that are not distinguished the law is taken: it says the same in fewer numbers. The forms
    # that were looked at are paid for where something is said to be there, not once more against the curve.
    enough = parent.log + max(readings[0].gain - APART, PRICE_OF_LOOKS + NAMED)
    if before is not None and ranked and (ranked[0][0].log <= enough or alarms_of(search, ranked[0][0])):
        look = partial(with_second_variables, search, before, parent, ranked, readings)
        ranked, _ = in_time(look, ranked, SECOND_LOOK * time_left())
    return Proposal(parent, ranked, readings) if ranked and ranked[0][0].log > enough else None


def _composed(search: Search, parent: LaplaceFit, readings: Sequence[Reading]) -> list[Composed]:
    """The laws worth a fit: of each of the best curves the forms that follow it best.

    A law says hardly more than its curve: what is far behind the best one leads to none.
    """
    found, taken = [], {effect.name for effect in (*search.task.problem.model.effects, *parent.effects)}
    for reading in [one for one in readings[:CURVES] if one.gain > readings[0].gain - FAR_BEHIND]:
        place = PLACES[reading.probe.name]
        forms = forms_of(reading.knots, shape_of(reading), reading.errors, place.absorbed, place.signed)
        found.append([composed(reading.probe, form, reading.knots, taken) for form in forms[:TRIED]])
    # The best form of each curve comes before the second of any.
    turns = [law for turn in range(TRIED) for laws in found for law in laws[turn : turn + 1]]
    return turns[:TRIED]


def _far(search: Search, supermodel: Supermodel, parent: LaplaceFit, plain: Hypothesis, law: Composed) -> LaplaceFit:
    """A parent with a law, from where plain squares lead: as any candidate where much is missing.

    Where a motion bounces, a descent of the likelihood from the regression's values ends in a wrong minimum: the law of
    a viscous friction that was left out 2160 nats below where plain squares, from a tenth of it, lead.
    """
    effect, values = effect_of_law(law), start_of_law(law)
    weak = {
        name: SMALL * value if name.rpartition(".")[2] in effect.strength else value for name, value in values.items()
    }
    end = trial_of(supermodel, search.context, plain, (effect,), (values, weak)).refitted(search.context)
    contains = parent.evidence.mode.objective
    return search.inference.fitted(supermodel, (*parent.effects, effect), end.fit.local, contains=contains)


def _near(search: Search, supermodel: Supermodel, parent: LaplaceFit, law: Composed) -> LaplaceFit:
    """A parent with a law where little is missing, as far as it may be worth more than the parent it contains."""
    effects, found = (*parent.effects, effect_of_law(law)), parent.evidence.mode
    start = _start(search, supermodel, parent, law)
    return search.inference.fitted(supermodel, effects, start, found.sigma, found.place.eta, found.objective)


def _start(search: Search, supermodel: Supermodel, parent: LaplaceFit, law: Composed) -> np.ndarray:
    """A law as the regression left it, base parameters moved so that least changes; weaker where motions would be lost.

    What base parameters take up of a curve was eliminated there: with the law alone, bounces come at other times.
    """
    effect, names = effect_of_law(law), supermodel.names
    before = transferred(supermodel, parent.supermodel, parent.local)
    goal = before.copy()
    for name, value in start_of_law(law).items():
        declared, column = supermodel.declared[name], names.index(name)
        goal[:, column] = np.clip(value, declared.lower, declared.upper)
        if name.rpartition(".")[2] not in effect.strength:
            before[:, column] = goal[:, column]
    held = search.context.subset(parent.effects)
    whole = replace(held, shared=(*held.shared, *(f"{effect.name}.{strength}" for strength in effect.strength)))
    most, counts = BLOWN * supermodel.costs(before, search.context.whole).sum(), search.context.whole
    for _ in range(GENTLER):
        start = predictor_step(supermodel, held, whole, before, goal, counts)
        if supermodel.costs(start, counts).sum() <= most:
            break
        goal = strengthened(supermodel, goal, [effect], SMALL)
    return start
