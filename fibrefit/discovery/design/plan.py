"""The next record: what each that could be taken would add to those at hand.

Source
------
Error bars: D-optimal design, e.g. Pukelsheim, Optimal Design of Experiments (1993). Rivals: where the one that is
wrong, at its best, still misses most (T-optimal design), Atkinson and Fedorov, Biometrika 62 (1975) 57-70.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np
from scipy.stats import norm

from fibrefit.discovery.design.distinguish import (
    UNIQUE,
    changed_values,
    confusion,
    grams_at_hand,
    likeness,
    little_sizes,
    menu_grams,
    projected,
    strengths_of,
    with_records,
)
from fibrefit.discovery.design.menu import batches, menu_of, records_of
from fibrefit.discovery.design.thresholds import CONCERNED, UNKNOWN
from fibrefit.discovery.engine.candidates import SMALL, absent_values, strengthened, transferred
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import difference_steps, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.engine.thresholds import APART, gate
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem.statement.layout import scale_of
from fibrefit.problem.statement.problem import Problem
from fibrefit.problem.task import Task
from fibrefit.simulation.model import Experiment

FITTED_WELL = 1e-6
"""Relative fall of a rival's cost at which it is fitted well enough."""


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
class Beside:
    """What the records at hand tell of their noise, and of how much they differ.

    Parameters
    ----------
    whitening : Whitening or None
        Of the noise that a model leaves; None where it counts as white.
    scatter : mapping of str to float
        Relative standard deviation of a parameter between records, by its name.
    """

    whitening: Any = None
    scatter: Mapping[str, float] = field(default_factory=dict)

    @classmethod
    def of(cls, search: Search, base: LaplaceFit) -> Beside:
        """That of the model without the rivals."""
        evidence, unknowns = base.evidence, base.evidence.mode.unknowns
        levels = evidence.weight @ evidence.grid
        names = [unknowns.names[i] for i in unknowns.scattering]
        return cls(search.inference.common_noise.whitening, dict(zip(names, levels.tolist(), strict=True)))

    def deviations(self, names: Sequence[str]) -> list[int]:
        """Which of some shared values differ between records."""
        return [i for i, name in enumerate(names) if self.scatter.get(name, 0.0) > 0.0]

    def held(self, grams: np.ndarray, names: Sequence[str], own: int, sizes: np.ndarray) -> np.ndarray:
        """Gram matrices in which each record has deviations of its own (random effects), as large as is known.

        Parameters
        ----------
        grams : (n_record, n, n)
            Of shared columns, each record's own, and further ones.
        names : sequence of str
            Of the shared columns.
        own : int
            Number of each record's own.
        sizes : (n_record, n_shared)
            Relative changes of the shared values that their columns stand for.
        """
        scattering, last = self.deviations(names), len(names) + own
        places = np.r_[:last, scattering, last : grams.shape[1]].astype(int)
        wide = grams[:, places][:, :, places]
        for j, i in enumerate(scattering):
            wide[:, last + j, last + j] += (sizes[:, i] / self.scatter[names[i]]) ** 2
        return wide


@dataclass(frozen=True)
class Worth:
    """What a further record would add.

    Parameters
    ----------
    choice : Choice
    errors : dict of str to float
        Factor on the standard error of each shared parameter that the records at hand determine.
    limits : dict of str to float
        Factor on the detection limit of each effect that the records at hand show.
    nats : float
        Expected logarithm of the likelihood ratio of two rivals with it, the smaller of both ways round; nan without.
    determined : tuple of str
        Shared parameters that are determined with it, and not by the records at hand.
    shown : tuple of str
        Effects that show with it, and not in the records at hand.
    """

    choice: Choice
    errors: dict[str, float]
    limits: dict[str, float]
    nats: float = float("nan")
    determined: tuple[str, ...] = ()
    shown: tuple[str, ...] = ()

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
    return float(np.exp(np.mean(np.log(list(factors.values()))))) if factors else 1.0


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


