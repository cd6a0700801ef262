"""Which effects a set of records could tell apart, before or after measuring: from the model's sensitivities alone.

Source
------
The projection and its smallest detectable strength are those of a t-test in a linear model; choosing the next record by
the worst pair follows Hunter and Reiner, Technometrics 7 (1965).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fibrefit.core.parameter import Parameter
from fibrefit.core.time_limit import check_time
from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.menu import batches, menu_of, records_of
from fibrefit.discovery.engine.candidates import SMALL, SearchContext, fit_all, transferred
from fibrefit.discovery.engine.effort import strengths_converged
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.refit import difference_steps
from fibrefit.discovery.engine.supermodel import Supermodel, residual_rows, supermodel_of
from fibrefit.discovery.engine.thresholds import INSEPARABLE, UNIQUE, gate
from fibrefit.discovery.model.finding import Choice, separation
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem.statement.layout import assembled, gathered, scale_of
from fibrefit.problem.statement.observations import Observations
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
    beside: Beside,
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
    beside : Beside
        How much records differ: deviations of a record imitate part of what an effect does to it.
    """
    strengths = strengths_of(effects)
    gates = np.array([limit(len(effect.parameters)) for effect in effects])
    most = sizes = sizes_of(strengths)
    floor = least_sizes(effects)
    for _ in range(ROUNDS):
        columns, targets = changed_values(supermodel, context, local, strengths, sizes)
        grams, own = grams_at_hand(supermodel, context, local, columns, targets), len(context.each)
        held = beside.held_at_hand(grams, context.base, own, local[:, columns], targets)
        norms, unique, cosine = likeness(held, len(context.base), own + len(beside.deviations(context.base)))
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


def detectable(search: Search, base: LaplaceFit) -> tuple[Detectable, ...]:
    """Smallest strength of each effect that a search with nothing to find would have found, in its supermodels.

    An effect without a supermodel was not tried, as there was nothing left for it to explain.

    Parameters
    ----------
    search : Search
    base : LaplaceFit
        The model that lacks nothing.
    """
    jobs, seen, beside = [], set[type[Effect]](), Beside.of(search, base)
    for supermodel in search.supermodels:
        effects = [effect for effect in search.effects if supermodel.holds([effect]) and effect not in seen]
        seen |= set(effects)
        if effects:
            jobs.append(partial(_detectable_in, search, supermodel, effects, beside))
    parts = fit_all(jobs, lambda done: None)
    check_time()  # what was not looked at in time is not known to be invisible
    found = {direction.effect: direction for part in parts for direction in part}
    return tuple(found[effect.name] for effect in search.effects if effect.name in found)


def _detectable_in(
    search: Search, plain: Supermodel, effects: Sequence[type[Effect]], beside: Beside
) -> tuple[Detectable, ...]:
    supermodel = search.inference.common_noise.whitened(plain)
    local = transferred(supermodel, search.base.supermodel, search.base.fit.local)
    return confusion(supermodel, search.context, local, effects, gate, beside).directions


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
    columns, targets = changed_values(supermodel, search.context, local, strengths_of(pair), little_sizes(pair))
    grams = grams_at_hand(
        as_simulated(supermodel, local, search.context.whole), search.context, local, columns, targets
    )
    before = float(likeness(grams, len(search.context.base), len(search.context.each))[2][0, 1])
    further = menu_grams(supermodel, search.context, local, columns, targets, menu)
    after = np.array([_cosine_with(grams, gram, search.context) for gram in further])
    if not np.isfinite(after).any():
        return None
    best = int(np.nanargmin(after))
    record = search.task.problem.layout.records[menu[best].record]
    names = (pair[0].name, pair[1].name)
    return separation(names, menu[best], record, cosine_before=before, cosine_after=float(after[best]))


def _cosine_with(grams: np.ndarray, further: np.ndarray, context: SearchContext) -> float:
    """Cosine of two effects with a further record; nan where it cannot be simulated, or one of them is hidden then."""
    if not np.isfinite(further).all():
        return float("nan")
    _, unique, cosine = likeness(np.concatenate([grams, further[None]]), len(context.base), len(context.each))
    return float(cosine[0, 1]) if (unique > UNIQUE).all() else float("nan")


