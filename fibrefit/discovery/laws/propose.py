"""A law for a free curve: proposed by regressions, decided by the likelihood.

Free curves show where something acts and on what it depends. A handful of forms that follow them best are written as
effects and fitted in full, with all base parameters, in the likelihood of the search. How many forms were looked at is
paid for. The best one has to account for the records as well as the best free curve does, as far as the two are
distinguished: it says as much in fewer numbers.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.limits import check_time, in_time, time_left
from fibrefit.discovery.curves.free_form import FittedCurve
from fibrefit.discovery.curves.probes import Curve
from fibrefit.discovery.engine.candidates import (
    SMALL,
    Hypothesis,
    fit_all,
    trial_of,
)
from fibrefit.discovery.engine.effort import (
    FAR_BEHIND,
    LAWS_FITTED,
    PROMISING,
    is_as_good,
    laws_in_turn,
    proposes_laws,
    second_look_time,
)
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import APART, NAMED
from fibrefit.discovery.laws.forms import FORMS, forms_of
from fibrefit.discovery.laws.places import PLACES
from fibrefit.discovery.laws.relaxation import beside, places_along, quadratic_of
from fibrefit.discovery.laws.source import Composed, composed, effect_of_law, heights_of, start_of_law
from fibrefit.discovery.laws.two_variables import Ranked, with_second_variables
from fibrefit.discovery.search.alarms import alarms_of, confirmed_where_it_settles
from fibrefit.discovery.search.inputs import fitted_about
from fibrefit.discovery.search.search import Search
from fibrefit.discovery.search.starts import little_is_missing
from fibrefit.fitting.result import Identification

PRICE_OF_LOOKS = float(np.log(len(FORMS) * len(PLACES)))
"""Nats: any place and any form could have been the one."""


class Proposal(NamedTuple):
    """Laws for what a model lacks.

    Parameters
    ----------
    search : Search
        In which they were compared.
    parent : LaplaceFit
        The model that lacks something.
    ranked : sequence of (LaplaceFit, Composed)
        It with each law, the most probable first.
    curves : sequence of FittedCurve
        The curves they were composed from.
    led : bool
        Whether they were led there from before the first bounces, as what is held against them is then.
    needed : float
        Nats that one has to gain to do what the best curve does.
    """

    search: Search
    parent: LaplaceFit
    ranked: Sequence[tuple[LaplaceFit, Composed]]
    curves: Sequence[FittedCurve]
    led: bool = False
    needed: float = -np.inf

    def beside(self, law: Composed) -> Proposal:
        """The same without the laws of a law's curve."""
        return self._replace(ranked=[pair for pair in self.ranked if pair[1].probe is not law.probe])

    @property
    def best(self) -> LaplaceFit:
        """The model with the best of them."""
        return self.ranked[0][0]

    @property
    def gain(self) -> float:
        """Logarithm of its Bayes factor over the parent; none of no law."""
        return self.best.log - self.parent.log if self.ranked else -np.inf


def proposed(
    search: Search, parent: LaplaceFit, curves: Sequence[FittedCurve], before: Identification | None = None
) -> Proposal | None:
    """The best laws for what a model lacks; None where a free curve does better.

    Where a curve does better than those of one variable, or more than noise is left with them, it is looked at whether
    they change with a second one.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
        The model that lacks something.
    curves : sequence of FittedCurve
        Free curves on top of it, the best first.
    before : Identification, optional
        Of the model the search began with; without it, laws are of one variable.
    """
    laws = _composed(search, parent, curves)
    if not laws:
        return None
    effects = [effect_of_law(law) for law in laws]
    # In the order in which a search has them: where readings are linearised about a law the same program serves.
    held = sorted((*parent.effects, *effects), key=lambda effect: effect.name)
    supermodel = supermodel_of(search.task, held, parent.supermodel.sensitivities)
    # Of a law and a curve that are not distinguished the law is taken: it says the same in fewer numbers. The forms
    # that were looked at are paid for where something is said to be there, not once more against the curve.
    needed = max(curves[0].gain - APART, PRICE_OF_LOOKS + NAMED)
    ranked = _ranked(search, supermodel, parent, curves, laws, parent.log + needed)
    here = Proposal(search, parent, ranked, curves, needed=needed)
    found, _ = in_time(partial(_about_the_best, here, needed), here, second_look_time(time_left()))
    if before is not None and found.ranked and (found.gain <= needed or alarms_of(found.search, found.best)):
        look = partial(with_second_variables, found.search, before, found.parent, found.ranked, curves)
        ranked, _ = in_time(look, found.ranked, second_look_time(time_left()))
        found = found._replace(ranked=ranked)
    if found.gain > needed:
        return found
    check_time()  # of laws that were not fitted in time nothing is known
    return None


