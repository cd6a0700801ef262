"""Where nothing moves in a record, and the fast noise and the steps that readings show by themselves."""

from __future__ import annotations

import weakref
from collections.abc import Callable, Sequence
from functools import wraps
from typing import NamedTuple, TypeVar

import numpy as np

from fibrefit.core.declarations import ROLES
from fibrefit.core.errors import DataError
from fibrefit.core.formatting import format_quantity
from fibrefit.rigs.signals.trace import Trace
from fibrefit.rigs.thresholds import DRIFT, FAST_NOISE, FIRST_BLOCKS, SHORTEST_REST, SLOW_NOISE, SPREADS

T = TypeVar("T")

BLOCK = 32
"""Samples whose mean is compared when looking for rest."""
SHORTEST_BLOCKS = SHORTEST_REST // BLOCK + 1
"""Blocks of the shortest rest, with the one that motion may begin in."""
PARABOLA = 3
"""Coefficients of one."""
QUIET = 0.25
"""Share of the blocks that are quieter than what is taken for noise: contacts are in the others."""


def once_of_readings(function: Callable[[np.ndarray], T]) -> Callable[[np.ndarray], T]:
    """A function of readings that is found once of those that are there still.

    Noise, starting values and checks ask the same of the same ones.
    """
    known: dict[int, tuple[weakref.ref[np.ndarray], T]] = {}

    @wraps(function)
    def once(signal: np.ndarray) -> T:
        place = id(signal)
        found = known.get(place)
        if found is None or found[0]() is not signal:
            found = known[place] = weakref.ref(signal, lambda _: known.pop(place, None)), function(signal)
        return found[1]

    return once


def rests(trace: Trace) -> list[slice]:
    """Stretches at the start and the end of a record in which no measured quantity moves."""
    signals = [_seen_in(signal) for signal in trace.channels.values()]
    signals += [
        _Signal(_means(values[:, 0]), DRIFT * float(np.ptp(values[:, 0])), 0.0) for values in trace.inputs.values()
    ]
    # Before the motion a block by itself may be damaged or loud; after it, one may look like rest at a turning point.
    seen, ahead = FIRST_BLOCKS, _run_length(_still(signals, FIRST_BLOCKS), 1)
    # What is at rest shows how slow noise moves, and that what follows is at rest too.
    while ahead > seen:
        seen, ahead = ahead, _run_length(_still(signals, ahead), 1)
    if ahead < FIRST_BLOCKS:
        # What does not even agree with itself says nothing of slow noise.
        seen, ahead = 0, _run_length(_still(signals, 0), 1)
    limits = [signal.limit(seen) for signal in signals]
    turned = [_near(signal, FIRST_BLOCKS, limit, -1) for signal, limit in zip(signals, limits, strict=True)]
    behind = _run_length(np.logical_and.reduce(turned)) * BLOCK
    found = [slice(0, ahead * BLOCK), slice(len(trace.times) - behind, len(trace.times))]
    return [rest for rest in found if rest.stop - rest.start >= SHORTEST_REST]


class RestAsked(NamedTuple):
    """The rest that a rig needs before its motion, and what is said of a record without it.

    Parameters
    ----------
    called, expected : str
        What the rest is called, and what is expected.
    moves, do : str
        What is found and what to do where a record does not begin with it.
    masked : str
        What to do where nothing of a ``{channel}`` was read in it.
    """

    called: str
    expected: str
    moves: str
    do: str
    masked: str


def first_rest(trace: Trace, asked: RestAsked) -> slice:
    """The rest that a record begins with; a `DataError` where it does not."""
    found = [rest for rest in rests(trace) if rest.start == 0]
    if not found:
        raise DataError(trace.name, asked.moves, asked.expected, asked.do)
    return found[0]


def mean_at_rest(trace: Trace, channel: str, rest: slice, asked: RestAsked) -> float:
    """Mean of a channel over a rest, in its SI unit; a `DataError` where nothing of it was read."""
    values, unit = trace.channels[channel], ROLES[channel]
    if np.isfinite(values[rest]).any():
        return float(np.nanmean(values[rest]))
    lowest, highest = (format_quantity(end(values), unit, 4) for end in (np.nanmin, np.nanmax))
    first = int(np.argmax(np.isfinite(values)))
    got = f"all {first} samples of the {channel} before {format_quantity(trace.times[first], 's', 4)} are masked as "
    got += f"saturated or damaged, the {asked.called} among them; those that are left go from {lowest} to {highest}"
    raise DataError(trace.name, got, asked.expected, asked.masked.format(channel=channel))


class _Signal(NamedTuple):
    """Means of the blocks of a signal, how far they part at rest in any case, and at the most where noise is slow.

    Of each block also how far its readings spread, beside the noise: a swing as long as a block has a mean at rest.
    """

    means: np.ndarray
    least: float
    most: float
    spreads: np.ndarray | None = None
    noise: float = 0.0

    def limit(self, seen: int) -> float:
        """How far noise moves a block's mean, as the first ones show it; the fewest show little of slow noise."""
        first = self.means[:seen]
        if seen < FIRST_BLOCKS or len(first) < seen or not np.isfinite(first).all():
            return self.least
        return max(self.least, self.most if seen == FIRST_BLOCKS else min(SPREADS * float(np.std(first)), self.most))


