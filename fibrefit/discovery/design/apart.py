"""How far apart two rivals are in a further record: by what the one that is wrong, at its best, still misses.

Source
------
T-optimal design, Atkinson and Fedorov, Biometrika 62 (1975) 57-70.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.discovery.design.beside import Beside, relative_changes
from fibrefit.discovery.design.grams import projected, read_exactly, with_records
from fibrefit.discovery.design.menu import batches, records_of
from fibrefit.discovery.engine.candidates import (
    SMALL,
    absent_values,
    strengthened,
    transferred,
    with_absent,
    with_values,
)
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import Subset, difference_steps, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem import Observations, Problem, Task
from fibrefit.simulation.model import Experiment

FITTED_WELL = 1e-6
"""Relative fall of a rival's cost at which it is fitted well enough."""
REFITTED_WELL = 1e-2
"""The same of one that is fitted to a further record too: its nats are wanted, not its values."""
LOOKS = 8
"""Most further records to which rivals are refitted, each as often as a fit asks; slopes do for the order of others."""


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

    @classmethod
    def by(
        cls, effect: type[Effect], names: Sequence[str], local: np.ndarray, mean: Mapping[str, float]
    ) -> Explanation:
        """That of a fit, its records alike but for what is each one's own.

        A rival pays for what it follows by deviations of a record: what records really differ by is none of its due.

        Parameters
        ----------
        effect : Effect class
        names : sequence of str
            Of the values of a record.
        local : (n_record, n_local) in SI units
        mean : mapping of str to float, in SI units
            What the records share.
        """
        found = {name: local[:, j] for j, name in enumerate(names)}
        return cls(effect, found | {name: np.full(len(local), mean[name]) for name in names if name in mean})


