"""From a study's records to traces: what a rig needs to know of each, in SI units."""

from __future__ import annotations

import math
from collections.abc import Mapping
from typing import Protocol

import numpy as np

from fibrefit.core.errors import StudyError
from fibrefit.problem.observations import Trace
from fibrefit.rigs.rig import Rig


class Measured(Protocol):
    """What a trace needs of a record that was read."""

    @property
    def name(self) -> str: ...

    @property
    def time(self) -> np.ndarray: ...

    @property
    def channels(self) -> Mapping[str, np.ndarray]: ...

    @property
    def masks(self) -> Mapping[str, np.ndarray]: ...


def trace_of(record: Measured, rig: Rig, stated: Mapping[str, float | None]) -> Trace:
    """Trace of one record.

    Parameters
    ----------
    record : Measured
        Channels in SI units with masks, True where valid.
    rig : Rig
    stated : mapping of str to float or None
        What the study says of the record, in SI units.

    Returns
    -------
    Trace

    Raises
    ------
    StudyError
        If a condition the rig needs is missing.
    """
    conditions = {}
    for condition in rig.conditions:
        value = stated.get(condition.name)
        value = condition.typical if value is None else value
        if math.isnan(value) and condition.name not in LEARNT:
            raise StudyError(
                f"{record.name}",
                f"no {condition.name}",
                f"{condition.doc}, in {condition.unit}",
                f"Give it in the record, under [rig], or with --set rig.{condition.name}=...",
            )
        conditions[condition.name] = float(value)
    channels = {name: np.where(record.masks[name], record.channels[name], np.nan) for name in rig.channels}
    inputs = {name: np.where(record.masks[name], record.channels[name], np.nan)[:, None] for name in rig.inputs}
    return Trace(record.name, np.asarray(record.time, dtype=float), channels, inputs, conditions)


LEARNT = ("lift",)
"""Conditions that the data can tell where a study is silent."""
