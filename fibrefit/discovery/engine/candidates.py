"""Candidates: which effects may be missing, where their refits start, and how they did."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from contextvars import copy_context
from dataclasses import dataclass, replace
from itertools import product
from typing import Any

import numpy as np

from fibrefit.core.declarations import Parameter
from fibrefit.core.limits import OutOfTimeError, check_time
from fibrefit.core.threads import thread_pool
from fibrefit.discovery.engine.effort import TOO_FAR
from fibrefit.discovery.engine.refit import Refit, Subset, predictor_step, refit
from fibrefit.discovery.engine.supermodel import Supermodel, supermodel_of
from fibrefit.laws.families import instants
from fibrefit.laws.law import Effect
from fibrefit.problem import Task

SMALL = 0.1
"""Strength at which a refit starts, as a share of the typical one: small enough not to spoil the orbit."""
BLOWN, GENTLER = 4.0, 3
"""Cost over that of the model without the effect from which a start is made weaker, and how often: bounces that come
at other times lead nowhere."""
GROWTH, GROWN, FOLLOWED = 1.3, 20, 8
"""Factor by which the strength of an effect then grows from a weak one, how often, and steps of each refit."""
PAST = 3
"""Strengths in turn with no lower cost after which the best one is past."""
SHAPES = (0.25, 1.0, 4.0)
"""Where a shape parameter, which has no slope while the strength is zero, starts: multiples of its typical size."""
SCREENING = 6
"""Steps every start is given before the best ones go on."""
FINALISTS = 2
RETIMED = 0.01
"""Relative fall of the cost for which a refit is continued once more."""
SEEN_FOLDED = np.arange(9.5, 65.0, 1.5)
"""Where a frequency far above the usual one starts, in multiples of that: such a ring is seen folded.

