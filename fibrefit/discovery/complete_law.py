"""A law of no name that accounts for all a model lacks: composed, held against effects, and with nothing left."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from functools import partial
from typing import NamedTuple

from fibrefit.core.limits import in_time, time_left
from fibrefit.discovery.comparison import Comparison, in_same_noise
from fibrefit.discovery.curves.free_form import FittedCurve, proposing
from fibrefit.discovery.curves.probes import COURSES
from fibrefit.discovery.engine.effort import side_search_time
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT, NAMED
from fibrefit.discovery.laws.propose import PRICE_OF_LOOKS
from fibrefit.discovery.laws.told import HeldLaw, described, held_laws, holding_without
from fibrefit.discovery.model.law import ProposedLaw
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.alarms import alarms_of, confirmed_where_it_settles
from fibrefit.discovery.search.inputs import fitted_about, overdispersion_corrected
from fibrefit.discovery.search.search import Search
from fibrefit.fitting.result import Identification


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


def law_about(
    search: Search, parent: LaplaceFit, chosen: LaplaceFit, before: Identification, ports: Collection[str], left: float
) -> Unnamed | None:
    """A law that gains what an effect does and what is left beside it, and leaves nothing itself.

    Those over the course of a record are all looked for where none of these does.
    """
    curves = proposing(search, parent, before, ports)
    found = law_of_curves(search, parent, chosen, curves, left)
    over_course = [curve for curve in curves if curve.probe in COURSES]
    if found is not None or len(over_course) == len(curves):
        return found
    more = over_course or proposing(search, parent, before, ports, COURSES)
    return law_of_curves(search, parent, chosen, more, left)


def law_of_curves(
    search: Search, parent: LaplaceFit, chosen: LaplaceFit | None, curves: Sequence[FittedCurve], left: float
) -> Unnamed | None:
    """The same of curves that were drawn; where no effect is `chosen`, beside the parent.

    Where a law is not what is missing, the best one of another curve is asked.
    """
    for held in held_laws(search, parent, curves) if curves else ():
        if (found := _weighed(search, parent, chosen, held, left)) is not None:
            return found
    return None


def _weighed(
    search: Search, parent: LaplaceFit, chosen: LaplaceFit | None, held: HeldLaw, left: float
) -> Unnamed | None:
    """A law that gains what was chosen does and so many nats that are left beside that, and leaves nothing itself.

    On a rig with measured inputs one that gains little more than it has to is asked about itself, as an effect is.
    """
    law, proposal, before = held.fit, held.proposal, 0.0
    if chosen is not None and proposal.search is not search:
        # Where readings are linearised about a law, an effect is worth no less than it was where it was found.
        before = chosen.log - parent.log
        chosen = fitted_about(proposal.search, chosen, proposal.led)
    linearised_elsewhere = proposal.search is search and parent.supermodel.sensitivities is not None
    search, parent, others = proposal.search, proposal.parent, () if chosen is None else (chosen,)
    here = Comparison(search, parent, tuple(sorted((law, *others), key=lambda one: -one.log)))
    # What the time does not suffice to compare in better known noise is compared in the noise at hand.
    there, _ = in_time(partial(in_same_noise, search, parent, [law, *others]), here, side_search_time(time_left()))
    fitted = next(one for one in there.found if one.names == law.names)
    most = max([there.parent.log + before, *(one.log for one in there.found if one is not fitted)])
    needed = most + left + NAMED
    if fitted.log - PRICE_OF_LOOKS <= needed:
        return None
    doubtful = linearised_elsewhere and fitted.log - PRICE_OF_LOOKS <= needed + BEYOND_DOUBT
    if doubtful or alarms_of(there.search, fitted):
        # What readings miss that are linearised about another model looks like something left, or like something.
        job = partial(_about_itself, there, fitted, needed - there.parent.log, chosen, left)
        about, _ = in_time(job, None, side_search_time(time_left()))
        if about is None:
            return None
        there, fitted = about
    # A law that was found is not lost with the time that this takes.
    whole = there.parent, held._replace(fit=fitted)
    (parent, told), _ = in_time(partial(_without_needless, there, whole[1]), whole, side_search_time(time_left()))
    return Unnamed(there.search, parent, held.proposal.curves, (told.fit, described(there.search, parent, told)))


def _without_needless(there: Comparison, held: HeldLaw) -> tuple[LaplaceFit, HeldLaw]:
    """A law without the effects that it makes needless, as a later effect does, and its parent without them.

    What was added before may be but the likeness of the law, in the first place where some effect did most of it. They
    stay where the law does not hold on records left out without them.
    """
    if not there.parent.effects:
        return there.parent, held
    inference, law = there.search.inference, held.fit
    left = pruned(inference, law)
    rest = tuple(effect for effect in there.parent.effects if effect in left.effects)
    if law.effects[-1] not in left.effects or len(rest) == len(there.parent.effects):
        return there.parent, held
    parent = inference.without(there.parent, rest)
    alone = holding_without(there.search, parent, held._replace(fit=left))
    return (there.parent, held) if alone is None else (parent, alone)


def _about_itself(
    there: Comparison, law: LaplaceFit, needed: float, chosen: LaplaceFit | None, left: float
) -> tuple[Comparison, LaplaceFit] | None:
    """A law with readings linearised about itself; None where it gains less there than is needed, or tests object.

    It is held there against what was `chosen`, and so many nats that are left beside that, once more.
    """
    seen, still = confirmed_where_it_settles(there.search, there.parent, law)
    if seen is None or seen.gain - PRICE_OF_LOOKS <= needed or still:
        return None
    if chosen is not None:
        rival = fitted_about(seen.search, chosen, seen.led)
        rival = overdispersion_corrected(seen.parent, rival, seen.overdispersion)
        if seen.found.log - PRICE_OF_LOOKS <= rival.log + left + NAMED:
            return None
    return Comparison(seen.search, seen.parent, (seen.found,)), seen.found
