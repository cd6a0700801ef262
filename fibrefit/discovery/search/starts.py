"""From where effects are followed, by the gain that the score test predicts of them, and which ones are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import numpy as np

from fibrefit.discovery.engine.effort import HARDLY, PROMISING, TOO_FAR, slopes_tell
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.screening import PredictedGain
from fibrefit.discovery.engine.secant import Seed
from fibrefit.discovery.engine.thresholds import BEYOND_DOUBT
from fibrefit.laws.families import instants_of
from fibrefit.laws.law import Effect


class EffectStart(NamedTuple):
    """From where an effect is followed: the gain predicted of it there in nats, over the parent, and the slopes."""

    predicted_gain: float
    effect: type[Effect]
    view: LaplaceFit
    prediction: PredictedGain
    slopes: Seed


def little_is_missing(gap: float, predicted_gain: float) -> bool:
    """Whether slopes lead to what is missing: a model with that gap is near, or so they predict themselves.

    Where noise is louder than at rest, as slow noise is, a gap of that size is all noise. Slopes predict too much
    rather than too little: what they predict in nats, at the most of any effect, says that little is missing.
    """
    return slopes_tell(gap) or (gap <= TOO_FAR and predicted_gain <= BEYOND_DOUBT)


def is_worth_following(effect: type[Effect], predicted_gain: float, least: float, of_singular: float = -np.inf) -> bool:
    """Whether an effect is followed, by the nats that slopes predict of it.

    Slopes are taken at a few shapes, and what they predict includes its price: where that is nothing, an effect would
    have to gain twice as much at a shape between these to be named. They say little of an effect at whose null the
    model changes its kind: of such a one they have to predict more than `of_singular`.
    """
    return predicted_gain > (of_singular if effect.singular else max(0.0, least))


def may_do_better(predicted_gain: float, gain: float) -> bool:
    """Whether an effect that slopes predict so much of is followed once another one gains so much; both in nats.

    What explains something beyond doubt is likelier missing than what is predicted to gain far less.
    """
    return gain <= BEYOND_DOUBT or predicted_gain > PROMISING * gain


def is_left_to_follow(start: EffectStart, gain: float) -> bool:
    """Whether a start is followed once another effect gains so much, in nats.

    Of an effect at whose null the model changes its kind slopes say too little for a small share to be asked of them.
    """
    hardly = not start.effect.singular and start.predicted_gain <= HARDLY * gain
    return may_do_better(start.predicted_gain, gain) and not hardly


def most_promising(
    predictions: Mapping[type[Effect], PredictedGain], seen: Sequence[type[Effect]]
) -> list[type[Effect]]:
    """The effects that were seen, those that slopes predict most of first."""
    return sorted(seen, key=lambda effect: -predictions[effect].promise)


def has_valleys(effect: type[Effect]) -> bool:
    """Whether it has frequencies or instants: too many to be tried in plain squares, where slopes tell which."""
    return searched_for(effect) > 0


def searched_for(effect: type[Effect]) -> int:
    """Number of its frequencies and instants, of each of which there are many that records tell apart."""
    frequencies = sum(parameter.unit == "Hz" for parameter in effect.parameters)
    return frequencies + (len(instants_of(effect)) if effect.sudden else 0)


def starting_values(prediction: PredictedGain) -> tuple[dict[str, float], ...]:
    """Where slopes predict most of an effect, and the same with the effect hardly there."""
    return (prediction.values,) if prediction.values == prediction.weak else (prediction.values, prediction.weak)
