"""Which effects a set of records could tell apart, before or after measuring: from the model's sensitivities alone.

Source
------
The projection and its smallest detectable strength are those of a t-test in a linear model. The record that tells the
worst pair apart: Hunter and Reiner, Technometrics 7 (1965); Atkinson and Fedorov, Biometrika 62 (1975) 57-70.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from fibrefit.core.limits import check_time
from fibrefit.discovery.design.beside import Beside
from fibrefit.discovery.design.grams import (
    changed_values,
    exactly,
    grams_at_hand,
    grams_with,
    least_sizes,
    likeness,
    projected,
    sizes_of,
    strengths_of,
)
from fibrefit.discovery.design.menu import menu_of
from fibrefit.discovery.engine.candidates import SMALL, SearchContext, fit_all, transferred
from fibrefit.discovery.engine.effort import strengths_converged
from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.supermodel import Supermodel
from fibrefit.discovery.engine.thresholds import INSEPARABLE, UNIQUE, gate
from fibrefit.discovery.model.finding import separation
from fibrefit.discovery.search.search import Search
from fibrefit.laws.law import Effect
from fibrefit.study.summaries.discovery import Detectable, Separation

ROUNDS = 4
"""Of looking for the strength that would just be found."""


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


def best_split(
    search: Search,
    supermodel: Supermodel,
    pair: Sequence[type[Effect]],
    found: Confusion,
    beside: Beside,
    louder: float = 1.0,
) -> Separation | None:
    """The record of the menu that tells a pair of effects apart best; None where the rig has no menu.

    That with which the one that is wrong, at its best as slopes say, misses most, each in turn being as strong as would
    just be found in the records at hand, or of its typical size where these cannot show it.

    Parameters
    ----------
    search : Search
    supermodel : Supermodel
        Whitened, of the model without them.
    pair : sequence of Effect classes
        Two.
    found : Confusion
        Of these and others.
    beside : Beside
        Of the records at hand.
    louder : float
        Power of what the model leaves of them, in units of the noise.
    """
    if not (menu := menu_of(search.task)):
        return None
    most = sizes_of(strengths_of(pair))
    sizes = np.minimum(wanted := _just_found(pair, found), most)
    at_hand, further, own = grams_with(search, exactly(supermodel), beside, menu, (pair, sizes))
    shared = len(search.context.base)
    before, *after = (
        _apart(projected(grams, shared, own)[0] / louder, wanted / sizes) if np.isfinite(grams).all() else np.nan
        for grams in (at_hand, *(np.concatenate([at_hand, gram[None]]) for gram in further))
    )
    if not (np.isfinite(before) and np.isfinite(after).any()):
        return None
    best = int(np.nanargmax(after))
    record = search.task.problem.layout.records[menu[best].record]
    return separation((pair[0].name, pair[1].name), menu[best], record, before, after[best])


def _just_found(pair: Sequence[type[Effect]], found: Confusion) -> np.ndarray:
    """Sizes as of `sizes_of` that would just be found, typical ones where the records cannot show an effect."""
    known = {direction.effect: direction.smallest_detectable for direction in found.directions}
    sizes = sizes_of(strengths_of(pair)) / SMALL
    for i, (effect, parameter) in enumerate(strengths_of(pair)):
        if (least := known[effect]) is not None:
            sizes[i] = 1.0 / least if parameter.reciprocal else least
    return sizes


def _apart(left: np.ndarray, factors: np.ndarray) -> float:
    """Nats by which the one of two effects that is wrong misses at its best, the smaller of both ways round.

    Parameters
    ----------
    left : (2, 2)
        Products of their changes beyond what base parameters can imitate.
    factors : (2,)
        On these changes.
    """
    own = np.maximum(np.diag(left), 0.0)
    other = np.where(own[::-1] > 0.0, own[::-1], 1.0)
    return float(0.5 * np.min(factors**2 * np.maximum(own - left[0, 1] ** 2 / other, 0.0)))
