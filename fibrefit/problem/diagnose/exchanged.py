"""Whether force and position stand in each other's place."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fibrefit.problem.thresholds import FEWEST_SPANS
from fibrefit.rigs.signals.trace import Trace

SPAN = 5e-3
"""Time over which readings are averaged, in s: noise is small then, and impacts are still seen."""


def are_exchanged(traces: Sequence[Trace]) -> bool:
    """Whether the force of every record is the smoother one of the two.

    A force accelerates a mass, and a position is the double integral of its acceleration: whatever their units, a
    position is smoother than a force. The roughness of the position is 0.01 to 0.5 of that of the force in the records
    of drops, of driven weights and of guided masses at hand, so that it would be 2 to 100 times where the two are
    exchanged; the limit is 1. Where nothing moves both are noise, which is rougher than its own spread: what stands in
    the place of the force must be smooth, as the position of something that moves is.

    Parameters
    ----------
    traces : sequence of Trace
        Records without both a force and a position say nothing.
    """
    pairs = [(trace.times, _readings(trace, "position"), _readings(trace, "force")) for trace in traces]
    rough = [
        (roughness(times, position), roughness(times, force))
        for times, position, force in pairs
        if position is not None and force is not None
    ]
    return bool(rough) and all(force < min(position, 1.0) for position, force in rough)


def roughness(times: np.ndarray, values: np.ndarray) -> float:
    """Second differences of a signal over `SPAN` beside its own spread; a pure number.

    Parameters
    ----------
    times : (n_time,) in s
    values : (n_time,)
        Any unit; NaN where there is none.
    """
    there = np.isfinite(values)
    if there.sum() < 2 or not np.ptp(values[there]) > 0.0:
        return np.nan
    number = max(1, round(SPAN / float(np.median(np.diff(times)))))
    blocks = len(times) // number
    whole = np.interp(times, times[there], values[there])
    means = whole[: blocks * number].reshape(blocks, number).mean(axis=1)
    if blocks < FEWEST_SPANS or not np.ptp(means) > 0.0:
        return np.nan
    return float(np.sqrt(np.mean(np.diff(means, 2) ** 2)) / np.std(means))


def _readings(trace: Trace, role: str) -> np.ndarray | None:
    if role in trace.channels:
        return np.asarray(trace.channels[role])
    # An input is kept with its readings beside what was made of them.
    return np.asarray(trace.inputs[role])[:, -1] if role in trace.inputs else None
