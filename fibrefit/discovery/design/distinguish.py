"""Which effects a set of records could tell apart, before or after measuring: from the model's sensitivities alone.

Source
------
The projection and its smallest detectable strength are those of a t-test in a linear model; choosing the next record by
the worst pair follows Hunter and Reiner, Technometrics 7 (1965).
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import equinox as eqx
import jax
import jax.numpy as jnp
import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.core.time_limit import check_time
from fibrefit.discovery.engine.candidates import SMALL, SearchContext, fit_all, transferred
from fibrefit.discovery.engine.effort import strengths_converged
from fibrefit.discovery.engine.refit import difference_steps
from fibrefit.discovery.engine.supermodel import Supermodel, residual_rows, supermodel_of
from fibrefit.discovery.engine.thresholds import INSEPARABLE, UNIQUE, gate
from fibrefit.discovery.model.finding import Choice, separation
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem.statement.layout import assembled, gathered, scale_of
from fibrefit.problem.statement.observations import Observations
from fibrefit.problem.task import Task
from fibrefit.simulation.inputs import Signals
from fibrefit.study.summaries.discovery import Detectable, Separation

ROUNDS = 4
"""Of looking for the strength that would just be found."""
LITTLE = 0.01
"""Share of strengths that spoil no motion, for what is compared without a strength that is requested."""


@dataclass(frozen=True)
class Confusion:
    """How alike effects are in a set of records.

    Parameters
    ----------
    directions : tuple of Detectable
    cosine : (n_effect, n_effect)
        Of the changes two effects make beyond what base parameters can imitate, without sign; 1 is inseparable.
    """

    directions: tuple[Detectable, ...]
    cosine: np.ndarray

    @property
    def invisible(self) -> tuple[str, ...]:
        """Effects these records cannot show."""
        return tuple(d.effect for d in self.directions if d.smallest_detectable is None)

    @property
    def inseparable(self) -> tuple[tuple[str, str], ...]:
        """Pairs that change these records in the same way, the most alike first."""
        return tuple((first, second) for first, second, _ in self.pairs(INSEPARABLE))

    def pairs(self, beyond: float) -> tuple[tuple[str, str, float], ...]:
        """Pairs whose cosine is beyond a limit, the most alike first.

        Parameters
        ----------
        beyond : float
            Cosine of the angle between what two effects do to the readings, 0 to 1.

        Returns
        -------
        tuple of (str, str, float)
            Names of both effects, and their cosine.
        """
        names = [direction.effect for direction in self.directions]
        found = [
            (names[i], names[j], float(self.cosine[i, j]))
            for i in range(len(names))
            for j in range(i)
            if self.cosine[i, j] > beyond
        ]
        return tuple(sorted(found, key=lambda pair: -pair[2]))


def confusion(
    supermodel: Supermodel,
    context: SearchContext,
    local: np.ndarray,
    effects: Sequence[type[Effect]],
    limit: Callable[[int], float],
) -> Confusion:
    """Compare what effects of a supermodel would do to its records.

    Parameters
    ----------
    supermodel : Supermodel
    context : SearchContext
    local : (n_record, n_local) in SI units
        Values of the base model, with every effect that may be missing absent.
    effects : sequence of Effect classes
        Those of the supermodel that may be missing.
    limit : callable
        Gain of 2 log likelihood from which a candidate with so many parameters is given its name, see `gate`.
    """
    strengths = strengths_of(effects)
    gates = np.array([limit(len(effect.parameters)) for effect in effects])
    most = sizes = sizes_of(strengths)
    # Where the model changes its kind at the null, weaker effects than this do the same and mean nothing.
    floor = np.array([effect.singular for effect in effects]) * most / SMALL
    for _ in range(ROUNDS):
        columns, targets = changed_values(supermodel, context, local, strengths, sizes)
        norms, unique, cosine = likeness(supermodel.grams(local, columns, targets, context.whole)[:, :-1, :-1], context)
        visible, used = unique > UNIQUE, sizes
        least = np.sqrt(gates) / np.where(visible, norms, 1.0)
        # Bounces bend what an effect does: its slope is taken over the strength that is requested.
        sizes = np.where(visible, np.clip(used * least, np.minimum(floor, most), most), used)
        if strengths_converged(used, sizes):
            break
    directions = []
    for i, (name, parameter) in enumerate(strengths):
        size = max(used[i] * least[i], floor[i]) if visible[i] else np.inf
        strength = (1.0 / size if np.isfinite(size) else np.inf) if parameter.reciprocal else size
        directions.append(
            Detectable(
                effect=name,
                parameter=parameter.name,
                unit=parameter.unit,
                smallest_detectable=float(strength),
                unique=float(unique[i]),
            )
        )
    return Confusion(tuple(directions), cosine)


def detectable(search: Search) -> tuple[Detectable, ...]:
    """Smallest strength of each effect that a search with nothing to find would have found, in its supermodels.

    An effect without a supermodel was not tried, as there was nothing left for it to explain.
    """
    jobs, seen = [], set[type[Effect]]()
    for supermodel in search.supermodels:
        effects = [effect for effect in search.effects if supermodel.holds([effect]) and effect not in seen]
        seen |= set(effects)
        if effects:
            jobs.append(partial(_detectable_in, search, supermodel, effects))
    parts = fit_all(jobs, lambda done: None)
    check_time()  # what was not looked at in time is not known to be invisible
    found = {direction.effect: direction for part in parts for direction in part}
    return tuple(found[effect.name] for effect in search.effects if effect.name in found)


def _detectable_in(search: Search, plain: Supermodel, effects: Sequence[type[Effect]]) -> tuple[Detectable, ...]:
    supermodel = search.inference.common_noise.whitened(plain)
    local = transferred(supermodel, search.base.supermodel, search.base.fit.local)
    return confusion(supermodel, search.context, local, effects, gate).directions


FACTORS = (0.5, 2.0)
"""On pace and size of an input."""


def menu_of(task: Task) -> list[Choice]:
    """Records that could be measured: all combinations of conditions, each input faster, slower, larger and smaller."""
    rig = task.problem.model.rig
    menu = [Choice(0, conditions) for conditions in rig.menu(task.problem.observations.experiment.conditions)]
    for record in range(len(task.problem.layout.records) if rig.inputs else 0):
        menu += [Choice(record, {}, pace=factor) for factor in FACTORS]
        menu += [Choice(record, {}, size=factor) for factor in FACTORS]
    return menu


def best_split(search: Search, pair: Sequence[type[Effect]]) -> Separation | None:
    """The record of the menu that splits a pair of effects best; None where the rig has no menu.

    Inputs count as known: what they would be measured like is not known beforehand.

    Parameters
    ----------
    search : Search
    pair : sequence of Effect classes
        Two.
    """
    if not (menu := menu_of(search.task)):
        return None
    held = next((supermodel for supermodel in search.supermodels if supermodel.holds(pair)), None)
    supermodel = supermodel_of(search.task, pair) if held is None else replace(held, sensitivities=None, whitening=None)
    local = transferred(supermodel, search.base.supermodel, search.base.fit.local)
    columns, targets = changed_values(
        supermodel, search.context, local, strengths_of(pair), LITTLE * sizes_of(strengths_of(pair))
    )
    at_hand = as_simulated(supermodel, local, search.context.whole)
    grams = at_hand.grams(local, columns, targets, search.context.whole)[:, :-1, :-1]
    before = float(likeness(grams, search.context)[2][0, 1])
    further = menu_grams(supermodel, search.context, local, columns, targets, menu)
    after = [float(likeness(np.concatenate([grams, gram[None]]), search.context)[2][0, 1]) for gram in further]
    best = int(np.argmin(after))
    record = search.task.problem.layout.records[menu[best].record]
    names = (pair[0].name, pair[1].name)
    return separation(names, menu[best], record, cosine_before=before, cosine_after=after[best])


def menu_grams(
    supermodel: Supermodel,
    context: SearchContext,
    local: np.ndarray,
    columns: np.ndarray,
    targets: np.ndarray,
    menu: Sequence[Choice],
) -> list[np.ndarray]:
    """Gram matrix of each record of a menu; in batches as long as the study, for which the program is compiled."""
    found: list[np.ndarray] = []
    for batch in batches(menu, len(local)):
        rows = [choice.record for choice in batch]
        data = records_of(supermodel.problem.observations, batch)
        problem = eqx.tree_at(lambda p: p.observations, supermodel.problem, data)
        elsewhere = replace(supermodel, task=replace(supermodel.task, problem=problem))
        elsewhere = as_simulated(elsewhere, local[rows], context.whole[rows])
        same = local[rows], columns, targets[rows], context.whole[rows]
        found += list(elsewhere.grams(*same)[:, :-1, :-1])
    return found[: len(menu)]


def as_simulated(supermodel: Supermodel, local: np.ndarray, counts: np.ndarray) -> Supermodel:
    """A supermodel whose records have measured what it says of them itself.

    Beside a jump what a change does to a residual hangs on the reading; where nothing is fitted, or nothing measured,
    that says nothing.

    Parameters
    ----------
    supermodel : Supermodel
        Its inputs known.
    local : (n_record, n_local) in SI units
    counts : (n_record,) int
    """
    data, channels = supermodel.problem.observations, supermodel.problem.model.rig.channels
    rows = np.asarray(residual_rows(supermodel, local, counts)).reshape(len(local), len(channels), -1)
    measured = dict(data.measured)
    for c, channel in enumerate(channels):
        weight = np.asarray(data.weight[channel])
        away = np.divide(rows[:, c], weight, out=np.zeros_like(rows[:, c]), where=weight > 0.0)
        measured[channel] = jnp.asarray(np.asarray(data.measured[channel]) + away)
    problem = eqx.tree_at(lambda p: p.observations, supermodel.problem, data._replace(measured=measured))
    return replace(supermodel, task=replace(supermodel.task, problem=problem))


def batches(menu: Sequence[Choice], records: int) -> Iterator[list[Choice]]:
    """Records of a menu, as many at a time as a study has; the last one fills the end."""
    for start in range(0, len(menu), records):
        yield [menu[min(start + r, len(menu) - 1)] for r in range(records)]


def records_of(observations: Observations, batch: Sequence[Choice]) -> Observations:
    """Observations ``(n_choice, ...)`` as records of a menu would be taken; what they measure is not known.

    Parameters
    ----------
    observations : Observations
        Of the study.
    batch : sequence of Choice
    """
    rows = np.array([choice.record for choice in batch])
    data: Observations = jax.tree.map(lambda leaf: leaf[rows], observations)
    experiment = data.experiment._replace(
        conditions=_conditions(data.experiment.conditions, batch), inputs=_driven(data.experiment, batch)
    )
    return data._replace(experiment=experiment)


def _conditions(stated: Mapping[str, Any], batch: Sequence[Choice]) -> dict[str, Any]:
    changed = {name: np.array(values) for name, values in stated.items()}
    for r, choice in enumerate(batch):
        for name, value in choice.conditions.items():
            changed[name][r] = value
    return {name: jnp.asarray(values) for name, values in changed.items()}


def _driven(experiment: Any, batch: Sequence[Choice]) -> dict[str, Signals]:
    """Inputs of records run at another pace and size, about where they begin; held where they end."""
    times, counts = np.asarray(experiment.times), np.asarray(experiment.count)
    driven = {}
    for name, signals in experiment.inputs.items():
        values, slopes = np.array(signals.values), np.array(signals.slopes)
        for r, choice in enumerate(batch):
            known = slice(0, counts[r])
            there = times[r, 0] + choice.pace * (times[r] - times[r, 0])
            moved = np.interp(there, times[r, known], values[r, known])
            values[r] = values[r, 0] + choice.size * (moved - values[r, 0])
            steep = np.interp(there, times[r, known], slopes[r, known], right=0.0)
            slopes[r] = choice.size * choice.pace * steep
        driven[name] = Signals(jnp.asarray(values), jnp.asarray(slopes))
    return driven


def strengths_of(effects: Sequence[type[Effect]]) -> list[tuple[str, Parameter]]:
    """Each effect by the parameter that tells its strength."""
    return [(effect.name, next(p for p in effect.parameters if p.name == effect.strength[0])) for effect in effects]


def likeness(grams: np.ndarray, context: SearchContext) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size of each effect's own change, its share of the whole change, and the cosines."""
    own, whole = projected(grams, len(context.base), len(context.each))
    norms = np.sqrt(np.maximum(np.diag(own), 0.0))
    total = np.sqrt(np.diag(whole))
    unique = np.divide(norms, total, out=np.zeros_like(norms), where=total > 0.0)
    visible = unique > UNIQUE
    safe = np.where(visible, norms, 1.0)
    cosine = np.abs(own / np.outer(safe, safe)) * np.outer(visible, visible)
    np.fill_diagonal(cosine, 1.0)
    return norms, unique, cosine


