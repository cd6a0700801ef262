"""Where nothing moves in a record, and the fast noise and the steps that readings show by themselves."""

from __future__ import annotations

import numpy as np

from fibrefit.core.errors import DataError
from fibrefit.rigs.signals.trace import Trace

BLOCK = 32
"""Samples whose mean is compared when looking for rest."""
SHORTEST_REST = 64
DRIFT = 0.003
"""Share of its travel by which an input or a reading may move while the rig is at rest."""
FIRST, WANDER = 4, 4.0
"""First blocks that show how noise moves their means, and how many standard deviations of those are still rest."""


def rests(trace: Trace) -> list[slice]:
    """Stretches at the start and the end of a record in which no measured quantity moves."""
    # White and 1/f noise move block means by less than this, and coarse readings by a step; real motion by far more
    # within one block.
    signals = [
        (signal, max(1.2 * hiss(signal), _wander(signal), resolution(signal))) for signal in trace.channels.values()
    ]
    signals += [(values[:, 0], DRIFT * float(np.ptp(values[:, 0]))) for values in trace.inputs.values()]
    # Before the motion a block by itself may be damaged or loud; after it, one may look like rest at a turning point.
    ahead = _run_length(np.logical_and.reduce([_like_the_first(signal, limit) for signal, limit in signals]), 1) * BLOCK
    turned = [(signal[::-1], limit) for signal, limit in signals]
    behind = _run_length(np.logical_and.reduce([_like_the_first(signal, limit) for signal, limit in turned])) * BLOCK
    found = [slice(0, ahead), slice(len(trace.times) - behind, len(trace.times))]
    return [rest for rest in found if rest.stop - rest.start >= SHORTEST_REST]


def first_rest(trace: Trace, got: str, expected: str, do: str) -> slice:
    """The rest that a record begins with; where it does not, a `DataError` of these words."""
    found = [rest for rest in rests(trace) if rest.start == 0]
    if not found:
        raise DataError(trace.name, got, expected, do)
    return found[0]


def _wander(signal: np.ndarray) -> float:
    """How far slow noise may move a block's mean, by the first ones; at most a small share of the travel."""
    first = signal[: FIRST * BLOCK]
    if len(first) < FIRST * BLOCK or not np.isfinite(first).all():
        return 0.0
    moved = WANDER * float(np.std(first.reshape(FIRST, BLOCK).mean(axis=1)))
    return min(moved, DRIFT * float(np.nanmax(signal) - np.nanmin(signal)))


def _like_the_first(signal: np.ndarray, limit: float) -> np.ndarray:
    """Whether each block's mean agrees with the first ones' within `limit`."""
    blocks = signal[: len(signal) // BLOCK * BLOCK].reshape(-1, BLOCK)
    number = np.isfinite(blocks).sum(axis=1)
    means = np.where(number > 0, np.nansum(blocks, axis=1) / np.maximum(number, 1), np.nan)
    known = means[np.isfinite(means)]
    return ~(np.abs(means - known[:3].mean()) > limit) if known.size else np.ones(len(means), dtype=bool)


def _run_length(flags: np.ndarray, spared: int = 0) -> int:
    """Blocks at rest from the start on; so many moving ones are spared if they are followed by rest."""
    out, moving = ~flags, ~flags
    for _ in range(spared):
        moving = moving & np.append(out[1:], True)
        out = np.append(out[1:], True)
    first = int(np.argmax(moving)) if moving.any() else len(flags)
    # The block in which motion begins may still look like rest: it is left out.
    return max(first - 1, 0)


def hiss(signal: np.ndarray) -> float:
    """Standard deviation of the fast part, from third differences, which motion hardly enters."""
    finite = signal[np.isfinite(signal)]
    # A simulated record has none at all: rounding must not look like motion then.
    least = 1e-9 * float(np.ptp(finite)) + 1e-300 if finite.size else 1e-300
    fast = fast_part(finite)
    # Coarse readings may stand still for long, and differ by whole steps then.
    return max(fast, resolution(finite) / np.sqrt(12.0)) + least


def fast_part(signal: np.ndarray) -> float:
    """Standard deviation of white noise by the third differences of a signal, which a smooth motion hardly enters."""
    finite = signal[np.isfinite(signal)]
    return float(np.median(np.abs(np.diff(finite, 3))) / 0.6745 / np.sqrt(20.0)) if finite.size > 3 else 0.0


def resolution(signal: np.ndarray) -> float:
    """Smallest step between readings, in their unit."""
    steps = np.diff(np.unique(signal[np.isfinite(signal)]))
    return float(steps.min()) if len(steps) else 0.0