def worths(
    search: Search, rivals: Sequence[Explanation], choices: Sequence[Choice], beside: Beside
) -> tuple[list[Worth], float]:
    """What each of some records would add, and the nats by which the records at hand tell the rivals apart.

    Inputs count as known. Records that cannot be simulated are left out.

    Parameters
    ----------
    search : Search
        With all effects whose detection limits count in one supermodel, see `set_up`.
    rivals : sequence of Explanation
        Two, or none.
    choices : sequence of Choice
    beside : Beside
        Of the records at hand.
    """
    plain, local, context = _plain(search.base.supermodel), search.base.fit.local, search.context
    supermodel = replace(plain, whitening=beside.whitening)
    columns, targets = changed_values(
        supermodel, context, local, strengths_of(search.effects), little_sizes(search.effects)
    )
    shared, own = len(context.base), len(context.each)
    sizes = _relative(local[:, columns[:shared]], targets[:, :shared])
    grams = grams_at_hand(supermodel, context, local, columns, targets)
    # What is believed of shared values counts as one more record.
    grams = beside.held(grams, context.base, own, np.concatenate([sizes, sizes[:1]]))
    added = menu_grams(supermodel, context, local, columns, targets, choices)
    added = [
        beside.held(gram[None], context.base, own, sizes[[choice.record]])[0]
        for gram, choice in zip(added, choices, strict=True)
    ]
    own += len(beside.deviations(context.base))
    possible = [i for i, gram in enumerate(added) if np.isfinite(gram).all()]
    now, nats = float("nan"), [float("nan")] * len(possible)
    if rivals and possible:
        now, nats = _apart(search, rivals, [choices[i] for i in possible], beside)
    found = [
        replace(_worth(search, (grams, added[i]), own, choices[i]), nats=apart)
        for i, apart in zip(possible, nats, strict=True)
        if not rivals or np.isfinite(apart)
    ]
    return found, now