def grams_at_hand(
    supermodel: Supermodel, context: SearchContext, local: np.ndarray, columns: np.ndarray, targets: np.ndarray
) -> np.ndarray:
    """Gram matrices of the records of a study, and as of one more record what is believed of shared values.

    Parameters
    ----------
    supermodel : Supermodel
    context : SearchContext
    local : (n_record, n_local) in SI units
    columns, targets : as of `changed_values`

    Returns
    -------
    (n_record + 1, n_column, n_column)
    """
    grams = supermodel.grams(local, columns, targets, context.whole)[:, :-1, :-1]
    beliefs = _belief_row(supermodel, context, local, targets)
    whole = np.zeros((1, *grams.shape[1:]))
    whole[0, : len(beliefs), : len(beliefs)] = np.diag(beliefs**2)
    return np.concatenate([grams, whole])


def _belief_row(supermodel: Supermodel, context: SearchContext, local: np.ndarray, targets: np.ndarray) -> np.ndarray:
    """Change of the residual that each shared value's belief is, ``(n_base,)``; zero where nothing is believed."""
    slots = {slot.name: slot for slot in supermodel.problem.layout.slots}
    row = np.zeros(len(context.base))
    for i, name in enumerate(context.base):
        if (belief := slots[name].belief) is not None:
            value = local[0, supermodel.names.index(name)]
            row[i] = belief.slope(value) * (targets[0, i] - value)
    return row


def menu_grams(
    supermodel: Supermodel,
    context: SearchContext,
    local: np.ndarray,
    columns: np.ndarray,
    targets: np.ndarray,
    menu: Sequence[Choice],
) -> list[np.ndarray]:
    """Gram matrix of each record of a menu; in batches as long as the study, for which the program is compiled.

    Not finite where it cannot be simulated.
    """
    found: list[np.ndarray] = []
    for batch in batches(menu, len(local)):
        rows = [choice.record for choice in batch]
        data, values = records_of(supermodel.problem, local, batch)
        elsewhere = as_simulated(with_records(supermodel, data, rows), values, context.whole[rows])
        goals, shifted = targets[rows], (values != local[rows])[:, columns]
        goals[shifted] += values[:, columns][shifted] - local[rows][:, columns][shifted]
        found += list(elsewhere.grams(values, columns, goals, context.whole[rows])[:, :-1, :-1])
    return found[: len(menu)]


def with_records(supermodel: Supermodel, data: Observations, like: Sequence[int] | None = None) -> Supermodel:
    """A supermodel with other records; the noise of each is that of the record it is like, by default at its place."""
    problem = eqx.tree_at(lambda p: p.observations, supermodel.problem, data)
    whitening = supermodel.whitening
    if whitening is not None and like is not None:
        whitening = whitening.of_records(like)
    return replace(supermodel, task=replace(supermodel.task, problem=problem), whitening=whitening)


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
    return with_records(supermodel, data._replace(measured=measured))


def strengths_of(effects: Sequence[type[Effect]]) -> list[tuple[str, Parameter]]:
    """Each effect by the parameter that tells its strength."""
    return [(effect.name, next(p for p in effect.parameters if p.name == effect.strength[0])) for effect in effects]


def likeness(grams: np.ndarray, shared: int, own: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Size of each effect's own change, its share of the whole change, and the cosines; columns as of `projected`."""
    left, whole = projected(grams, shared, own)
    norms = np.sqrt(np.maximum(np.diag(left), 0.0))
    total = np.sqrt(np.diag(whole))
    unique = np.divide(norms, total, out=np.zeros_like(norms), where=total > 0.0)
    visible = unique > UNIQUE
    safe = np.where(visible, norms, 1.0)
    cosine = np.abs(left / np.outer(safe, safe)) * np.outer(visible, visible)
    np.fill_diagonal(cosine, 1.0)
    return norms, unique, cosine


def sizes_of(strengths: Sequence[tuple[str, Parameter]]) -> np.ndarray:
    """Strengths, ``(n_effect,)``, that spoil no motion; of a parameter that vanishes at infinity its inverse."""
    weak = [SMALL / p.typical if p.reciprocal else SMALL * abs(p.typical - p.null) for _, p in strengths]
    return np.array(weak)


def least_sizes(effects: Sequence[type[Effect]]) -> np.ndarray:
    """Sizes as of `sizes_of` below which an effect does the same: where the model changes its kind at the null."""
    return np.array([effect.singular for effect in effects]) * sizes_of(strengths_of(effects)) / SMALL


def little_sizes(effects: Sequence[type[Effect]]) -> np.ndarray:
    """Sizes as of `sizes_of` at which effects are compared where no strength of them is asked for."""
    most = sizes_of(strengths_of(effects))
    return np.maximum(LITTLE * most, np.minimum(least_sizes(effects), most))


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
    targets[:, :n] += difference_steps(targets[:, :n], supermodel.sizes(names[:n]))
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
