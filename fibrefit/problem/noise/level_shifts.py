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

import jax
import numpy as np
from scipy.stats import chi2, norm

from fibrefit.problem.noise.blocks import BlockFilter


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


CLOSE, MOST = 8, 500
"""Samples between instants, if there are no more than so many instants in a record: innovations of slow noise show a
jump for some dozens of samples only."""
MARGIN = 32
"""Samples at either end of a record among which no jump is looked for: too few lie before it, or behind."""
AT_ONCE = 64
"""Instants whose shapes are held in memory together."""


def level_shifts(whitening: BlockFilter, residuals: np.ndarray, counts: np.ndarray) -> list[LevelShift]:
    """The likeliest jump in each channel of each record.

    Parameters
    ----------
    residuals : (n_record, n_channel, n_time) in units of the noise
        Zero where a sample is masked.
    counts : (n_record,) int
    """
    found = []
    for record, (row, count) in enumerate(zip(residuals, counts, strict=True)):
        instants = np.arange(MARGIN, count - MARGIN, max(CLOSE, count // MOST))
        if not len(instants):
            continue
        own = BlockFilter(*(part[:, record : record + 1] for part in jax.tree.leaves(whitening)))
        parts = np.array_split(instants, -(-len(instants) // AT_ONCE))
        heights = np.concatenate([_heights(own, row[:, :count], part) for part in parts], axis=1)
        for channel, (height, error) in enumerate(np.moveaxis(heights, 2, 0)):
            size = np.abs(height) / error
            worst = int(np.argmax(size))
            chance = min(1.0, 2.0 * len(size) * float(norm.sf(size[worst])))
            found.append(LevelShift(record, channel, int(instants[worst]), chance, float(height[worst])))
    return found


def without_shifts(residuals: np.ndarray, shifts: Sequence[LevelShift], counts: np.ndarray) -> np.ndarray:
    """Residuals ``(..., n_record, n_channel, n_time)`` with jumps taken off; masked samples stay zero."""
    left = residuals.copy()
    for one in shifts:
        after = left[..., one.record, one.channel, one.sample : counts[one.record]]
        after -= np.where(after != 0.0, one.height, 0.0)
    return left


def _heights(whitening: BlockFilter, row: np.ndarray, instants: np.ndarray) -> np.ndarray:
    """Heights of jumps at instants and their standard errors, ``(2, n_instant, n_channel)``.

    Noise may be louder about an instant than elsewhere: the error is no less than what is left there says by itself.
    """
    after = (np.arange(row.shape[-1]) >= instants[:, None])[:, None]
    white = whitening.whiten_many([np.concatenate([row[None], np.where(row != 0.0, after, 0.0)])])[0]
    innovations, shapes = white[:1], white[1:]
    seen = np.maximum(np.sum(shapes**2, axis=2), 1e-300)
    height = np.sum(shapes * innovations, axis=2) / seen
    scatter = np.sum(shapes**2 * (innovations - height[:, :, None] * shapes) ** 2, axis=2)
    return np.stack([height, np.sqrt(np.maximum(seen, scatter)) / seen])


def joint_probability(found: Sequence[LevelShift]) -> float:
    """Of all of them, if there is only noise: what is half as probable in each of several records is more so in all."""
    total = -2.0 * sum(np.log(max(jump.probability, 1e-300)) for jump in found)
    return float(chi2.sf(total, 2 * len(found))) if found else 1.0
