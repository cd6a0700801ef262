"""Grid of standard deviations between records over which evidence is summed, and its prior.

Law
---
With probability one half records agree in all parameters. What makes them differ in one hardly leaves the others alone:
each standard deviation is else zero with a probability of one in ten, or anything up to eight percent (six where many
parameters may differ), uniform to one percent and log-uniform beyond: a prior that is log-uniform throughout lets few
records that happen to agree say that all would.

R records tell the logarithm of a standard deviation to ``1 / sqrt(2 (R - 1))`` at best. Models are compared on one
grid, whose levels mostly lie a factor of two apart; what a fit reports is summed over one that is halved, where the
weight is, until its steps are fit for that.

Source
------
Gelman, Bayesian Anal. 1 (2006) on priors of such deviations; Trefethen and Weideman, SIAM Rev. 56 (2014) on the
trapezoidal rule, of which a normal law with steps of two standard deviations leaves an error of 1.4 percent.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from functools import reduce

import numpy as np

LEVELS = (0.0, 0.0003, 0.001, 0.002, 0.004, 0.008, 0.016, 0.03, 0.08)
"""Standard deviations between records, as shares of a parameter."""
FEW_LEVELS = (0.0, 0.001, 0.004, 0.016, 0.06)
"""The same where many parameters deviate."""
FURTHER = (0.2, 0.5)
"""Levels beyond the last one, of parameters that the records of a fit make differ by that: see `end_told`."""
MANY = 3
"""Parameters that may deviate at the most for the finer of these levels."""
AGREE = 0.5
"""Probability, before the records speak, that they agree in all parameters."""
ALONE = 0.1
"""Probability that they agree in one where they do not in all."""
UNIFORM_TO = 0.01
"""Standard deviation up to which any is as probable as another."""
WIDEST_STEP = 2.0
"""Step of the logarithm, over how well that can be known, above which a cell of weight is halved."""
WEIGHS, WEIGHTLESS = 1e-4, 1e-7
"""Weight of a level as a share of the largest: that which its cells are halved for, and that below which it goes."""
MOST_POINTS = 40_000
"""Points of a grid that is halved no further."""


@dataclass(frozen=True)
class SigmaAxis:
    """Levels of the standard deviation of one parameter.

    Parameters
    ----------
    levels : (n_level,)
        The first is zero.
    widths : (n_level - 1,)
        Of the cells of the others, in the logarithm.
    whole : float
        What the density beforehand adds up to over the cells of the grid this began as.
    """

    levels: np.ndarray
    widths: np.ndarray
    whole: float

    @classmethod
    def of(cls, levels: Sequence[float]) -> SigmaAxis:
        """Cells that end in the middle between levels, those at the ends as far beyond them."""
        some = np.array(levels[1:])
        widths = np.gradient(np.log(some))
        return cls(np.array(levels), widths, float(_density(some, widths).sum()))

    @property
    def shares(self) -> np.ndarray:
        """Probabilities ``(n_level,)`` of standard deviations, where records do not agree in all."""
        return np.concatenate([[ALONE], (1.0 - ALONE) * _density(self.levels[1:], self.widths) / self.whole])

    def halved(self, weight: np.ndarray, step: float) -> SigmaAxis:
        """Levels in the middle of cells that are wider than a step and have weight; without those that have none.

        Parameters
        ----------
        weight : (n_level,)
            Of each level, that of a model included.
        step : float
            Of the logarithm.

        Returns
        -------
        SigmaAxis
            Itself, where nothing is too wide.
        """
        logs, heavy = np.log(self.levels[1:]), weight[1:] > WEIGHS * weight.max()
        gap = np.diff(logs)
        split = np.flatnonzero((gap > step) & (heavy[1:] | heavy[:-1]))
        if not split.size:
            return self
        widths = self.widths.copy()
        np.subtract.at(widths, np.concatenate([split, split + 1]), np.tile(0.25 * gap[split], 2))
        kept = self._kept(weight)[1:]
        middle = np.exp(0.5 * (logs[split] + logs[split + 1]))
        levels = np.concatenate([self.levels[1:][kept], middle])
        order = np.argsort(levels)
        found = np.concatenate([widths[kept], 0.5 * gap[split]])[order]
        return SigmaAxis(np.concatenate([[0.0], levels[order]]), found, self.whole)

    def _kept(self, weight: np.ndarray) -> np.ndarray:
        """Which levels weigh anything, or lie beside one that does; zero and the last one, which are asked about."""
        some = weight > WEIGHTLESS * weight.max()
        beside = some.copy()
        beside[1:] |= some[:-1]
        beside[:-1] |= some[1:]
        beside[[0, -1]] = True
        return beside


def _density(sigma: np.ndarray, widths: np.ndarray) -> np.ndarray:
    return np.asarray(widths * np.minimum(sigma / UNIFORM_TO, 1.0))


def usual_axes(number: int, further: Collection[int] = ()) -> tuple[SigmaAxis, ...]:
    """Levels on which models are compared.

    Parameters
    ----------
    number : int
        Of parameters that may deviate.
    further : collection of int
        Those whose standard deviations go on to those of `FURTHER`.
    """
    usual = LEVELS if number <= MANY else FEW_LEVELS
    return tuple(SigmaAxis.of((*usual, *FURTHER) if i in further else usual) for i in range(number))


def grid_over(axes: Sequence[SigmaAxis]) -> tuple[np.ndarray, np.ndarray]:
    """Standard deviations ``(n_grid, n_axis)`` and the logarithms of their probabilities beforehand, ``(n_grid,)``."""
    if not axes:
        return np.zeros((1, 0)), np.zeros(1)
    grid = np.stack([column.ravel() for column in np.meshgrid(*(axis.levels for axis in axes), indexing="ij")], axis=1)
    share = reduce(np.multiply.outer, [axis.shares for axis in axes]).ravel()
    alike = np.all(grid == 0.0, axis=1)
    return grid, np.log(np.where(alike, AGREE, (1.0 - AGREE) * share / (1.0 - ALONE ** len(axes))))


def further_in(axes: Sequence[SigmaAxis]) -> list[int]:
    """Parameters whose standard deviations go on to those of `FURTHER`."""
    return [i for i, axis in enumerate(axes) if axis.levels[-1] >= FURTHER[-1]]


def finest_step(records: int) -> float:
    """Step of the logarithm that a grid needs at the most, of so many records."""
    return WIDEST_STEP / float(np.sqrt(2.0 * max(records - 1, 1)))
