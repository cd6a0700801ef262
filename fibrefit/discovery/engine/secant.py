"""Products of slopes and residuals, with slopes that are corrected from residuals alone between simulations of all.

A step of a Gauss-Newton needs the slopes along every unknown, a simulation each; near a minimum they hardly change.
Broyden's update makes the slopes predict the residuals that the last step led to, at one simulation a step. Slopes
are simulated anew when asked for, and no mode counts as found before such slopes ask for no further step.

Source
------
Broyden, Math. Comp. 19 (1965); of least squares: Dennis and Schnabel, Numerical Methods (1983), ch. 10.3.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from fibrefit.discovery.engine.supermodel import Supermodel, whitened_rows
from fibrefit.problem.inputs.sensitivities import InputSensitivities, pulled_by


class Slopes(NamedTuple):
    """Whitened residuals and their changes, one row each, and how errors of inputs take part in them.

    Parameters
    ----------
    rows : (n_record, 1 + n_column, n_row)
        Residuals first.
    pulled : (n_record, 1 + n_column, n_wave) or None
        Products with the sensitivities to errors of inputs.
    """

    rows: np.ndarray
    pulled: np.ndarray | None

    def grams(self, sensitivities: InputSensitivities | None) -> np.ndarray:
        """Products ``(n_record, n_column + 1, n_column + 1)``, errors of inputs eliminated; residuals come last."""
        grams = self.rows @ np.swapaxes(self.rows, 1, 2)
        if self.pulled is not None and sensitivities is not None:
            grams = grams - self.pulled @ np.asarray(sensitivities.inverse) @ np.swapaxes(self.pulled, 1, 2)
        keep = np.r_[1 : grams.shape[1], 0]
        return grams[:, keep][:, :, keep]

    def columns(self, places: np.ndarray) -> Slopes:
        """Some of the rows."""
        return Slopes(self.rows[:, places], None if self.pulled is None else self.pulled[:, places])

    def beside(self, further: Slopes) -> Slopes:
        """With further rows after them."""
        both = None
        if self.pulled is not None and further.pulled is not None:
            both = np.concatenate([self.pulled, further.pulled], axis=1)
        return Slopes(np.concatenate([self.rows, further.rows], axis=1), both)

    def scaled(self, factor: np.ndarray) -> Slopes:
        """Changes ``(n_record, n_column)`` times as large; the residuals stay."""
        whole = np.concatenate([np.ones((len(factor), 1)), factor], axis=1)[:, :, None]
        return Slopes(self.rows * whole, None if self.pulled is None else self.pulled * whole)

    def led_to(self, residuals: Slopes, way: np.ndarray) -> Slopes:
        """Slopes that predict the residuals to which a step led.

        Parameters
        ----------
        residuals : Slopes
            With no column.
        way : (n_record, n_column)
            The step, in units of the changes that the columns stand for.
        """
        along = way / np.maximum(np.sum(way**2, axis=1), TINY)[:, None]
        corrected = [
            None if old is None or new is None else _broyden(old, new[:, 0], way, along)
            for old, new in zip(self, residuals, strict=True)
        ]
        assert corrected[0] is not None
        return Slopes(corrected[0], corrected[1])


TINY = 1e-300
"""In place of the square of a step of nothing, along which nothing is corrected."""


def _broyden(old: np.ndarray, new: np.ndarray, way: np.ndarray, along: np.ndarray) -> np.ndarray:
    missed = new - old[:, 0] - np.einsum("rj,rjk->rk", way, old[:, 1:])
    return np.concatenate([new[:, None], old[:, 1:] + along[:, :, None] * missed[:, None]], axis=1)


def slopes_at(
    frame: Supermodel, local: np.ndarray, columns: np.ndarray, targets: np.ndarray, counts: np.ndarray
) -> Slopes:
    """Simulated; parameters as `Supermodel.grams`, the frame whitened."""
    rows = frame.rows(local, columns, targets, counts)
    white = whitened_rows(rows, len(frame.problem.observations.weight), frame.whitening)
    kept = np.asarray(white)[:, : 1 + len(columns)]
    return Slopes(kept, None if frame.sensitivities is None else pulled_by(frame.sensitivities, kept))


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
    """Products of slopes and residuals wherever they are asked for, see `Gram`; few of the slopes are simulated.

    Parameters
    ----------
    frame : Supermodel
        Whitened.
    counts : (n_record,) int
    seed : Seed, optional
        Slopes to begin with; what it lacks is simulated.
    """

    frame: Supermodel
    counts: np.ndarray
    seed: Seed | None = None
    exact: bool = field(default=False, init=False)
    _known: _Known | None = field(default=None, init=False)

    def __call__(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> np.ndarray:
        """Products at some values; parameters as `Supermodel.grams`."""
        if self._known is None:
            slopes = self._first(local, columns, targets)
            grams = slopes.grams(self.frame.sensitivities)
            self._known = _Known(local, targets - local[:, columns], slopes, float(np.sum(grams[:, -1, -1])))
            return grams
        known, change = self._known, targets - local[:, columns]
        # What cannot move has no change to count its way in.
        moved = (local - known.local)[:, columns]
        way = np.divide(moved, known.change, out=np.zeros_like(moved), where=known.change != 0.0)
        here = slopes_at(self.frame, local, columns[:0], targets[:, :0], self.counts)
        size = np.divide(change, known.change, out=np.ones_like(change), where=known.change != 0.0)
        slopes = known.slopes.led_to(here, way).scaled(size)
        grams = slopes.grams(self.frame.sensitivities)
        self.exact = False
        # A step that led upwards is hardly ever taken: slopes are corrected along the way that is.
        if np.sum(grams[:, -1, -1]) <= known.cost:
            self._known = _Known(local, change, slopes, float(np.sum(grams[:, -1, -1])))
        return grams

    def _first(self, local: np.ndarray, columns: np.ndarray, targets: np.ndarray) -> Slopes:
        seed, self.seed = self.seed, None
        self.exact = seed is None
        if seed is None:
            return slopes_at(self.frame, local, columns, targets, self.counts)
        names = [self.frame.names[column] for column in columns]
        new = np.array([j for j, name in enumerate(names) if name not in seed.names], dtype=int)
        simulated = slopes_at(self.frame, local, columns[new], targets[:, new], self.counts)
        both = simulated.beside(seed.slopes)
        order = [0]
        for j, name in enumerate(names):
            if name in seed.names:
                order.append(2 + len(new) + seed.names.index(name))
            else:
                order.append(1 + int(np.flatnonzero(new == j)[0]))
        return both.columns(np.array(order))

    def renew(self) -> None:
        """Have all slopes simulated where products are asked for next."""
        self._known = None


@dataclass(frozen=True)
class _Known:
    """Slopes at a place, of changes of some size."""

    local: np.ndarray
    change: np.ndarray
    slopes: Slopes
    cost: float