@dataclass(frozen=True)
class Lengthened:
    """A supermodel with one more record than its programs take, which they simulate after the others; see `Refittable`.

    Parameters
    ----------
    supermodel : Supermodel
        Of the records at hand.
    further : Supermodel
        Of as many records; the first one is the record in addition.
    """

    supermodel: Supermodel
    further: Supermodel

    @property
    def problem(self) -> Problem:
        """That of the records at hand."""
        return self.supermodel.problem

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the values, which both have."""
        return self.supermodel.names

    def sizes(self, names: Iterable[str]) -> np.ndarray:
        """Typical sizes of values, in SI units."""
        return self.supermodel.sizes(names)

    def grams(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """As those of a supermodel, the further record last."""
        at_hand = self.supermodel.grams(local[:-1], columns, targets[:-1], counts[:-1])
        last = [np.repeat(each[-1:], len(at_hand), axis=0) for each in (local, targets, counts)]
        return np.concatenate([at_hand, self.further.grams(last[0], columns, last[1], last[2])[:1]])


@dataclass(frozen=True)
class Contest:
    """A rival of a model that is taken for true, at its best for what that one says of the records at hand.

    Parameters
    ----------
    true, supermodel : Supermodel
        Of the true model and of the rival; the rival's in the noise of the records at hand.
    truth, found : (n_record, n_local) in SI units
        Values of the true model, and of the rival at its best.
    subset : Subset
        What of the rival is fitted, and what of it differs between records.
    counts : (n_record,) int
        Samples of each record.
    beside : Beside
    """

    true: Supermodel
    supermodel: Supermodel
    truth: np.ndarray
    found: np.ndarray
    subset: Subset
    counts: np.ndarray
    beside: Beside

    @classmethod
    def of(cls, search: Search, true: Explanation, other: Explanation, beside: Beside) -> Contest:
        """That of two explanations, the other one fitted to what the true one says, without noise.

        Parameters
        ----------
        search : Search
        true, other : Explanation
        beside : Beside
            Of the records at hand.
        """
        plain = supermodel_of(search.task, (true.effect, other.effect), search.base.supermodel.sensitivities)
        context, truth = search.context, _values(plain, search.task, true)
        alike = replace(context.subset((other.effect,)), scatter={})
        unweighted = cls(plain, read_exactly(plain, Beside()), truth, truth, alike, context.whole, beside).at_hand
        starts = _starts(plain, _values(plain, search.task, other), other.effect)
        fits = [refit(unweighted, alike, start, context.whole, enough=FITTED_WELL) for start in starts]
        best = min(fits, key=lambda fit: fit.cost if np.isfinite(fit.cost) else np.inf)
        # Of a value that is zero, as a friction that a rival takes the place of, no share differs between records.
        nothing = {name for j, name in enumerate(plain.names) if not best.local[:, j].any()}
        scatter = {name: sd for name, sd in beside.scatter.items() if sd > 0.0 and name not in nothing}
        subset = replace(alike, scatter=scatter)
        return cls(plain, read_exactly(plain, beside), truth, best.local, subset, context.whole, beside)

    @classmethod
    def between(cls, search: Search, true: LaplaceFit, other: LaplaceFit) -> Contest:
        """That of two models of a search, each with the values it was found with, its records alike.

        Parameters
        ----------
        search : Search
        true, other : LaplaceFit
            Records differ as the true one says.
        """
        beside = Beside.of(search, true)
        seen = read_exactly(other.supermodel, beside)
        own = supermodel_of(search.task, true.effects).task
        # Of inputs without the errors that were found in them.
        told = Problem(own.problem.model, own.problem.layout, seen.problem.observations)
        model = Supermodel(replace(own, problem=told))
        truth = transferred(model, true.supermodel, with_values(true.supermodel, true.local, true.shared))
        found = with_values(other.supermodel, other.local, other.shared)
        return cls(model, seen, truth, found, search.context.subset(other.effects), search.context.whole, beside)

    @cached_property
    def at_hand(self) -> Supermodel:
        """With the records at hand as the true model says they are."""
        return self._as_read(self.truth, self.true.problem.observations)

    @cached_property
    def grams(self) -> np.ndarray:
        """Gram matrices of the rival in the records at hand."""
        return self._seen(self.at_hand, self.found, self.counts)

    @property
    def now(self) -> float:
        """Nats by which it misses the records at hand."""
        return self._left(self.grams)

    def _seen(self, model: Supermodel, values: np.ndarray, counts: np.ndarray) -> np.ndarray:
        """Gram matrices of some records at values of the rival, with what deviations of a record do."""
        shared, names = len(self.subset.shared), (*self.subset.shared, *self.subset.each)
        columns = np.array([model.names.index(name) for name in names], dtype=int)
        steps = difference_steps(values[:, columns], model.sizes(names))
        grams = model.grams(values, columns, values[:, columns] + steps, counts)
        relative = relative_changes(values[:, columns], values[:, columns] + steps)
        return self.beside.held(grams, self.subset.shared, len(self.subset.each), relative[:, :shared])

    def _left(self, grams: np.ndarray) -> float:
        """Nats that remain where all that is fitted has moved as the slopes say."""
        if not np.isfinite(grams).all():
            return float("nan")
        shared = len(self.subset.shared)
        return 0.5 * max(float(projected(grams, shared, grams.shape[1] - shared - 1)[0].sum()), 0.0)

    def by_slopes(self, choices: Sequence[Choice]) -> list[float]:
        """Nats by which it misses them and each of some further records, as its slopes there say.

        Not finite of one that cannot be simulated.
        """
        further: list[np.ndarray] = []
        for batch in batches(choices, len(self.found)):
            there, values, counts = self._further(batch)
            further += list(self._seen(there, values, counts))
        return [self._left(np.concatenate([self.grams, gram[None]])) for gram in further[: len(choices)]]

    def refitted(self, choice: Choice) -> float:
        """Nats by which it misses them and a further record, fitted to all of them.

        Far from where it was found a rival bends to what its slopes there cannot follow, and misses less.
        """
        there, values, counts = self._further([choice] * len(self.found))
        whole = Lengthened(self.at_hand, there)
        start, samples = np.concatenate([self.found, values[:1]]), np.append(self.counts, counts[0])
        return 0.5 * refit(whole, self.subset, start, samples, enough=REFITTED_WELL).cost

    def _further(self, batch: Sequence[Choice]) -> tuple[Supermodel, np.ndarray, np.ndarray]:
        """Further records as the true model says they would be, the rival's values there, and their samples."""
        rows = [choice.record for choice in batch]
        data, true_values = records_of(self.true.problem, self.truth, batch)
        values = records_of(self.supermodel.problem, self.found, batch)[1]
        return self._as_read(true_values, data, rows), values, self.counts[rows]

    def _as_read(self, truth: np.ndarray, data: Observations, like: Sequence[int] | None = None) -> Supermodel:
        """The rival's supermodel of records, like some of those at hand, that are read as the true model says."""
        readings = _predicted(self.true.problem, jnp.asarray(truth), data.experiment)
        return with_records(
            self.supermodel, data._replace(measured={name: readings[name] for name in data.measured}), like
        )


