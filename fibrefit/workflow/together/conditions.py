"""Conditions of records side by side: what a study states of each, its order, and the speed it was taken at."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from datetime import datetime, timedelta

import numpy as np

from fibrefit.problem import stated_numbers
from fibrefit.rigs.catalogue import rig_of
from fibrefit.series.meta_analysis import BY_ORDER, Quantity
from fibrefit.study import Study
from fibrefit.study.records import RecordTable
from fibrefit.workflow.together.pooled import MOTION, varying

WORDS = ("excitation",)
SINCE = "time since the first record"


def units_of_conditions(study: Study) -> dict[str, str]:
    """Conditions that a study may state in numbers, and their SI units."""
    return {condition.name: condition.unit for condition in rig_of(study.kind, study.variant).conditions} | MOTION


def conditions_of_records(study: Study, records: Sequence[RecordTable]) -> tuple[Quantity, ...]:
    """Every condition that differs between records, and their order.

    Parameters
    ----------
    records : sequence of record tables
        Of the study, in the order in which they were taken.
    """
    order = _exact(BY_ORDER, "-", np.arange(1.0, len(records) + 1.0))
    return varying((*stated_conditions(units_of_conditions(study), records), order))


def stated_conditions(units: Mapping[str, str], records: Sequence[RecordTable]) -> tuple[Quantity, ...]:
    """Every condition that is stated of some record, in SI units; a word is one for each of its values, 1 or 0.

    Parameters
    ----------
    units : mapping of str to str
        Conditions in numbers, and their units.
    records : sequence of record tables
        They may be of several studies.
    """
    stated = [stated_numbers(record) for record in records]
    found = [
        Quantity(
            name,
            unit,
            np.array([row.get(name, np.nan) for row in stated]),
            np.array([record.uncertainty(name) for record in records]),
        )
        for name, unit in units.items()
    ]
    for name in WORDS:
        said = [getattr(record, name, None) for record in records]
        for kind in sorted({word for word in said if word})[1:]:
            found.append(
                _exact(f"{name} {kind}", "-", np.array([float(word == kind) if word else np.nan for word in said]))
            )
    found.append(_exact(SINCE, "d", since_the_first([getattr(record, "taken", None) for record in records])))
    return tuple(one for one in found if np.isfinite(one.values).any())


def since_the_first(taken: Sequence[datetime | None]) -> np.ndarray:
    """Days from the first of some tests to each, ``(n_record,)``; NaN where it is not stated.

    Times with and without an offset from UTC, which only different studies mix, do not compare: those with one count.
    """
    known = [one for one in taken if one is not None]
    zoned = [one for one in known if one.utcoffset() is not None]
    counted = zoned or known
    if not counted:
        return np.full(len(taken), np.nan)
    first = min(counted)
    alike = [one is not None and (one.utcoffset() is None) == (first.utcoffset() is None) for one in taken]
    return np.array(
        [(one - first) / timedelta(days=1) if one and same else np.nan for one, same in zip(taken, alike, strict=True)]
    )


def speed_condition(rows: np.ndarray) -> Quantity:
    """Root mean square of the speeds that tell of a parameter, ``(n_record, 3)`` in m/s, as `speeds_of` has them."""
    return _exact("speed", "m/s", rows[:, 1])


def _exact(name: str, unit: str, values: np.ndarray) -> Quantity:
    return Quantity(name, unit, values, np.zeros(len(values)))


def by_record(conditions: Sequence[Quantity], number: int) -> tuple[dict[str, float], dict[str, float]]:
    """Conditions of one record by name, and the errors of those that are not known exactly."""
    known = {one.name: (float(one.values[number]), float(one.errors[number])) for one in conditions}
    values = {name: value for name, (value, _) in known.items() if np.isfinite(value)}
    return values, {name: error for name, (_, error) in known.items() if name in values and error > 0.0}
