"""Population and trends as summaries, of a series that was fitted jointly or of a batch."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from fibrefit.series.meta_analysis import BY_ORDER, Population, Quantity, population, trends
from fibrefit.study.summaries.part import Measure
from fibrefit.study.summaries.series import SPEED_OF, BatchItem, PopulationSummary, TrendSummary, speed_name

MOTION = {"amplitude": "m", "rate": "m/s", "hold": "s"}
"""What a study states of the motion of a drive, beside the conditions of the rig, and the units."""
USABLE = ("ok", "suspect")
NOTHING_OWN = 1e-6
"""Share of an error below which its record's own part is rounding: the record says nothing of that value."""


def population_summary(one: Population, unit: str) -> PopulationSummary:
    """A parameter over the records."""
    return PopulationSummary(
        unit=unit,
        mean=one.mean,
        mean_interval_95=one.mean_interval,
        between_records=one.sd,
        between_records_interval_95=one.sd_interval,
        relative=one.logarithmic,
        new_record_interval_95=one.new_record,
        chance=one.chance,
    )


def quantities_of(items: Mapping[str, BatchItem]) -> tuple[tuple[Quantity, ...], tuple[Quantity, ...]]:
    """Free parameters and conditions of the items that can be used, over all of them.

    Parameters
    ----------
    items : mapping of str to BatchItem
        In the order in which the records were taken.
    """
    usable = [item for item in items.values() if item.status in USABLE]
    units = {name: found.unit for item in usable for name, found in item.parameters.items() if found.free}
    parameters = tuple(_parameter(name, unit, usable) for name, unit in units.items())
    names = dict.fromkeys(name for item in usable for name in item.conditions)
    conditions = [_condition(name, usable) for name in names]
    order = np.array([float(n) for n, item in enumerate(items.values(), 1) if item.status in USABLE])
    conditions.append(Quantity(BY_ORDER, "-", order, np.zeros(len(order))))
    return parameters, varying(conditions)


def varying(conditions: Sequence[Quantity]) -> tuple[Quantity, ...]:
    """Conditions that are not the same in all records."""
    return tuple(one for one in conditions if len(np.unique(one.values[np.isfinite(one.values)])) > 1)


def _parameter(name: str, unit: str, items: Sequence[BatchItem]) -> Quantity:
    found = [item.parameters.get(name) for item in items]
    values = np.array([np.nan if one is None else one.value for one in found])
    known = [(np.nan, 0.0) if one is None else (_or_nan(one.std_error), one.common_error or 0.0) for one in found]
    errors, common = np.array(known).T
    # Priors are those of the study: an error of theirs is no difference between records, and none of them averages it.
    own = np.sqrt(np.maximum(errors**2 - common**2, 0.0))
    own = np.where(own > NOTHING_OWN * errors, own, np.nan)
    # One that holds the value, or has none, says nothing of what the others share.
    told = common[np.isfinite(own)] if np.isfinite(own).any() else common[np.isfinite(common)]
    return Quantity(name, unit, values, own, float(np.median(told)) if len(told) else 0.0)


def _or_nan(value: float | None) -> float:
    return np.nan if value is None else value


def _condition(name: str, items: Sequence[BatchItem]) -> Quantity:
    """A condition by its headed name, such as ``lift [m]``."""
    bare, _, unit = name.partition(" [")
    values = np.array([item.conditions.get(name, np.nan) for item in items])
    errors = np.array([item.condition_errors.get(name, 0.0) for item in items])
    return Quantity(bare, unit.rstrip("]") or "-", values, errors)


class PooledBatch(NamedTuple):
    """What the items of a batch say together.

    Parameters
    ----------
    trends : tuple of TrendSummary
        The surest first.
    shrunk : dict of str to dict of str to Measure
        By item and parameter: value drawn to the mean by as much as it is uncertain, and its standard deviation.
    """

    summaries: dict[str, PopulationSummary]
    trends: tuple[TrendSummary, ...]
    shrunk: dict[str, dict[str, Measure]]


def pooled_batch(items: Mapping[str, BatchItem]) -> PooledBatch:
    """Population of each free parameter, and trends over all conditions."""
    parameters, conditions = quantities_of(items)
    names = [name for name, item in items.items() if item.status in USABLE]
    all_of_them = [(one, population(one.values, one.errors, one.common)) for one in parameters]
    found = [(one, pooled) for one, pooled in all_of_them if pooled is not None]
    populations = {one.name: population_summary(pooled, one.unit) for one, pooled in found}
    shrunk = {
        name: {
            one.name: Measure(value=float(pooled.shrunk[n]), error=float(pooled.shrunk_error[n]))
            for one, pooled in found
            if np.isfinite(pooled.shrunk[n])
        }
        for n, name in enumerate(names)
    }
    pairs = [(y, x) for y in parameters for one in conditions if (x := _seen_by(y, one)) is not None]
    return PooledBatch(populations, trends(names, pairs), shrunk)


def _seen_by(parameter: Quantity, condition: Quantity) -> Quantity | None:
    """A condition as one parameter is held against it: of speeds only its own, called the speed."""
    if not condition.name.startswith(SPEED_OF):
        return condition
    return replace(condition, name="speed") if condition.name == speed_name(parameter.name) else None