def _relative(values: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Relative changes from values to others."""
    return np.asarray((targets - values) / np.where(values == 0.0, 1.0, values))


def _worth(search: Search, grams: tuple[np.ndarray, np.ndarray], own: int, choice: Choice) -> Worth:
    """What a record adds to error bars and detection limits, from Gram matrices of those at hand and its own.

    Parameters
    ----------
    search : Search
    grams : ((n_record, n, n), (n, n))
        Columns as of `changed_values`, with deviations of a record, see `Beside.held`.
    own : int
        Number of columns that are each record's own.
    choice : Choice
    """
    context, whole = search.context, np.concatenate([grams[0], grams[1][None]])
    shared = len(context.base)
    before, after = (_errors(each, shared, own) for each in (grams[0], whole))
    (norms, unique, _), (norms_then, unique_then, _) = (likeness(each, shared, own) for each in (grams[0], whole))
    names, known, shows = [effect.name for effect in search.effects], np.isfinite(before), unique > UNIQUE
    # What was seen is seen still where far more of a change is imitated in a further record.
    most = np.maximum(norms, np.where(unique_then > UNIQUE, norms_then, norms))
    less = np.divide(norms, most, out=np.ones_like(norms), where=shows)
    return Worth(
        choice,
        {name: float(after[i] / before[i]) for i, name in enumerate(context.base) if known[i]},
        {name: float(less[i]) for i, name in enumerate(names) if shows[i]},
        determined=tuple(name for i, name in enumerate(context.base) if not known[i] and np.isfinite(after[i])),
        shown=tuple(name for i, name in enumerate(names) if not shows[i] and unique_then[i] > UNIQUE),
    )


def _plain(supermodel: Supermodel) -> Supermodel:
    """A supermodel with known inputs, in white noise as yet."""
    return replace(supermodel, sensitivities=None, whitening=None)


def _errors(grams: np.ndarray, shared: int, own: int) -> np.ndarray:
    """Standard errors of the shared columns, in units of their changes, each record's own eliminated.

    Infinite for a parameter that is not determined, be it by itself or beside others.
    """
    information = np.zeros((shared, shared))
    for gram in grams:
        mine = gram[shared : shared + own, shared : shared + own]
        unit = scale_of(mine)
        cross = gram[:shared, shared : shared + own] / unit
        inverse = np.linalg.pinv(mine / np.outer(unit, unit), rcond=UNKNOWN, hermitian=True)
        information += gram[:shared, :shared] - cross @ inverse @ cross.T
    size = np.sqrt(np.maximum(np.diag(information), 0.0))
    safe = np.where(size > 0.0, size, 1.0)
    values, vectors = np.linalg.eigh(information / np.outer(safe, safe))
    seen = values > UNKNOWN * values.max(initial=0.0)
    variance = (vectors[:, seen] ** 2 / values[seen]).sum(axis=1)
    known = (vectors[:, ~seen] ** 2).sum(axis=1) < CONCERNED
    return np.where(known, np.sqrt(variance) / safe, np.inf)


def _apart(
    search: Search, rivals: Sequence[Explanation], choices: Sequence[Choice], beside: Beside
) -> tuple[float, list[float]]:
    """Nats by which two rivals differ: at hand, and with each choice; whichever of them is true."""
    first, second = rivals
    ways = [_missed(search, true, other, choices, beside) for true, other in ((first, second), (second, first))]
    return min(ways[0][0], ways[1][0]), [min(pair) for pair in zip(ways[0][1], ways[1][1], strict=True)]


def _missed(
    search: Search, true: Explanation, other: Explanation, choices: Sequence[Choice], beside: Beside
) -> tuple[float, list[float]]:
    """Half of what a rival at its best still misses of a true model, in squares of the noise.

    The rival is fitted to what the true model says of the records at hand, without noise. Of a further record it is
    fitted to both by its slopes there, in each record by deviations of its own too. Not finite of one that cannot be
    simulated.
    """
    plain, context = supermodel_of(search.task, (true.effect, other.effect)), search.context
    supermodel = replace(plain, whitening=beside.whitening)
    truth = _values(supermodel, search.task, true)
    data = supermodel.problem.observations
    at_hand = with_records(supermodel, data._replace(measured=_readings(supermodel.problem, truth, data.experiment)))
    subset = context.subset((other.effect,))
    starts = _starts(supermodel, _values(supermodel, search.task, other), other.effect)
    unweighted = replace(at_hand, whitening=None)
    fits = [refit(unweighted, subset, start, context.whole, enough=FITTED_WELL) for start in starts]
    found = min(fits, key=lambda fit: fit.cost if np.isfinite(fit.cost) else np.inf).local
    names = (*subset.shared, *subset.each)
    columns = np.array([supermodel.names.index(name) for name in names])
    size = np.array([abs(supermodel.declared[name].typical) for name in names])
    targets = found[:, columns] + difference_steps(found[:, columns], size)
    shared, own = len(subset.shared), len(subset.each)

    def seen(model: Supermodel, values: np.ndarray, goals: np.ndarray, counts: np.ndarray) -> np.ndarray:
        grams = model.grams(values, columns, goals, counts)
        return beside.held(grams, subset.shared, own, _relative(values[:, columns[:shared]], goals[:, :shared]))

    def left(grams: np.ndarray) -> float:
        if not np.isfinite(grams).all():
            return float("nan")
        return 0.5 * max(float(projected(grams, shared, grams.shape[1] - shared - 1)[0].sum()), 0.0)

    grams = seen(at_hand, found, targets, context.whole)

    further = []
    for batch in batches(choices, len(found)):
        rows = [choice.record for choice in batch]
        taken, true_values = records_of(supermodel.problem, truth, batch)
        values = records_of(supermodel.problem, found, batch)[1]
        there = with_records(
            supermodel, taken._replace(measured=_readings(supermodel.problem, true_values, taken.experiment)), rows
        )
        goals = values[:, columns] + difference_steps(values[:, columns], size)
        further += list(seen(there, values, goals, context.whole[rows]))
    return left(grams), [left(np.concatenate([grams, gram[None]])) for gram in further[: len(choices)]]


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


def _starts(supermodel: Supermodel, start: np.ndarray, effect: type[Effect]) -> list[np.ndarray]:
    """Where a rival is fitted from: with its effect as strong as it was found, weak and absent."""
    absent, blank = start.copy(), absent_values(supermodel, len(start))
    columns = [supermodel.names.index(f"{effect.name}.{parameter.name}") for parameter in effect.parameters]
    absent[:, columns] = blank[:, columns]
    return [start, strengthened(supermodel, start, (effect,), SMALL), absent]


def just_found(search: Search, base: LaplaceFit, effect: type[Effect]) -> Explanation | None:
    """A model with an effect so strong that the records at hand would just show it; None where they cannot show it.

    Parameters
    ----------
    search : Search
    base : LaplaceFit
        The model without it.
    effect : Effect class
    """
    plain = supermodel_of(search.task, (effect,), search.base.supermodel.sensitivities)
    supermodel = search.inference.common_noise.whitened(plain)
    local = transferred(supermodel, base.supermodel, base.local)
    (found,) = confusion(supermodel, search.context, local, (effect,), gate).directions
    if (strength := found.smallest_detectable) is None:
        return None
    ((_, declared),) = strengths_of((effect,))
    if not declared.reciprocal:
        strength = declared.null + np.sign(declared.typical - declared.null) * strength
    values = {name: local[:, j] for j, name in enumerate(supermodel.names)}
    return Explanation(effect, values | {f"{effect.name}.{declared.name}": np.full(len(local), strength)})
