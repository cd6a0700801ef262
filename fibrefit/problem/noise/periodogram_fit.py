"""Periodograms of a channel, and the parts of a spectrum that make them most likely.

Variances of the parts are found by multiplicative steps that keep them from becoming negative; most of them vanish.

Source
------
Whittle, Ark. Mat. 2 (1953); expectation of the periodogram instead of the density: Sykulski et al., Biometrika 106
(2019); the steps: Fevotte, Bertin and Durrieu, Neural Comput. 21 (2009).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import jax
import numpy as np

from fibrefit.core.programs import kept_program
from fibrefit.problem.thresholds import NEGLIGIBLE_PART

BINS_PER_OCTAVE = 12
"""Frequencies of all records are pooled where there are many."""
STEPS = 400
ROWS = 64
"""Bands are filled up to a multiple of this."""


@dataclass(frozen=True)
class Periodograms:
    """Power of one channel of all records, and what each part of the noise is expected to give.

    Parameters
    ----------
    frequency : (n_ordinate,) in Hz
    power : (n_ordinate,)
        One-sided density, in unit^2/Hz.
    expected : (n_ordinate, n_relaxation + 2)
        For a variance of one of each first-order part, a density of 1/f, and a variance of one of white noise.
    record : (n_ordinate,) int
    """

    frequency: np.ndarray
    power: np.ndarray
    expected: np.ndarray
    record: np.ndarray

    @cached_property
    def bands(self) -> _Bands:
        """Means over narrow bands."""
        return _Bands(*_pooled(self))

    def where(self, chosen: np.ndarray) -> Periodograms:
        """The ordinates that are `chosen`."""
        return Periodograms(self.frequency[chosen], self.power[chosen], self.expected[chosen], self.record[chosen])


def fitted(of: Periodograms) -> np.ndarray:
    """Variances ``(n_relaxation + 2,)`` of the parts of the spectrum that the periodograms ask for.

    Of white noise, that with 1/f, with a first-order part, with both, and with first-order parts of all corners, the
    one with the lowest BIC. Few ordinates tell of the slowest noise: the simplest spectrum that will do says most of
    it, and of what a record of its length does not show at all.

    Source
    ------
    Schwarz, Ann. Stat. 6 (1978).
    """
    return of.bands.simplest()


@dataclass(frozen=True)
class _Bands:
    """Means over narrow bands of periodograms.

    Parameters
    ----------
    power, number : (n_band,)
        And ordinates in each.
    expected : (n_band, n_part)
    """

    power: np.ndarray
    expected: np.ndarray
    number: np.ndarray

    @property
    def _corners(self) -> int:
        return self.expected.shape[1] - 2

    @cached_property
    def of_any_corner(self) -> np.ndarray:
        """Variances ``(n_part,)`` of first-order parts of all corners and of white noise."""
        return self.fitted([np.r_[np.arange(self._corners), self._corners + 1]])[0]

    def simplest(self) -> np.ndarray:
        """Variances ``(n_part,)`` of the spectrum with the lowest BIC."""
        corners, of_any_corner = self._corners, self.of_any_corner
        first = int(np.argmax(of_any_corner[: corners - 1] + of_any_corner[1:corners])) if corners > 1 else 0
        pair, either = np.array([first, first + 1])[:corners], np.array([corners, corners + 1])
        simple = [either[1:], either, np.r_[pair, either[1:]], np.r_[pair, either]]
        weights = np.concatenate([of_any_corner[None], self.fitted(simple)])
        used = of_any_corner[:corners] > NEGLIGIBLE_PART * (of_any_corner[:corners].sum() + of_any_corner[-1])
        # A pair of neighbouring corners stands for one part whose corner lies between them.
        sizes = np.array([1 + np.count_nonzero(used), 1, 2, 3, 4])
        return np.asarray(weights[int(np.argmin(self.costs(weights) + sizes * np.log(self.number.sum())))])

    def fitted(self, parts: Sequence[np.ndarray]) -> np.ndarray:
        """Variances ``(n_choice, n_part)`` that are most likely where some parts alone are there."""
        size = 0.1 * np.average(self.power, weights=self.number) / self.expected.mean(axis=0)
        widest = max(map(len, parts))
        # Bands that hold nothing make up the rows of a program that other records share, and parts that are nothing,
        # and remain so under multiplicative steps, its columns.
        spare = -len(self.number) % ROWS
        rows = np.pad(self.expected, ((0, spare), (0, 0)), constant_values=1.0)
        power, number = (np.pad(band, (0, spare)) for band in (self.power, self.number))
        places = np.array([np.resize(some, widest) for some in parts])
        there = np.arange(widest) < np.array([len(some) for some in parts])[:, None]
        found = _stepped(np.where(there, size[places], 0.0), np.moveaxis(rows[:, places], 1, 0), power, number)
        weights = np.zeros((len(parts), len(size)))
        for row, some, those in zip(weights, parts, np.asarray(found), strict=True):
            row[some] = those[: len(some)]
        return weights

    def costs(self, weights: np.ndarray) -> np.ndarray:
        """Minus twice Whittle's log likelihood of variances ``(n_choice, n_part)``."""
        density = np.maximum(weights @ self.expected.T, 1e-300)
        return np.asarray(2.0 * (np.log(density) + self.power / density) @ self.number)


@kept_program
def _stepped(weights: jax.Array, expected: jax.Array, power: jax.Array, number: jax.Array) -> jax.Array:
    """Variances ``(n_start, n_part)`` after `STEPS` multiplicative steps, each of parts ``(n_start, n_band, n_part)``.

    One start after the other: products with a vector are compiled into the loop, those of four rows leave it for a
    library each time, and take four times as long.
    """

    def one(row: tuple[jax.Array, jax.Array]) -> jax.Array:
        start, expected = row

        def step(_: int, weights: jax.Array) -> jax.Array:
            density = expected @ weights
            share = number / density
            return weights * ((share * power / density) @ expected) / (share @ expected)

        return jax.lax.fori_loop(0, STEPS, step, start)

    return jax.lax.map(one, (weights, expected))


def _pooled(of: Periodograms) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Means of power and expectations over narrow bands, and the ordinates in each."""
    place = np.floor(BINS_PER_OCTAVE * np.log2(of.frequency / of.frequency.min())).astype(int)
    number = np.bincount(place).astype(float)
    some = number > 0.0
    mean = lambda column: np.bincount(place, weights=column)[some] / number[some]  # noqa: E731
    return mean(of.power), np.stack([mean(column) for column in of.expected.T], axis=1), number[some]
