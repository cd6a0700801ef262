"""Effects exchanged for others, once those beside them are there: the exchange step of floating selection."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import partial

from fibrefit.core.time_limit import in_time
from fibrefit.discovery.comparison import Comparison, in_same_noise
from fibrefit.discovery.engine.effort import PROMISING, is_near, is_partner
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.thresholds import NAMED
from fibrefit.discovery.pairs import pruned
from fibrefit.discovery.search.inputs import fitted_about
from fibrefit.laws.law import Effect


def best_exchange(single: Comparison, last: Comparison, found: LaplaceFit) -> Comparison | None:
    """Effects of a model exchanged for others that now do better; None where none does.

    What is added first has to account for all that is missing; once another is there, a third may do its part better,
    however far behind it was by itself: of a viscous friction and a damping that depends on rate a quadratic drag
    accounted for more by 55 nats. And beside that third one, the last may no longer be the best.

    Parameters
    ----------
    single : Comparison
        Of effects one by one.
    last : Comparison
        Of the round that found the last effect of the model.
    found : LaplaceFit
        With two effects or more, added one after the other.

    Returns
    -------
    Comparison or None
        The best first. That is the model itself where others are near and inputs have errors: which of them is the best
        is told where readings are linearised about one of them.

    Raises
    ------
    OutOfTimeError
        If the time is over before the model and those with one effect exchanged have been compared.

    Source
    ------
    Pudil, Novovicova and Kittler, Pattern Recognition Letters 15 (1994).
    """
    there = fitted_about(single.search, found)
    likely = [one for one in single.found if one.effects[-1] not in found.effects]
    best = [one.effects[-1] for i, one in enumerate(likely) if is_partner(i) and single.gain(one) > NAMED]
    if not best:
        return None
    tried = [one for gone in found.effects[:-1] for one in _instead(single, there, gone, best)]
    models = in_same_noise(single.search, single.parent, [*tried, there])
    # In the noise that these are compared in: evidence in another one says nothing beside theirs.
    further = partial(_last_instead, replace(single, search=models.search), models, there, _near(last))
    more, _ = in_time(further, list[LaplaceFit]())
    if more:
        models = in_same_noise(models.search, models.parent, [*_near(models), *more])
    most, same = models.found[0], set(models.found[0].names) == set(found.names)
    if most.log <= models.parent.log + NAMED or (same and not _is_told_elsewhere(models)):
        return None
    return models if same or pruned(models.search.inference, most) is most else None


def _instead(
    single: Comparison, whole: LaplaceFit, gone: type[Effect], others: Sequence[type[Effect]]
) -> list[LaplaceFit]:
    """A model with each of some effects in place of one."""
    search, kept = single.search, tuple(effect for effect in whole.effects if effect is not gone)
    rest = _without(single, whole, kept)
    allowed, least = set(search.extensions(rest)), PROMISING * (whole.log - rest.log)
    return search.tried(rest, [one for one in others if one in allowed], "trying others in its place", least).found


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
