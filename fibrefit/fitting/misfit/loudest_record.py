"""Whether a single record leaves more than its noise, which hardly shows in what all records leave together.

Law
---
The mean square of normal noise whose periodogram is expected to be ``E_k`` has the relative variance
``Σ E_k² / (Σ E_k)²``: ``2/n`` of n samples of white noise, more of slow noise. It is distributed nearly as chi-squared
with twice the inverse of that as degrees of freedom, over these.

Source
------
Satterthwaite, Biometrics Bull. 2 (1946).
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.special import chdtri

from fibrefit.fitting.misfit.structure import loudness
from fibrefit.fitting.thresholds import LOUDER_THAN_AT_REST, RARE_POWER
from fibrefit.problem.diagnose.motion import ResidualSet
from fibrefit.problem.noise.spectrum import Noise
from fibrefit.study.summaries.check import Check


def loudest_record(sizes: Mapping[str, float], residual_set: ResidualSet, expected: float) -> tuple[Check, ...]:
    """Whether the loudest record leaves no more than noise that is a little louder than at rest; none of one record.

    Parameters
    ----------
    sizes : mapping of record to float
        Gap of each, in the order of the residuals.
    expected : float
        Gap of a perfect model.
    """
    if len(sizes) < 2:
        return ()
    limit, worst, which = LOUDER_THAN_AT_REST * expected, 0.0, ""
    for r, (name, size) in enumerate(sizes.items()):
        ratio = size / _by_chance(residual_set, r, len(sizes)) if np.isfinite(size) else np.inf
        if limit < ratio < np.inf:
            ratio /= _loudness(residual_set, r)
        if ratio > worst:
            worst, which = ratio, name
    found = Check(
        name="no record stands out",
        passed=bool(worst <= limit),
        statistic=float(worst),
        threshold=float(limit),
        identifier="loudest_record",
        quantity="residuals of single records",
        about="model",
        facts={"record": which},
    )
    return (found,)


def _by_chance(residual_set: ResidualSet, record: int, number: int) -> float:
    """Gap that noise alone leaves in a record, and rarely exceeds in any of so many."""
    count, rate = int(residual_set.counts[record]), float(residual_set.rates[record])
    counted = residual_set.counted[record].sum(axis=-1)
    scatters = [
        scatter_of_noise(residual_set.noise[channel], count, rate, int(seen))
        for channel, seen in zip(residual_set.channels, counted, strict=True)
    ]
    freedom = 2.0 * len(scatters) ** 2 / sum(scatters)
    return float(np.sqrt(max(chdtri(freedom, RARE_POWER / number) / freedom, 1.0)))


def scatter_of_noise(noise: Noise, count: int, rate: float, counted: int) -> float:
    """Relative variance of the mean square of noise over a record.

    Parameters
    ----------
    count, counted : int
        Samples of the record, and those of them that count.
    rate : float
        Samples a second, in Hz.
    """
    power = noise.expected(count, rate) if count > 2 else np.zeros(0)
    whole = float(power.sum())
    slow = float(np.sum(power**2)) / whole**2 * count / max(counted, 1) if whole > 0.0 else 0.0
    return max(slow, 2.0 / max(counted, 1))


def _loudness(residual_set: ResidualSet, record: int) -> float:
    """How much louder the record is at all frequencies alike, which no lack of a model explains."""
    own = np.arange(len(residual_set.counts))[:, None] == record
    loud = [loudness(residual_set, c, residual_set.counted[:, c] & own) for c in range(len(residual_set.channels))]
    return float(np.sqrt(np.mean(np.square(loud))))