@eqx.filter_jit
def _predicted(problem: Problem, local: jax.Array, experiment: Experiment) -> dict[str, jax.Array]:
    return problem.predict(local, experiment)


def nats_apart(
    search: Search,
    rivals: Sequence[Explanation],
    choices: Sequence[Choice],
    beside: Beside,
    ranked: Callable[[np.ndarray, np.ndarray], Sequence[tuple[float, ...]]],
) -> tuple[np.ndarray, np.ndarray, list[int]]:
    """Nats by which two rivals differ, where the first one is true and where the second one is: at hand, and with more.

    Rivals are refitted to those choices, in the order of what slopes promise, that would come before the best one to
    which they were, until none would: what comes first has been looked into, and so has what costs less.

    Parameters
    ----------
    search : Search
    rivals : sequence of Explanation
        Two.
    choices : sequence of Choice
    beside : Beside
    ranked : callable
        Rank of each choice, the lowest first, from the nats at hand and with each.

    Returns
    -------
    now : (2,)
        In the records at hand.
    nats : (2, n_choice)
        With each choice too; not finite, either way, of one that cannot be simulated.
    refitted : list of int
        Those choices to which the rivals were refitted.
    """
    first, second = rivals
    ways = [Contest.of(search, true, other, beside) for true, other in ((first, second), (second, first))]
    now, nats = np.array([way.now for way in ways]), np.array([way.by_slopes(choices) for way in ways])
    nats[:, ~np.isfinite(nats).all(axis=0)] = np.nan
    refitted, tried = list[int](), set[int]()
    for _ in range(LOOKS):
        ranks = ranked(now, nats)
        best = min((ranks[i] for i in refitted), default=(np.inf,))
        ahead = [i for i, rank in enumerate(ranks) if i not in tried and np.isfinite(nats[0, i]) and rank < best]
        if not ahead:
            break
        i = max(ahead, key=lambda i: float(nats[:, i].min()))
        tried.add(i)
        ends = [way.refitted(choices[i]) for way in ways]
        # Where either way loses the motion, slopes are all that is known of the record.
        if np.isfinite(ends).all():
            nats[:, i] = ends
            refitted.append(i)
    return now, nats, refitted


def _values(supermodel: Supermodel, task: Task, rival: Explanation) -> np.ndarray:
    """Values ``(n_record, n_local)`` of a supermodel that are those of a rival, the other one absent."""
    local = absent_values(supermodel, len(task.problem.layout.records))
    for j, name in enumerate(supermodel.names):
        if name in rival.values:
            local[:, j] = rival.values[name]
    return local


def _starts(supermodel: Supermodel, start: np.ndarray, effect: type[Effect]) -> list[np.ndarray]:
    """Where a rival is fitted from: with its effect as strong as it was found, weak and absent."""
    weak, absent = strengthened(supermodel, start, (effect,), SMALL), with_absent(supermodel, start, (effect,))
    return [start, weak, absent]
