"""How much each added effect matters, and how sure it is."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import jax.numpy as jnp
import numpy as np

from fibrefit.core.declarations import Statement
from fibrefit.discovery.engine.candidates import Hypothesis, own_task, with_absent
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import refit
from fibrefit.discovery.search.search import Search
from fibrefit.fitting.result import Identification
from fibrefit.laws.law import Effect
from fibrefit.problem import ForceBalance
from fibrefit.study.summaries.discovery import Weight


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


def effect_sizes(search: Search, best: LaplaceFit, after: Identification) -> tuple[Weight, ...]:
    """How much each effect of the final model matters.

    Parameters
    ----------
    search : Search
    best : LaplaceFit
    after : Identification
        Of the model with its effects.
    """
    values = {name: estimate.value for name, estimate in after.parameters.items()}
    errors = {name: estimate.std_error or 0.0 for name, estimate in after.parameters.items()}
    kept, found = search.plain(best), []
    base = _where_records_differ(search, best, (), search.base)
    for other in _without_each(search, best, kept, base):
        distance = _distance(other.effect, values, errors)
        of_signal, signal = _share_of_signal(search, kept, other)
        found.append(
            Weight(
                effect=other.effect.name,
                share_of_signal=of_signal,
                signal=signal,
                share_of_gap=share_of_gap(base.fit.cost - search.samples, other.gain),
                standard_errors=distance,
            )
        )
    return tuple(found)


def share_of_gap(beyond: float, gain: float) -> float | None:
    """Share of what the first model leaves beyond noise that an effect accounts for; None where it leaves no more.

    Errors of measured inputs, and differences between records, take up a faint effect.

    Parameters
    ----------
    beyond, gain : float
        Sum of squared residuals beyond that of noise, and by how much the effect lowers it.
    """
    return float(np.clip(gain / beyond, 0.0, 1.0)) if beyond > 0.0 else None


def _without_each(search: Search, best: LaplaceFit, kept: Hypothesis, base: Hypothesis) -> list[Without]:
    """One for each effect that no other one needs."""
    needed = {name for effect in best.effects for name in effect.needs}
    return [_without(search, best, kept, base, effect) for effect in best.effects if effect.name not in needed]


def _without(search: Search, best: LaplaceFit, kept: Hypothesis, base: Hypothesis, effect: type[Effect]) -> Without:
    rest = tuple(other for other in best.effects if other is not effect)
    lesser = base
    if rest:
        absent = with_absent(kept.supermodel, kept.fit.local, [effect])
        fit = refit(kept.supermodel, search.context.subset(rest), absent, search.context.whole)
        lesser = _where_records_differ(search, best, rest, Hypothesis(rest, fit, kept.supermodel))
    return Without(effect, lesser, lesser.fit.cost - kept.fit.cost)


def _where_records_differ(
    search: Search, best: LaplaceFit, rest: tuple[type[Effect], ...], alike: Hypothesis
) -> Hypothesis:
    """A model with fewer effects where its records may differ as those of the final one do, if that leaves less.

    What differences between records explain is not what an effect does.
    """
    if not best.evidence.mode.sigma.any():
        return alike
    return min(alike, search.plain(search.inference.without(best, rest)), key=lambda one: one.fit.cost)


def _distance(effect: type[Effect], values: Mapping[str, float], errors: Mapping[str, float]) -> float:
    """By how many standard errors an effect's strength differs from nothing."""
    found = [0.0]
    for parameter in effect.parameters:
        name = f"{effect.name}.{parameter.name}"
        if parameter.name in effect.strength and errors.get(name, 0.0) > 0.0:
            # What vanishes at infinity is as far from there, in its errors, as its inverse is from zero.
            far = values[name] if parameter.reciprocal else values[name] - parameter.null
            found.append(abs(far) / errors[name])
    return float(max(found))


def _share_of_signal(search: Search, best: Hypothesis, other: Without) -> tuple[float, str]:
    """What an effect explains over what was measured, both rms, and of what."""
    lacking, remaining = (ForceBalance.of(*own_task(search.task, one)) for one in (other.lesser, best))
    if lacking is not None and remaining is not None:
        return float(np.sqrt(max(lacking.share**2 - remaining.share**2, 0.0))), "force"
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


def of_interest(search: Search, best: LaplaceFit, least: float) -> tuple[LaplaceFit, list[Statement]]:
    """What was found without effects of less than the least strength, the smallest first; and what is said of these.

    A strength is the root of what the mean square of the normalised residuals falls by: the rms of what the effect
    explains, in units of the noise.
    """
    said: list[Statement] = []
    while least > 0.0:
        needed = {name for effect in best.effects for name in effect.needs}
        lesser = {
            effect: search.inference.without(best, tuple(other for other in best.effects if other is not effect))
            for effect in best.effects
            if effect.name not in needed
        }
        whole = search.gap_left(best) ** 2
        explained = {effect: search.gap_left(one) ** 2 - whole for effect, one in lesser.items()}
        smallest = min(explained, key=lambda effect: explained[effect], default=None)
        if smallest is None or explained[smallest] >= least**2:
            break
        strength = float(np.sqrt(max(explained[smallest], 0.0)))
        said.append(Statement("too_small", {"effect": smallest.name, "strength": strength, "least": least}))
        best = lesser[smallest]
    return best, said
