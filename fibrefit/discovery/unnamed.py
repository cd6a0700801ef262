"""A law of no name, held against the effect that a round has found.

A cause that no catalogue holds still changes the readings, and some effect always fits them better than none: added
one after the other, such effects account for little and take all the time. Where tests of the innovations see something
left beside the best effect, a law composed from free curves is a candidate like any other.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial

import numpy as np

from fibrefit.core.limits import OutOfTimeError, in_time, time_left
from fibrefit.discovery.comparison import Comparison, in_one_noise
from fibrefit.discovery.complete_law import Unnamed, law_about, law_of_curves
from fibrefit.discovery.curves.free_form import FittedCurve, proposed_by, proposing
from fibrefit.discovery.curves.predicted import look_at
from fibrefit.discovery.curves.probes import COURSES, PROBES
from fibrefit.discovery.engine.effort import HARDLY, PROMISING, side_search_time, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.screening import PredictedGain
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, LIKENESS, NAMED
from fibrefit.discovery.laws.propose import PRICE_OF_LOOKS
from fibrefit.discovery.search.alarms import alarms_of, most_nats
from fibrefit.discovery.search.inputs import (
    Confirmation,
    fitted_about,
    is_held_back,
)
from fibrefit.discovery.search.search import Search, Tried
from fibrefit.discovery.search.starts import may_do_better
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
from fibrefit.laws.ports import PORTS, port_of

OF_ONE_QUANTITY = ("guide", "fibre")
"""Ports whose laws change one force each; those of sensors change readings of several channels."""


def law_before_effects(
    search: Search, parent: LaplaceFit, before: Identification
) -> tuple[Unnamed | None, Comparison] | None:
    """A law of which slopes predict far more than of any effect, and the effects held against it; None for none.

    It is sooner composed than all effects are followed. Then those are of which slopes predict more than hardly any
    of what it gains, and another one beside the best where that does half of it. Where these do as well there is no
    law, and the round is what was found of effects. Where no law leaves nothing, the round goes on as ever.

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
    most = max(one.promise for one in gains.values())
    sets = (PROBES, COURSES) if most > BEYOND_DOUBT else (PROBES,)
    looks = look_at(search, parent, before, tuple(PORTS), *sets)
    if COURSES not in sets and looks.promise > BEYOND_DOUBT:
        looks = looks.joined(look_at(search, parent, before, tuple(PORTS), COURSES))
    if may_do_better(most, max(looks.promise, 0.0)):
        return None
    curves = partial(proposed_by, search, parent, looks)
    found, _ = in_time(lambda: law_of_curves(search, parent, None, curves(), 0.0), None, side_search_time(time_left()))
    if found is None:
        return None
    effects = found.search.extensions(found.parent)
    job = partial(_tried_against, found, found.parent, effects, HARDLY)
    # What the time does not suffice to ask is told, and a law that was found is not lost with it.
    tried, _ = in_time(job, Tried([], effects))
    compared = partial(in_one_noise, found.search, found.parent, tried)
    if _does_as_well(found, tried):
        return None, compared()
    best = max((one for one in tried.found if one.evidence.mode.steps), key=lambda one: one.log, default=found.parent)
    gain = best.log - found.parent.log
    if gain > PROMISING * (_worth(found) - found.parent.log):
        little = not is_held_back(found.parent) and found.search.lacks_little(found.parent, gain)
        near = parent if little else None
        second = partial(_second_does_as_well, found, best, near)
        explained, _ = in_time(second, False, side_search_time(time_left()))
        if explained:
            return None, compared()
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
        # What linearised readings miss passes for something left: where slopes said more, no more than that counts.
        beside = min(left, predicted) if predicted else left
        job = partial(law_about, comparison.search, comparison.parent, chosen, before, tuple(PORTS), beside)
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
    search: Search, best: LaplaceFit, before: Identification, curves: Sequence[FittedCurve] | None
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
    curves : sequence of FittedCurve or None
        Free curves that explain more than it does, the best first; None where the time did not suffice to say so of
        any about itself, which no law needs.

    Raises
    ------
    OutOfTimeError
        If those could not be drawn either.
    """
    curves = proposing(search, best, before, tuple(PORTS)) if curves is None else curves
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
    found, _ = in_time(partial(law_of_curves, search, best, None, curves, left), None, side_search_time(time_left()))
    return found


def effects_as_good(found: Unnamed) -> Comparison | None:
    """Effects beside the parent of a law, where one makes the records as probable as that does; None where none does.

    A law that was found about itself was found in other noise, and of other readings, than effects were asked in: of a
    friction that grows with the tension the law was told, and the effect, of the same law, had been predicted nothing.

    Parameters
    ----------
    found : Unnamed
    """
    effects = found.search.swift_extensions(found.parent)
    tried = _tried_against(found, found.parent, effects, PROMISING)
    return in_one_noise(found.search, found.parent, tried) if _does_as_well(found, tried) else None


def _law_in_place(
    search: Search, best: LaplaceFit, rest: tuple[type[Effect], ...], before: Identification, port: str, left: float
) -> Unnamed | None:
    """A law of a port beside the rest of what was named, better than all of it and what is left beside that."""
    return law_about(search, search.inference.without(best, rest), best, before, {port}, left)


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
    # Of what slopes predict no overdispersion is taken off.
    gain = comparison.gain(chosen.undivided)
    gain = gain if seen is None else max(gain, seen.gain + seen.found.divided_off)
    looks = look_at(search, parent, before, tuple(PORTS))
    # A law pays for the places and forms that were looked at, and not for the places once more. A curve over what an
    # effect depends on holds all that the effect does and a little more, which is no sign of another law.
    curve = looks.promise + looks.price - PRICE_OF_LOOKS - max(NAMED, LIKENESS * gain)
    if curve > gain and curve > min(_predicted_of(search, parent, chosen), gain / PROMISING):
        return curve - gain
    return 0.0


def _predicted_of(search: Search, parent: LaplaceFit, chosen: LaplaceFit) -> float:
    """What slopes predict of the effects that are to be added, one by one."""
    added = [effect for effect in chosen.effects if effect not in parent.effects]
    gains = search.predicted_gains(parent, search.inference.slopes(parent), added, "what slopes promise of it")
    return sum(one.promise for one in gains.values())


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
    return came and max((one.promise for one in gains.values()), default=-np.inf) > PROMISING * left


def _in_one_place(chosen: LaplaceFit, parent: LaplaceFit) -> frozenset[str]:
    """The port of what is to be added where all effects of its parent act there, too; empty where they do not.

    How an effect says it, as a friction, a viscosity or a force, makes no difference to the weight.
    """
    ports = frozenset(str(port_of(effect)) for effect in chosen.effects)
    return ports & set(OF_ONE_QUANTITY) if parent.effects and len(ports) == 1 else frozenset()


def _law_instead(
    first: Comparison, chosen: LaplaceFit, before: Identification, ports: Collection[str]
) -> Unnamed | None:
    """A law in the place of two effects, all in the noise of the first round and linearised about its model.

    None where that saw but what comes before the first bounces: effects were found in whole records.
    """
    if is_held_back(first.parent):
        return None
    return law_about(first.search, first.parent, fitted_about(first.search, chosen), before, ports, 0.0)
