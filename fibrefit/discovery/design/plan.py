"""The next record: what each that could be taken would add to those at hand.

Source
------
Error bars: D-optimal design, e.g. Pukelsheim, Optimal Design of Experiments (1993). Rivals: where the one that is
wrong, at its best, still misses most (T-optimal design), Atkinson and Fedorov, Biometrika 62 (1975) 57-70.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import norm

from fibrefit.discovery.design.distinguish import (
    LITTLE,
    UNIQUE,
    batches,
    changed_values,
    likeness,
    menu_grams,
    menu_of,
    projected,
    records_of,
    sizes_of,
    strengths_of,
)
from fibrefit.discovery.engine.candidates import absent_values
from fibrefit.discovery.engine.refit import difference_steps, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import APART
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem.statement.observations import Observations
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.simulation.model import Experiment

FITTED_WELL = 1e-6
"""Relative fall of a rival's cost at which it is fitted well enough."""
UNKNOWN = 1e-12
"""Share of the largest information below which a parameter is not determined."""


@dataclass(frozen=True)
class Explanation:
    """An explanation with its values.

    Parameters
    ----------
    effect : Effect class
    values : mapping of str to (n_record,) in SI units
        Of the whole model, its base parameters and what is each record's own among them.
    """

    effect: type[Effect]
    values: Mapping[str, np.ndarray]


@dataclass(frozen=True)
class Worth:
    """What a further record would add.

    Parameters
    ----------
    choice : Choice
    errors : dict of str to float
        Factor on the standard error of each shared parameter.
    limits : dict of str to float
        Factor on the detection limit of each effect that shows with it.
    nats : float
        Expected logarithm of the likelihood ratio of two rivals with it, the smaller of both ways round; nan without.
    """

    choice: Choice
    errors: dict[str, float]
    limits: dict[str, float]
    nats: float = float("nan")

    @property
    def distinguished(self) -> float:
        """Probability that the rivals are distinguished."""
        return probability_distinguished(self.nats)

    @property
    def error(self) -> float:
        """Mean factor on standard errors."""
        return _mean(self.errors)

    @property
    def limit(self) -> float:
        """Mean factor on detection limits."""
        return _mean(self.limits)


def _mean(factors: Mapping[str, float]) -> float:
    known = [factor for factor in factors.values() if factor > 0.0]
    return float(np.exp(np.mean(np.log(known)))) if known else 1.0


def probability_distinguished(nats: float) -> float:
    """Probability that a likelihood ratio, of which so much is expected, comes out beyond doubt.

    Twice its logarithm is normal about the noncentrality with twice its root as standard deviation.
    """
    if not nats > 0.0:
        return 0.0
    return float(norm.cdf((nats - APART) / np.sqrt(2.0 * nats)))


def options_of(task: Task) -> list[Choice]:
    """Records that could be taken: each of those at hand once more, and the rig's menu."""
    again = [Choice(record, {}) for record in range(len(task.problem.layout.records))]
    return [*again, *menu_of(task)]


def worths(search: Search, rivals: Sequence[Explanation], choices: Sequence[Choice]) -> tuple[list[Worth], float]:
    """What each of some records would add, and the nats by which the records at hand tell the rivals apart.

    Noise counts as white, and inputs as known.

    Parameters
    ----------
    search : Search
        With all effects whose detection limits count in one supermodel, see `set_up`.
    rivals : sequence of Explanation
        Two, or none.
    choices : sequence of Choice
    """
    supermodel, local, context = _plain(search.base.supermodel), search.base.fit.local, search.context
    strengths = strengths_of(search.effects)
    columns, targets = changed_values(supermodel, context, local, strengths, LITTLE * sizes_of(strengths))
    grams = supermodel.grams(local, columns, targets, context.whole)[:, :-1, :-1]
    added = menu_grams(supermodel, context, local, columns, targets, choices)
    errors = _errors(grams, len(context.base), len(context.each))
    norms = likeness(grams, context)[0]
    now, further = _apart(search, rivals, choices) if rivals else (float("nan"), [float("nan")] * len(choices))
    found = []
    for choice, gram, nats in zip(choices, added, further, strict=True):
        whole = np.concatenate([grams, gram[None]])
        after = _errors(whole, len(context.base), len(context.each))
        norms_then, shown, _ = likeness(whole, context)
        limits = {
            effect: float(norms[i] / norms_then[i]) for i, (effect, _) in enumerate(strengths) if shown[i] > UNIQUE
        }
        known = {name: float(ratio) for name, ratio in zip(context.base, after / errors, strict=True)}
        found.append(Worth(choice, {n: r for n, r in known.items() if np.isfinite(r)}, limits, nats))
    return found, now