One that is just seen has died away after a sample or two, of some 0.5 ms: 300 Hz beside it, its phase there is another
by a radian."""
FREQUENCIES = np.concatenate([np.geomspace(0.125, 8.0, 18), SEEN_FOLDED])
"""Where a frequency starts: its valley is narrow, as wide as it is damped."""
MANY, KEPT = 12, 4
"""Starts from which on each takes a single step before the best few go on."""
JOBS_AT_ONCE = 2
"""Jobs at a time, whatever cores there are: each holds the rows of a supermodel, hundreds of megabytes."""


@dataclass(frozen=True)
class Hypothesis:
    """Effects that may be missing together, fitted.

    Parameters
    ----------
    effects : tuple of Effect classes
        Added to the model the search began with, in the order they were found.
    fit : Refit
    supermodel : Supermodel
        The one it was fitted in.
    """

    effects: tuple[type[Effect], ...]
    fit: Refit
    supermodel: Supermodel

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)


@dataclass(frozen=True)
class SearchContext:
    """What all hypotheses of a search have in common.

    Parameters
    ----------
    base : tuple of str
        Shared free values of the model the search began with.
    each : tuple of str
        Free values of each record.
    scattering : tuple of str
        Those of `base` that belong to the rig itself and may differ from record to record.
    counts : (n_stage, n_record) int
        Horizons, the last one whole.
    data_start : dict of str to (n_record,)
        Values the data themselves suggest.
    """

    base: tuple[str, ...]
    each: tuple[str, ...]
    scattering: tuple[str, ...]
    counts: np.ndarray
    data_start: dict[str, np.ndarray]

    @property
    def whole(self) -> np.ndarray:
        """Samples of each record."""
        return self.counts[-1]

    def subset(self, effects: Iterable[type[Effect]]) -> Subset:
        """Active values when these effects are on."""
        added = tuple(f"{effect.name}.{p.name}" for effect in effects for p in effect.parameters)
        return Subset(self.base + added, self.each)

    def descended(self, effects: Sequence[type[Effect]]) -> Subset:
        """Those of them that a descent in plain squares moves: along an instant slopes are those of a few samples."""
        whole, held = self.subset(effects), instants(effects)
        return replace(whole, shared=tuple(name for name in whole.shared if name not in held))


def absent_values(supermodel: Supermodel, records: int) -> np.ndarray:
    """Values ``(n_record, n_local)`` with every effect at its null and nothing else set."""
    local = np.zeros((records, len(supermodel.names)))
    for j, name in enumerate(supermodel.names):
        declared = supermodel.declared[name]
        reachable = declared.lower <= declared.null <= declared.upper
        local[:, j] = declared.null if reachable or declared.reciprocal else declared.typical
    return local


def transferred(
    supermodel: Supermodel, source: Supermodel, local: np.ndarray, onto: np.ndarray | None = None
) -> np.ndarray:
    """Values ``(n_record, n_local)`` of one supermodel in another; what it lacks as in `onto`, or else absent."""
    values = absent_values(supermodel, len(local)) if onto is None else onto.copy()
    for j, name in enumerate(supermodel.names):
        if name in source.names:
            values[:, j] = local[:, source.names.index(name)]
    return values


def with_absent(supermodel: Supermodel, local: np.ndarray, gone: Sequence[type[Effect]]) -> np.ndarray:
    """Values ``(n_record, n_local)`` with some effects back at their nulls."""
    values, blank = local.copy(), absent_values(supermodel, len(local))
    for effect in gone:
        columns = [supermodel.names.index(f"{effect.name}.{parameter.name}") for parameter in effect.parameters]
        values[:, columns] = blank[:, columns]
    return values


def with_values(supermodel: Supermodel, local: np.ndarray, named: Mapping[str, float | np.ndarray]) -> np.ndarray:
    """Values ``(n_record, n_local)`` with some of them given by name, one for all records or ``(n_record,)``, in SI."""
    values = local.copy()
    for name, value in named.items():
        values[:, supermodel.names.index(name)] = value
    return values


def own_task(task: Task, hypothesis: Hypothesis) -> tuple[Task, np.ndarray]:
    """Task of a model with the effects of a hypothesis and no others, and its values ``(n_free,)`` in SI units.

    Parameters
    ----------
    task : Task
        Of the model the search began with.
    hypothesis : Hypothesis
    """
    own, local = own_task_by_record(task, hypothesis)
    return own, own.problem.layout.means_of(local)


def own_task_by_record(task: Task, hypothesis: Hypothesis) -> tuple[Task, np.ndarray]:
    """The same with the values of each record, ``(n_record, n_local)`` in SI units, which may differ."""
    own = supermodel_of(task, hypothesis.effects).task
    return own, transferred(Supermodel(own), hypothesis.supermodel, hypothesis.fit.local)


@dataclass(frozen=True)
class Trial:
    """Further effects on a hypothesis, fitted so far as to see whether they are worth a full refit.

    Parameters
    ----------
    supermodel : Supermodel
    effects : tuple of Effect classes
        Those of the hypothesis and the further ones.
    fits : tuple of Refit
        The best few ends of short refits, best first.
    """

    supermodel: Supermodel
    effects: tuple[type[Effect], ...]
    fits: tuple[Refit, ...]

    def as_it_is(self) -> Hypothesis:
        """The hypothesis without a full refit."""
        return Hypothesis(self.effects, self.fits[0], self.supermodel)

    def refitted(self, context: SearchContext) -> Hypothesis:
        """The hypothesis refitted in full, from the best few ends."""
        subset = context.descended(self.effects)
        ends = [refit(self.supermodel, subset, found.local, context.whole) for found in self.fits]
        best = min(ends, key=lambda found: found.cost)
        return Hypothesis(
            self.effects, rescued_by_short_horizons(self.supermodel, subset, best, context), self.supermodel
        )


def rescued_by_short_horizons(supermodel: Supermodel, subset: Subset, found: Refit, context: SearchContext) -> Refit:
    """A refit continued once more in the horizon, from what can be predicted to whole records, while that ends lower.

    Where later bounces are matched in the wrong order, the first ones still tell the way out.
    """
    while supermodel.sensitivities is None and len(context.counts) > 1:
        early = found
        for counts in context.counts[:-1]:
            early = refit(supermodel, subset, early.local, counts, SCREENING, 1e-3)
        other = refit(supermodel, subset, early.local, context.whole)
        if not other.cost < (1.0 - RETIMED) * found.cost:
            break
        found = other
    return found


def trial_of(
    supermodel: Supermodel,
    context: SearchContext,
    parent: Hypothesis,
    added: Sequence[type[Effect]],
    begun: Sequence[Mapping[str, float]] = (),
) -> Trial:
    """A parent hypothesis with more effects, refitted by some steps from several starts.

    Parameters
    ----------
    supermodel : Supermodel
        One that holds all effects.
    context : SearchContext
    parent : Hypothesis
    added : sequence of Effect classes
    begun : sequence of mapping of str to float, optional
        Values of their parameters, in SI units, to start from; each sign that makes sense and each shape by default.
    """
    effects = (*parent.effects, *added)
    subset = context.descended(effects)
    before = transferred(supermodel, parent.supermodel, parent.fit.local)
    most = BLOWN * parent.fit.cost
    plain = [with_values(supermodel, before, values) for values in begun] or _starts(supermodel, before, added)
    starts = [_weakened(supermodel, context, start, added, most) for start in plain]
    weakened = any(start is not first for start, first in zip(starts, plain, strict=True))
    if len(starts) > MANY:
        first = sorted(
            (refit(supermodel, subset, start, context.whole, 1) for start in starts), key=lambda found: found.cost
        )
        starts = [found.local for found in first[:KEPT]]
    fits = [refit(supermodel, subset, start, context.whole, SCREENING, 1e-3) for start in starts]
    if weakened:
        fits += _continuation(supermodel, context, subset, min(fits, key=lambda found: found.cost), added)
    # What errors of inputs do is known for the motion of a good fit, and what is far from it is not to be had there.
    near = supermodel.sensitivities is not None and parent.fit.cost < TOO_FAR**2 * supermodel.samples.sum()
    if not parent.effects and not near:
        suggested = [with_values(supermodel, start, context.data_start) for start in starts]
        fits += [_from_data(supermodel, context, subset, start) for start in suggested]
    return Trial(supermodel, effects, tuple(sorted(fits, key=lambda found: found.cost)[:FINALISTS]))


def fit_all(jobs: Sequence[Callable[[], Any]], tell: Callable[[int], None]) -> list[Any]:
    """Carry out `JOBS_AT_ONCE` jobs at a time, the first ones first; compiled programs do not hold the interpreter.

    Returns
    -------
    list
        None for those that the time did not suffice for.
    """
    done: list[Any] = []
    with thread_pool(JOBS_AT_ONCE) as pool:
        # A limit of time holds for what is done in other threads too.
        for future in [pool.submit(copy_context().run, _in_time, job) for job in jobs]:
            done.append(future.result())
            tell(len(done))
    return done


def _in_time(job: Callable[[], Any]) -> Any:
    try:
        check_time()
        return job()
    except OutOfTimeError:
        return None


def _weakened(
    supermodel: Supermodel, context: SearchContext, start: np.ndarray, added: Sequence[type[Effect]], most: float
) -> np.ndarray:
    """A start, or a weaker one where it costs more than `most`."""
    for _ in range(GENTLER):
        if supermodel.costs(start, context.whole).sum() <= most:
            break
        weaker = strengthened(supermodel, start, added, SMALL)
        if np.array_equal(weaker, start):
            break
        start = weaker
    return start


def _continuation(
    supermodel: Supermodel, context: SearchContext, subset: Subset, weak: Refit, added: Sequence[type[Effect]]
) -> list[Refit]:
    """Continuation (homotopy): refits at strengths that grow step by step, the other values predicted and refitted.

    Where a motion bounces, a strong effect is far beyond what slopes predict, and a weak one lies in a dent of its
    own: each strength is reached from the one before.
    """
    strengths = {f"{effect.name}.{name}" for effect in added for name in effect.strength}
    held = replace(subset, shared=tuple(name for name in subset.shared if name not in strengths))
    local, ends, best = weak.local, [], weak.cost
    for _ in range(GROWN):
        goal = strengthened(supermodel, local, added, GROWTH)
        grown = goal != local
        if not (grown.any() and np.isfinite(goal[grown]).all()):
            break
        start = predictor_step(supermodel, held, subset, local, goal, context.whole)
        fit = refit(supermodel, held, start, context.whole, FOLLOWED, 1e-5)
        local = fit.local
        ends.append(fit)
        best = min(best, fit.cost)
        if not any(fit.cost <= best for fit in ends[-PAST:]):
            break
    return ends


def strengthened(
    supermodel: Supermodel, values: np.ndarray, added: Sequence[type[Effect]], factor: float
) -> np.ndarray:
    """Values with added effects made stronger or weaker, inside their bounds; a frequency stays."""
    scaled = values.copy()
    for effect in added:
        for name in effect.strength:
            j = supermodel.names.index(f"{effect.name}.{name}")
            declared = supermodel.declared[supermodel.names[j]]
            if declared.reciprocal:
                scaled[:, j] /= factor
            elif declared.unit != "Hz":
                scaled[:, j] = declared.null + factor * (scaled[:, j] - declared.null)
            scaled[:, j] = np.clip(scaled[:, j], declared.lower, declared.upper)
    return scaled


def _from_data(supermodel: Supermodel, context: SearchContext, subset: Subset, start: np.ndarray) -> Refit:
    early = refit(supermodel, subset, start, context.counts[0], SCREENING, 1e-2)
    return refit(supermodel, subset, early.local, context.whole, SCREENING, 1e-3)


def _starts(supermodel: Supermodel, before: np.ndarray, added: Sequence[type[Effect]]) -> list[np.ndarray]:
    """Values with the added effects weakly present: each sign that makes sense, each shape."""
    choices = []
    for effect in added:
        choices.append(list(product(*(_sizes(effect, parameter) for parameter in effect.parameters))))
    starts = []
    for choice in product(*choices):
        values = before.copy()
        for effect, sizes in zip(added, choice, strict=True):
            for parameter, size in zip(effect.parameters, sizes, strict=True):
                values[:, supermodel.names.index(f"{effect.name}.{parameter.name}")] = size
        starts.append(values)
    return starts


def _sizes(effect: type[Effect], parameter: Parameter) -> list[float]:
    step = SMALL * (parameter.typical - parameter.null)
    if parameter.reciprocal:
        strengths = [parameter.typical / SMALL**0.5]
    else:
        strengths = [parameter.null + step, *([parameter.null - step] if parameter.lower < parameter.null else [])]
    return starting_sizes(effect, parameter, strengths)


def starting_sizes(effect: type[Effect], parameter: Parameter, strengths: Sequence[float]) -> list[float]:
    """Where a parameter starts: its own starts if it declares any; each shape; each frequency; or else `strengths`."""
    if parameter.starts:
        return list(parameter.starts)
    if parameter.name not in effect.strength:
        sizes = [factor * parameter.typical for factor in SHAPES] if parameter.log else [parameter.typical]
    elif parameter.unit == "Hz":
        sizes = list(FREQUENCIES * parameter.typical)
    else:
        sizes = list(strengths)
    return [float(np.clip(size, parameter.lower, parameter.upper)) for size in dict.fromkeys(sizes)]
