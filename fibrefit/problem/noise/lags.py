"""What parts of a noise are expected to give in a periodogram: transforms of what samples have in common by lag."""

from __future__ import annotations

from functools import lru_cache

import numpy as np

KEPT_SAMPLES = 1 << 14
"""Length of a record up to which the transforms of its lags are kept: eight of them are some ten MB."""


def lag_transforms(decay: np.ndarray, seen: np.ndarray) -> np.ndarray:
    """Transforms ``(n_relaxation + 1, n_frequency)`` of what parts of variance one share at each lag of a record.

    Parameters
    ----------
    decay : (n_relaxation,)
        Factor on each first-order part from one sample to the next.
    seen : (n_time,) bool
        Samples that count.
    """
    of = _transforms if len(seen) > KEPT_SAMPLES else _transforms_kept
    return of(decay.tobytes(), seen.tobytes())


def _transforms(decay: bytes, seen: bytes) -> np.ndarray:
    """Transforms ``(n_relaxation + 1, n_frequency)`` of what parts of variance one share at each lag of a record.

    Parameters
    ----------
    decay : (n_relaxation,) float
        Factor on each first-order part from one sample to the next.
    seen : (n_time,) bool
        Samples that count.
    """
    factors, mask = np.frombuffer(decay), np.frombuffer(seen, dtype=bool)
    found = _of_triangle(factors, len(mask)) if mask.all() else _of_pairs(factors, mask)
    found.flags.writeable = False
    return found


def _of_triangle(factors: np.ndarray, count: int) -> np.ndarray:
    """Those of a record without holes, which has one pair of samples fewer at each lag: the sum of a known series."""
    turn = np.exp(-2j * np.pi * np.arange(count // 2 + 1) / count)
    found = np.full((len(factors) + 1, len(turn)), 0.5 * count)
    # One after the other: of a long record, each fits into the fast memory.
    for row, factor in zip(found, factors, strict=False):
        # The last power of each term is that of its factor alone: a whole number of turns.
        term, rest = factor * turn, 1.0 / (1.0 - factor * turn)
        row[:] = (count * rest - term * (1.0 - factor**count) * rest**2).real - 0.5 * count
    return found


def _of_pairs(factors: np.ndarray, mask: np.ndarray) -> np.ndarray:
    """Those of any record, from the pairs of valid samples at each lag."""
    count, lags = len(mask), np.arange(len(mask))
    pairs = np.fft.irfft(np.abs(np.fft.rfft(mask.astype(float), 2 * count)) ** 2, 2 * count)[:count]
    kernels = np.concatenate([factors[:, None] ** lags, (lags == 0)[None]]) * pairs
    kernels[:, 0] *= 0.5
    return np.ascontiguousarray(np.fft.rfft(kernels, axis=-1).real)


# Channels, iterations and records of a series share them.
_transforms_kept = lru_cache(maxsize=8)(_transforms)
