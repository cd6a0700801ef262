"""Jumps of a reading: at some instant all that follows lies higher or lower than a model says.

Slow noise can be fitted to any series that jumps now and then: its innovations are then small everywhere, and only at
the jumps a run of them has the shape that a jump leaves. So at each instant it is tested whether a jump there accounts
for innovations better than chance.

Source
------
Shocks in the level of a series, by its innovations: de Jong and Penzer, J. Am. Stat. Assoc. 93 (1998). Errors that hold
where noise is not equally loud: White, Econometrica 48 (1980). Joint probability: Fisher, Statistical Methods for
Research Workers (1925).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

from fibrefit.problem import BlockFilter


class LevelShift(NamedTuple):
    """The likeliest instant of a jump in one channel of one record.

    Parameters
    ----------
    probability : float
        Of one as likely anywhere in it, if there is only noise.
    height : float
        In units of the noise.
    """

    record: int
    channel: int
    sample: int
    probability: float
    height: float


CLOSE = 8
"""Samples between instants: innovations of slow noise show a jump for some dozens of samples only."""


def level_shifts(whitening: BlockFilter, residuals: np.ndarray, counts: np.ndarray) -> list[LevelShift]:
    """The likeliest jump in each channel of each record.

    Noise may be louder about an instant than elsewhere: the error of a height is no less than what is left there says
    by itself.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time) in units of the noise
        Zero where a sample is masked.
    counts : (n_record,) int
    """
    from scipy.stats import norm  # a third of a second, which a fit does without

    found = []
    for record, (row, count) in enumerate(zip(residuals, counts, strict=True)):
        # Among the first and the last 32 samples too few lie before a jump, or behind; 500 instants are enough of any.
        instants = np.arange(32, count - 32, max(CLOSE, count // 500))
        if not len(instants):
            continue
        own, row, parts = whitening.of_records([record]), row[:, :count], []
        # Shapes of at most 64 instants are held in memory together.
        for part in np.array_split(instants, -(-len(instants) // 64)):
            after = (np.arange(count) >= part[:, None])[:, None]
            (white,) = own.whiten_many([np.concatenate([row[None], np.where(row != 0.0, after, 0.0)])])
            innovations, shapes = white[:1], white[1:]
            seen = np.maximum(np.sum(shapes**2, axis=2), 1e-300)
            height = np.sum(shapes * innovations, axis=2) / seen
            scatter = np.sum(shapes**2 * (innovations - height[:, :, None] * shapes) ** 2, axis=2)
            parts.append(np.stack([height, np.sqrt(np.maximum(seen, scatter)) / seen]))
        for channel, (height, error) in enumerate(np.moveaxis(np.concatenate(parts, axis=1), 2, 0)):
            size = np.abs(height) / error
            worst = int(np.argmax(size))
            chance = min(1.0, 2.0 * len(size) * float(norm.sf(size[worst])))
            found.append(LevelShift(record, channel, int(instants[worst]), chance, float(height[worst])))
    return found


def without_shifts(residuals: np.ndarray, shifts: Sequence[LevelShift], counts: np.ndarray) -> np.ndarray:
    """Residuals ``(..., n_record, n_channel, n_time)`` with jumps taken off; masked samples stay zero."""
    steady = residuals.copy()
    for one in shifts:
        after = steady[..., one.record, one.channel, one.sample : counts[one.record]]
        after -= np.where(after != 0.0, one.height, 0.0)
    return steady


def joint_probability(found: Sequence[LevelShift]) -> float:
    """Of all of them, if there is only noise: what is half as probable in each of several records is more so in all."""
    from scipy.stats import chi2  # a third of a second, which a fit does without

    total = -2.0 * sum(np.log(max(jump.probability, 1e-300)) for jump in found)
    return float(chi2.sf(total, 2 * len(found))) if found else 1.0
