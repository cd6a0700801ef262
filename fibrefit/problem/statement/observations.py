"""Records as arrays of one shape: what a compiled program reads."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import jax
import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.problem.statement.steps import Steps
from fibrefit.problem.thresholds import FEWEST_READINGS
from fibrefit.rigs.signals.trace import Trace
from fibrefit.simulation.inputs import Signals
from fibrefit.simulation.model import Experiment

BY_SAMPLE = ("record", "sample")
"""Dimensions of what every sample has, where it is written."""
LENGTH_STEP = 512
"""Lengths are padded to a multiple of this, so that studies of like length share a compiled program."""


class Observations(NamedTuple):
    """Stacked records.

    Parameters
    ----------
    experiment : Experiment
        Leaves ``(n_record, ...)``.
    measured : dict of (n_record, n_time)
        Zero where nothing was measured.
    weight : dict of (n_record, n_time)
        One over the noise (rms, SI) where a sample counts, zero elsewhere.
    steps : dict of Steps
        Of the channels whose residuals are those of readings in coarse steps.
    """

    experiment: Experiment
    measured: dict[str, jax.Array]
    weight: dict[str, jax.Array]
    steps: dict[str, Steps] = {}  # noqa: RUF012


def stack(traces: Sequence[Trace], noise: Mapping[str, Sequence[Any]]) -> Observations:
    """Pad the records to one length and stack them.

    Parameters
    ----------
    noise : mapping of channel to (n_record,) in SI units
        Noise rms of each channel in each record, or of each of its readings, ``(n_time,)``.

    Raises
    ------
    DataError
        If a record has fewer than 16 samples.
    """
    for trace in traces:
        if len(trace.times) < FEWEST_READINGS:
            do = "Check how the file was read."
            raise DataError(trace.name, f"{len(trace.times)} samples", f"at least {FEWEST_READINGS}", do)
    longest = max(len(trace.times) for trace in traces)
    size = -(-longest // LENGTH_STEP) * LENGTH_STEP
    experiment = Experiment(
        times=_stacked([_extended(trace.times, size) for trace in traces]),
        count=jax.device_put(np.array([len(trace.times) for trace in traces], dtype=np.int32)),
        conditions={name: _stacked([trace.conditions[name] for trace in traces]) for name in traces[0].conditions},
        inputs={
            name: Signals(*(_stacked([_padded(t.inputs[name][:, i], size) for t in traces]) for i in (0, 1)))
            for name in traces[0].inputs
        },
        duration=_stacked([float(trace.times[-1] - trace.times[0]) for trace in traces]),
    )
    channels = traces[0].channels
    return Observations(
        experiment,
        {c: _stacked([_padded(np.nan_to_num(t.channels[c]), size) for t in traces]) for c in channels},
        {
            c: _stacked([_weight(t.channels[c], size, n) for t, n in zip(traces, noise[c], strict=True)])
            for c in channels
        },
    )


def _extended(times: np.ndarray, size: int) -> np.ndarray:
    ahead = times[-1] + np.diff(times).mean() * np.arange(1, size - len(times) + 1)
    return np.concatenate([times, ahead])


def _padded(values: np.ndarray, size: int, fill: float | None = None) -> np.ndarray:
    last = values[-1] if fill is None else fill
    return np.concatenate([values, np.full(size - len(values), last)])


def _weight(values: np.ndarray, size: int, noise: Any) -> np.ndarray:
    return _padded(np.isfinite(values) / noise, size, 0.0)


def _stacked(rows: Sequence[np.ndarray] | Sequence[float]) -> jax.Array:
    # As it is: another way of handing it over would be a program for each shape.
    return jax.device_put(np.array(rows, dtype=float))
