"""Records that may share what sets them apart: which of them, by what records differ in."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.discovery.engine.laplace_fit import LaplaceFit
from fibrefit.discovery.engine.screening import stands_for_differences
from fibrefit.discovery.engine.thresholds import PRICE
from fibrefit.laws.families import family_of, may_be_shared, number_of_sets, shared_by
from fibrefit.laws.law import Effect
from fibrefit.problem import SIGMA_LEVELS

ALIKE = SIGMA_LEVELS[1]
"""Relative standard deviation that is taken for none: nearer to each other no values of records are believed to be."""
CHANGE = "_change"
"""End of the name of a relative change, behind that of the parameter of the rig that it is of."""


def of_record_sets(parent: LaplaceFit, effects: Sequence[type[Effect]]) -> tuple[type[Effect], ...]:
    """Effects of some records that its deviations promise, at most one of each family.

    Parameters
    ----------
    parent : LaplaceFit
        Of all records, which may differ.
    effects : sequence of Effect classes
        That may be added to it, those of single records among them. Of a family of which some are left out by whoever
        asks, no set of records is offered either.
    """
    single = [one for one in effects if len(one.records) == 1 and may_be_shared(one) and stands_for_differences(one)]
    families = dict[str, list[type[Effect]]]()
    for one in single:
        families.setdefault(family_of(one), []).append(one)
    known, found = {one.name for one in (*parent.supermodel.effects, *effects)}, []
    for one in (members[0] for members in families.values() if len(members) == len(parent.local)):
        split = most_likely_split(_deviations(parent, one))
        if split is None or split[1] <= PRICE * len(one.parameters):
            continue
        if (shared := shared_by(one, split[0])).name not in known:
            found.append(shared)
    return tuple(found)


def most_likely_split(deviations: np.ndarray) -> tuple[tuple[int, ...], float] | None:
    """Records that are most likely to be another population than the others; None of fewer than four.

    Parameters
    ----------
    deviations : (n_record, n_parameter)
        Logarithms of each record's values over those of all.

    Returns
    -------
    places : tuple of int
        Of the smaller set, from 1; of two as large, of the one without the first record.
    gain : float
        In nats, the number of sets paid for.

    Law
    ---
    Two normal populations with means of their own and one standard deviation are more likely than one by
    ``n / 2 ln(S / S_w)`` for each parameter, S and S_w the sums of squares about one mean and about two. In the order
    of a parameter, the best two sets lie on either side of a gap (Fisher, J. Am. Stat. Assoc. 53 (1958)).
    """
    number = len(deviations)
    if number < 4 or not deviations.shape[1]:
        return None
    orders = np.argsort(deviations, axis=0).T
    parts = [(order[:size], order[size:]) for order in orders for size in range(2, number - 1)]
    whole = _squares(deviations)
    gains = [0.5 * number * float(np.sum(np.log(whole / _squares(*(deviations[p] for p in part))))) for part in parts]
    best = parts[int(np.argmax(gains))]
    smaller = min(best, key=lambda part: (len(part), 0 in part))
    return tuple(sorted(int(place) + 1 for place in smaller)), max(gains) - float(np.log(number_of_sets(number)))


def _squares(*sets: np.ndarray) -> np.ndarray:
    """Sums of squares about the means of sets of records, ``(n_parameter,)``."""
    return sum(np.sum((one - one.mean(axis=0)) ** 2 + ALIKE**2, axis=0) for one in sets)


def _deviations(parent: LaplaceFit, effect: type[Effect]) -> np.ndarray:
    """What records deviate by in what an effect changes, ``(n_record, n_parameter)``, as far as they differ."""
    found = parent.evidence.mode
    changed = {parameter.name.removesuffix(CHANGE) for parameter in effect.parameters}
    names = [found.unknowns.names[place] for place in found.unknowns.scattering]
    columns = [i for i, name in enumerate(names) if name in changed and found.sigma[i] > 0.0]
    return np.asarray(found.place.eta)[:, columns]
