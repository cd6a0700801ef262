"""What effects and values of a model change in records at hand and in further ones: Gram matrices, and what is left.

Source
------
Elimination of what else is unknown: Golub and Pereyra, SIAM J. Numer. Anal. 10 (1973).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import equinox as eqx
import jax.numpy as jnp
import numpy as np

from fibrefit.core.arrays import assembled, gathered
from fibrefit.core.declarations import Parameter
from fibrefit.core.matrices import equilibrated, scale_of
from fibrefit.discovery.design.beside import Beside, relative_changes
from fibrefit.discovery.design.menu import batches, records_of
from fibrefit.discovery.engine.candidates import SMALL, SearchContext
from fibrefit.discovery.engine.refit import difference_steps
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import UNIQUE
from fibrefit.discovery.model.finding import Choice
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.problem import Observations

LITTLE = 0.01
"""Share of strengths that spoil no motion, for what is compared without a strength that is requested."""


def grams_with(
    search: Search,
    supermodel: Supermodel,
    beside: Beside,
    menu: Sequence[Choice],
    effects: tuple[Sequence[type[Effect]], np.ndarray],
) -> tuple[np.ndarray, list[np.ndarray], int]:
    """Gram matrices of the records at hand and of each of a menu, their deviations held, read as the model says.

    Parameters
    ----------
    search : Search
    supermodel : Supermodel
        See `exactly`.
    beside : Beside
        Of the records at hand.
    menu : sequence of Choice
    effects : (sequence of Effect classes, (n_effect,))
        With the sizes, as of `sizes_of`, by which they change the readings.

    Returns
    -------
    at_hand : (n_record + 1, n, n)
        See `grams_at_hand`.
    further : list of (n, n)
        Not finite of a record that cannot be simulated.
    own : int
        Number of columns that are each record's own.
    """
    local, context = search.base.fit.local, search.context
    columns, targets = changed_values(supermodel, context, local, strengths_of(effects[0]), effects[1])
    shared, own = len(context.base), len(context.each)
    changes = relative_changes(local[:, columns[:shared]], targets[:, :shared])
    told = as_simulated(supermodel, local, context.whole)
    at_hand = grams_at_hand(told, context, local, columns, targets)
    further = menu_grams(supermodel, context, local, columns, targets, menu)
    return (
        beside.held_at_hand(at_hand, context.base, own, local[:, columns], targets),
        [
            beside.held(gram[None], context.base, own, changes[[choice.record]])[0]
            for gram, choice in zip(further, menu, strict=True)
        ],
        own + len(beside.deviations(context.base)),
    )


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


def exactly(supermodel: Supermodel) -> Supermodel:
    """A supermodel whose readings will be what a model says of them.

    The errors of measured inputs are open, as in a fit, and none is known; no reading is rounded.
    """
    reacting = supermodel.sensitivities
    if reacting is not None:
        reacting = reacting._replace(offset=np.zeros_like(reacting.offset))
    return replace(supermodel, sensitivities=reacting, in_steps=None)


def read_exactly(supermodel: Supermodel, beside: Beside) -> Supermodel:
    """The same of one that is not whitened, in the noise of the records at hand."""
    reacting, whitening = supermodel.sensitivities, beside.whitening
    if reacting is not None and whitening is not None:
        reacting = reacting.through(whitening)
    return replace(exactly(replace(supermodel, sensitivities=reacting)), whitening=whitening)


def with_records(supermodel: Supermodel, data: Observations, like: Sequence[int] | None = None) -> Supermodel:
    """A supermodel with other records.

    The noise of each, and what errors of its input do to it, are those of the record it is like, by default at its
    place: a fibre that is taut hands them on, whatever else is varied.
    """
    problem = eqx.tree_at(lambda p: p.observations, supermodel.problem, data)
    whitening, reacting = supermodel.whitening, supermodel.sensitivities
    if whitening is not None and like is not None:
        whitening = whitening.of_records(like)
    if reacting is not None and like is not None:
        rows = list(like)
        reacting = reacting._replace(
            coefficients={name: waves[rows] for name, waves in reacting.coefficients.items()},
            downweight=reacting.downweight[rows],
            offset=reacting.offset[rows],
            records=tuple(reacting.records[row] for row in rows),
        )
    task = replace(supermodel.task, problem=problem)
    return replace(supermodel, task=task, whitening=whitening, sensitivities=reacting)


def as_simulated(supermodel: Supermodel, local: np.ndarray, counts: np.ndarray) -> Supermodel:
    """A supermodel whose records have measured what it says of them itself.

    Beside a jump what a change does to a residual hangs on the reading; where nothing is fitted, or nothing measured,
    that says nothing. What is said is told by the residuals: beside a jump a part of its height is left of them.

    Parameters
    ----------
    supermodel : Supermodel
        See `exactly`.
    local : (n_record, n_local) in SI units
    counts : (n_record,) int
    """
    data, channels = supermodel.problem.observations, supermodel.problem.model.rig.channels
    rows = np.asarray(supermodel.residuals(local, counts)).reshape(len(local), len(channels), -1)
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
    cosine = np.abs(equilibrated(left, safe)) * np.outer(visible, visible)
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
    solved = np.linalg.lstsq(equilibrated(base, scale), cross / scale[:, None], rcond=1e-10)[0]
    return whole - (cross / scale[:, None]).T @ solved, whole
