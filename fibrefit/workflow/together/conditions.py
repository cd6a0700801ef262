"""Conditions of records side by side: what a study states of each, its order, and the speed it was taken at."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.problem.formulate.formulate import stated_of
from fibrefit.rigs.catalogue import rig_of
from fibrefit.series.trends import BY_ORDER, Quantity
from fibrefit.study import Study
from fibrefit.workflow.together.pooled import MOTION

WORDS = ("excitation",)


def conditions_of_records(study: Study, records: Sequence[object]) -> tuple[Quantity, ...]:
    """Every condition that differs between records, in SI units; a word is one for each of its values, 1 or 0.

    Parameters
    ----------
    study : Study
    records : sequence of record tables
        Of the study, in the order in which they were taken.
    """
    units = {condition.name: condition.unit for condition in rig_of(study.kind, study.variant).conditions} | MOTION
    stated = [stated_of(record) for record in records]
    found = [_exact(name, unit, np.array([row.get(name, np.nan) for row in stated])) for name, unit in units.items()]
    for name in WORDS:
        said = [getattr(record, name, None) for record in records]
        kinds = sorted({word for word in said if word})
        found += [_exact(f"{name} {kind}", "-", np.array([float(word == kind) for word in said])) for kind in kinds[1:]]
    found.append(_exact(BY_ORDER, "-", np.arange(1.0, len(records) + 1.0)))
    return tuple(one for one in found if len(np.unique(one.values[np.isfinite(one.values)])) > 1)


def speed_condition(rows: np.ndarray) -> Quantity:
    """Root mean square of the speeds that tell of a parameter, ``(n_record, 3)`` in m/s, as `speeds_of` has them."""
    return _exact("speed", "m/s", rows[:, 1])


def _exact(name: str, unit: str, values: np.ndarray) -> Quantity:
    return Quantity(name, unit, values, np.zeros(len(values)))


def by_record(conditions: Sequence[Quantity], number: int) -> dict[str, float]:
    """Conditions of one record by name."""
    return {one.name: float(one.values[number]) for one in conditions if np.isfinite(one.values[number])}
