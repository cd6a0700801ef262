"""Events: instants before which a record is explained down to its noise, and after which it is not.

Law
---
The first window that is louder than noise gets by chance begins an event where all before it, taken together and just
before it, is noise; most of the motion after it is loud, at once and not by and by; and what the rig does then it has
done before, in the same phase and at no larger a speed, position or tension.
"""

from __future__ import annotations

import numpy as np

from fibrefit.core.declarations import HELD, REST
from fibrefit.discovery.engine.thresholds import AROUND_EVENT, LOUD_AFTER, LOUD_AT_ONCE, PHASE_SEEN, STRETCHED
from fibrefit.discovery.residuals.chance import loudest
from fibrefit.discovery.residuals.residuals import ChannelResidual, channel_residuals
from fibrefit.problem import ResidualSet

AT_ONCE = 5
"""Windows just after an event and just before it."""
TRIALS = 10
"""Times that what lies before an event is looked at: so often noise may be loud by chance."""


def events(found: ResidualSet) -> tuple[tuple[str, float], ...]:
    """Records in which something happens, each with its instant [s].

    Parameters
    ----------
    found : ResidualSet
        A parameter that all records share, or all of one record does, is fitted to what is before an event and after
        it alike: an event is only seen where that leaves what is before it noise.
    """
    pieces, listed = channel_residuals(found), []
    trials = sum(len(piece.times) // piece.window for piece in pieces)
    for r, record in enumerate(found.problem.layout.records):
        instant = _event(found, [piece for piece in pieces if piece.record == r], trials)
        if instant is not None:
            listed.append((record, instant))
    return tuple(listed)


def _event(found: ResidualSet, own: list[ChannelResidual], trials: int) -> float | None:
    width = own[0].window
    powers = np.array([_powers(piece, width) for piece in own])
    limits = np.array([[loudest(p.noise, width, len(p.times), p.rate, trials)] for p in own])
    loud = np.asarray((powers > limits).any(axis=0))
    phase = _usual(own[0].phase, width)
    moving = ~np.isin(phase, (HELD, REST))
    if not loud.any():
        return None
    first = int(loud.argmax())
    after = np.flatnonzero(moving[first:]) + first
    if moving[:first].sum() < AROUND_EVENT or len(after) < AROUND_EVENT or loud[after].mean() < LOUD_AFTER:
        return None
    if not all(_is_noise(piece, powers[c], first, width) for c, piece in enumerate(own)):
        return None
    sizes = powers.max(axis=0)
    at_once = slice(first, first + AT_ONCE)
    if sizes[at_once].mean() < LOUD_AT_ONCE * np.median(sizes[after][loud[after]]):
        return None
    if not _done_before(found, own[0].record, phase, first, width):
        return None
    return float(own[0].times[first * width])


def _powers(piece: ChannelResidual, width: int) -> np.ndarray:
    number = len(piece.times) // width
    squares = np.where(piece.counted, piece.residual**2, 0.0)
    return squares[: number * width].reshape(number, width).mean(axis=1)


def _usual(values: np.ndarray, width: int) -> np.ndarray:
    """The commonest of the integers in each window."""
    windows = values[: len(values) // width * width].reshape(-1, width)
    return np.array([np.bincount(window).argmax() for window in windows])


def _is_noise(piece: ChannelResidual, powers: np.ndarray, first: int, width: int) -> bool:
    """Whether all windows before one, and the last few of them, are noise, each taken together."""
    numbers = (first, AT_ONCE)
    limits = [loudest(piece.noise, number * width, len(piece.times), piece.rate, TRIALS) for number in numbers]
    return all(powers[first - number : first].mean() <= limit for number, limit in zip(numbers, limits, strict=True))


def _done_before(found: ResidualSet, record: int, phase: np.ndarray, first: int, width: int) -> bool:
    """Whether the rig has been in the phase of a window before, and its states as far out."""
    if (phase[:first] == phase[first]).sum() < PHASE_SEEN:
        return False
    inside, past = slice(first * width, (first + 1) * width), slice(0, first * width)
    same = found.motion.phase[record, past] == phase[first]
    for state in found.motion.states.values():
        low, high = np.min(state[record, past][same]), np.max(state[record, past][same])
        room = STRETCHED * (high - low)
        here = np.median(state[record, inside])
        if not low - room <= here <= high + room:
            return False
    return True
