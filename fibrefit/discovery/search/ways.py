"""From where an effect is followed, and which effects are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

from fibrefit.discovery.engine.effort import PROMISING
from fibrefit.discovery.engine.screening import Promise
from fibrefit.discovery.engine.secant import Seed
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT
from fibrefit.discovery.engine.weighed import Weighed
from fibrefit.laws.law import Effect


class WayIn(NamedTuple):
    """From where an effect is followed: what slopes promise of it there in nats, over the parent, and these slopes."""

    promised: float
    effect: type[Effect]
    view: Weighed
    promise: Promise
    slopes: Seed


def is_worth_following(effect: type[Effect], promised: float, least: float) -> bool:
    """Whether an effect is followed: one at whose null the model changes its kind whatever slopes say there.

    Slopes are taken at a few shapes, and what they promise includes its price: where that is nothing, an effect would
    have to gain twice as much at a shape between these to be named.
    """
    return bool(effect.singular) or promised > max(0.0, least)


def may_do_better(promised: float, gain: float) -> bool:
    """Whether an effect that slopes promise so much of is followed once another one gains so much; both in nats.

    What explains something beyond doubt is likelier missing than what promises far less.
    """
    return gain <= BEYOND_DOUBT or promised > PROMISING * gain


def most_promising(
    promises: Mapping[type[Effect], Promise], seen: Sequence[type[Effect]], number: int
) -> list[type[Effect]]:
    """So many of the effects that were seen, those that slopes promise most of first."""
    return sorted(seen, key=lambda effect: -promises[effect].gain)[:number]


def has_valleys(effect: type[Effect]) -> bool:
    """Whether it has frequencies or instants: too many to be tried in plain squares, where slopes tell which."""
    return effect.sudden or any(parameter.unit == "Hz" for parameter in effect.parameters)


def beginnings(promise: Promise) -> tuple[dict[str, float], ...]:
    """Where slopes promise most of an effect, and the same with the effect hardly there."""
    return (promise.values,) if promise.values == promise.weak else (promise.values, promise.weak)
