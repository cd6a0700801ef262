"""Curves over frequency: extremes of the motion, jumps, and ranges in which the pendulum overturns."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fibrefit.rigs.signals.rest import runs
from fibrefit.series.thresholds import HIGH, STEEP_JUMP


@dataclass(frozen=True)
class Extremes:
    """Extremes of the motions of one branch, ``(n_frequency, n_channel)``, the angle in the first column.

    Parameters
    ----------
    lowest, highest : (n_frequency, n_channel)
        In the steady state; NaN where the pendulum overturned.
    first_lowest, first_highest : (n_frequency, n_channel)
        The same, transient included.
    """

    lowest: np.ndarray
    highest: np.ndarray
    first_lowest: np.ndarray
    first_highest: np.ndarray

    @property
    def amplitude(self) -> np.ndarray:
        """Steady-state amplitude: half the travel of the angle, ``(n_frequency,)`` in rad."""
        return 0.5 * (self.highest[:, 0] - self.lowest[:, 0])

    @property
    def max_angle(self) -> np.ndarray:
        """Maximum |angle|, transient included, ``(n_frequency,)`` in rad."""
        return np.maximum(-self.first_lowest[:, 0], self.first_highest[:, 0])


@dataclass(frozen=True)
class Jump:
    """A jump between two neighbouring frequencies.

    Parameters
    ----------
    lower, upper : float in Hz
    before, after : float in rad
        At the lower and at the upper frequency.
    """

    lower: float
    upper: float
    before: float
    after: float


def jumps(frequencies: np.ndarray, amplitude: np.ndarray) -> tuple[Jump, ...]:
    """Jumps of a curve.

    Parameters
    ----------
    frequencies : (n_frequency,) in Hz
    amplitude : (n_frequency,) in rad
        NaN where the pendulum overturned; next to that there is no jump.
    """
    change = np.abs(np.diff(amplitude))
    neighbours = np.stack([np.r_[np.nan, change[:-1]], np.r_[change[1:], np.nan]])
    known = np.isfinite(neighbours)
    steepest = np.max(np.where(known, neighbours, 0.0), axis=0)
    size = np.nanmax(amplitude, initial=0.0)
    # A flank with no neighbour to compare it with is no evidence.
    found = (change > HIGH * size) & (change > STEEP_JUMP * steepest) & known.any(axis=0)
    return tuple(
        Jump(*(float(number) for number in (frequencies[i], frequencies[i + 1], amplitude[i], amplitude[i + 1])))
        for i in np.flatnonzero(found)
    )


def ranges(frequencies: np.ndarray, flags: np.ndarray) -> tuple[tuple[float, float], ...]:
    """First and last frequency [Hz] of each unbroken range in which `flags` hold, both ``(n_frequency,)``."""
    return tuple((float(frequencies[a]), float(frequencies[b - 1])) for a, b in runs(flags))
