"""Effects exchanged for others, once those beside them are there: the exchange step of floating selection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from fibrefit.core.limits import in_time
from fibrefit.discovery.comparison import Comparison, in_same_noise
from fibrefit.discovery.design.rivals import Rivals
from fibrefit.discovery.engine.effort import PROMISING, is_near, is_partner
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import APART, NAMED
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.inputs import fitted_about, is_held_back
from fibrefit.laws.law import Effect


def with_exchanges(
    single: Comparison,
    last: Comparison,
    found: LaplaceFit,
    rivals: Sequence[Rivals] = (),
) -> Comparison | None:
    """A model and those with effects of it exchanged for others; None where there are none to exchange them for.

    What is added first has to account for all that is missing; once another is there, a third may do its part better,
    however far behind it was by itself: of a viscous friction and a damping that depends on rate a quadratic drag
    accounted for more by 55 nats. And beside that third one, the last may no longer be the best.

    An effect may also do as well as another only beside those that came later: of a gain and an offset of the force, an
    acceleration that acts on the gauge had taken the part of the gain, before the offset was there.

    Parameters
    ----------
    single : Comparison
        Of effects one by one.
    last : Comparison
        Of the round that found the last effect of the model.
    found : LaplaceFit
        With two effects or more, added one after the other.
    rivals : sequence of Rivals, optional
        What did as well as an effect when that was added.

    Returns
    -------
    Comparison or None
        The best first, see `is_better`.

    Raises
    ------
    OutOfTimeError
        If the time is over before the model and those with one effect exchanged have been compared.

    Source
    ------
    Pudil, Novovicova and Kittler, Pattern Recognition Letters 15 (1994).
    """
    others = [*_partners(single, found), *_partners(last, found)]
    instead = {gone: [*dict.fromkeys([*others, *_rivals_to(gone, rivals)])] for gone in found.effects[:-1]}
    if not any(instead.values()):
        return None
    there = fitted_about(single.search, found)
    tried = [one for gone, best in instead.items() for one in _instead(single, there, gone, best)]
    models = in_same_noise(single.search, single.parent, [*tried, there])
    # In the noise that these are compared in: evidence in another one says nothing beside theirs.
    further = partial(_last_instead, replace(single, search=models.search), models, there, _near(last))
    more, _ = in_time(further, list[LaplaceFit]())
    return _with_more(models, more) if more else models


def is_better(models: Comparison, found: LaplaceFit) -> bool:
    """Whether another model may be what is missing: it is the best, and needs all of its effects.

    So it may be where it is near the best and inputs have errors: which of them that is tells itself where readings are
    linearised about one of them.

    Parameters
    ----------
    models : Comparison
        Of a model and those that some of its effects were exchanged in.
    found : LaplaceFit
        The model.
    """
    most, same = models.found[0], set(models.found[0].names) == set(found.names)
    if most.log <= models.parent.log + NAMED or (same and not _is_told_elsewhere(models)):
        return False
    return same or pruned(models.search.inference, most) is most


def rivals_of(comparison: Comparison, best: LaplaceFit) -> tuple[Rivals, ...]:
    """What was added, and each effect that would have explained the records as well in its place."""
    pairs: dict[tuple[str, str], Rivals] = {}
    for other in comparison.found:
        mine = [name for name in best.names if name not in other.names]
        theirs = [name for name in other.names if name not in best.names]
        fitted = bool(other.evidence.mode.steps)  # What was not followed has what slopes predict of it.
        if fitted and abs(other.log - best.log) < APART and len(mine) == len(theirs) == 1:
            pairs.setdefault((mine[0], theirs[0]), Rivals((mine[0], theirs[0]), (best, other)))
    return tuple(pairs.values())


def rivals_beside(before: Sequence[Rivals], models: Comparison, found: LaplaceFit) -> tuple[Rivals, ...]:
    """Rivals of a model's effects once all of them are there, and those of before that were not held beside all.

    Parameters
    ----------
    before : sequence of Rivals
    models : Comparison
        Of the model, and those that some of its effects were exchanged in.
    found : LaplaceFit
        The model.
    """
    held, seen = set(found.names), {frozenset(one.names) for one in models.found}
    whole = [one for one in models.found if set(one.names) == held]
    # What was added since then is no rival of what it stands beside.
    others = (one for one in before if one.names[1] not in held)
    unseen = (one for one in others if frozenset((held - {one.names[0]}) | {one.names[1]}) not in seen)
    return *unseen, *(rival for one in whole for rival in rivals_of(models, one))


def _partners(comparison: Comparison, found: LaplaceFit) -> list[type[Effect]]:
    """The best effects of a round that a model does not have."""
    likely = [one for one in comparison.found if one.effects[-1] not in found.effects]
    return [one.effects[-1] for i, one in enumerate(likely) if is_partner(i) and comparison.gain(one) > NAMED]


def _rivals_to(effect: type[Effect], rivals: Sequence[Rivals]) -> list[type[Effect]]:
    others = [(one.names[1], one.models[1]) for one in rivals if one.names[0] == effect.name]
    return [each for name, model in others for each in model.effects if each.name == name]


def _instead(
    single: Comparison, whole: LaplaceFit, gone: type[Effect], others: Sequence[type[Effect]]
) -> list[LaplaceFit]:
    """A model with each of some effects in place of one."""
    search, kept = single.search, tuple(effect for effect in whole.effects if effect is not gone)
    rest = _without(single, whole, kept)
    allowed, least = set(search.extensions(rest)), PROMISING * (whole.log - rest.log)
    # Programs beside what stays would be made anew for every group of effects, those of the first round are at hand.
    begun = single.parent
    near = begun if not is_held_back(begun) and search.lacks_little(begun, rest.log - begun.log) else None
    what = "trying others in its place"
    return search.tried(rest, [one for one in others if one in allowed], what, least, near=near).found


def _with_more(models: Comparison, more: Sequence[LaplaceFit]) -> Comparison:
    """The best of some models and further ones in one noise; those behind them, as far behind as they were."""
    both = in_same_noise(models.search, models.parent, [*_near(models), *more])
    named = {one.names for one in both.found}
    behind = [one.with_log(both.parent.log + models.gain(one)) for one in models.found if one.names not in named]
    return replace(both, found=(*both.found, *behind))


def _last_instead(
    single: Comparison, models: Comparison, found: LaplaceFit, near: Sequence[LaplaceFit]
) -> list[LaplaceFit]:
    """Near models in which another than the last effect was exchanged, with that one exchanged for near ones, too."""
    last = found.effects[-1]
    others = [one.effects[-1] for one in near if one.effects[-1] is not last]
    exchanged = [one for one in _near(models) if one.names != found.names] if others else []
    return [each for one in exchanged for each in _instead(single, one, last, others)]


def _near(comparison: Comparison) -> list[LaplaceFit]:
    """The best of a comparison, and those that are not far behind."""
    found = [one for one in comparison.found if one.evidence.mode.steps and comparison.gain(one) > NAMED]
    return [one for i, one in enumerate(found) if is_near(i, one.log - found[0].log)]


def _is_told_elsewhere(models: Comparison) -> bool:
    """Whether the best of some models is near others, and readings linearised about none of them do not tell."""
    return models.parent.supermodel.sensitivities is not None and len(_near(models)) > 1


def _without(single: Comparison, whole: LaplaceFit, kept: tuple[type[Effect], ...]) -> LaplaceFit:
    """A model without one of its effects: from where it is, or as it was found by itself if that is more probable.

    A motion that loses an effect at once may end in a wrong minimum, hundreds of nats below a model with none.
    """
    inference = single.search.inference
    found = [inference.again(one) for one in single.found if one.effects == kept]
    return max([inference.without(whole, kept), *found], key=lambda one: one.log)
