"""A law of no name, held against the effect that a round has found.

A cause that no catalogue holds still changes the readings, and some effect always fits them better than none: added
one after the other, such effects account for little and take all the time. Where tests of the innovations see something
left beside the best effect, a law composed from free curves is a candidate like any other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from typing import NamedTuple

import numpy as np

from fibrefit.core.time_limit import OutOfTimeError, in_time, time_left
from fibrefit.discovery.comparison import Comparison, in_same_noise
from fibrefit.discovery.curves.free_form import FittedCurve, proposed_by, proposing
from fibrefit.discovery.curves.predicted import look_at
from fibrefit.discovery.curves.probes import COURSES, PROBES
from fibrefit.discovery.engine.effort import HARDLY, PROMISING, side_search_time, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.screening import PredictedGain
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, LIKENESS, NAMED
from fibrefit.discovery.laws.propose import PRICE_OF_LOOKS
from fibrefit.discovery.laws.told import described, held_law
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.alarms import alarms_of, most_nats
from fibrefit.discovery.search.inputs import Confirmation, confirmed, fitted_about
from fibrefit.discovery.search.search import Search, Tried
from fibrefit.discovery.search.starts import may_do_better
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
from fibrefit.laws.ports import PORTS, port_of

OF_ONE_QUANTITY = ("guide", "fibre")
"""Ports whose laws change one force each; those of sensors change readings of several channels."""


class Unnamed(NamedTuple):
    """A law that leaves nothing but noise, and what it was found with.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
        The model without it, in the noise that it leaves.
    curves : sequence of FittedCurve
        Free curves on top of the parent, the best first.
    law : (LaplaceFit, ProposedLaw)
    """

    search: Search
    parent: LaplaceFit
    curves: Sequence[FittedCurve]
    law: tuple[LaplaceFit, ProposedLaw]


def law_before_effects(search: Search, parent: LaplaceFit, before: Identification) -> tuple[Unnamed, Comparison] | None:
    """A law of which slopes predict far more than of any effect, and the effects held against it; None for none.

    It is sooner composed than all effects are followed. Then those are of which slopes predict more than hardly any
    of what it gains, and another one beside the best where that does half of it. Where these do as well, or no law
    leaves nothing, the round goes on as ever.

    Parameters
    ----------
    search : Search
    parent : LaplaceFit
        The model the search began with.
    before : Identification
        Of it.
    """
    swift = search.swift_extensions(parent)
    gains = search.predicted_gains(parent, search.inference.slopes(parent), swift, "looking for what slopes promise")
    if not gains:
        return None
    most = max(one.gain for one in gains.values())
    sets = (PROBES, COURSES) if most > BEYOND_DOUBT else (PROBES,)
    looks = look_at(search, parent, before, tuple(PORTS), *sets)
    if COURSES not in sets and looks.promise > BEYOND_DOUBT:
        looks = looks.joined(look_at(search, parent, before, tuple(PORTS), COURSES))
    if may_do_better(most, max(looks.promise, 0.0)):
        return None
    curves = partial(proposed_by, search, parent, looks)
    found, _ = in_time(lambda: _law_of(search, parent, None, curves(), 0.0), None, side_search_time(time_left()))
    if found is None:
        return None
    effects = found.search.extensions(found.parent)
    job = partial(_tried_against, found, found.parent, effects, HARDLY)
    # What the time does not suffice to ask is told, and a law that was found is not lost with it.
    tried, _ = in_time(job, Tried([], effects))
    if _does_as_well(found, tried):
        return None
    best = max((one for one in tried.found if one.evidence.mode.steps), key=lambda one: one.log, default=found.parent)
    gain = best.log - found.parent.log
    if gain > PROMISING * (_worth(found) - found.parent.log):
        near = parent if found.search.lacks_little(found.parent, gain) else None
        second = partial(_second_does_as_well, found, best, near)
        explained, _ = in_time(second, False, side_search_time(time_left()))
        if explained:
            return None
    return found, Comparison(found.search, found.parent, tuple(tried.found), untried=tried.untried)


def law_beside_choice(
    comparison: Comparison,
    chosen: LaplaceFit | None,
    seen: Confirmation | None,
    first: Comparison,
    before: Identification,
    near: LaplaceFit | None = None,
) -> Unnamed | None:
    """A law that accounts for what the effect chosen in a round does not; None where there is no such.

    Parameters
    ----------
    comparison : Comparison
    chosen : LaplaceFit or None
        What is to be added; where nothing is, see `law_without_choice`.
    seen : Confirmation or None
        Of it.
    first : Comparison
        The first round, at effects one by one.
    before : Identification
        Of the model the search began with.
    near : LaplaceFit, optional
        A model without what is chosen that lacks little, in which slopes of further effects may be taken.

    Raises
    ------
    OutOfTimeError
        If slopes predict far more of a curve than the effect gains, and no time was left to see whether it is so.
    """
    if chosen is None:
        return None
    # What the time does not suffice to ask is not held against an effect that was found.
    left, _ = in_time(partial(_left, comparison, chosen, seen), 0.0)
    predicted, _ = in_time(partial(_predicted_beyond, comparison, chosen, seen, before), 0.0)
    much = predicted or (left if _leaves_much(comparison, chosen, left) else 0.0)
    if asked := much > 0.0 and not _another_promises(comparison, chosen, seen, much, near):
        job = partial(_law_about, comparison.search, comparison.parent, chosen, before, tuple(PORTS), left)
    elif ports := _in_one_place(chosen, comparison.parent):
        # Two effects that change the same force may stand in for one law of it.
        job = partial(_law_instead, first, chosen, before, ports)
    else:
        return None
    found, came = in_time(job, None, side_search_time(time_left()))
    if asked and predicted and not came:
        raise OutOfTimeError
    if found is not None and len(chosen.effects) == len(found.parent.effects) + 1:
        second = partial(_second_does_as_well, found, chosen, near)
        explained, _ = in_time(second, False, side_search_time(time_left()))
        return None if explained else found
    return found


def law_without_choice(
    search: Search, best: LaplaceFit, before: Identification, curves: Sequence[FittedCurve]
) -> Unnamed | None:
    """A law where no further effect gains enough: in the place of one that was named, or beside all; None for none.

    An effect whose law is near that of a cause which no catalogue holds leaves next to nothing, and often no test
    objects: it has its name only if no law composed without it accounts for the records better. What such a law does
    beyond the effect, a free curve of the same port does on top of it.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
        With all effects that were found.
    before : Identification
        Of the model the search began with.
    curves : sequence of FittedCurve
        Free curves that explain more than it does, the best first.
    """
    if not curves:
        return None
    needed = {name for effect in best.effects for name in effect.needs}
    further, left = {str(port_of(curve.probe)) for curve in curves}, most_nats(alarms_of(search, best))
    for effect in best.effects:
        port = str(port_of(effect))
        if port in further and effect.name not in needed:
            rest = tuple(other for other in best.effects if other is not effect)
            job = partial(_law_in_place, search, best, rest, before, port, left)
            found, _ = in_time(job, None, side_search_time(time_left()))
            if found is not None:
                return found
    found, _ = in_time(partial(_law_of, search, best, None, curves, left), None, side_search_time(time_left()))
    return found


def _law_in_place(
    search: Search, best: LaplaceFit, rest: tuple[type[Effect], ...], before: Identification, port: str, left: float
) -> Unnamed | None:
    """A law of a port beside the rest of what was named, better than all of it and what is left beside that."""
    return _law_about(search, search.inference.without(best, rest), best, before, {port}, left)


def _left(comparison: Comparison, chosen: LaplaceFit, seen: Confirmation | None) -> float:
    """Nats that tests of the innovations see left beside what is to be added; 0 where none objects."""
    return most_nats(alarms_of(comparison.search, chosen) if seen is None else alarms_of(seen.search, seen.found))


def _predicted_beyond(
    comparison: Comparison, chosen: LaplaceFit, seen: Confirmation | None, before: Identification
) -> float:
    """Nats that slopes predict of a free curve beyond what the effect gains, where little is missing; 0 for no more.

    They are none either unless slopes predict more of the curve than of the effect.

    No effect of the catalogue is what is missing then: of some that a friction over the position looks like, one
    gained 30 nats where a curve gains 300. From afar slopes predict too much of everything, of an effect as of a
    curve; where the effect gains nothing like what they predict, that says nothing of it.
    """
    search, parent = comparison.search, comparison.parent
    if not slopes_tell(comparison.gap):
        return 0.0
    gain = comparison.gain(chosen) if seen is None else max(comparison.gain(chosen), seen.gain)
    curve = look_at(search, parent, before, tuple(PORTS)).promise - NAMED - PRICE_OF_LOOKS
    if curve > gain and curve > min(_predicted_of(search, parent, chosen), gain / PROMISING):
        return curve - gain
    return 0.0


def _predicted_of(search: Search, parent: LaplaceFit, chosen: LaplaceFit) -> float:
    """What slopes predict of the effects that are to be added, one by one."""
    added = [effect for effect in chosen.effects if effect not in parent.effects]
    gains = search.predicted_gains(parent, search.inference.slopes(parent), added, "what slopes promise of it")
    return sum(one.gain for one in gains.values())


def _second_does_as_well(found: Unnamed, chosen: LaplaceFit, near: LaplaceFit | None) -> bool:
    """Whether an effect and a further one make the records as probable as a law that takes the place of the first.

    Two effects of the catalogue are no less likely than one law that nobody has seen. Slopes of the further one may be
    taken in a `near` model.
    """
    there, known = found.search, found.parent.supermodel.sensitivities
    seen_there = chosen.supermodel.sensitivities is known
    first = there.inference.again(chosen) if seen_there else fitted_about(there, chosen)
    return _does_as_well(found, _tried_against(found, first, there.swift_extensions(first), PROMISING, near))


def _tried_against(
    found: Unnamed,
    first: LaplaceFit,
    effects: Sequence[type[Effect]],
    share: float,
    near: LaplaceFit | None = None,
) -> Tried:
    """Effects on top of a hypothesis, of which slopes predict a share of what they need to come near a law."""
    least = share * (_worth(found) - first.log)
    return found.search.tried(first, effects, "trying further effects against a law", least, near)


def _does_as_well(found: Unnamed, tried: Tried) -> bool:
    """Whether one of the effects tried makes the records as probable as a law does."""
    return any(one.log >= _worth(found) for one in tried.found if one.evidence.mode.steps)


def _worth(found: Unnamed) -> float:
    """Evidence from which an effect is no less likely than a law, whose forms are paid for."""
    return found.law[0].log - PRICE_OF_LOOKS - NAMED


def _leaves_much(comparison: Comparison, chosen: LaplaceFit, left: float) -> bool:
    """Whether an effect may be but the likeness of another law, by what it leaves, where slopes say nothing of curves.

    What it leaves may as well be another effect, which the next round finds, or a law in the place of this one then.
    """
    near = slopes_tell(comparison.gap)
    return not near and left > LIKENESS * comparison.gain(chosen)


def _another_promises(
    comparison: Comparison, chosen: LaplaceFit, seen: Confirmation | None, left: float, near: LaplaceFit | None
) -> bool:
    """Whether slopes predict of a further effect a fair share of what the first leaves: the next round tries it first.

    Two effects are no less likely than a law that nobody has seen, and are sooner tried; a law of what these leave, or
    in their place, is looked for after that.
    """
    search, best = (comparison.search, chosen) if seen is None else (seen.search, seen.found)
    swift = search.swift_extensions(best)

    def predicted() -> dict[type[Effect], PredictedGain]:
        return search.predicted_gains(best, search.inference.slopes(best), swift, "what is left beside it", near)

    gains, came = in_time(predicted, dict[type[Effect], PredictedGain]())
    return came and max((one.gain for one in gains.values()), default=-np.inf) > PROMISING * left


def _in_one_place(chosen: LaplaceFit, parent: LaplaceFit) -> frozenset[str]:
    """The port of what is to be added where all effects of its parent act there, too; empty where they do not.

    How an effect says it, as a friction, a viscosity or a force, makes no difference to the weight.
    """
    ports = frozenset(str(port_of(effect)) for effect in chosen.effects)
    return ports & set(OF_ONE_QUANTITY) if parent.effects and len(ports) == 1 else frozenset()


def _law_instead(
    first: Comparison, chosen: LaplaceFit, before: Identification, ports: Collection[str]
) -> Unnamed | None:
    """A law in the place of two effects, all in the noise of the first round and linearised about its model."""
    return _law_about(first.search, first.parent, fitted_about(first.search, chosen), before, ports, 0.0)


def _law_about(
    search: Search, parent: LaplaceFit, chosen: LaplaceFit, before: Identification, ports: Collection[str], left: float
) -> Unnamed | None:
    """A law that gains what an effect does and what is left beside it, and leaves nothing itself.

    Those over the course of a record are all looked for where none of these does.
    """
    curves = proposing(search, parent, before, ports)
    found = _law_of(search, parent, chosen, curves, left)
    over_course = [curve for curve in curves if curve.probe in COURSES]
    if found is not None or len(over_course) == len(curves):
        return found
    more = over_course or proposing(search, parent, before, ports, COURSES)
    return _law_of(search, parent, chosen, more, left)


def _law_of(
    search: Search, parent: LaplaceFit, chosen: LaplaceFit | None, curves: Sequence[FittedCurve], left: float
) -> Unnamed | None:
    """The same of curves that were drawn; where no effect is `chosen`, beside the parent."""
    held = held_law(search, parent, curves) if curves else None
    if held is None:
        return None
    law, proposal, before = held.fit, held.proposal, 0.0
    if chosen is not None and proposal.search is not search:
        # Where readings are linearised about a law, an effect is worth no less than it was where it was found.
        before = chosen.log - parent.log
        chosen = fitted_about(proposal.search, chosen, proposal.led)
    search, parent, others = proposal.search, proposal.parent, () if chosen is None else (chosen,)
    here = Comparison(search, parent, tuple(sorted((law, *others), key=lambda one: -one.log)))
    # What the time does not suffice to compare in better known noise is compared in the noise at hand.
    there, _ = in_time(partial(in_same_noise, search, parent, [law, *others]), here, side_search_time(time_left()))
    fitted = next(one for one in there.found if one.names == law.names)
    most = max([there.parent.log + before, *(one.log for one in there.found if one is not fitted)])
    needed = most + left + NAMED
    if fitted.log - PRICE_OF_LOOKS <= needed:
        return None
    if alarms_of(there.search, fitted):
        # What readings miss that are linearised about another model looks like something left.
        job = partial(_about_itself, there, fitted, needed - there.parent.log)
        about, _ = in_time(job, None, side_search_time(time_left()))
        if about is None:
            return None
        there, fitted = about
    # A law that was found is not lost with the time that this takes.
    whole, look = (there.parent, fitted), partial(_without_needless, there, fitted)
    (parent, fitted), _ = in_time(look, whole, side_search_time(time_left()))
    told = described(there.search, parent, held._replace(fit=fitted))
    return Unnamed(there.search, parent, curves, (fitted, told))


def _without_needless(there: Comparison, law: LaplaceFit) -> tuple[LaplaceFit, LaplaceFit]:
    """A law without the effects that it makes needless, as a later effect does, and its parent without them.

    What was added before may be but the likeness of the law, in the first place where some effect did most of it.
    """
    if not there.parent.effects:
        return there.parent, law
    inference = there.search.inference
    left = pruned(inference, law)
    rest = tuple(effect for effect in there.parent.effects if effect in left.effects)
    if law.effects[-1] not in left.effects or len(rest) == len(there.parent.effects):
        return there.parent, law
    return inference.without(there.parent, rest), left


def _about_itself(there: Comparison, law: LaplaceFit, needed: float) -> tuple[Comparison, LaplaceFit] | None:
    """A law with readings linearised about itself; None where it gains less there than is needed, or tests object."""
    seen = confirmed(there.search, there.parent, law)
    if seen is None or seen.gain - PRICE_OF_LOOKS <= needed or alarms_of(seen.search, seen.found):
        return None
    return Comparison(seen.search, seen.parent, (seen.found,)), seen.found
