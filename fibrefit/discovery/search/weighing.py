"""How much each added effect matters, and how sure it is where more than noise is left.

Where a model leaves a gap, the noise no longer measures chance: what is left wanders more, and longer, than noise does.
An effect is then measured by how far the residuals themselves scatter its strength.

Source
------
The variance of scores with memory: Newey and West, Econometrica 55 (1987).
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fibrefit.discovery.engine.candidates import Hypothesis, absent_values, alone
from fibrefit.discovery.engine.refit import STEP, refit
from fibrefit.discovery.engine.supermodel import STRETCHES
from fibrefit.discovery.engine.thresholds import chance
from fibrefit.discovery.model.finding import Weight
from fibrefit.discovery.search.search import Search
from fibrefit.effects.law import Effect
from fibrefit.fitting.result import Identification
from fibrefit.fitting.uncertainty import MEMORY, sandwich
from fibrefit.problem.diagnose.inverse_dynamics import unexplained_share


@dataclass(frozen=True)
class Without:
    """What is best without one effect of a hypothesis.

    Parameters
    ----------
    effect : Effect class
    lesser : Hypothesis
    gain : float
        By which the effect lowers the sum of squared residuals.
    """

    effect: type[Effect]
    lesser: Hypothesis
    gain: float


def only_sure(search: Search, best: Hypothesis) -> Hypothesis:
    """A hypothesis without what may be owed to the residuals it leaves, the last one found first.

    Parameters
    ----------
    search : Search
    best : Hypothesis
        One that leaves more than noise.
    """
    errors = scattered_errors(search, best)
    for other in reversed(_without_each(search, best)):
        distance = _distance(other.effect, best.fit.shared, errors)
        if distance**2 < chance(len(other.effect.parameters)):
            return only_sure(search, other.lesser)
    return best


def weights(search: Search, best: Hypothesis, after: Identification) -> tuple[Weight, ...]:
    """How much each effect of the final model matters.

    Parameters
    ----------
    search : Search
    best : Hypothesis
    after : Identification
        Of the model with its effects.
    """
    values = {name: estimate.value for name, estimate in after.parameters.items()}
    errors = {name: estimate.std_error for name, estimate in after.parameters.items()}
    found = []
    for other in _without_each(search, best):
        beyond = max(search.base.fit.cost - search.samples, other.gain, 1.0)
        share = float(np.clip(other.gain / beyond, 0.0, 1.0))
        distance = _distance(other.effect, values, errors)
        found.append(Weight(other.effect.name, *_share_of_signal(search, best, other), share, distance))
    return tuple(found)


def scattered_errors(search: Search, hypothesis: Hypothesis) -> dict[str, float]:
    """Standard errors in SI units of shared values by the residuals a hypothesis leaves; infinite for what is not seen.

    Parameters
    ----------
    search : Search
    hypothesis : Hypothesis
    """
    frame, local = hypothesis.frame, hypothesis.fit.local
    shared, each = search.ground.subset(hypothesis.effects).shared, search.ground.each
    names = (*shared, *each)
    columns = np.array([frame.names.index(name) for name in names])
    size = np.array([abs(frame.declared[name].typical) for name in names])
    steps = STEP * np.maximum(np.abs(local[:, columns]), 0.01 * size)
    grams, scores = frame.grams_and_scores(local, columns, local[:, columns] + steps, search.ground.whole)
    normal = _assembled(grams[:, :-1, :-1] / (steps[:, :, None] * steps[:, None, :]), len(shared))
    scatter = _assembled(np.stack([long_run(one) for one in scores / steps[:, :, None]]), len(shared))
    return dict(zip(shared, np.sqrt(np.diag(sandwich(normal, scatter))).tolist(), strict=False))


def long_run(scores: np.ndarray) -> np.ndarray:
    """Variance ``(n, n)`` of the sum of scores ``(n, STRETCHES)`` with memory, by Bartlett's weights."""
    lags = round(MEMORY * STRETCHES)
    total = scores @ scores.T
    for lag in range(1, lags + 1):
        product = scores[:, lag:] @ scores[:, :-lag].T
        total += (1.0 - lag / (lags + 1.0)) * (product + product.T)
    return total


def _assembled(parts: np.ndarray, shared: int) -> np.ndarray:
    """Sum of the records' matrices ``(n_record, n, n)``, the first values of which are shared."""
    own = parts.shape[-1] - shared
    total = np.zeros((shared + len(parts) * own,) * 2)
    for r, part in enumerate(parts):
        place = np.r_[np.arange(shared), shared + r * own + np.arange(own)]
        total[np.ix_(place, place)] += part
    return total


def _without_each(search: Search, best: Hypothesis) -> list[Without]:
    """One for each effect that no other one needs."""
    needed = {name for effect in best.effects for name in effect.needs}
    return [_without(search, best, effect) for effect in best.effects if effect.name not in needed]


def _without(search: Search, best: Hypothesis, effect: type[Effect]) -> Without:
    rest = tuple(other for other in best.effects if other is not effect)
    if not rest:
        return Without(effect, search.base, search.base.fit.cost - best.fit.cost)
    local, blank = best.fit.local.copy(), absent_values(best.frame, len(best.fit.local))
    columns = [best.frame.names.index(f"{effect.name}.{parameter.name}") for parameter in effect.parameters]
    local[:, columns] = blank[:, columns]
    fit = refit(best.frame, search.ground.subset(rest), local, search.ground.whole)
    return Without(effect, Hypothesis(rest, fit, best.frame), fit.cost - best.fit.cost)


def _distance(effect: type[Effect], values: Mapping[str, float], errors: Mapping[str, float]) -> float:
    """By how many standard errors an effect's strength differs from nothing."""
    found = [0.0]
    for parameter in effect.parameters:
        name = f"{effect.name}.{parameter.name}"
        if parameter.name in effect.strength and errors.get(name, 0.0) > 0.0:
            # What vanishes at infinity is as far from there, in its errors, as its inverse is from nil.
            far = values[name] if parameter.reciprocal else values[name] - parameter.null
            found.append(abs(far) / errors[name])
    return float(max(found))


def _share_of_signal(search: Search, best: Hypothesis, other: Without) -> tuple[float, str]:
    """What an effect explains over what was measured, both rms, and of what."""
    lacking, left = (unexplained_share(*alone(search.task, one)) for one in (other.lesser, best))
    if lacking is not None and left is not None:
        return float(np.sqrt(max(lacking**2 - left**2, 0.0))), "force"
    return float(np.sqrt(max(other.gain, 0.0) / _loudness(search))), "readings"


def _loudness(search: Search) -> float:
    """Sum of the squares of what was measured about its mean, in units of the noise."""
    data, total = search.task.problem.observations, 0.0
    for channel, measured in data.measured.items():
        weight = data.weight[channel]
        number = jnp.maximum(jnp.sum(weight > 0.0, axis=1, keepdims=True), 1)
        mean = jnp.sum(jnp.where(weight > 0.0, measured, 0.0), axis=1, keepdims=True) / number
        total += float(jnp.sum(((measured - mean) * weight) ** 2))
    return max(total, 1.0)
