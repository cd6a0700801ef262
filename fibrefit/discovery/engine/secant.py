"""Products of slopes and residuals, with slopes that are corrected from residuals alone between simulations of all.

A step of a Gauss-Newton needs the slopes along every unknown, a simulation each; near a minimum they hardly change.
Broyden's update makes the slopes predict the residuals that the last step led to, at one simulation a step. Slopes
are simulated anew when needed, and no mode counts as found before such slopes ask for no further step.

Source
------
Broyden, Math. Comp. 19 (1965); of least squares: Dennis and Schnabel, Numerical Methods (1983), ch. 10.3.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fibrefit.discovery.engine.slopes import Slopes
from fibrefit.discovery.engine.supermodel import Supermodel


class Seed(NamedTuple):
    """Slopes of a model that the one at hand contains.

    Parameters
    ----------
    names : tuple of str
        Of their columns.
    slopes : Slopes
    """

    names: tuple[str, ...]
    slopes: Slopes


@dataclass
class SecantGram:
    """Products of slopes and residuals wherever they are needed, see `Gram`; few of the slopes are simulated.

    Parameters
    ----------
    supermodel : Supermodel
        Whitened.
    counts : (n_record,) int
    seed : Seed, optional
        Slopes to begin with; what it lacks is simulated.
    """

    supermodel: Supermodel
    counts: np.ndarray
    seed: Seed | None = None
    exact: bool = field(default=False, init=False)
    _known: _Known | None = field(default=None, init=False)

    def __call__(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Products at some values; parameters as `Supermodel.grams`."""
        if self._known is None:
            slopes = self._first(local, columns, targets)
            grams = slopes.grams(self.supermodel.sensitivities)
            self._known = _Known(local, targets - local[:, columns], slopes, float(np.sum(grams[:, -1, -1])))
            return grams
        known, change = self._known, targets - local[:, columns]
        # What cannot move has no change to count its way in.
        moved = (local - known.local)[:, columns]
        way = np.divide(moved, known.change, out=np.zeros_like(moved), where=known.change != 0.0)
        here = self.supermodel.slopes(local, columns[:0], targets[:, :0], self.counts)
        size = np.divide(change, known.change, out=np.ones_like(change), where=known.change != 0.0)
        slopes = known.slopes.updated(here, way).scaled(size)
        grams = slopes.grams(self.supermodel.sensitivities)
        self.exact = False
        # A step that led upwards is hardly ever taken: slopes are corrected along the way that is.
        if np.sum(grams[:, -1, -1]) <= known.cost:
            self._known = _Known(local, change, slopes, float(np.sum(grams[:, -1, -1])))
        return grams

    def _first(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> Slopes:
        seed, self.seed = self.seed, None
        self.exact = seed is None
        if seed is None:
            return self.supermodel.slopes(local, columns, targets, self.counts)
        names = [self.supermodel.names[column] for column in columns]
        new = np.array([j for j, name in enumerate(names) if name not in seed.names], dtype=int)
        simulated = self.supermodel.slopes(local, columns[new], targets[:, new], self.counts)
        both = simulated.beside(seed.slopes)
        order = [0]
        for j, name in enumerate(names):
            if name in seed.names:
                order.append(2 + len(new) + seed.names.index(name))
            else:
                order.append(1 + int(np.flatnonzero(new == j)[0]))
        return both.columns(np.array(order))

    def renew(self) -> None:
        """Have all slopes simulated where products are needed next."""
        self._known = None


@dataclass(frozen=True)
class _Known:
    """Slopes at a place, of changes of some size."""

    local: np.ndarray
    change: np.ndarray
    slopes: Slopes
    cost: float