def _plain(supermodel: Supermodel) -> Supermodel:
    """A supermodel with white noise and known inputs: what further records would be like is not known better."""
    return replace(supermodel, sensitivities=None, whitening=None)


def _errors(grams: np.ndarray, shared: int, own: int) -> np.ndarray:
    """Standard errors of the shared columns, in units of their changes, each record's own eliminated."""
    information = np.zeros((shared, shared))
    for gram in grams:
        mine = gram[shared : shared + own, shared : shared + own]
        cross = gram[:shared, shared : shared + own]
        information += gram[:shared, :shared] - cross @ np.linalg.pinv(mine, rcond=UNKNOWN, hermitian=True) @ cross.T
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    safe = np.where(size > 0.0, size, 1.0)
    inverse = np.linalg.pinv(information / np.outer(safe, safe), rcond=UNKNOWN, hermitian=True)
    return np.where(size > 0.0, np.sqrt(np.maximum(np.diag(inverse), 0.0)) / safe, np.inf)


def _apart(search: Search, rivals: Sequence[Explanation], choices: Sequence[Choice]) -> tuple[float, list[float]]:
    """Nats by which two rivals differ: at hand, and with each choice; whichever of them is true."""
    first, second = rivals
    ways = [_missed(search, true, other, choices) for true, other in ((first, second), (second, first))]
    return min(ways[0][0], ways[1][0]), [min(pair) for pair in zip(ways[0][1], ways[1][1], strict=True)]


def _missed(
    search: Search, true: Explanation, other: Explanation, choices: Sequence[Choice]
) -> tuple[float, list[float]]:
    """Half of what a rival at its best still misses of a true model, in squares of the noise.

    The rival is fitted to what the true model says of the records at hand, without noise. Of a further record it is
    fitted to both by its slopes there.
    """
    supermodel, context = supermodel_of(search.task, (true.effect, other.effect)), search.context
    truth, start = (_values(supermodel, search.task, rival) for rival in (true, other))
    data = supermodel.problem.observations
    at_hand = _with(supermodel, data._replace(measured=_readings(supermodel.problem, truth, data.experiment)))
    subset = context.subset((other.effect,))
    found = refit(at_hand, subset, start, context.whole, enough=FITTED_WELL).local
    names = (*subset.shared, *subset.each)
    columns = np.array([supermodel.names.index(name) for name in names])
    size = np.array([abs(supermodel.declared[name].typical) for name in names])
    targets = found[:, columns] + difference_steps(found[:, columns], size)
    grams = at_hand.grams(found, columns, targets, context.whole)
    shared, own = len(subset.shared), len(subset.each)

    def left(grams: np.ndarray) -> float:
        return 0.5 * max(float(projected(grams, shared, own)[0].sum()), 0.0)

    further = []
    for batch in batches(choices, len(found)):
        rows = [choice.record for choice in batch]
        taken = records_of(data, batch)
        there = _with(supermodel, taken._replace(measured=_readings(supermodel.problem, truth[rows], taken.experiment)))
        further += list(there.grams(found[rows], columns, targets[rows], context.whole[rows]))
    return left(grams), [left(np.concatenate([grams, gram[None]])) for gram in further[: len(choices)]]


def _with(supermodel: Supermodel, data: Observations) -> Supermodel:
    """A supermodel with other records."""
    problem = eqx.tree_at(lambda p: p.observations, supermodel.problem, data)
    return replace(supermodel, task=replace(supermodel.task, problem=problem))


@eqx.filter_jit
def _predicted(problem: Problem, local: jax.Array, experiment: Experiment) -> dict[str, jax.Array]:
    return problem.predict(local, experiment)


def _readings(problem: Problem, local: np.ndarray, experiment: Experiment) -> dict[str, jax.Array]:
    readings = _predicted(problem, jnp.asarray(local), experiment)
    return {channel: readings[channel] for channel in problem.observations.measured}


def _values(supermodel: Supermodel, task: Task, rival: Explanation) -> np.ndarray:
    """Values ``(n_record, n_local)`` of a supermodel that are those of a rival, the other one absent."""
    local = absent_values(supermodel, len(task.problem.layout.records))
    for j, name in enumerate(supermodel.names):
        if name in rival.values:
            local[:, j] = rival.values[name]
    return local