def _about_the_best(found: Proposal, needed: float) -> Proposal:
    """Laws that gain a fair share of what is needed with readings linearised about the best, if that is all there is.

    A free curve bends to what readings miss that are linearised in errors of their inputs about the parent, as a law
    cannot: of an end stop on a drive no form came nearer to the curve than 146 nats, and its knee gains 2736 about
    itself for 1977. There it leaves nothing, and has 86 N/m in place of 55, as it should be nearer to 101.
    """
    if not PROMISING * needed < found.gain <= needed:
        return found
    (best, law), search = found.ranked[0], found.search
    seen, left = confirmed_where_it_settles(search, found.parent, best)
    if seen is None or seen.gain <= needed or left:
        return found
    # As all laws here, without an overdispersion: none is held against what was divided by one.
    own = seen.found if seen.overdispersion == 1.0 else seen.search.inference.again(seen.found)
    near = [pair for pair in found.ranked[1:] if pair[0].log > best.log - FAR_BEHIND]
    there = fit_all([partial(fitted_about, seen.search, end, seen.led) for end, _ in near], lambda done: None)
    others = [(end, law) for end, (_, law) in zip(there, near, strict=True) if end is not None]
    ranked = sorted([(own, law), *others], key=lambda pair: -pair[0].log)
    return Proposal(seen.search, seen.parent, ranked, found.curves, seen.led, needed)


def _ranked(
    search: Search, supermodel: Supermodel, parent: LaplaceFit, curves: Sequence[FittedCurve], laws: Sequence[Composed],
    enough: float,
) -> Ranked:  # fmt: skip
    """A parent with each law, from where its curve is, or from afar where that is not enough; most probable first.

    The gap is that of slow noise as well: though it is large, slopes that foretell what a curve gains lead to its law.
    """
    plain = search.plain(parent)
    near = partial(_near, search, supermodel, parent, {curve.probe: curve for curve in curves})
    far = partial(_far, search, supermodel, parent, plain)
    little = little_is_missing(search.gap(plain), curves[0].gain)
    ranked, sources = list[tuple[LaplaceFit, Composed]](), [law.source for law in laws]
    # What was found from one of them is often enough; where it is not, neither place is known to be the better one.
    first, second = ("near", "far") if little or curves[0].predicted_well else ("far", "near")
    both = {"near": near, "far": far}
    ways = {way: both[way] for way in ((first,) if little else (first, second))}
    for way, follow in ways.items():
        about = sources, way
        jobs = [search.recalled("law", parent, (*about, law.name), partial(follow, law), supermodel) for law in laws]
        ends = fit_all(jobs, lambda done: search.tell("fitting laws to the free curves", done / len(laws)))
        ranked += [(end, law) for end, law in zip(ends, laws, strict=True) if end is not None and np.isfinite(end.log)]
        ranked.sort(key=lambda pair: -pair[0].log)
        if ranked and ranked[0][0].log > enough:
            break
    best = {law.name: (end, law) for end, law in reversed(ranked)}
    return sorted(best.values(), key=lambda pair: -pair[0].log)


def _composed(search: Search, parent: LaplaceFit, curves: Sequence[FittedCurve]) -> list[Composed]:
    """The laws worth a fit: of each of the best curves the forms that follow it best.

    A law says hardly more than its curve: what is far behind the best one leads to none.
    """
    found, taken = [], {effect.name for effect in (*search.task.problem.model.effects, *parent.effects)}
    best = [one for place, one in enumerate(curves) if proposes_laws(place)]
    for curve in [one for one in best if is_as_good(one.gain, curves[0].gain)]:
        place = PLACES[curve.probe.name]
        forms = forms_of(quadratic_of(curve), place.signed)
        found.append([composed(curve.probe, form, curve.knots, taken) for form in forms[:LAWS_FITTED]])
    return laws_in_turn(found)


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


def _near(
    search: Search, supermodel: Supermodel, parent: LaplaceFit, curves: Mapping[type[Curve], FittedCurve], law: Composed
) -> LaplaceFit:
    """A parent with a law from where its free curve is, as far as it may be worth more than the parent it contains.

    Base parameters that were moved for the curve stay near: with the law alone bounces come at other times.
    """
    curve = curves[law.probe]
    effects, there = (*parent.effects, effect_of_law(law)), curve.fitted.evidence.mode
    start = beside(curve, heights_of(law, places_along(curve.knots)), supermodel)
    for name, value in start_of_law(law).items():
        declared = supermodel.declared[name]
        start[:, supermodel.names.index(name)] = np.clip(value, declared.lower, declared.upper)
    contains = parent.evidence.mode.objective
    return search.inference.fitted(supermodel, effects, start, there.sigma, there.place.eta, contains)
