"""From a study's records to traces: what a rig needs to know of each, in SI units."""

from __future__ import annotations

import math
from collections.abc import Collection, Mapping, Sequence
from typing import Protocol

import numpy as np

from fibrefit.core.errors import DataError, StudyError
from fibrefit.core.limits import MOST_PLANNED, too_far_apart
from fibrefit.problem.inputs.smoothing import smoothed
from fibrefit.problem.thresholds import FEWEST_READINGS
from fibrefit.rigs.rig import Rig
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.model import ORDER


class Measured(Protocol):
    """What a trace needs of a record that was read."""

    @property
    def name(self) -> str:
        """In results and messages."""

    @property
    def time(self) -> np.ndarray:
        """Instants ``(n_time,)``, in s."""

    @property
    def channels(self) -> Mapping[str, np.ndarray]:
        """Measured values ``(n_time,)`` in SI units, by role; NaN where a sample is damaged."""

    @property
    def rate(self) -> float:
        """Samples a second, in Hz."""

    @property
    def uniform(self) -> bool:
        """Whether all steps in time are equal, gaps aside."""


def trace_of(record: Measured, rig: Rig, stated: Mapping[str, float | None]) -> Trace:
    """Trace of one record.

    Parameters
    ----------
    record : Measured
        Channels in SI units, NaN where a sample is damaged.
    stated : mapping of str to float or None
        What the study says of the record, in SI units.

    Raises
    ------
    StudyError
        If a condition the rig needs is missing.
    DataError
        If a channel the rig needs is missing, or an input has holes.
    """
    conditions = conditions_of(record.name, rig, stated)
    for name in rig.measured:
        if name not in record.channels:
            do = f'Name its column: [channels] {name} = "..."; fibrefit inspect tells what was left out, and why.'
            do += _without(name, record.channels, rig)
            raise DataError(record.name, f"no {name} channel", f"one, for a {rig.kind} rig", do)
        valid = int(np.count_nonzero(np.isfinite(record.channels[name])))
        if valid < FEWEST_READINGS:
            raise DataError(
                f'{record.name}, channel "{name}"',
                f"{valid} valid samples",
                f"at least {FEWEST_READINGS}",
                "Check its column and unit; fibrefit inspect tells what was masked, and why.",
            )
    times, place = _grid(record)
    spread = {name: _spread(record.channels[name], place, len(times)) for name in rig.measured}
    read = {name: name for name in rig.inputs if name not in rig.derived} | (
        {} if rig.anchor is None else {"anchor": rig.anchor}
    )
    return Trace(
        record.name,
        times,
        {name: spread[name] for name in rig.channels},
        {name: _input(spread[role], times, f'{record.name}, channel "{role}"') for name, role in read.items()},
        conditions,
    )


def conditions_of(name: str, rig: Rig, stated: Mapping[str, float | None]) -> dict[str, float]:
    """Conditions of a record, in SI units; NaN for one that the data must tell.

    Raises
    ------
    StudyError
        If one that must be known is missing.
    """
    conditions = {}
    for condition in rig.conditions:
        value = stated.get(condition.name)
        value = condition.typical if value is None else value
        if math.isnan(value) and condition.name not in ESTIMATED:
            raise StudyError(
                name,
                f"no {condition.name}",
                f"{condition.doc}, in {condition.unit}",
                f"Give it in the record, under [rig], or with --set rig.{condition.name}=...",
            )
        conditions[condition.name] = float(value)
    return conditions


def in_order(traces: Sequence[Trace]) -> list[Trace]:
    """Traces that know their place in the series, from 1: some laws change from record to record."""
    return [trace._replace(conditions={**trace.conditions, ORDER: float(i)}) for i, trace in enumerate(traces, 1)]


def _input(values: np.ndarray, times: np.ndarray, where: str) -> np.ndarray:
    return np.column_stack([smoothed(values, times, where), values])


def _without(name: str, channels: Collection[str], rig: Rig) -> str:
    """What to state where a channel was not measured at all, and the rig knows of such records."""
    fitting = [
        variant.channels
        for variant in rig.variants.values()
        if variant.inputs == rig.inputs and name not in variant.measured and set(variant.measured) <= set(channels)
    ]
    stated = f' Where it was not measured: measured = "{" and ".join(fitting[0])}" under [rig].' if fitting else ""
    return stated if name in rig.channels else ""


def _grid(record: Measured) -> tuple[np.ndarray, np.ndarray]:
    """Instants of an unbroken grid, and the place of each sample in it: what is missing is left out, not bridged."""
    times = np.asarray(record.time, dtype=float)
    if not record.uniform:
        return times, np.arange(len(times))
    place = np.round((times - times[0]) * record.rate).astype(int)
    if place[-1] >= max(MOST_PLANNED, 2 * len(times)):
        longest = int(np.argmax(np.diff(place)))
        raise too_far_apart(record.name, int(place[-1]) + 1, float(np.diff(times)[longest]), float(times[longest]))
    return times[0] + np.arange(place[-1] + 1) / record.rate, place


def _spread(values: np.ndarray, place: np.ndarray, size: int) -> np.ndarray:
    full = np.full(size, np.nan)
    full[place] = values
    return full


ESTIMATED = ("lift",)
"""Conditions that the data can tell where a study is silent."""
