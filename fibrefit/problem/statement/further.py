"""Values of a model in a further record, that would be taken under other conditions than one at hand."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from fibrefit.problem.statement.problem import Problem
from fibrefit.simulation.model import corrected_conditions


def values_elsewhere(
    problem: Problem, row: np.ndarray, before: Mapping[str, Any], after: Mapping[str, Any], chosen: Mapping[str, float]
) -> np.ndarray:
    """Values of a record at hand as they are in a further one like it.

    A condition that is a value of each record is the one that is chosen, and the start is that of a rig at rest.

    Parameters
    ----------
    problem : Problem
    row : (n_local,) in SI units
        Of the record at hand.
    before, after : mapping of str to float, in SI units
        Conditions of that record as stated, and of the further one.
    chosen : mapping of str to float, in SI units
        Those conditions of the further one that are chosen.

    Returns
    -------
    (n_local,) in SI units
    """
    names, values = problem.layout.names, row.copy()
    started = _at_rest(problem, row, before)
    for name, value in chosen.items():
        if name in names:
            values[names.index(name)] = value
    for name, value in _at_rest(problem, values, after).items():
        if name in names:
            j = names.index(name)
            limits = problem.layout.slots[j].range
            values[j] = np.clip(values[j] + value - started[name], limits.lower, limits.upper)
    return values


def _at_rest(problem: Problem, row: np.ndarray, stated: Mapping[str, Any]) -> Mapping[str, float]:
    """Nuisances by which the rig would start at rest under the conditions that a model has in a record."""
    if (planned := problem.model.rig.planned) is None:
        return {}
    values = dict(zip(problem.layout.names, row, strict=True))
    laws = problem.model.laws(values)
    return planned(corrected_conditions(dict(stated), values, laws))