@once_of_readings
def _seen_in(signal: np.ndarray) -> _Signal:
    # The standard deviation about a parabola in each block, of the quieter blocks: noise behind a filter is not fast.
    # Motion hardly enters it, as it is smooth over the length of a block.
    blocks = signal[: len(signal) // BLOCK * BLOCK].reshape(-1, BLOCK)
    blocks, filtered = blocks[np.isfinite(blocks).all(axis=1)], 0.0
    if len(blocks):
        smooth = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, BLOCK), PARABOLA))[0]
        rough = blocks - (blocks @ smooth) @ smooth.T
        filtered = float(np.quantile(np.sqrt(np.sum(rough**2, axis=1) / (BLOCK - PARABOLA)), QUIET))
    # White and 1/f noise move block means by less than this, and coarse readings by a step; real motion by far more
    # within one block.
    white = max(white_noise(signal), filtered)
    travel = float(np.nanmax(signal) - np.nanmin(signal)) if np.isfinite(signal).any() else 0.0
    least, most = max(FAST_NOISE * white, resolution(signal)), max(DRIFT * travel, SLOW_NOISE * white)
    means = _means(signal)
    whole = signal[: len(means) * BLOCK]
    spreads = np.sqrt(_means((whole - np.repeat(means, BLOCK)) ** 2))
    return _Signal(means, least, most, spreads, white)


def _means(signal: np.ndarray) -> np.ndarray:
    blocks = signal[: len(signal) // BLOCK * BLOCK].reshape(-1, BLOCK)
    number = np.isfinite(blocks).sum(axis=1)
    return np.where(number > 0, np.nansum(blocks, axis=1) / np.maximum(number, 1), np.nan)


def _still(signals: Sequence[_Signal], seen: int) -> np.ndarray:
    """Which blocks are like the first ones in all signals."""
    return np.logical_and.reduce([_near(signal, seen, signal.limit(seen)) for signal in signals])


def _near(signal: _Signal, seen: int, limit: float, way: int = 1) -> np.ndarray:
    """Which blocks, in one `way` or from the end, are quiet and have means that agree with the first within `limit`."""
    means = signal.means[::way]
    known = means[np.isfinite(means)]
    if not known.size:
        return np.ones(len(means), dtype=bool)
    # The motion that ends a short rest is no part of what the others are held against.
    level = known[:seen].mean() if seen else np.median(known[:SHORTEST_BLOCKS])
    near: np.ndarray = ~(np.abs(means - level) > limit)
    if signal.spreads is None:
        return near
    spreads = signal.spreads[::way]
    quiet = np.nanmedian(spreads[:SHORTEST_BLOCKS]) if np.isfinite(spreads[:SHORTEST_BLOCKS]).any() else 0.0
    # Slow noise spreads readings within a block about as far as it moves the means of blocks.
    return near & ~(spreads > min(limit + SPREADS * signal.noise, SPREADS * max(quiet, signal.noise)))


def _run_length(flags: np.ndarray, spared: int = 0) -> int:
    """Blocks at rest from the start on; so many moving ones are spared if they are followed by rest."""
    out, moving = ~flags, ~flags
    for _ in range(spared):
        moving = moving & np.append(out[1:], True)
        out = np.append(out[1:], True)
    # What would be spared is the motion where nothing else moves.
    moving = moving if moving.any() else ~flags
    first = int(np.argmax(moving)) if moving.any() else len(flags)
    # The block in which motion begins may still look like rest: it is left out.
    return max(first - 1, 0)


def white_noise(signal: np.ndarray) -> float:
    """Standard deviation of the fast part, from third differences, which motion hardly enters."""
    finite = signal[np.isfinite(signal)]
    # A simulated record has none at all: rounding must not look like motion then.
    least = 1e-9 * float(np.ptp(finite)) + 1e-300 if finite.size else 1e-300
    fast = fast_part(finite)
    # Coarse readings may stand still for long, and differ by whole steps then.
    return max(fast, resolution(signal) / np.sqrt(12.0)) + least


def fast_part(signal: np.ndarray) -> float:
    """Standard deviation of white noise by the third differences of a signal, which a smooth motion hardly enters."""
    finite = signal[np.isfinite(signal)]
    return float(np.median(np.abs(np.diff(finite, 3))) / 0.6745 / np.sqrt(20.0)) if finite.size > 3 else 0.0


@once_of_readings
def resolution(signal: np.ndarray) -> float:
    """Smallest step between readings, in their unit."""
    steps = np.diff(np.unique(signal[np.isfinite(signal)]))
    return float(steps.min()) if len(steps) else 0.0


def runs(flags: np.ndarray) -> np.ndarray:
    """Runs of true flags ``(n,)``: first place of each, and the one after its last, ``(n_run, 2)``."""
    return np.flatnonzero(np.diff(np.asarray(flags, dtype=np.int8), prepend=0, append=0)).reshape(-1, 2)