def sizes_of(strengths: Sequence[tuple[str, Parameter]]) -> np.ndarray:
    """Strengths, ``(n_effect,)``, that spoil no motion; of a parameter that vanishes at infinity its inverse."""
    weak = [SMALL / p.typical if p.reciprocal else SMALL * abs(p.typical - p.null) for _, p in strengths]
    return np.array(weak)


def changed_values(
    supermodel: Supermodel,
    context: SearchContext,
    local: np.ndarray,
    strengths: Sequence[tuple[str, Parameter]],
    sizes: np.ndarray,
) -> tuple[np.ndarray, np.ndarray]:
    """Columns, and the values they are set to: effects are given their `sizes`."""
    names = [*context.base, *context.each, *(f"{effect}.{parameter.name}" for effect, parameter in strengths)]
    columns = np.array([supermodel.names.index(name) for name in names])
    targets = local[:, columns].copy()
    n = len(context.base) + len(context.each)
    scale = np.array([abs(supermodel.declared[name].typical) for name in names[:n]])
    targets[:, :n] += difference_steps(targets[:, :n], scale)
    for i, (_, parameter) in enumerate(strengths):
        sign = np.sign(parameter.typical - parameter.null)
        targets[:, n + i] = 1.0 / sizes[i] if parameter.reciprocal else parameter.null + sign * sizes[i]
    return columns, targets


def projected(grams: np.ndarray, shared: int, own: int) -> tuple[np.ndarray, np.ndarray]:
    """Gram matrix of the effects' columns, base parameters and nuisances projected off, and without projection."""
    n, records = shared + own, len(grams)
    each = shared + np.arange(records * own).reshape(records, own)
    places = np.concatenate([np.broadcast_to(np.arange(shared), (records, shared)), each], axis=1)
    size = shared + records * own
    base, cross = assembled(grams[:, :n, :n], places, size), gathered(grams[:, :n, n:], places, size)
    whole = grams[:, n:, n:].sum(axis=0)
    scale = scale_of(base)
    solved = np.linalg.lstsq(base / np.outer(scale, scale), cross / scale[:, None], rcond=1e-10)[0]
    return whole - (cross / scale[:, None]).T @ solved, whole
